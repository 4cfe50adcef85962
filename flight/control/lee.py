"""The geometric controller of Lee, Leok and McClamroch (CDC 2010) as the Crazyflie has it.

Force from errors of position and velocity and the plan's acceleration, attitude from the force, moments in newton metres from errors of
attitude and of body rates, which the plan's jerk turns. By default there is no sum of the position's error: its mass must be right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flight.control.onboard_controller import (
    ACCELERATION,
    ATTITUDE,
    COSINE,
    GYRO,
    JERK,
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
    mixed,
    turning_of,
)
from flight.control.profiles import autopilot_of
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, cross
from flight.model.timing import STEP
from verify.data import GRAVITY
from verify.data.autopilot import LeeGains


@dataclass(frozen=True, slots=True)
class Lee(ToldItsMass):
    """Lee, Leok and McClamroch's controller, with the gains of the vehicle's autopilot."""

    def laws_at(self, airframe: Airframe, mass: float) -> Laws:
        """Return its laws for one airframe; arguments as said there."""
        return _Lee(airframe, mass)


LEE = Lee()

# Rows of the memory: sums of the errors of position and attitude.
_SUMMED, _TURNED = slice(0, 3), slice(3, 6)


class _Lee:
    traceable = True

    def __init__(self, airframe: Airframe, mass: float) -> None:
        gains, vehicle = autopilot_of(airframe).gains(LeeGains), airframe.vehicle
        self._mass, self._inertia = mass, column(gains.inertia)
        self._position, self._velocity, self._integral = (
            column(part) for part in (gains.position, gains.velocity, gains.integral)
        )
        self._attitude, self._rate, self._turned = (
            column(part) for part in (gains.attitude, gains.rate, gains.attitude_integral)
        )
        offset = vehicle.arm / np.sqrt(2.0)
        self._shares = 0.25 / column((offset, -offset, vehicle.torque_to_thrust))
        self._greatest = vehicle.rotor_thrust_max

    def at_first(self, setpoint: Floats) -> Floats:
        return np.zeros((6, setpoint.shape[1]))

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        setpoint, known, after = now.setpoint, now.known, np.empty_like(memory)
        off, drift = setpoint[POSITION] - known[POSITION], setpoint[VELOCITY] - known[VELOCITY]
        after[_SUMMED] = memory[_SUMMED] + STEP * off
        push = setpoint[ACCELERATION] + self._velocity * drift + self._position * off + self._integral * after[_SUMMED]
        push[2] += GRAVITY
        actual = body_axes(known[ATTITUDE])
        thrust = along_axis(push, actual[2])
        wanted, _ = axes_towards(push, setpoint[COSINE], setpoint[SINE])
        error = 0.5 * attitude_error(wanted, actual)
        turning = turning_of(setpoint[JERK], wanted, np.maximum(thrust, 0.1))
        # the firmware's yaw rate: that of the set-point, which holds a share of the plan's z axis, times that of the wanted one
        spin = setpoint[RATES][2] * wanted[2, 2]
        world = turning[0] * wanted[0] + turning[1] * wanted[1] + spin * wanted[2]
        slip = np.empty_like(error)
        for axis in range(3):
            slip[axis] = known[GYRO][axis] - along_axis(actual[axis], world)
        after[_TURNED] = memory[_TURNED] + STEP * error
        torque = cross(known[GYRO], self._inertia * known[GYRO])
        torque = torque - self._attitude * error - self._rate * slip - self._turned * after[_TURNED]
        share = (0.25 * self._mass) * thrust
        return mixed(share, self._shares * torque, self._greatest * (now.ceiling * now.ceiling)), after
