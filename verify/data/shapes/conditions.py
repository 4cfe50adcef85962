"""Inequalities as they are asked of points: half-spaces and quadrics, exact, with their bounds for a ball around the point.

An inequality x'Qx + l.x <= b of float64 numbers means exactly what it says. Here it becomes, in rational numbers,

* a half-space n.x <= h, with an upper bound of |n|, or
* a quadric (x - c)'Q(x - c) <= B, its square completed, with s^2 an upper bound of Q's greatest eigenvalue.

What is asked of a ball of radius d around x is asked of x with another bound: sqrt((x - c)'Q(x - c)) changes by at most s d
within it, and n.x by at most |n| d. The root of B is bounded from below where the ball must be inside, and from above where it
must be outside, so that both answers are on the safe side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np

from verify.data.errors import BadInput
from verify.data.shapes.inequalities import Inequality

Vector = tuple[Fraction, Fraction, Fraction]
Rows = tuple[Vector, Vector, Vector]

_FINE = 1 << 60
"""Roots are enclosed to this share of what they are."""


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """The points x with normal . x <= bound.

    Attributes:
        normal: In 1/m, of any length but zero.
        bound: Right-hand side.
        length: At least |normal|.
    """

    normal: Vector
    bound: Fraction
    length: Fraction

    def bounds(self, margin: Fraction) -> tuple[Fraction | None, Fraction]:
        """Return what normal . x is at most where the ball around x is inside, and at most where it is not outside."""
        return self.bound - self.length * margin, self.bound + self.length * margin


@dataclass(frozen=True, slots=True)
class Quadric:
    """The points x with (x - centre)' matrix (x - centre) <= square.

    Attributes:
        matrix: m^-2; of some axes of the world positive definite, of the others zero.
        centre: m; zero on those others.
        square: Above zero.
        scale: 1/m; its square is at least the matrix's greatest eigenvalue.
    """

    matrix: Rows
    centre: Vector
    square: Fraction
    scale: Fraction

    def bounds(self, margin: Fraction) -> tuple[Fraction | None, Fraction]:
        """Return what the form is at most where the ball around x is inside (None: never), and at most where it is not outside."""
        if margin == 0:
            return self.square, self.square
        low, high = root_bounds(self.square)
        within = low - self.scale * margin
        return within * within if within > 0 else None, (high + self.scale * margin) ** 2


Condition = HalfSpace | Quadric


@lru_cache(maxsize=65536)
def condition(inequality: Inequality) -> Condition:
    """Return an inequality as it is asked of points.

    Raises:
        BadInput: It leaves all points or none, its quadratic form is not convex, or it is flat in a direction askew to the axes.
    """
    quadratic = [[Fraction(x) for x in row] for row in inequality.quadratic]
    linear = [Fraction(x) for x in inequality.linear]
    bound = Fraction(inequality.bound)
    axes = [i for i in range(3) if any(quadratic[i])]
    if not axes:
        if not any(linear):
            raise BadInput(
                "An inequality without any coordinate leaves all points or none; give it a `linear` or a `quadratic`."
            )
        return HalfSpace((linear[0], linear[1], linear[2]), bound, root_bounds(sum((x * x for x in linear), Fraction(0)))[1])
    block = [[quadratic[i][j] for j in axes] for i in axes]
    if not is_positive(block) or any(linear[i] for i in range(3) if i not in axes):
        raise BadInput(
            f"The inequality with quadratic {[list(row) for row in inequality.quadratic]} is none that is understood: the form must "
            "be positive definite, or zero along some axes of the world, without a linear term there, and positive definite in the others."
        )
    solved = solve(block, [-linear[i] / 2 for i in axes])
    centre = [Fraction(0)] * 3
    for i, value in zip(axes, solved, strict=True):
        centre[i] = value
    square = bound - sum((linear[i] * centre[i] for i in axes), Fraction(0)) / 2
    if square <= 0:
        raise BadInput(f"The quadratic inequality with bound {inequality.bound:g} leaves no points inside.")
    rows = tuple((row[0], row[1], row[2]) for row in quadratic)
    return Quadric((rows[0], rows[1], rows[2]), (centre[0], centre[1], centre[2]), square, _scale(block))


def _scale(block: Sequence[Sequence[Fraction]]) -> Fraction:
    """Return s such that s^2 is at least the greatest eigenvalue of a positive definite matrix."""
    guess = float(np.linalg.eigvalsh(np.array([[float(x) for x in row] for row in block]))[-1])
    size = len(block)
    for exponent in range(44, 2, -1) if math.isfinite(guess) and guess > 0 else ():
        scale = Fraction(math.sqrt(guess)) * (1 + Fraction(1, 2**exponent))
        rest = [[(scale * scale if i == j else Fraction(0)) - block[i][j] for j in range(size)] for i in range(size)]
        if is_positive(rest):
            return scale
    return root_bounds(sum((block[i][i] for i in range(size)), Fraction(0)))[1]  # the trace is at least any eigenvalue


def root_bounds(value: Fraction) -> tuple[Fraction, Fraction]:
    """Return rational numbers just below and just above the root of one that is not negative, or the root itself twice.

    Args:
        value: Not negative.
    """
    top, under = value.numerator, value.denominator
    product = top * under
    shift = max(0, 2 * _FINE.bit_length() - product.bit_length() // 2)
    scaled = math.isqrt(product << (2 * shift))
    low = Fraction(scaled, under << shift)
    if low * low == value:
        return low, low
    return low, Fraction(scaled + 1, under << shift)


def is_positive(matrix: Sequence[Sequence[Fraction]]) -> bool:
    """Return whether a symmetric matrix is positive definite: all its leading minors are above zero.

    Args:
        matrix: Shape (n, n), n at most 3.
    """
    return all(determinant([row[:k] for row in matrix[:k]]) > 0 for k in range(1, len(matrix) + 1))


def dot(a: Vector, b: Vector) -> Fraction:
    """Return the inner product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def determinant(matrix: Sequence[Sequence[Fraction]]) -> Fraction:
    """Return the determinant of a matrix of at most three rows.

    Args:
        matrix: Shape (n, n).
    """
    if len(matrix) == 1:
        return matrix[0][0]
    if len(matrix) == 2:
        return matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0]
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def solve(matrix: Sequence[Sequence[Fraction]], right: Sequence[Fraction]) -> list[Fraction]:
    """Solve a regular system of at most three equations, by Cramer's rule.

    Args:
        matrix: Shape (n, n), its determinant not zero.
        right: Shape (n,).
    """
    whole = determinant(matrix)
    size = len(matrix)
    return [
        determinant([[right[i] if j == column else matrix[i][j] for j in range(size)] for i in range(size)]) / whole
        for column in range(size)
    ]
