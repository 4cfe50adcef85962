"""Proofs about two convex bodies of any shape: that they have no common point, or that one lies in the other.

Everything rests on one bound: how far a body reaches at most in a direction. A polyhedron's is proved by the faces that meet where
it is reached (the direction is a sum of their normals with weights that are not negative, solved exactly), a quadric's by its
inverse form, an upright cylinder's by the sum of both. Directions are found in floats and taken as they are: any direction in
which two bodies' reaches leave a gap parts them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from verify.data.shapes.conditions import HalfSpace, Quadric, Vector, condition, determinant, dot, root_bounds, solve
from verify.data.shapes.convex_parts import convex_body, polyhedron_corners
from verify.data.shapes.inequalities import Inequality, Point

Floats = NDArray[np.float64]
Face = tuple[Vector, Fraction]
"""Normal and bound: all points of a body have normal . x <= bound."""

_AXES: tuple[Vector, ...] = tuple(
    (Fraction(sign * (axis == 0)), Fraction(sign * (axis == 1)), Fraction(sign * (axis == 2)))
    for axis in range(3)
    for sign in (1, -1)
)
_MOST_FACES = 28
"""A polyhedron with more faces has too many corners for each to be computed exactly."""
_ROUNDS = 60
_LEAST_GAP = 1e-12
"""m; parts that are not farther from each other than this count as touching."""


@dataclass(frozen=True, slots=True)
class ConvexPart:
    """One convex part of a region: inequalities around a centre, in m, world frame."""

    centre: Point
    inequalities: tuple[Inequality, ...]


@dataclass(frozen=True, eq=False, slots=True)
class _Shape:
    """A part in the world's frame.

    Attributes:
        faces: Its half-spaces and the box of each quadric, exact.
        quadrics: Each with its centre in the world's frame.
        normals: Of the faces, in floats. Shape (faces, 3).
        corners: Of the polyhedron of the faces, in floats. Shape (corners, 3).
        edges: Directions of the polyhedron's edges, where it is all of the part, in floats. Shape (edges, 3).
        bounds: The faces' bounds by their normals.
    """

    faces: tuple[Face, ...]
    quadrics: tuple[tuple[Quadric, Vector], ...]
    normals: Floats
    corners: Floats
    edges: Floats
    bounds: dict[Vector, Fraction]


@lru_cache(maxsize=4096)
def _shape(part: ConvexPart) -> _Shape:
    faces: list[Face] = []
    quadrics: list[tuple[Quadric, Vector]] = []
    for inequality in part.inequalities:
        one = condition(inequality)
        if isinstance(one, HalfSpace):
            bound = one.bound + sum((n * Fraction(c) for n, c in zip(one.normal, part.centre, strict=True)), Fraction(0))
            faces.append(_of_common_length(one.normal, bound))
        else:
            x, y, z = (Fraction(a) + b for a, b in zip(part.centre, one.centre, strict=True))
            quadrics.append((one, (x, y, z)))
    own = len(faces)
    for quadric, centre in quadrics:
        for axis in _AXES:
            bound = _reach_of_quadric(quadric, centre, axis)
            if bound is not None:
                faces.append((axis, bound))
    normals = np.array([[float(x) for x in normal] for normal, _ in faces])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    distances = np.array([float(bound - dot(normal, _exact(part.centre))) for normal, bound in faces])
    corners = polyhedron_corners(normals / lengths, distances / lengths[:, 0]) + np.array(part.centre)
    edges = np.zeros((0, 3))
    if own == len(faces):
        pairs = np.array(list(itertools.combinations(range(own), 2)))
        edges = np.cross(normals[pairs[:, 0]], normals[pairs[:, 1]])
        edges = edges[np.linalg.norm(edges, axis=1) > 1e-9]
        edges = np.unique(np.round(edges / np.linalg.norm(edges, axis=1, keepdims=True), 9), axis=0)
    bounds: dict[Vector, Fraction] = {}
    for normal, bound in faces:
        bounds[normal] = min(bound, bounds.get(normal, bound))
    return _Shape(tuple(faces), tuple(quadrics), normals, corners, edges, bounds)


def _of_common_length(normal: Vector, bound: Fraction) -> Face:
    """Return a face whose normal's square is a float like others; those that are so long or short that it is not are scaled."""
    largest = float(max(map(abs, normal)))
    if not 1e-100 < largest < 1e100:
        scale = Fraction(2) ** -math.frexp(largest)[1]
        x, y, z = (scale * value for value in normal)
        return (x, y, z), scale * bound
    return normal, bound


def _exact(point: Iterable[float]) -> Vector:
    x, y, z = (Fraction(value) for value in point)
    return x, y, z


def farthest(part: ConvexPart, direction: Vector) -> Fraction | None:
    """Return a proved upper bound of direction . r over a part, in the world's frame; None where none was found.

    Args:
        part: The part.
        direction: Of any length.
    """
    shape = _shape(part)
    found = [_reach_of_faces(shape, direction)]
    for quadric, centre in shape.quadrics:
        axes = _axes(quadric)
        x, y, z = (value if i in axes else Fraction(0) for i, value in enumerate(direction))
        own = _reach_of_quadric(quadric, centre, (x, y, z))
        rest = (direction[0] - x, direction[1] - y, direction[2] - z)
        more = _reach_of_faces(shape, rest) if any(rest) else Fraction(0)
        found.append(None if own is None or more is None else own + more)
    known = [bound for bound in found if bound is not None]
    return min(known) if known else None


def _axes(quadric: Quadric) -> list[int]:
    return [i for i in range(3) if any(quadric.matrix[i])]


def _reach_of_quadric(quadric: Quadric, centre: Vector, direction: Vector) -> Fraction | None:
    """Return d . c + sqrt(B d'Q^-1 d), rounded up; None where the quadric has no end in that direction."""
    axes = _axes(quadric)
    if any(direction[i] for i in range(3) if i not in axes):
        return None
    solved = solve([[quadric.matrix[i][j] for j in axes] for i in axes], [direction[i] for i in axes])
    square = quadric.square * sum((direction[i] * value for i, value in zip(axes, solved, strict=True)), Fraction(0))
    return dot(direction, centre) + root_bounds(square)[1]


def _reach_of_faces(shape: _Shape, direction: Vector) -> Fraction | None:
    """Write the direction as a sum of normals of three faces that meet where it is reached; their bounds add up alike."""
    if len(shape.corners) == 0:
        return None
    way = np.array([float(x) for x in direction])
    values = shape.corners @ way
    top = int(np.argmax(values))
    known = shape.bounds.get(direction)
    if known is not None and float(known) <= values[top] + 1e-9 * (1 + abs(values[top])):
        return known  # a face of its own
    corner = shape.corners[top]
    near = np.abs(shape.normals @ corner - np.array([float(bound) for _, bound in shape.faces]))
    lengths = np.linalg.norm(shape.normals, axis=1)
    active = np.flatnonzero(near <= 1e-8 * lengths * (1 + np.abs(shape.corners).max()))
    best: Fraction | None = None
    for triple in itertools.islice(itertools.combinations(active.tolist(), 3), 64):
        normals = [shape.faces[k][0] for k in triple]
        columns = [[normals[j][i] for j in range(3)] for i in range(3)]
        if determinant(columns) == 0:
            continue
        weights = solve(columns, direction)
        if min(weights) >= 0:
            bound = sum((weight * shape.faces[k][1] for weight, k in zip(weights, triple, strict=True)), Fraction(0))
            best = bound if best is None else min(best, bound)
            break
    return best


def are_apart(a: ConvexPart, b: ConvexPart) -> bool:
    """Prove that two parts have no common point; False means only that no proof was found.

    Args:
        a: One part.
        b: The other.
    """
    first, second = _shape(a), _shape(b)
    ways = _directions(a, b, first, second)
    gaps = -_reaches(second, -ways) - _reaches(first, ways)
    for k in np.argsort(-gaps)[:3].tolist():
        if not gaps[k] > _LEAST_GAP:
            break
        direction = _exact(ways[k].tolist())
        reach = farthest(a, direction)
        back = None if reach is None else farthest(b, (-direction[0], -direction[1], -direction[2]))
        if reach is not None and back is not None and reach < -back:
            return True
    return False


def _directions(a: ConvexPart, b: ConvexPart, first: _Shape, second: _Shape) -> Floats:
    """Return directions in which the parts may leave a gap: normals of faces, across pairs of edges, and between nearest points."""
    found = [first.normals, -second.normals]
    if len(first.edges) and len(second.edges):
        across = np.cross(first.edges[:, None], second.edges[None]).reshape(-1, 3)
        across = across[np.linalg.norm(across, axis=1) > 1e-9]
        found += [across, -across]
    if first.quadrics or second.quadrics:
        found.append(_between_nearest(first, second, np.array(b.centre) - np.array(a.centre)))
    every = np.concatenate(found)
    lengths = np.linalg.norm(every, axis=1, keepdims=True)
    kept = lengths[:, 0] > 0
    return every[kept] / lengths[kept]


def _between_nearest(first: _Shape, second: _Shape, way: Floats) -> Floats:
    """Return directions between points of both that come nearer and nearer to each other (Gilbert's algorithm)."""
    between = way if np.any(way) else np.array([1.0, 0.0, 0.0])
    found = [between]
    for _ in range(_ROUNDS):
        size = np.linalg.norm(between)
        if not size > 1e-12:
            break
        unit = between / size
        point = _farthest_point(second, -unit) - _farthest_point(first, unit)
        step = point - between
        length = float(step @ step)
        if length <= 1e-24:
            break
        between = between + min(max(-float(between @ step) / length, 0.0), 1.0) * step
        found.append(between)
    return np.array(found)


def _reaches(shape: _Shape, ways: Floats) -> Floats:
    """Return in floats how far a part reaches in directions. Shape (n, 3) to (n,)."""
    reach = np.max(ways @ shape.corners.T, axis=1)
    for quadric, centre in shape.quadrics:
        axes = _axes(quadric)
        form = np.array([[float(quadric.matrix[i][j]) for j in axes] for i in axes])
        own = ways[:, axes]
        far = np.sqrt(float(quadric.square) * np.einsum("ni,ij,nj->n", own, np.linalg.inv(form), own))
        rest = ways.copy()
        rest[:, axes] = 0.0
        reach = np.minimum(
            reach, own @ np.array([float(centre[i]) for i in axes]) + far + np.max(rest @ shape.corners.T, axis=1)
        )
    return reach


def _farthest_point(shape: _Shape, way: Floats) -> Floats:
    point = shape.corners[int(np.argmax(shape.corners @ way))].copy()
    for quadric, centre in shape.quadrics[:1]:
        axes = _axes(quadric)
        form = np.array([[float(quadric.matrix[i][j]) for j in axes] for i in axes])
        pull = np.linalg.solve(form, way[axes])
        size = math.sqrt(max(float(way[axes] @ pull), 1e-300))
        point[axes] = np.array([float(centre[i]) for i in axes]) + math.sqrt(float(quadric.square)) * pull / size
    return point


def is_inside(inner: ConvexPart, outer: ConvexPart) -> bool:
    """Prove that every point of one part lies in another; False means only that no proof was found.

    Args:
        inner: The part that may lie inside.
        outer: The part that may hold it.
    """
    if np.min(convex_body(outer.inequalities).depths(_shape(inner).corners.mean(axis=0)[None] - np.array(outer.centre))) < 0:
        return False
    shape = _shape(outer)
    own = sum(isinstance(condition(one), HalfSpace) for one in outer.inequalities)
    for normal, bound in shape.faces[:own]:
        reach = farthest(inner, normal)
        if reach is None or reach > bound:
            return False
    return all(_is_in_quadric(inner, quadric, centre) for quadric, centre in shape.quadrics)


def _is_in_quadric(inner: ConvexPart, outer: Quadric, centre: Vector) -> bool:
    """A convex function is greatest at a corner of a polyhedron, and every corner is where three faces meet."""
    for quadric, own in _shape(inner).quadrics:
        if quadric.matrix == outer.matrix and own == centre and quadric.square <= outer.square:
            return True
    faces = list(_shape(inner).faces)
    for quadric, own in _shape(inner).quadrics:
        faces += _tangents(quadric, own)
    if len(faces) > _MOST_FACES:
        return False
    for triple in itertools.combinations(faces, 3):
        normals = [face[0] for face in triple]
        if determinant(normals) == 0:
            continue
        x, y, z = solve(normals, [face[1] for face in triple])
        if any(dot(normal, (x, y, z)) > bound for normal, bound in faces):
            continue
        offset = (x - centre[0], y - centre[1], z - centre[2])
        if sum((offset[i] * outer.matrix[i][j] * offset[j] for i in range(3) for j in range(3)), Fraction(0)) > outer.square:
            return False
    return True


def _tangents(quadric: Quadric, centre: Vector) -> list[Face]:
    """Return half-spaces that hold a quadric, by Cauchy and Schwarz: u'Q(x - c) <= sqrt(B u'Qu) for every u."""
    axes = _axes(quadric)
    angles = np.arange(1, 16) * (np.pi / 8)
    if len(axes) == 2:
        fan = [[math.cos(angle), math.sin(angle)] for angle in angles.tolist() if abs(math.sin(2 * angle)) > 1e-9]
    else:
        fan = [list(signs) for signs in itertools.product((1.0, -1.0), repeat=len(axes))]
    found: list[Face] = []
    for way in fan:
        u = [Fraction(0)] * 3
        for axis, value in zip(axes, way, strict=True):
            u[axis] = Fraction(value) / quadric.scale if len(axes) == 1 else Fraction(value)
        x, y, z = (sum((quadric.matrix[i][j] * u[j] for j in range(3)), Fraction(0)) for i in range(3))
        size = sum((value * step for value, step in zip((x, y, z), u, strict=True)), Fraction(0))
        found.append(((x, y, z), dot((x, y, z), centre) + root_bounds(quadric.square * size)[1]))
    return found
