"""The cascade of PID controllers that the Crazyflie flies by default: position, velocity, angle, rate.

It takes nothing from the plan but position and heading, so it lags behind by half a second of way at its gain of 2/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flight.control.onboard_controller import (
    ATTITUDE,
    FULL_SCALE,
    GYRO,
    HEADING,
    POSITION,
    VELOCITY,
    Laws,
    Moment,
    OnBoardController,
    column,
    limited,
    mixed,
    settled_sum,
)
from flight.control.profiles import autopilot_of
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, euler
from flight.model.timing import FRAME_STEPS, STEP
from verify.data.autopilot import PidGains


@dataclass(frozen=True, slots=True)
class Pid(OnBoardController):
    """Position, velocity, angle and rate in a cascade, with the gains of the vehicle's autopilot. It knows no mass.

    Attributes:
        settled: Whether its sums begin as a long hover leaves them, and not at zero: what a vehicle weighs stands in them alone.
    """

    orders: ClassVar[int] = 0

    settled: bool = True

    def laws(self, airframe: Airframe) -> Laws:
        """Return its laws for one airframe; argument as said there."""
        return _Pid(airframe, self.settled)


PID = Pid()

# Rows of the memory: sums of each loop's errors, angles and rates at the last step, and what the loops of position ask for.
_PLACE, _SPEED, _ANGLE, _RATE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
_LAST_ANGLE, _LAST_RATE, _WANTED, _THRUST = slice(12, 15), slice(15, 18), slice(18, 20), 20
_FRAME = FRAME_STEPS * STEP


class _Pid:
    traceable = False  # it computes with Euler angles

    def __init__(self, airframe: Airframe, settled: bool) -> None:
        gains = autopilot_of(airframe).gains(PidGains)
        self._gains = gains
        self._position, self._place, self._speeds = (
            column(part) for part in (gains.position, gains.position_integral, gains.speed_limit)
        )
        self._velocity, self._speed = column(gains.velocity), column(gains.velocity_integral)
        self._angle, self._angled, self._angle_limit, self._angle_change = (
            column(part) for part in (gains.angle, gains.angle_integral, gains.angle_integral_limit, gains.angle_change)
        )
        self._rate, self._rated, self._rate_limit, self._rate_change = (
            column(part) for part in (gains.rate, gains.rate_integral, gains.rate_integral_limit, gains.rate_change)
        )
        self._greatest = airframe.vehicle.rotor_thrust_max
        self._count = self._greatest / FULL_SCALE
        self._shares = self._count * column((0.5, -0.5, 1.0))
        hovering = airframe.vehicle.weight / (4.0 * self._count)  # counts of each motor
        missing = (hovering - gains.thrust_base) / gains.thrust_scale
        self._lifting = settled_sum(missing, gains.velocity_integral[2]) if settled else 0.0

    def at_first(self, setpoint: Floats) -> Floats:
        memory = np.zeros((21, setpoint.shape[1]))
        memory[_SPEED][2] = self._lifting
        memory[_LAST_ANGLE][2] = np.degrees(setpoint[HEADING])
        return memory

    def aim(self, flat: Floats | None, now: Moment, memory: Floats) -> Floats:  # noqa: ARG002  # it takes the set-point alone
        """Run the loops of position and velocity, in axes that turn with the vehicle's heading."""
        gains, after, setpoint, known = self._gains, memory.copy(), now.setpoint, now.known
        heading = euler(known[ATTITUDE])[2]
        cosine, sine = np.cos(heading), np.sin(heading)
        off = _turned(setpoint[POSITION] - known[POSITION], cosine, sine)
        after[_PLACE] = memory[_PLACE] + _FRAME * off
        speed = limited(self._position * off + self._place * after[_PLACE], self._speeds)
        drift = speed - _turned(known[VELOCITY], cosine, sine)
        after[_SPEED] = memory[_SPEED] + _FRAME * drift
        asked = self._velocity * drift + self._speed * after[_SPEED]
        after[18] = limited(-asked[1], gains.tilt_limit)
        after[19] = limited(asked[0], gains.tilt_limit)
        thrust = gains.thrust_scale * limited(asked[2], 0.5 * FULL_SCALE / gains.thrust_scale) + gains.thrust_base
        after[_THRUST] = np.minimum(np.maximum(thrust, gains.thrust_least), FULL_SCALE)
        return after

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        setpoint, known, after = now.setpoint, now.known, memory.copy()
        angles, rates = np.degrees(euler(known[ATTITUDE])), np.degrees(known[GYRO])
        off = np.empty_like(angles)
        off[:2] = memory[_WANTED] - angles[:2]
        off[2] = _within_a_turn(np.degrees(setpoint[HEADING]) - angles[2])
        moved = angles - memory[_LAST_ANGLE]
        moved[2] = _within_a_turn(moved[2])
        after[_LAST_ANGLE], after[_LAST_RATE] = angles, rates
        after[_ANGLE] = limited(memory[_ANGLE] + STEP * off, self._angle_limit)
        wanted = self._angle * off + self._angled * after[_ANGLE] - self._angle_change * moved / STEP
        slip = wanted - rates
        after[_RATE] = limited(memory[_RATE] + STEP * slip, self._rate_limit)
        moment = self._rate * slip + self._rated * after[_RATE] - self._rate_change * (rates - memory[_LAST_RATE]) / STEP
        moment = limited(moment, 32767.0)
        return mixed(self._count * memory[_THRUST], self._shares * moment, self._greatest * (now.ceiling * now.ceiling)), after


def _turned(vector: Floats, cosine: Floats, sine: Floats) -> Floats:
    return np.stack([cosine * vector[0] + sine * vector[1], cosine * vector[1] - sine * vector[0], vector[2]])


def _within_a_turn(angle: Floats) -> Floats:
    return np.mod(angle + 180.0, 360.0) - 180.0
