"""Proved relations of regions at large: the reach of a ball of the margin, and pairs that are disjoint or nested.

Two ellipsoids, each its stored float64 matrix, are told apart by their forms; bodies of other shapes, part by part, by
`verify.motion.convex_bodies`. All proofs are in rational arithmetic; floats only propose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from flint import fmpq, fmpq_mat

from verify.arithmetic.exact import rational
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import Matrix, Point
from verify.data.shapes.region import Region
from verify.model_checking.timeline import Relations
from verify.motion.convex_bodies import ConvexPart, are_apart, farthest, is_inside


@dataclass(frozen=True, slots=True)
class Extent:
    """Proved bounds on an ellipsoid's matrix M.

    Attributes:
        scale: s with s^2 >= the greatest eigenvalue of M: moving by d changes sqrt((r-c)' M (r-c)) by at most s d.
        reach: R such that no point of the ellipsoid is further than R from its centre, in m.
    """

    scale: Fraction
    reach: Fraction


@dataclass(frozen=True, slots=True)
class Ellipsoid:
    """A region as the checker sees it: centre and stored matrix, exact."""

    centre: Point
    matrix: Matrix

    @classmethod
    def of(cls, region: Region) -> Ellipsoid:
        """Take centre and compiled form of a region or hoop.

        Raises:
            BadInput: Its body is not one quadratic form around its centre.
        """
        return cls(region.center, region.quadratic)


@lru_cache(maxsize=4096)
def extent(region: Ellipsoid) -> Extent:
    """Return proved bounds on a region's size.

    Raises:
        BadInput: The matrix is not positive definite, so the region is no ellipsoid.
    """
    matrix = _matrix(region)
    identity = fmpq_mat([[int(i == j) for j in range(3)] for i in range(3)])
    values = np.linalg.eigvalsh(np.array(region.matrix))
    if not (np.all(np.isfinite(values)) and _positive(matrix)):
        raise BadInput("A region's matrix is not positive definite; it must come from positive radii.")
    for exponent in range(44, 2, -1):  # the first attempt succeeds but for regions of absurd proportions
        scale = Fraction(math.sqrt(values[-1])) * (1 + Fraction(1, 2**exponent))
        reach = Fraction(1 / math.sqrt(max(values[0], values[-1] * 2.0**-60))) * (1 + Fraction(1, 2**exponent))
        if _positive(identity * rational(scale * scale) - matrix) and _positive(matrix - identity * rational(1 / reach**2)):
            return Extent(scale, reach)
    raise BadInput("A region is so thin that its size cannot be bounded; use radii of similar lengths.")


def relations(mission: Mission) -> Relations:
    """Prove which regions have no common point and which lie inside others."""
    regions = {name: _Proved.of(region) for name, region in mission.all_regions.items()}
    disjoint: set[tuple[str, str]] = set()
    nested: set[tuple[str, str]] = set()
    names = sorted(regions)
    for a, b, far in _pairs(names, regions):
        if far or regions[a].is_apart_from(regions[b]):
            disjoint.add((a, b))
            continue
        if regions[a].is_in(regions[b]):
            nested.add((a, b))
        if regions[b].is_in(regions[a]):
            nested.add((b, a))
    return Relations(frozenset(disjoint), frozenset(nested))


@dataclass(frozen=True, eq=False, slots=True)
class _Proved:
    """A region with what is proved of it alone.

    Attributes:
        centre: m.
        reach: No point is farther from the centre than this, m.
        ellipsoid: The region, where it is one.
        parts: Its convex parts.
        covers: Convex bodies within it, its parts among them.
    """

    centre: Point
    reach: float
    ellipsoid: Ellipsoid | None
    parts: tuple[ConvexPart, ...]
    covers: tuple[ConvexPart, ...]

    @classmethod
    def of(cls, region: Region) -> _Proved:
        parts = tuple(ConvexPart(region.center, tuple(part)) for part in region.body)
        if region.is_ellipsoid:
            own = Ellipsoid.of(region)
            return cls(own.centre, float(extent(own).reach), own, parts, parts)
        around = tuple(ConvexPart(region.center, cover) for cover in covers(region.body))
        return cls(region.center, max(map(_reach, parts)), None, parts, around)

    def is_apart_from(self, other: _Proved) -> bool:
        if self.ellipsoid is not None and other.ellipsoid is not None:
            return are_disjoint(self.ellipsoid, other.ellipsoid)
        return all(are_apart(a, b) for a in self.parts for b in other.parts)

    def is_in(self, other: _Proved) -> bool:
        if self.ellipsoid is not None and other.ellipsoid is not None:
            return lies_inside(self.ellipsoid, other.ellipsoid)
        return all(any(is_inside(part, cover) for cover in other.covers) for part in self.parts)


def _reach(part: ConvexPart) -> float:
    """Return how far a part reaches from its centre at most, along the world's axes, in m; infinite where that was not proved."""
    square = Fraction(0)
    for axis in range(3):
        sides: list[Fraction] = []
        for sign in (1, -1):
            x, y, z = (Fraction(sign * (i == axis)) for i in range(3))
            far = farthest(part, (x, y, z))
            if far is None:
                return math.inf
            sides.append(abs(far - sign * Fraction(part.centre[axis])))
        square += max(sides) ** 2
    return math.nextafter(math.sqrt(square), math.inf) * (1 + 2.0**-50)


def _pairs(names: list[str], regions: dict[str, _Proved]) -> Iterator[tuple[str, str, bool]]:
    """Yield all pairs, and whether centres and reaches alone prove them disjoint; those that they do not may be so all the same.

    Each float here is within ten roundings of what it stands for, and a thousand times as much is allowed for.
    """
    centres = np.array([regions[name].centre for name in names]).reshape(-1, 3)
    reaches = np.array([regions[name].reach for name in names])
    for i, name in enumerate(names):
        offsets = centres[i + 1 :] - centres[i]
        gaps = np.einsum("jk,jk->j", offsets, offsets) * (1 - 2.0**-40)
        far = gaps > (reaches[i + 1 :] + reaches[i]) ** 2 * (1 + 2.0**-40)
        yield from ((name, other, apart) for other, apart in zip(names[i + 1 :], far.tolist(), strict=True))


@lru_cache(maxsize=65536)
def are_disjoint(a: Ellipsoid, b: Ellipsoid) -> bool:
    """Prove that two regions have no common point; False means only that no proof was found.

    A weighted mean w q_a + (1 - w) q_b of the two quadratic forms that is above 1 everywhere leaves no point
    where both are at most 1; where the ellipsoids lie apart there is such a weight.
    """
    gap = sum(((Fraction(p) - Fraction(q)) ** 2 for p, q in zip(a.centre, b.centre, strict=True)), Fraction(0))
    if gap > (extent(a).reach + extent(b).reach) ** 2:
        return True
    if gap == 0:
        return False
    offset = np.array(b.centre) - np.array(a.centre)
    first_shape, second_shape = np.array(a.matrix), np.array(b.matrix)
    weights = np.linspace(0.0, 1.0, 65)[1:-1]
    low, high = _best(weights, [_mean_least(first_shape, second_shape, offset, w) for w in weights])
    weight = _golden(lambda w: _mean_least(first_shape, second_shape, offset, w), low, high)
    w = rational(weight)
    first, second = _matrix(a) * w, _matrix(b) * (1 - w)
    shift = fmpq_mat([[rational(q) - rational(p)] for p, q in zip(a.centre, b.centre, strict=True)])
    # least of y' A y + (y - d)' B y - d): at (A + B) y = B d, its value is d' B d - d' B y
    pull = second * shift
    least = (shift.transpose() * pull - pull.transpose() * (first + second).solve(pull))[0, 0]
    return bool(least > 1)


@lru_cache(maxsize=65536)
def lies_inside(inner: Ellipsoid, outer: Ellipsoid) -> bool:
    """Prove that every point of one region lies in another; False means only that no proof was found.

    By the S-lemma it does if some w >= 0 makes w (q_inner - 1) - (q_outer - 1) nowhere negative.
    """
    offset = np.array(outer.centre) - np.array(inner.centre)
    small, large = np.array(inner.matrix), np.array(outer.matrix)
    if float(offset @ large @ offset) > 1:
        return False
    top = float(np.max(np.linalg.eigvals(np.linalg.solve(small, large)).real))
    weights = np.linspace(0.0, 1.0, 65)
    low, high = _best(weights, [_certificate_least(small, large, offset, w) for w in top + (1 - top) * weights])
    share = _golden(lambda s: _certificate_least(small, large, offset, top + (1 - top) * s), low, high)
    w = rational(top + (1 - top) * share)
    if w < 0:
        return False
    a, b = _matrix(inner), _matrix(outer)
    shift = fmpq_mat([[rational(q) - rational(p)] for p, q in zip(inner.centre, outer.centre, strict=True)])
    pull = b * shift
    corner = 1 - w - (shift.transpose() * pull)[0, 0]
    rows = [[(a * w - b)[i, j] for j in range(3)] + [pull[i, 0]] for i in range(3)]
    rows.append([pull[i, 0] for i in range(3)] + [corner])
    return _positive(fmpq_mat(rows))


def _matrix(region: Ellipsoid) -> fmpq_mat:
    return fmpq_mat([[rational(x) for x in row] for row in region.matrix])


def _positive(matrix: fmpq_mat) -> bool:
    """Decide whether a symmetric rational matrix is positive definite: all leading minors are above zero."""
    size = matrix.nrows()
    minors = (fmpq_mat([[matrix[i, j] for j in range(k)] for i in range(k)]).det() for k in range(1, size + 1))
    return all(minor > fmpq(0) for minor in minors)


def _mean_least(a: np.ndarray, b: np.ndarray, offset: np.ndarray, weight: float) -> float:
    pull = (1 - weight) * (b @ offset)
    return float(offset @ pull - pull @ np.linalg.solve(weight * a + (1 - weight) * b, pull))


def _certificate_least(a: np.ndarray, b: np.ndarray, offset: np.ndarray, weight: float) -> float:
    block = np.empty((4, 4))
    block[:3, :3] = weight * a - b
    block[:3, 3] = block[3, :3] = b @ offset
    block[3, 3] = 1 - weight - offset @ b @ offset
    return float(np.linalg.eigvalsh(block)[0])


def _best(places: np.ndarray, values: list[float]) -> tuple[float, float]:
    at = int(np.argmax(values))
    return float(places[max(at - 1, 0)]), float(places[min(at + 1, len(places) - 1)])


def _golden(value: Callable[[float], float], low: float, high: float) -> float:
    share = (math.sqrt(5) - 1) / 2
    for _ in range(60):
        a, b = high - share * (high - low), low + share * (high - low)
        if value(a) >= value(b):
            high = b
        else:
            low = a
    return (low + high) / 2
