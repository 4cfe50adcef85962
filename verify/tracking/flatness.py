"""Flatness in intervals: what the controller feeds forward, and how that changes with the feedback, for all feedback within a box.

The feedback p adds to the plan's force; attitude, rates and angular acceleration follow from their sum. Derivatives by p are carried along
(automatic differentiation), every operation rounded outwards. Numbers are arrays over the commands of a flight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.intervals import Interval, interval


@dataclass(frozen=True, eq=False, slots=True)
class Jet:
    """A number with its derivatives by the three components of the feedback.

    Attributes:
        value: Shape (ticks,).
        slope: Three of that shape.
    """

    value: Interval
    slope: tuple[Interval, Interval, Interval]

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, _each(lambda a, b: a + b, self, other))

    def __sub__(self, other: Jet) -> Jet:
        return Jet(self.value - other.value, _each(lambda a, b: a - b, self, other))

    def __mul__(self, other: Jet) -> Jet:
        return Jet(self.value * other.value, _each(lambda a, b: a * other.value + self.value * b, self, other))

    def __truediv__(self, other: Jet) -> Jet:
        quotient = self.value / other.value
        return Jet(quotient, _each(lambda a, b: (a - quotient * b) / other.value, self, other))

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple(-s for s in self.slope))  # pyright: ignore[reportArgumentType]  # three

    def root(self) -> Jet:
        """Square root."""
        root = self.value.root()
        twice = root + root
        return Jet(root, tuple(s / twice for s in self.slope))  # pyright: ignore[reportArgumentType]  # three


@dataclass(frozen=True, eq=False, slots=True)
class Moving:
    """A number with its derivative by time, both with theirs by the feedback.

    Attributes:
        value: The number.
        dot: Its derivative.
    """

    value: Jet
    dot: Jet

    def __add__(self, other: Moving) -> Moving:
        return Moving(self.value + other.value, self.dot + other.dot)

    def __sub__(self, other: Moving) -> Moving:
        return Moving(self.value - other.value, self.dot - other.dot)

    def __mul__(self, other: Moving) -> Moving:
        return Moving(self.value * other.value, self.value * other.dot + self.dot * other.value)

    def __truediv__(self, other: Moving) -> Moving:
        quotient = self.value / other.value
        return Moving(quotient, (self.dot - quotient * other.dot) / other.value)

    def __neg__(self) -> Moving:
        return Moving(-self.value, -self.dot)

    def root(self) -> Moving:
        """Square root."""
        root = self.value.root()
        return Moving(root, self.dot / (root + root))


Number = TypeVar("Number", Jet, Moving)


def _each(rule: Callable[[Interval, Interval], Interval], one: Jet, other: Jet) -> tuple[Interval, Interval, Interval]:
    return tuple(rule(a, b) for a, b in zip(one.slope, other.slope, strict=True))  # pyright: ignore[reportReturnType]  # three


@dataclass(frozen=True, eq=False, slots=True)
class FedForward(Generic[Number]):
    """Feed-forward at each command.

    Attributes:
        length: Of the force, m/s^2.
        axis: The direction of the thrust.
        rate: Of the thrust, m/s^3.
        change: Its derivative, m/s^4, which the autopilot leaves out.
        rates: Of the body, rad/s.
        rates_change: Their derivative, rad/s^2.
    """

    length: Number
    axis: tuple[Number, Number, Number]
    rate: Number
    change: Number
    rates: tuple[Number, Number, Number]
    rates_change: tuple[Number, Number, Number]


def fed_forward(force: Floats, jerk: Floats, snap: Floats, reach: Floats) -> FedForward[Jet]:
    """Return what is fed forward, for every feedback in a box, at heading 0.

    Args:
        force: Of the plan, with its drag and gravity, m/s^2. Shape (ticks, 3).
        jerk: Its derivative. Shape (ticks, 3).
        snap: Its second derivative. Shape (ticks, 3).
        reach: Half the sides of the boxes of feedback, m/s^2. Shape (ticks, 3).
    """
    return _flat(_pushed(force, reach, 0.0 * reach), _held(jerk, 0.0 * reach), _held(snap, 0.0 * reach))


def changes_of_turning(
    plan: tuple[Floats, Floats, Floats, Floats], away: tuple[Floats, ...], reach: Floats
) -> tuple[Jet, Jet, Jet]:
    """Return the second derivatives of the body rates that are fed forward, at all times until the next command.

    Args:
        plan: Force, jerk, snap and crackle at the commands. Shape (ticks, 3) each.
        away: How far these may get from there until the next command. Shape (ticks, 3) each.
        reach: As in `fed_forward`.
    """
    force, jerk, snap, crackle = plan
    forces, jerks = _pushed(force, reach, away[0]), _held(jerk, away[1])
    snaps, crackles = _held(snap, away[2]), _held(crackle, away[3])
    moving = (tuple(map(Moving, *pair)) for pair in ((forces, jerks), (jerks, snaps), (snaps, crackles)))
    found = _flat(*moving)  # pyright: ignore[reportArgumentType]  # three of three each
    x, y, z = (rate.dot for rate in found.rates_change)
    return x, y, z


def _held(values: Floats, away: Floats) -> tuple[Jet, Jet, Jet]:
    """Return vectors within some distances, which no feedback changes."""
    nothing = interval(np.zeros(len(values)))
    x, y, z = (Jet(_near(values[:, k], away[:, k]), (nothing, nothing, nothing)) for k in range(3))
    return x, y, z


def _pushed(force: Floats, reach: Floats, away: Floats) -> tuple[Jet, Jet, Jet]:
    """Return forces within some distances, with feedback in boxes added."""
    nothing, one = interval(np.zeros(len(force))), interval(np.ones(len(force)))
    found: list[Jet] = []
    for axis in range(3):
        slope = [one if axis == k else nothing for k in range(3)]
        found.append(
            Jet(
                _near(force[:, axis], reach[:, axis]) + _near(0.0 * away[:, axis], away[:, axis]),
                (slope[0], slope[1], slope[2]),
            )
        )
    return found[0], found[1], found[2]


def _near(values: Floats, away: Floats) -> Interval:
    return interval(values) + Interval(-away, away)


def _flat(
    total: tuple[Number, Number, Number], j: tuple[Number, Number, Number], s: tuple[Number, Number, Number]
) -> FedForward[Number]:
    """Return what a force with its derivatives needs, at heading 0."""
    length = _dot(total, total).root()
    z = (total[0] / length, total[1] / length, total[2] / length)
    level = (z[0] * z[0] + z[2] * z[2]).root()  # y . y_C, and the length of y_C x z
    x = (z[2] / level, -(z[0] / level))  # its first and third component; the second is 0
    y = (z[1] * x[1], z[2] * x[0] - z[0] * x[1], -(z[1] * x[0]))
    rate = _dot(j, z)
    turning = ((j[0] - rate * z[0]) / length, (j[1] - rate * z[1]) / length, (j[2] - rate * z[2]) / length)
    wx, wy = -_dot(turning, y), turning[0] * x[0] + turning[2] * x[1]
    wz = wy * z[1] / level
    change = _dot(s, z) + _dot(j, turning)
    twice = rate + rate
    bending = tuple((s[k] - change * z[k] - twice * turning[k]) / length for k in range(3))
    ax, ay = -_dot(bending, y) + wy * wz, bending[0] * x[0] + bending[2] * x[1] - wx * wz  # pyright: ignore[reportArgumentType]  # three
    az = (ay * z[1] + wy * turning[1] - wz * (wx * z[1])) / level
    return FedForward(length, z, rate, change, (wx, wy, wz), (ax, ay, az))


def _dot(a: tuple[Number, Number, Number], b: tuple[Number, Number, Number]) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
