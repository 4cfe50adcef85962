"""Mellinger and Kumar's controller (ICRA 2011) as the Crazyflie has it.

Force from errors of position and velocity, their sum and the plan's acceleration; attitude from the force; moments from errors of
attitude, rates, and of the rates' derivative. Moments are counts of the motors' PWM, and so is thrust, by one factor for all vehicles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.control.onboard_controller import (
    ACCELERATION,
    ATTITUDE,
    COSINE,
    FULL_SCALE,
    GYRO,
    POSITION,
    RATES,
    SINE,
    VELOCITY,
    Laws,
    Moment,
    ToldItsMass,
    along_axis,
    attitude_error,
    axes_towards,
    body_axes,
    column,
    limited,
    mixed,
    settled_sum,
)
from flight.control.profiles import autopilot_of
from flight.model.airframe import Airframe
from flight.model.attitude import Floats
from flight.model.timing import STEP
from verify.data import GRAVITY
from verify.data.autopilot import MellingerGains


@dataclass(frozen=True, slots=True)
class Mellinger(ToldItsMass):
    """Mellinger and Kumar's controller, with the gains of the vehicle's autopilot.

    Attributes:
        settled: Whether its sums begin as a long hover leaves them, and not at zero.
    """

    settled: bool = True

    def laws_at(self, airframe: Airframe, mass: float) -> Laws:
        """Return its laws for one airframe; arguments as said there."""
        return _Mellinger(airframe, mass, self.settled)


MELLINGER = Mellinger()

# Rows of the memory: sums of the errors of position and attitude, and the rates' last errors.
_SUMMED, _TURNED, _BEFORE = slice(0, 3), slice(3, 6), slice(6, 9)


class _Mellinger:
    traceable = True

    def __init__(self, airframe: Airframe, mass: float, settled: bool) -> None:
        gains = autopilot_of(airframe).gains(MellingerGains)
        self._mass = mass
        self._position, self._velocity, self._integral, self._integral_limit = (
            column(part) for part in (gains.position, gains.velocity, gains.integral, gains.integral_limit)
        )
        self._attitude, self._rate, self._turned, self._turned_limit, self._change = (
            column(part)
            for part in (
                gains.attitude,
                gains.rate,
                gains.attitude_integral,
                gains.attitude_integral_limit,
                gains.rate_change,
            )
        )
        self._limit = gains.moment_limit
        count = airframe.vehicle.rotor_thrust_max / FULL_SCALE  # N that one count of one motor gives
        self._thrust = gains.thrust_to_pwm * count
        # roll and pitch are halved by the mixer, and pitch counts against the rotors in front
        self._shares = count * column((0.5, -0.5, 1.0))
        self._greatest = airframe.vehicle.rotor_thrust_max
        weight = mass * GRAVITY
        # one factor from force to counts is not right for every vehicle: what it lacks in hover stands in the sum
        missing = weight / (4.0 * self._thrust) - weight
        self._summed = settled_sum(missing, gains.integral[2], gains.integral_limit[2]) if settled else 0.0

    def at_first(self, setpoint: Floats) -> Floats:
        memory = np.zeros((9, setpoint.shape[1]))
        memory[_SUMMED][2] = self._summed
        return memory

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        setpoint, known, after = now.setpoint, now.known, np.empty_like(memory)
        off, drift = setpoint[POSITION] - known[POSITION], setpoint[VELOCITY] - known[VELOCITY]
        after[_SUMMED] = limited(memory[_SUMMED] + STEP * off, self._integral_limit)
        force = self._mass * setpoint[ACCELERATION] + self._position * off + self._velocity * drift
        force = force + self._integral * after[_SUMMED]
        force[2] += self._mass * GRAVITY
        actual = body_axes(known[ATTITUDE])
        wanted, _ = axes_towards(force, setpoint[COSINE], setpoint[SINE])
        error = attitude_error(wanted, actual)
        slip = setpoint[RATES] - known[GYRO]
        after[_BEFORE] = slip
        after[_TURNED] = limited(memory[_TURNED] - STEP * error, self._turned_limit)
        change = (slip - memory[_BEFORE]) / STEP
        moment = self._rate * slip - self._attitude * error + self._turned * after[_TURNED] + self._change * change
        moment = limited(moment, self._limit)
        share = self._thrust * along_axis(force, actual[2])
        return mixed(share, self._shares * moment, self._greatest * (now.ceiling * now.ceiling)), after
