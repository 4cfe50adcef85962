"""PX4's cascade: position, velocity, attitude and body rate, as its multicopter modules define them.

Set-points with position, velocity, acceleration, heading and its rate arrive 50 times a second and are held in between. Position and
velocity run 100 times a second (`mc_pos_control`), attitude, rates and allocation 500 times (`mc_att_control`, `mc_rate_control`,
`control_allocator`). It knows its hover thrust, but no mass, and takes nothing of the plan beyond acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flight.control.onboard_controller import (
    ACCELERATION,
    ATTITUDE,
    GYRO,
    HEADING,
    POSITION,
    VELOCITY,
    Laws,
    Moment,
    OnBoardController,
    body_axes,
    column,
    limited,
    mixed,
)
from flight.control.profiles import autopilot_of
from flight.model.airframe import Airframe
from flight.model.attitude import Floats, cross, dot, from_matrix, norm, quaternion_product, unit
from flight.model.timing import FRAME_STEPS, STEP
from verify.data import GRAVITY, BadInput
from verify.data.autopilot import Px4Gains


@dataclass(frozen=True, slots=True)
class Px4(OnBoardController):
    """PX4's cascade of position, velocity, attitude and rates, with the gains of the vehicle's autopilot."""

    setpoints: ClassVar[float] = 50.0
    orders: ClassVar[int] = 2

    def laws(self, airframe: Airframe) -> Laws:
        """Return its laws for one airframe; argument as said there."""
        return _Px4(airframe)


PX4 = Px4()

_FRAME = FRAME_STEPS * STEP
# Rows of the memory. Of the slow loops: the set-point that is held, sums of the velocity's error, the last velocity and its filtered change,
# and what they ask for. Of the fast ones: sums of the rates' error, two states of the gyroscopes' filter, the last rates, and filtered changes.
_HELD, _HEADING, _TURNING = slice(0, 9), 9, 10
_SUMMED, _BEFORE, _CHANGE = slice(11, 14), slice(14, 17), slice(17, 20)
_WANTED, _THRUST = slice(20, 24), 24
_RATED, _NEW, _OLD, _LAST, _TWIST, _YAW = slice(25, 28), slice(28, 31), slice(31, 34), slice(34, 37), slice(37, 40), 40
_MEMORY = 41


class _Px4:
    traceable = True

    def __init__(self, airframe: Airframe) -> None:
        gains = autopilot_of(airframe).gains(Px4Gains)
        self._position, self._velocity = _VelocityLoop(gains), _AccelerationLoop(gains, _hover_signal(airframe, gains))
        self._angles, self._rates = _AttitudeLoop(gains), _RateLoop(gains)
        self._mix = column(gains.mix) * column((1.0, -1.0, 1.0))  # pitch counts against the rotors in front
        self._idle, self._curve = gains.idle, gains.thrust_curve
        self._greatest = airframe.vehicle.rotor_thrust_max
        self._hover = self._velocity.hover

    def at_first(self, setpoint: Floats) -> Floats:
        memory = np.zeros((_MEMORY, setpoint.shape[1]))
        memory[_HELD], memory[_HEADING] = setpoint[:9], setpoint[HEADING]
        memory[20], memory[23] = np.cos(0.5 * setpoint[HEADING]), np.sin(0.5 * setpoint[HEADING])
        memory[_THRUST] = self._hover
        return memory

    def aim(self, flat: Floats | None, now: Moment, memory: Floats) -> Floats:
        """Run the loops of position and velocity on the set-point that arrived last."""
        after = memory.copy()
        if flat is not None:  # one arrives
            after[_HELD], after[_HEADING], after[_TURNING] = now.setpoint[:9], now.setpoint[HEADING], flat[1, 3]
        held, velocity = after[_HELD], now.known[VELOCITY]
        wanted = self._position.asked(held[POSITION] - now.known[POSITION], held[VELOCITY])
        change = (velocity - memory[_BEFORE]) / _FRAME
        after[_BEFORE] = velocity
        after[_CHANGE] = memory[_CHANGE] + self._velocity.share * (change - memory[_CHANGE])
        force, after[_SUMMED] = self._velocity.asked(wanted - velocity, held[ACCELERATION], memory[_SUMMED], after[_CHANGE])
        after[_THRUST] = norm(force)
        after[_WANTED] = _towards(force / after[_THRUST], after[_HEADING])
        return after

    def thrusts(self, now: Moment, memory: Floats) -> tuple[Floats, Floats]:
        after = np.empty_like(memory)
        after[: _THRUST + 1] = memory[: _THRUST + 1]
        rates = self._angles.asked(memory[_WANTED], now.known[ATTITUDE], memory[_TURNING])
        moment = self._rates.asked(rates, now.known[GYRO], memory, after)
        signals = mixed(memory[_THRUST], self._mix * moment, 0.0 * memory[_THRUST] + 1.0)
        if self._curve > 0.0:  # thrust is taken for (1 - f) s + f s^2 of the signal s
            linear = (1.0 - self._curve) / (2.0 * self._curve)
            signals = np.sqrt(linear * linear + signals / self._curve) - linear
        speeds = np.minimum(self._idle + (1.0 - self._idle) * signals, now.ceiling)
        return self._greatest * (speeds * speeds), after


class _VelocityLoop:
    """From the position's error to a velocity: `PositionControl::_positionControl`."""

    def __init__(self, gains: Px4Gains) -> None:
        self._gain = column(gains.position)
        self._sideways, self._up, self._down = gains.speed_limit, gains.climb_limit, gains.descent_limit

    def asked(self, off: Floats, planned: Floats) -> Floats:
        """Return what is asked for: the plan's velocity gives way where both are above the limit. Shape (3, n)."""
        own = self._gain * off
        wanted = own + planned
        sideways = np.hypot(wanted[0], wanted[1])
        for k in np.flatnonzero(sideways > self._sideways):
            wanted[:2, k] = _within(own[:2, k], planned[:2, k], self._sideways)
        wanted[2] = np.minimum(np.maximum(wanted[2], -self._down), self._up)
        return wanted


class _AccelerationLoop:
    """From the velocity's error to a thrust vector: `PositionControl::_velocityControl`."""

    def __init__(self, gains: Px4Gains, hover: float) -> None:
        self._gain, self._sum, self._damp = (
            column(part) for part in (gains.velocity, gains.velocity_integral, gains.velocity_change)
        )
        self._tilt = math.tan(math.radians(gains.tilt_limit))
        self._least, self._most, self._sideways = gains.thrust_least, gains.thrust_most, gains.thrust_sideways
        self._unwinding = 2.0 / gains.velocity[0] if gains.velocity[0] else 0.0
        self.share = _share(gains.velocity_change_cutoff, _FRAME)
        self.hover = hover

    def asked(self, drift: Floats, planned: Floats, summed: Floats, change: Floats) -> tuple[Floats, Floats]:
        """Return the thrust vector as a share of the greatest, and the new sums. Shapes (3, n).

        Args:
            drift: Error of the velocity, m/s. Shape (3, n).
            planned: Acceleration of the set-point, m/s^2. Shape (3, n).
            summed: m/s^2. Shape (3, n).
            change: Filtered derivative of the velocity, m/s^2. Shape (3, n).
        """
        push = planned + self._gain * drift + summed - self._damp * change
        # the tilt is that of a vehicle that keeps its height, and the thrust is along it
        sideways = np.hypot(push[0], push[1])
        lean = push[:2] * np.minimum(1.0, self._tilt * GRAVITY / np.maximum(sideways, 1e-9)) / GRAVITY
        upright = np.sqrt(1.0 + lean[0] * lean[0] + lean[1] * lean[1])
        thrust = np.maximum(self.hover * (push[2] / GRAVITY + 1.0) * upright, self._least)
        up = thrust / upright
        rests = ((up <= self._least) & (drift[2] <= 0.0)) | ((up >= self._most) & (drift[2] >= 0.0))
        across = lean * up
        length = np.hypot(across[0], across[1])
        up = np.minimum(up, np.sqrt(self._most**2 - np.minimum(length, self._sideways) ** 2))
        room = np.sqrt(np.maximum(self._most**2 - up * up, 0.0))
        across = across * np.minimum(1.0, room / np.maximum(length, 1e-12))
        given = across * (GRAVITY / self.hover)
        less = np.sum(push[:2] ** 2, axis=0) > np.sum(given**2, axis=0)
        error = drift.copy()
        error[2] = np.where(rests, 0.0, drift[2])
        error[:2] -= self._unwinding * np.where(less, push[:2] - given, 0.0)
        after = summed + _FRAME * self._sum * error
        after[2] = limited(after[2], GRAVITY)
        return np.stack([across[0], across[1], up]), after


class _AttitudeLoop:
    """From an attitude to body rates: `AttitudeControl::update`, by Brescianini, Hehn, D'Andrea (ETH Zurich 2013)."""

    def __init__(self, gains: Px4Gains) -> None:
        self._weight = gains.yaw_weight
        self._gain = column(gains.angle) / column((1.0, 1.0, gains.yaw_weight))
        self._limit = np.radians(column(gains.rate_limit))

    def asked(self, wanted: Floats, actual: Floats, turning: Floats) -> Floats:
        """Return body rates, rad/s. Shape (3, n).

        Args:
            wanted: Quaternion. Shape (4, n).
            actual: Quaternion. Shape (4, n).
            turning: Rate of the heading, rad/s. Shape (n,).
        """
        now, then = body_axes(actual), body_axes(wanted)
        # first the thrust's direction, the short way; then a share of what is left about it
        tilt = np.empty_like(wanted)
        tilt[0] = np.maximum(1.0 + dot(now[2], then[2]), 1e-6)
        tilt[1:] = cross(now[2], then[2])
        reduced = quaternion_product(unit(tilt), actual)
        left = quaternion_product(_conjugate(reduced), wanted)
        sine = limited(left[3] * _sign(left[0]), 0.7)
        angle = self._weight * _arcsine(sine)
        part = np.empty_like(wanted)
        part[0], part[1], part[2], part[3] = _cosine(angle), 0.0 * angle, 0.0 * angle, _sine(angle)
        error = quaternion_product(quaternion_product(_conjugate(actual), reduced), part)
        rates = self._gain * (2.0 * _sign(error[0]) * error[1:])
        up = np.empty_like(rates)  # the world's z axis as the body sees it
        up[0], up[1], up[2] = now[0, 2], now[1, 2], now[2, 2]
        return limited(rates + up * turning, self._limit)


class _RateLoop:
    """From body rates to moments, as shares: `RateControl::update`, with the filters of its gyroscopes."""

    def __init__(self, gains: Px4Gains) -> None:
        self._gain, self._sum, self._most, self._damp = (
            column(part) for part in (gains.rate, gains.rate_integral, gains.rate_integral_limit, gains.rate_change)
        )
        self._change, self._yaw = _share(gains.gyro_change_cutoff, STEP), _share(gains.yaw_cutoff, STEP)
        # a Butterworth filter of order two
        stiff = math.tan(math.pi * gains.gyro_cutoff * STEP)
        whole = 1.0 + math.sqrt(2.0) * stiff + stiff * stiff
        self._in = stiff * stiff / whole
        self._one, self._two = 2.0 * (stiff * stiff - 1.0) / whole, (1.0 - math.sqrt(2.0) * stiff + stiff * stiff) / whole

    def asked(self, wanted: Floats, gyro: Floats, memory: Floats, after: Floats) -> Floats:
        """Return moments, and write what is remembered. Shape (3, n).

        Args:
            wanted: rad/s. Shape (3, n).
            gyro: rad/s. Shape (3, n).
            memory: Shape (memory, n).
            after: The new memory; the rows of this loop are written.
        """
        state = gyro - self._one * memory[_NEW] - self._two * memory[_OLD]
        rates = self._in * (state + 2.0 * memory[_NEW] + memory[_OLD])
        after[_NEW], after[_OLD], after[_LAST] = state, memory[_NEW], rates
        after[_TWIST] = memory[_TWIST] + self._change * ((rates - memory[_LAST]) / STEP - memory[_TWIST])
        slip = wanted - rates
        moment = self._gain * slip + memory[_RATED] - self._damp * after[_TWIST]
        large = slip * slip / math.radians(400.0) ** 2
        after[_RATED] = limited(memory[_RATED] + STEP * self._sum * np.maximum(1.0 - large, 0.0) * slip, self._most)
        after[_YAW] = memory[_YAW] + self._yaw * (moment[2] - memory[_YAW])
        asked = np.empty_like(moment)
        asked[0], asked[1], asked[2] = moment[0], moment[1], after[_YAW]
        return limited(asked, 1.0)


def _hover_signal(airframe: Airframe, gains: Px4Gains) -> float:
    """Return the thrust set-point that lets a vehicle hover, as the autopilot's estimate of it settles (MPC_USE_HTE)."""
    vehicle = airframe.vehicle
    speed = math.sqrt(vehicle.weight / (4.0 * vehicle.rotor_thrust_max))
    signal = (speed - gains.idle) / (1.0 - gains.idle)
    if signal <= 0.0:
        raise BadInput(
            f"vehicle '{vehicle.name}': its rotors lift more than its weight at no signal (autopilot.px4.idle {gains.idle:g}); {speed:.2f} is too much."
        )
    return (1.0 - gains.thrust_curve) * signal + gains.thrust_curve * signal * signal


def _share(cutoff: float, step: float) -> float:
    """Return what a filter of order one takes of a new value.

    Args:
        cutoff: Hz.
        step: s between two values.
    """
    return step / (step + 1.0 / (2.0 * math.pi * cutoff))


def _within(first: Floats, second: Floats, most: float) -> Floats:
    """Return as much of a sum as a length leaves: the first of two vectors whole where it fits, then what fits of the second. Shape (2,)."""
    length, other = float(np.hypot(*first)), float(np.hypot(*second))
    if length >= most or other < 1e-9:
        return first * (most / length)
    along = second / other
    inner = float(first @ along)
    return first + along * (math.sqrt(inner * inner + most * most - length * length) - inner)


def _towards(z: Floats, heading: Floats) -> Floats:
    """Return the attitude whose z axis is given and whose x axis is at a heading. Shapes (3, n) and (n,) to (4, n)."""
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)])
    x = cross(across, z)
    x = x / norm(x)
    return from_matrix(np.stack([x, cross(z, x), z], axis=1))


def _conjugate(q: Floats) -> Floats:
    turned = np.empty_like(q)
    turned[0], turned[1], turned[2], turned[3] = q[0], -q[1], -q[2], -q[3]
    return turned


def _sign(value: Floats) -> Floats:
    """Return about 1 or -1: of a quaternion's first part, which is near 0 only half a turn away."""
    return limited(1e9 * value, 1.0)


# Series, as sines are not compiled: within 2e-3 up to 45 degrees, which a heading's error never is far from.
def _arcsine(x: Floats) -> Floats:
    square = x * x
    return x * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0))))


def _sine(x: Floats) -> Floats:
    square = x * x
    return x * (1.0 - square * (1.0 / 6.0 - square / 120.0))


def _cosine(x: Floats) -> Floats:
    square = x * x
    return 1.0 - square * (0.5 - square / 24.0)
