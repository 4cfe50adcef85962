"""Regions at a margin: where a path must be inside, and where it must be outside.

A quadric is (x - c)'Q(x - c) <= B with Q semidefinite, its square completed. Of a ball of radius d around x all points keep it where
sqrt((x - c)'Q(x - c)) <= sqrt(B) - s d, and none does where it is above sqrt(B) + s d, s^2 being at least Q's greatest eigenvalue
(Coq: `quadric_must`, `quadric_no`). A half-space n.x <= h moves by |n| d (Coq: `half_space_must`, `half_space_no`).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import chain

from .bounds import root
from .flights import Plane, Segment, box_around
from .polynomials import Bernstein, Polynomial
from .refused import Refused
from .statement import Inequality, Shape, Vector
from .trees import Cell, Rows

ZERO = Fraction(0)
_Square = Sequence[Sequence[Fraction]]


@dataclass(frozen=True, slots=True)
class Condition:
    """An inequality as it is asked of a path: what a form along the path, a sum with these weights, has to be.

    All of the ball is inside where the form is at most `inside` (None: nowhere), none where it is above `outside`, or the path is beyond
    one of the planes.
    """

    weights: Polynomial
    inside: Fraction | None
    outside: Fraction
    planes: list[Plane]


@dataclass(frozen=True, slots=True)
class Body:
    """A region at a margin: its conditions, and their numbers in each part, and in each convex body within the region."""

    conditions: list[Condition]
    parts: list[tuple[int, ...]]
    covers: list[tuple[int, ...]]

    def is_far(self, segment: Segment) -> bool:
        """Return whether the box of a segment alone shows that it is out of the region."""
        return all(any(segment.is_beyond(plane) for k in part for plane in self.conditions[k].planes) for part in self.parts)

    def along(self, segment: Segment) -> Cell:
        """Return a segment in which `m` says that it is inside, `n` that it is outside, and `c` that it crosses the boundary once."""
        return Cell([segment.sum(one.weights) for one in self.conditions], self.claims)

    def claims(self, mark: str, rows: Rows) -> bool:
        """Return whether a mark is so (Coq: `check_region_sound`)."""
        if mark == "c":
            return self.crossing(rows) != ""
        return self._says(mark, [self.known(k, row) for k, row in enumerate(rows)])

    def known(self, k: int, row: Bernstein) -> str:
        """Return whether an inequality is kept or broken on all of a part; else nothing."""
        one = self.conditions[k]
        return "broken" if row.above(one.outside) else "kept" if one.inside is not None and row.at_most(one.inside) else ""

    def _says(self, mark: str, known: Sequence[str]) -> bool:
        if mark == "n":
            return all(any(known[k] == "broken" for k in part) for part in self.parts)
        return mark == "m" and any(all(known[k] == "kept" for k in cover) for cover in self.covers)

    def crossing(self, rows: Rows) -> str:
        """Return `rise` or `fall` where a path without margin comes in once, or leaves once (Coq: `crossing_in`, `crossing_out`).

        One inequality alone is open, and decides; what it bounds never rises, or never falls.
        """
        known = [self.known(k, row) for k, row in enumerate(rows)]
        if known.count("") != 1:
            return ""
        k = known.index("")
        row, bound = rows[k], self.conditions[k].outside
        kept, broken = ([*known[:k], word, *known[k + 1 :]] for word in ("kept", "broken"))
        if not (self._says("m", kept) and self._says("n", broken) and self.conditions[k].inside == bound):
            return ""
        first, last = row.ends()
        if first > bound >= last and row.numbers == sorted(row.numbers, reverse=True):
            return "rise"
        return "fall" if first <= bound < last and row.numbers == sorted(row.numbers) else ""


def body_of(shape: Shape, margin: Fraction, bridges: Iterable[Sequence[int]] = ()) -> Body:
    """Return a region at a margin.

    Args:
        shape: The region.
        margin: m.
        bridges: Convex bodies across a face at which one part begins where another ends: numbers of two bodies, and of a face of each.
            Bodies are counted from the parts on.

    Raises:
        Refused: An inequality is none that is understood, or a bridge is none.
    """
    every = list(dict.fromkeys(chain.from_iterable(shape.parts)))
    number = {one: k for k, one in enumerate(every)}
    parts = [tuple(number[one] for one in part) for part in shape.parts]
    covers = list(parts)
    for one, other, a, b in bridges:
        if max(one, other) >= len(covers) or a not in covers[one] or b not in covers[other] or not meet(every[a], every[b]):
            raise Refused("a bridge joins bodies that do not meet")
        # a point that keeps all others of both keeps a, and is in the one, or is beyond it, and so keeps b and is in the other
        rest = [*(k for k in covers[one] if k != a), *(k for k in covers[other] if k != b)]
        covers.append(tuple(k for k in dict.fromkeys(rest) if not any(holds(every[j], every[k]) for j in rest)))
    return Body([condition(one, shape.center, margin) for one in every], parts, covers)


def holds(one: Inequality, other: Inequality) -> bool:
    """Return whether one half-space lies strictly within another of the same normal, which it makes needless."""
    return one.linear == other.linear and one.quadratic == other.quadratic and one.bound < other.bound


def meet(one: Inequality, other: Inequality) -> bool:
    """Return whether all points beyond the one half-space are within the other."""
    first, second = one.linear or (ZERO,) * 3, other.linear or (ZERO,) * 3
    share = next((-b / a for a, b in zip(first, second, strict=True) if a), ZERO)
    opposite = all(b == -share * a for a, b in zip(first, second, strict=True))
    return not one.quadratic and not other.quadratic and share > 0 and opposite and other.bound >= -share * one.bound


@lru_cache(maxsize=4096)
def condition(one: Inequality, center: Vector, margin: Fraction) -> Condition:
    """Return an inequality at a margin.

    Args:
        one: The inequality.
        center: What it is around, m.
        margin: m.

    Raises:
        Refused: Its form is not semidefinite, or it is none.
    """
    linear, weights = one.linear or (ZERO,) * 3, Polynomial.of(terms_of(one, center))
    if not one.quadratic:
        if not (square := sum((x * x for x in linear), ZERO)):
            raise Refused("an inequality has no coordinate in it")
        flat, by = Polynomial(weights.numbers[6:], weights.shift), root(square)[1] * margin
        return Condition(flat, one.bound - by, one.bound + by, [Plane(flat, one.bound + by)])
    axes = [i for i in range(3) if any(one.quadratic[i])]
    block = [[one.quadratic[i][k] for k in axes] for i in axes]
    whole = determinant(block)
    if not whole or not is_semidefinite(block) or any(linear[i] for i in range(3) if i not in axes):
        raise Refused("an inequality has a form that is not understood")
    middle, reach = list(center), list[Fraction | None]([None] * 3)
    moved = ZERO  # -(c - center)'Q(c - center)
    for column, i in enumerate(axes):  # Cramer's rule: block (c - center) = -linear / 2
        found = determinant(
            [[-linear[a] / 2 if k == column else x for k, x in enumerate(row)] for a, row in zip(axes, block, strict=True)]
        )
        middle[i] += found / whole
        moved += linear[i] * found / whole / 2
    if (square := one.bound - moved) <= 0:
        raise Refused("an inequality leaves no points")
    for i in range(len(axes)):  # |x - c| <= sqrt(B / Q) along each axis
        rest = determinant([row[:i] + row[i + 1 :] for row in block[:i] + block[i + 1 :]])
        reach[axes[i]] = root(square * rest / whole)[1] + margin
    planes = box_around(middle, reach)
    if not margin:
        return Condition(weights, one.bound, one.bound, planes)
    (low, high), by = root(square), _scale(block) * margin
    return Condition(weights, (low - by) ** 2 + moved if low > by else None, (high + by) ** 2 + moved, planes)


def terms_of(one: Inequality, center: Vector) -> list[Fraction]:
    """Return the weights of xx, xy, xz, yy, yz, zz, x, y, z and 1 in an inequality's left side, around the world's origin."""
    q, linear = one.quadratic or ((ZERO,) * 3,) * 3, one.linear or (ZERO,) * 3
    pulled = [sum((q[i][k] * center[k] for k in range(3)), ZERO) for i in range(3)]
    rest = sum(((pulled[i] - linear[i]) * center[i] for i in range(3)), ZERO)
    moved = [linear[i] - 2 * pulled[i] for i in range(3)]
    return [q[0][0], 2 * q[0][1], 2 * q[0][2], q[1][1], 2 * q[1][2], q[2][2], *moved, rest]


def determinant(matrix: _Square) -> Fraction:
    """Return the determinant of a matrix of at most three rows."""
    if len(matrix) < 2:
        return matrix[0][0] if matrix else Fraction(1)
    minors = ([[*row[:k], *row[k + 1 :]] for row in matrix[1:]] for k in range(len(matrix)))
    return sum(((-1) ** k * matrix[0][k] * determinant(minor) for k, minor in enumerate(minors)), ZERO)


def is_semidefinite(matrix: _Square) -> bool:
    """Return whether a symmetric matrix is positive semidefinite, by elimination (Coq: `elimination_semidefinite`)."""
    rows = [list(row) for row in matrix]
    while rows:
        pivot, *rest = rows[0]
        if pivot < 0 or (not pivot and any(rest)):
            return False
        rows = [[a - row[0] * b / pivot if pivot else a for a, b in zip(row[1:], rest, strict=True)] for row in rows[1:]]
    return True


def _scale(block: _Square) -> Fraction:
    """Return s such that s^2 is at least the greatest eigenvalue of a semidefinite matrix (Coq: `rest_grows`, `rows_grow`)."""
    low, high = max(row[i] for i, row in enumerate(block)), max(sum(map(abs, row), ZERO) for row in block)
    for _ in range(32):
        middle = (low + high) / 2
        rest = [[(middle if i == k else ZERO) - x for k, x in enumerate(row)] for i, row in enumerate(block)]
        low, high = (low, middle) if is_semidefinite(rest) else (middle, high)
    return root(high)[1]
