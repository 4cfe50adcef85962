"""Flatness in intervals: what the controller feeds forward, and how that changes with the feedback, for all feedback within a box.

The feedback p adds to the plan's force; attitude, rates and angular acceleration follow from their sum. Derivatives by p are carried along
(automatic differentiation), every operation rounded outwards. Jets are arrays over the commands of a flight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.intervals import Interval, interval


@dataclass(frozen=True, eq=False, slots=True)
class Jet:
    """A number with its derivatives by the three components of the feedback.

    Attributes:
        value: Shape (ticks,).
        slopes: Shape (3, ticks); None of what the feedback does not move, or whose derivatives nobody asks for.
    """

    value: Interval
    slopes: Interval | None

    @property
    def slope(self) -> tuple[Interval, Interval, Interval]:
        """The derivatives, each of the value's shape."""
        assert self.slopes is not None, "they are asked for"
        x, y, z = (Interval(low, high) for low, high in zip(self.slopes.low, self.slopes.high, strict=True))
        return x, y, z

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, _sum(self.slopes, other.slopes))

    def __sub__(self, other: Jet) -> Jet:
        return self + -other

    def __mul__(self, other: Jet) -> Jet:
        return Jet(self.value * other.value, _sum(_times(self.slopes, other.value), _times(other.slopes, self.value)))

    def __truediv__(self, other: Jet) -> Jet:
        quotient = self.value / other.value
        slopes = _sum(self.slopes, _times(other.slopes, -quotient))
        return Jet(quotient, None if slopes is None else slopes / other.value)

    def __neg__(self) -> Jet:
        return Jet(-self.value, None if self.slopes is None else -self.slopes)

    @property
    def middle(self) -> Floats:
        """Middle of the number."""
        return 0.5 * (self.value.low + self.value.high)

    def root(self) -> Jet:
        """Square root."""
        root = self.value.root()
        return Jet(root, None if self.slopes is None else self.slopes / (root + root))


def _sum(one: Interval | None, other: Interval | None) -> Interval | None:
    return other if one is None else one if other is None else one + other


def _times(slopes: Interval | None, factor: Interval) -> Interval | None:
    return None if slopes is None else slopes * factor


@dataclass(frozen=True, eq=False, slots=True)
class FedForward:
    """Feed-forward at each command.

    Attributes:
        length: Of the force, m/s^2.
        axis: The direction of the thrust.
        rate: Of the thrust, m/s^3.
        change: Its derivative, m/s^4, which the autopilot leaves out.
        rates: Of the body, rad/s.
        rates_change: Their derivative, rad/s^2.
    """

    length: Jet
    axis: tuple[Jet, Jet, Jet]
    rate: Jet
    change: Jet
    rates: tuple[Jet, Jet, Jet]
    rates_change: tuple[Jet, Jet, Jet]


def fed_forward(force: Floats, jerk: Floats, snap: Floats, reach: Floats, *, sloped: bool = True) -> FedForward:
    """Return what is fed forward, for every feedback in a box and all derivatives in boxes, at heading 0.

    Args:
        force: Of the plan, with its drag and gravity, m/s^2. Shape (ticks, 3).
        jerk: Its derivative. Shape (ticks, 3).
        snap: Its second derivative. Shape (ticks, 3).
        reach: Half the sides of the boxes of feedback and of both derivatives, m/s^2 and s. Shape (3, ticks, 3).
        sloped: Whether derivatives by the feedback are asked for.
    """
    slopes = np.eye(3)[:, :, None] * np.ones(len(force))
    boxes = [
        [interval(values[:, k]) + Interval(-sides[:, k], sides[:, k]) for k in range(3)]
        for values, sides in zip((force, jerk, snap), reach, strict=True)
    ]
    pushed = [Jet(box, interval(slope) if sloped else None) for box, slope in zip(boxes[0], slopes, strict=True)]
    held = [[Jet(box, None) for box in sides] for sides in boxes[1:]]
    return _flat((pushed[0], pushed[1], pushed[2]), *((x, y, z) for x, y, z in held))


def _flat(total: tuple[Jet, Jet, Jet], j: tuple[Jet, Jet, Jet], s: tuple[Jet, Jet, Jet]) -> FedForward:
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
    b, c, d = ((s[k] - change * z[k] - twice * turning[k]) / length for k in range(3))
    bending = b, c, d
    ax, ay = -_dot(bending, y) + wy * wz, bending[0] * x[0] + bending[2] * x[1] - wx * wz
    az = (ay * z[1] + wy * turning[1] - wz * (wx * z[1])) / level
    return FedForward(length, z, rate, change, (wx, wy, wz), (ax, ay, az))


def _dot(a: tuple[Jet, Jet, Jet], b: tuple[Jet, Jet, Jet]) -> Jet:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
