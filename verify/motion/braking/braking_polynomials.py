"""Braking to a hover from any instant of a flight: where it leads, and how fast, for all instants at once.

Velocity, and the heading's rate, go to zero within a length L as the polynomial of degree 5 that begins with the velocity, acceleration and jerk of the instant t and
ends with all three at zero. At a share s of the way the place is then

    p(t, s) = x(t) + L k1(s) x'(t) + L^2 k2(s) x''(t) + L^3 k3(s) x'''(t),

for a fixed s again a path of polynomials in t. For s within an interval p lies among the paths that the Bernstein coefficients of k1, k2
and k3 on it give: in their convex hull, for every t. So one path in the middle, and how far the others are from it, enclose all. Time
derivatives of the braking have the derivatives of k1, k2 and k3 over powers of L for weights. The heading brakes as x, y and z do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Balls, Floats, concatenate, dot, nearest, raised
from verify.arithmetic.bounds import peaks
from verify.data.trajectory import DEGREE
from verify.motion.limits import with_gravity
from verify.motion.paths import TeamPaths
from verify.motion.rotors import Motion

Weights = tuple[Fraction, Fraction, Fraction]
"""Of velocity, acceleration and jerk at the instant at which braking begins."""

_SHAPES = (
    (0, 1, 0, 0, Fraction(-5, 2), 3, -1),
    (0, 0, Fraction(1, 2), 0, Fraction(-3, 2), Fraction(8, 5), Fraction(-1, 2)),
    (0, 0, 0, Fraction(1, 6), Fraction(-3, 8), Fraction(3, 10), Fraction(-1, 12)),
)
"""k1, k2 and k3 by powers of s."""
_SLACK = 1e-4
"""How much a bound on a square may stay above what is reached, as a share of its first bound."""


def weights(length: Fraction, begin: Fraction, end: Fraction, order: int = 0) -> list[Weights]:
    """Return Bernstein coefficients in s of what multiplies velocity, acceleration and jerk, between two shares of the braking.

    Args:
        length: L, s.
        begin: Share, from 0.
        end: Share, to 1.
        order: 0 for the place, 1 for the velocity of braking, and so on.
    """
    rows = [_bernstein(_derived(shape, order), begin, end) for shape in _SHAPES]
    a, b, c = ([length ** (i - order) * value for value in row] for i, row in enumerate(rows, 1))
    return list(zip(a, b, c, strict=True))


def weights_at(length: Fraction, share: Fraction) -> Weights:
    """Return what multiplies velocity, acceleration and jerk for the place at one share of the braking."""
    a, b, c = (length**i * sum(value * share**k for k, value in enumerate(shape)) for i, shape in enumerate(_SHAPES, 1))
    return a, b, c


def _derived(shape: Sequence[Fraction | int], order: int) -> list[Fraction]:
    values = [Fraction(value) for value in shape]
    for _ in range(order):
        values = [k * value for k, value in enumerate(values)][1:]
    return values


def _bernstein(powers: Sequence[Fraction], begin: Fraction, end: Fraction) -> list[Fraction]:
    """Return a polynomial's Bernstein coefficients on an interval."""
    degree, width = len(powers) - 1, end - begin
    local = [
        width**k * sum((math.comb(n, k) * powers[n] * begin ** (n - k) for n in range(k, degree + 1)), Fraction(0))
        for k in range(degree + 1)
    ]
    return [
        sum((Fraction(math.comb(i, k), math.comb(degree, k)) * local[k] for k in range(i + 1)), Fraction(0))
        for i in range(degree + 1)
    ]


def greatest(paths: TeamPaths, rows: Sequence[Weights], *, gravity: bool = False) -> Floats:
    """Bound how great the sum of weighted velocity, acceleration and jerk gets for any row and instant. Shape (robots,).

    Args:
        paths: What is flown.
        rows: Weights.
        gravity: Add what holds a vehicle up, 9.81 m/s^2 along z: rows are of accelerations.
    """
    squares: list[Balls] = []
    for row in rows:
        found = weighted_sum(paths, row)
        found = with_gravity(found) if gravity else found
        squares.append(dot(found, found))
    count, all_squares = len(paths.robots), concatenate(squares)
    groups = np.tile(paths.piece_owner, len(rows))
    first = np.zeros(count)
    np.maximum.at(first, groups, all_squares.high.max(axis=1))
    found = peaks(all_squares, groups, count, slack=_SLACK * first + 1e-12)
    return np.nextafter(np.sqrt(np.maximum(found.upper, 0.0)) * (1 + 1e-15), np.inf)


def weighted_sum(paths: TeamPaths, row: Weights) -> Balls:
    """Enclose the weighted sum of velocity, acceleration and jerk on each piece. Shape (pieces, 3, DEGREE + 1).

    Args:
        paths: What is flown.
        row: The weights.
    """
    first, second, third = (
        raised(paths.derivative(order)[:, :3], DEGREE).scaled(*nearest(weight)) for order, weight in enumerate(row, 1)
    )
    return first + second + third


def braking_motion(paths: TeamPaths, length: Fraction, begin: Fraction, end: Fraction) -> Motion:
    """Enclose forces, their derivatives and headings between two shares of the braking, for every instant at which it begins.

    Args:
        paths: What is flown.
        length: L, s.
        begin: Share, from 0.
        end: Share, to 1.
    """
    places, heading = slice(0, 3), 3

    def enclosed(order: int, axes: slice | int) -> Balls:
        total = None
        rows = weights(length, begin, end, order)
        for derivative, values in enumerate(zip(*rows, strict=True), 1):
            low, high = min(values), max(values)
            middle, off = nearest((low + high) / 2)
            radius = math.nextafter(float((high - low) / 2) * (1 + 1e-15) + off, math.inf)
            part = raised(paths.derivative(derivative)[:, axes], DEGREE).scaled(middle, radius)
            total = part if total is None else total + part
        assert total is not None
        return total

    acceleration, jerk, snap = (enclosed(order, places) for order in (2, 3, 4))
    yaw = paths.derivative(0)[:, heading] + enclosed(0, heading)
    return Motion(with_gravity(acceleration), jerk, snap, yaw, enclosed(1, heading), enclosed(2, heading))
