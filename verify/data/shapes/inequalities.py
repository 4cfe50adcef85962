"""The compiled form of a region: what every shape becomes once, and all that planner, refinement and judge know of it.

A body is a union of convex parts; a part is what several polynomial inequalities of degree at most two leave, each a value of
float64 numbers that mean exactly what they say. Coordinates x = r - center are taken from the region's centre with the axes of the
world, so that a region that moves keeps its inequalities. The closed region *is* this value, however its numbers were rounded.

A body moved by d, for the margin, is never a new body: each inequality is asked for another bound, on the safe side.

* A quadratic form x'Mx <= 1: two points d apart differ in sqrt(x'Mx) by at most s d, where s^2 bounds M's greatest eigenvalue.
  Everything within d is inside where x'Mx <= (1 - s d)^2, and nothing within d is inside where x'Mx > (1 + s d)^2.
* A half-space n.x <= h: the bounds are h - |n| d and h + |n| d, with an upper bound of |n|, since a rounded normal is not quite a
  unit vector.

What asks for an ellipsoid's matrix gets it by `centred_form`, which refuses every other body, so that none is ever taken for what
it is not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from verify.data.errors import BadInput
from verify.data.value import Value
from verify.data.vehicle import Number

Point = tuple[Number, Number, Number]
Matrix = tuple[tuple[Number, Number, Number], tuple[Number, Number, Number], tuple[Number, Number, Number]]

_ZERO: Point = (0.0, 0.0, 0.0)


def point_of(values: Iterable[float]) -> Point:
    """Return three coordinates as a point of plain numbers.

    Args:
        values: x, y and z.
    """
    x, y, z = (float(value) for value in values)
    return x, y, z


LEAST_RADIUS, GREATEST_RADIUS = 1e-6, 1e6
"""m; between these a region's radii must lie."""


class Inequality(Value):
    """The points x with x' quadratic x + linear . x <= bound."""

    quadratic: Matrix = Field(default=(_ZERO, _ZERO, _ZERO), description="m^-2, symmetric; zero for a half-space")
    linear: Point = Field(default=_ZERO, description="m^-1; a half-space's normal")
    bound: Number = Field(default=1.0, description="right-hand side")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Inequality):
            return NotImplemented
        return (self.quadratic, self.linear, self.bound) == (other.quadratic, other.linear, other.bound)

    def __hash__(self) -> int:
        return hash((self.quadratic, self.linear, self.bound))

    @model_validator(mode="after")
    def _is_symmetric(self) -> Inequality:
        if self.quadratic != tuple(zip(*self.quadratic, strict=True)):
            raise ValueError("quadratic must be symmetric")
        return self


Part = Annotated[tuple[Inequality, ...], Field(min_length=1)]
Parts = Annotated[tuple[Part, ...], Field(min_length=1)]


def quadratic_form(matrix: Sequence[Sequence[float]] | NDArray[np.float64]) -> tuple[tuple[Inequality, ...], ...]:
    """Return the body x' matrix x <= 1 of one part.

    Args:
        matrix: m^-2, symmetric and positive definite. Shape (3, 3).
    """
    rows = tuple(tuple(float(x) for x in row) for row in matrix)
    return ((Inequality.model_validate({"quadratic": rows}),),)


def centred_form(parts: Sequence[Sequence[Inequality]]) -> Matrix:
    """Return M of a body that is x'Mx <= 1, in m^-2; bodies of other kinds are refused.

    Raises:
        BadInput: It has several parts or inequalities, a linear term or another bound, or it is no ellipsoid of sensible size.
    """
    if len(parts) != 1 or len(parts[0]) != 1:
        count = f"{len(parts)} parts" if len(parts) != 1 else f"a part of {len(parts[0])} inequalities"
        raise BadInput(
            f"Only ellipsoids are known here, bodies of one part with one quadratic inequality; this one has {count}."
        )
    (only,) = parts[0]
    if any(only.linear) or only.bound != 1.0 or only.quadratic != tuple(zip(*only.quadratic, strict=True)):
        raise BadInput(
            "Only ellipsoids are known here, bodies of one quadratic inequality x' quadratic x <= 1 around their centre; this one is "
            f"quadratic {[list(row) for row in only.quadratic]}, linear {list(only.linear)}, bound {only.bound:g}."
        )
    least, _, greatest = semi_axes(only.quadratic)
    if not (least >= LEAST_RADIUS and greatest <= GREATEST_RADIUS):  # NaN where it is no ellipsoid
        raise BadInput(
            f"A region's radii must lie between {LEAST_RADIUS:g} m and {GREATEST_RADIUS:g} m; those of the inequality are "
            f"{least:g} m to {greatest:g} m (nan where it is no ellipsoid)."
        )
    return only.quadratic


@lru_cache(maxsize=4096)
def semi_axes(matrix: Matrix) -> tuple[float, float, float]:
    """Return the ellipsoid's half axes, in m, the least first, in floats; NaN for a matrix that is not positive definite."""
    try:
        values = np.linalg.eigvalsh(np.array(matrix))[::-1]
    except np.linalg.LinAlgError:  # numbers beyond all bounds
        return math.nan, math.nan, math.nan
    a, b, c = (1.0 / math.sqrt(value) if value > 0 else math.nan for value in values.tolist())
    return a, b, c


def half_lengths(matrix: Matrix) -> tuple[float, float, float]:
    """Return half the edges of the least box along the world's axes that holds the ellipsoid, in m, in floats."""
    x, y, z = np.sqrt(np.diag(np.linalg.inv(np.array(matrix)))).tolist()
    return x, y, z


def moved(one: Inequality, center: Point, own: Point) -> Inequality:
    """Return an inequality around one point as one around another, rounded once.

    Args:
        one: The inequality.
        center: The point that it is to be around, m.
        own: The point that it is around, m.
    """
    step = [Fraction(a) - Fraction(b) for a, b in zip(own, center, strict=True)]
    pulled = [sum((Fraction(one.quadratic[i][j]) * step[j] for j in range(3)), Fraction(0)) for i in range(3)]
    linear = tuple(float(Fraction(one.linear[i]) - 2 * pulled[i]) for i in range(3))
    along = sum((Fraction(one.linear[i]) * step[i] for i in range(3)), Fraction(0))
    square = sum((step[i] * pulled[i] for i in range(3)), Fraction(0))
    return Inequality.model_validate(
        {"quadratic": one.quadratic, "linear": linear, "bound": float(Fraction(one.bound) + along - square)}
    )


def turned(parts: Sequence[Sequence[Inequality]], angle: float) -> tuple[tuple[Inequality, ...], ...]:
    """Return a body turned about z through its centre by an angle in rad, rounded; the result is a region in its own right."""
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def one(old: Inequality) -> Inequality:
        matrix = turn @ np.array(old.quadratic) @ turn.T
        matrix = (matrix + matrix.T) / 2
        return Inequality.model_validate(
            {"quadratic": tuple(map(tuple, matrix.tolist())), "linear": tuple((turn @ old.linear).tolist()), "bound": old.bound}
        )

    return tuple(tuple(map(one, part)) for part in parts)


def grown(parts: Sequence[Sequence[Inequality]], margin: float) -> tuple[tuple[Inequality, ...], ...]:
    """Return a body larger by a margin in m, each inequality moved outwards, rounded; of convex inequalities only."""

    def one(old: Inequality) -> Inequality:
        matrix, linear = np.array(old.quadratic), np.array(old.linear)
        if not matrix.any():
            return old.model_copy(update={"bound": old.bound + float(np.linalg.norm(linear)) * margin})
        centre = np.linalg.lstsq(matrix, -linear / 2, rcond=None)[0]
        square = old.bound - float(linear @ centre) / 2
        root = math.sqrt(square) + math.sqrt(float(np.linalg.eigvalsh(matrix)[-1])) * margin
        return old.model_copy(update={"bound": old.bound + root**2 - square})

    return tuple(tuple(map(one, part)) for part in parts)
