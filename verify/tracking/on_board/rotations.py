"""Rotations in slopes: attitudes as sines of a tilt about two axes and twice the sine of half a heading, and unit quaternions w x y z.

A sum of products is written so that what cancels does not stand in it, as intervals cannot tell.
"""

from __future__ import annotations

import numpy as np

from verify.tracking.on_board.slopes import Slopes, root, stacked


def turned(q: Slopes) -> Slopes:
    """Return the body's axes in the world, as columns, of a unit quaternion. Shape (4,) to (3, 3)."""
    return bent(q) + np.eye(3)


def flown(attitude: Slopes) -> Slopes:
    """Return the unit quaternion of the vehicle's attitude: its heading, then its tilt about axes that have turned. Shape (3,) to (4,)."""
    w, x, y, c, s = halves(attitude)
    return stacked([w * c, x * c - y * s, y * c + x * s, w * s])


def estimated(attitude: Slopes) -> Slopes:
    """Return the unit quaternion of the attitude that is estimated: its tilt about the world's axes, after its heading. Shape (3,) to (4,)."""
    w, x, y, c, s = halves(attitude)
    return stacked([w * c, x * c + y * s, y * c - x * s, w * s])


def halves(attitude: Slopes) -> tuple[Slopes, Slopes, Slopes, Slopes, Slopes]:
    """Return cosine and sines of half the tilt, cosine and sine of half the heading."""
    s, twice = 0.5 * attitude[2], 2.0 * root(0.5 + 0.5 * upright(attitude))
    return 0.5 * twice, attitude[0] / twice, attitude[1] / twice, root(1.0 - s * s), s


def upright(attitude: Slopes) -> Slopes:
    """Return the cosine of the tilt."""
    return root(1.0 - (attitude[0] * attitude[0] + attitude[1] * attitude[1]))


def tilting(attitude: Slopes) -> Slopes:
    """Return the matrix of an attitude's tilt. Shape (3,) to (3, 3)."""
    a, b, up = attitude[0], attitude[1], upright(attitude)
    below = 1.0 + up
    return stacked(
        [
            stacked([1.0 - b * b / below, a * b / below, b]),
            stacked([a * b / below, 1.0 - a * a / below, -a]),
            stacked([-b, a, up]),
        ]
    )


def applied(matrix: Slopes, vector: Slopes) -> Slopes:
    """Return a matrix times a vector or a matrix."""
    return stacked([sum((matrix[i, k] * vector[k] for k in range(1, 3)), start=matrix[i, 0] * vector[0]) for i in range(3)])


def crossed(a: Slopes, b: Slopes) -> Slopes:
    """Return a x b."""
    return stacked([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def along(a: Slopes, b: Slopes) -> Slopes:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def skew(v: Slopes, diagonal: float) -> Slopes:
    """Return `diagonal` I - [v x]."""
    same = 0.0 * v[0] + diagonal
    return stacked([stacked([same, v[2], -v[1]]), stacked([-v[2], same, v[0]]), stacked([v[1], -v[0], same])])


def half_turn(v: Slopes) -> Slopes:
    """Return how a turn's error is seen from axes that have turned by v, to second order in v / 2."""
    d = 0.5 * v
    rows = list[Slopes]()
    for i in range(3):
        row = list[Slopes]()
        for j in range(3):
            if i == j:
                row.append(1.0 - 0.5 * (d[(i + 1) % 3] * d[(i + 1) % 3] + d[(i + 2) % 3] * d[(i + 2) % 3]))
            else:
                sign = 1.0 if (i + 1) % 3 == j else -1.0
                row.append(sign * d[3 - i - j] + 0.5 * (d[i] * d[j]))
        rows.append(stacked(row))
    return stacked(rows)


def conjugate(q: Slopes) -> Slopes:
    """Return the inverse of a unit quaternion."""
    return stacked([q[0], -q[1], -q[2], -q[3]])


def product(a: Slopes, b: Slopes) -> Slopes:
    """Return the product of quaternions."""
    return stacked(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


def little(turn: Slopes) -> tuple[Slopes, Slopes]:
    """Return the unit quaternion of a small rotation vector, by the first terms of its sine, and the share of the vector that it has."""
    square = 0.25 * along(turn, turn)
    share = 0.5 * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
    whole = 1.0 - square * (0.5 - square * (1.0 / 24.0))
    size = root(whole * whole + square * (4.0 * share * share))
    share = share / size
    return stacked([whole / size, share * turn[0], share * turn[1], share * turn[2]]), share


def bent(q: Slopes, sine: Slopes | None = None) -> Slopes:
    """Return the matrix of a unit quaternion less the unit matrix.

    Args:
        q: The quaternion.
        sine: The vector of the turn's sine; 2 w (x, y, z) where it is not given.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    a, b, c = (2.0 * (w * q[k]) if sine is None else sine[k - 1] for k in (1, 2, 3))
    return stacked(
        [
            stacked([-2.0 * (y * y + z * z), 2.0 * (x * y) - c, 2.0 * (x * z) + b]),
            stacked([2.0 * (x * y) + c, -2.0 * (x * x + z * z), 2.0 * (y * z) - a]),
            stacked([2.0 * (x * z) - b, 2.0 * (y * z) + a, -2.0 * (x * x + y * y)]),
        ]
    )
