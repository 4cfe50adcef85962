"""Refutation of clearances: one instant of a path and one solid point that are too near, in rational numbers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from verify.arithmetic.exact import fraction, rational
from verify.data.shapes.conditions import HalfSpace, condition, determinant, dot, solve
from verify.data.shapes.nearest import surface_of
from verify.data.shapes.region import Hoop
from verify.data.shapes.solid_parts import SolidPart, holds
from verify.motion.obstacles.half_spaces import HalfSpaces, farthest_of
from verify.motion.obstacles.openings import BESIDE, Opening
from verify.motion.paths import TeamPaths

Vector = tuple[Fraction, Fraction, Fraction]

_ON = 1e-9
"""m; a face this near to the nearest point may be what it lies on."""
_FAR = 10**9
"""m; no obstacle is there."""
_PULLS = (0.0, 2.0**-46, 2.0**-40, 2.0**-30)
"""By these shares points found in floats are pulled inwards, or out of openings."""


def meets(paths: TeamPaths, part: SolidPart, segment: int, place: float, limit: Fraction) -> bool:
    """Prove that at one instant a path is no farther than a limit from what is solid; False means only that no proof was found.

    Args:
        paths: The team.
        part: The part of an obstacle.
        segment: Index of the segment.
        place: Where in it, from 0 to 1.
        limit: m, exact.
    """
    x, y, z = (fraction(axis(rational(place))) for axis in paths.exact_position(segment))
    return max(abs(x), abs(y), abs(z)) < _FAR and is_near((x, y, z), part, limit)


def is_near(point: Vector, part: SolidPart, limit: Fraction) -> bool:
    """Prove that a point is no farther than a limit from what is solid; False means only that no proof was found.

    Args:
        point: m, exact.
        part: The part of an obstacle.
        limit: m, exact; below zero nothing is near.
    """
    return limit >= 0 and any(
        _square(solid, point) <= limit * limit
        and holds(part.center, part.inequalities, solid)
        and not any(_in_opening(hoop, solid) for _, hoop in part.holes)
        for solid in _candidates(part, point)
    )


def _candidates(part: SolidPart, point: Vector) -> Iterator[Vector]:
    """Yield points that may be solid and nearest."""
    yield point
    center = np.array(part.center)
    surface = surface_of(part.inequalities)
    near = surface.nearest(np.array([[float(x) for x in point]]) - center)[0]
    yield from _on_faces(part, point, near)
    for share in _PULLS:
        yield _exact(center + near + share * (surface.corners.mean(axis=0) - near))
    for _, hoop in part.holes:
        yield from _on_edge(hoop, point, near + center)
        yield from _on_slanted_edge(hoop, part, point)


def _on_faces(part: SolidPart, point: Vector, near: np.ndarray) -> Iterator[Vector]:
    """Yield the points of faces, of edges and of corners near the nearest point that are nearest themselves, without rounding."""
    known = [condition(one) for one in part.inequalities]
    flat = [one for one in known if isinstance(one, HalfSpace)]
    offset = [x - Fraction(c) for x, c in zip(point, part.center, strict=True)]
    active = [
        one
        for one in flat
        if abs(sum(float(n) * x for n, x in zip(one.normal, near.tolist(), strict=True)) - float(one.bound))
        <= _ON * float(one.length)
    ]
    for count in (1, 2, 3):
        for chosen in itertools.combinations(active[:6], count):
            gram = [[dot(a.normal, b.normal) for b in chosen] for a in chosen]
            if determinant(gram) == 0:
                continue
            over = [dot(one.normal, (offset[0], offset[1], offset[2])) - one.bound for one in chosen]
            weights = solve(gram, over)
            x, y, z = (
                p - sum((w * one.normal[i] for w, one in zip(weights, chosen, strict=True)), Fraction(0))
                for i, p in enumerate(point)
            )
            yield x, y, z


def _on_edge(hoop: Hoop, point: Vector, near: np.ndarray) -> Iterator[Vector]:
    """Yield points on an opening's edge, outwards from a point and from what would be nearest without the opening."""
    centre, normal = np.array(hoop.center), np.array(hoop.normal)
    here = np.array([float(x) for x in point])
    for outward in (here, near):
        across = outward - centre - ((outward - centre) @ normal) * normal
        length = float(np.linalg.norm(across))
        unit = across / length if length > 1e-9 else np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        unit = unit / np.linalg.norm(unit)
        for along in ((here - centre) @ normal, (near - centre) @ normal):
            for share in _PULLS[1:]:
                yield _exact(centre + along * normal + hoop.opening * (1 + share) * unit)


def _on_slanted_edge(hoop: Hoop, part: SolidPart, point: Vector) -> Iterator[Vector]:
    """Yield points where an opening's edge, on faces of the part, is nearest, pulled off the axis and into the part."""
    flat = [one for one in part.inequalities if not any(map(any, one.quadratic))]
    if not flat:
        return
    normals, bounds = np.array([[one.linear for one in flat]]), np.array([[one.bound for one in flat]])
    rows = HalfSpaces(normals, bounds, np.zeros_like(normals), np.zeros_like(bounds))
    here, center, axis = np.array([[float(x) for x in point]]), np.array(part.center), np.array(hoop.normal)
    rows = farthest_of(rows, here - center, BESIDE)
    weights, _, nearest = Opening.of(part, hoop).weights(rows, here, here - center)
    place, way = nearest[0] + center, np.einsum("r,ri->i", weights[0], rows.normals[0])
    outward = place - np.array(hoop.center)
    outward = outward - (outward @ axis) * axis
    pull = outward / max(float(np.linalg.norm(outward)), 1e-12) - way / max(float(np.linalg.norm(way)), 1e-12)
    for share in _PULLS:
        yield _exact(place + share * hoop.opening * pull)


def _in_opening(hoop: Hoop, point: Vector) -> bool:
    x, y, z = (value - Fraction(c) for value, c in zip(point, hoop.center, strict=True))
    normal = _exact(np.array(hoop.normal))
    along = dot((x, y, z), normal)
    return dot((x, y, z), (x, y, z)) * dot(normal, normal) - along * along < Fraction(hoop.opening) ** 2 * dot(normal, normal)


def _exact(point: np.ndarray) -> Vector:
    x, y, z = (Fraction(value) for value in point.tolist())
    return x, y, z


def _square(a: Vector, b: Vector) -> Fraction:
    return sum(((x - y) ** 2 for x, y in zip(a, b, strict=True)), Fraction(0))
