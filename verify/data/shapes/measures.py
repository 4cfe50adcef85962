"""What planning and pictures ask of a body, in floats: how deep points lie in it, how far it reaches, where its surface is.

The depth of a point is the radius of a ball around it that the body holds, or minus that of one that it does not touch; where
corners are near it may be less than the greatest. It changes by at most d within d. Nothing here is a proof.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from verify.data.errors import BadInput
from verify.data.shapes.conditions import HalfSpace, condition
from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Inequality, Parts

Floats = NDArray[np.float64]

_FAR = 4 * GREATEST_RADIUS
MOST_PARTS, MOST_INEQUALITIES = 64, 64
"""A region may have so many parts, and each so many inequalities."""


@dataclass(frozen=True, eq=False, slots=True)
class ConvexBody:
    """One convex body as arrays.

    Attributes:
        normals: Unit normals of its faces. Shape (faces, 3).
        distances: Of the faces from the origin, along the normals, in m. Shape (faces,).
        matrices: Of its quadrics, in m^-2. Shape (quadrics, 3, 3).
        centres: m. Shape (quadrics, 3).
        roots: Of the quadrics' right-hand sides. Shape (quadrics,).
        scales: 1/m; by which a quadric's root changes at most. Shape (quadrics,).
    """

    normals: Floats
    distances: Floats
    matrices: Floats
    centres: Floats
    roots: Floats
    scales: Floats

    def depths(self, points: Floats) -> Floats:
        """Return how deep points lie. Shape (n, 3) to (n,)."""
        depth = np.full(len(points), np.inf)
        if len(self.normals):
            depth = np.min(self.distances - points @ self.normals.T, axis=1)
        for matrix, centre, root, scale in zip(self.matrices, self.centres, self.roots, self.scales, strict=True):
            offset = points - centre
            level = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", offset, matrix, offset), 0.0))
            depth = np.minimum(depth, (root - level) / scale)
        return depth

    def grown(self, by: float) -> ConvexBody:
        """Return it with each face and quadric moved outwards by so many m."""
        return ConvexBody(
            self.normals, self.distances + by, self.matrices, self.centres, self.roots + self.scales * by, self.scales
        )

    def reaches(self, ways: Floats, corners: Floats) -> Floats:
        """Return how far it reaches in directions, at the most.

        Args:
            ways: Directions. Shape (n, 3).
            corners: As `corners` gives them.

        Returns:
            The greatest way . point of the body, or more. Shape (n,).
        """
        reach = np.max(ways @ corners.T, axis=1)
        for matrix, centre, root in zip(self.matrices, self.centres, self.roots, strict=True):
            axes = np.flatnonzero(np.diag(matrix))
            own = ways[:, axes]
            far = root * np.sqrt(np.einsum("ni,ij,nj->n", own, np.linalg.inv(matrix[np.ix_(axes, axes)]), own))
            rest = ways.copy()
            rest[:, axes] = 0.0
            reach = np.minimum(reach, own @ centre[axes] + far + np.max(rest @ corners.T, axis=1))
        return reach

    def edges(self) -> Floats:
        """Return unit vectors along the edges of a polyhedron: across all pairs of its faces' normals. Shape (edges, 3)."""
        pairs = np.array(list(itertools.combinations(range(len(self.normals)), 2)), dtype=np.intp).reshape(-1, 2)
        across = np.cross(self.normals[pairs[:, 0]], self.normals[pairs[:, 1]])
        sizes = np.linalg.norm(across, axis=1)
        return np.unique(np.round(across[sizes > 1e-9] / sizes[sizes > 1e-9, None], 9), axis=0)

    def corners(self) -> Floats:
        """Return the corners of a polyhedron around the body: its faces, and the box of each quadric. Shape (corners, 3)."""
        normals, distances = [self.normals], [self.distances]
        for matrix, centre, root in zip(self.matrices, self.centres, self.roots, strict=True):
            axes = np.flatnonzero(np.diag(matrix))
            half = root * np.sqrt(np.diag(np.linalg.inv(matrix[np.ix_(axes, axes)])))
            for sign in (1.0, -1.0):
                normals.append(sign * np.eye(3)[axes])
                distances.append(sign * centre[axes] + half)
        normals.append(np.concatenate([np.eye(3), -np.eye(3)]))
        distances.append(np.full(6, _FAR))
        return polyhedron_corners(np.concatenate(normals), np.concatenate(distances))


def polyhedron_corners(normals: Floats, distances: Floats) -> Floats:
    """Return where three faces meet within all others.

    Args:
        normals: Unit normals. Shape (n, 3).
        distances: Of the faces from the origin, m. Shape (n,).

    Returns:
        m. Shape (corners, 3).
    """
    triples = np.array(list(itertools.combinations(range(len(normals)), 3)))
    sides = normals[triples]
    regular = np.abs(np.linalg.det(sides)) > 1e-9
    triples, sides = triples[regular], sides[regular]
    points: NDArray[Any] = np.linalg.solve(sides, distances[triples][..., None])[
        ..., 0
    ]  # of any type: numpy's solve does not say which
    slack = 1e-9 * (1 + np.abs(points).max(axis=1, initial=0.0))
    return points[np.max(points @ normals.T - distances, axis=1) <= slack]


def outline(body: ConvexBody) -> Floats:
    """Return the corners of a polyhedron close around a convex body, for pictures: its faces, and many that touch its quadrics.

    Args:
        body: The body.

    Returns:
        m. Shape (corners, 3).
    """
    return polyhedron_corners(*faces_around(body))


def faces_around(body: ConvexBody) -> tuple[Floats, Floats]:
    """Return the faces of a polyhedron close around a convex body: its own, and many that touch its quadrics.

    Args:
        body: The body.

    Returns:
        Unit normals, and distances from the origin along them in m. Shapes (faces, 3) and (faces,).
    """
    normals, distances = [body.normals], [body.distances]
    angles = np.arange(24) * (np.pi / 12)
    for matrix, centre, root in zip(body.matrices, body.centres, body.roots, strict=True):
        axes = np.flatnonzero(np.diag(matrix))
        around = np.stack([np.cos(angles), np.sin(angles)], axis=1) if len(axes) == 2 else _fibonacci(60)[:, axes]
        if len(axes) == 1:
            around = np.array([[1.0], [-1.0]])
        ways = np.zeros((len(around), 3))
        ways[:, axes] = around
        inverse = np.linalg.inv(matrix[np.ix_(axes, axes)])
        normals.append(ways)
        distances.append(ways @ centre + root * np.sqrt(np.einsum("ni,ij,nj->n", around, inverse, around)))
    return np.concatenate(normals), np.concatenate(distances)


@dataclass(frozen=True, eq=False, slots=True)
class Solid:
    """A convex body with what telling it from others takes.

    Attributes:
        body: The body.
        corners: Of a polyhedron around it, m. Shape (corners, 3).
        edges: Directions of its edges, where it is a polyhedron. Shape (edges, 3).
    """

    body: ConvexBody
    corners: Floats
    edges: Floats

    @classmethod
    def of(cls, body: ConvexBody) -> Solid:
        """Compute corners and edges."""
        return cls(body, body.corners(), body.edges() if not len(body.matrices) else np.zeros((0, 3)))

    @property
    def is_round(self) -> bool:
        """Tell whether it is no polyhedron."""
        return len(self.body.matrices) > 0

    def beside(self, points: Floats, ways: Floats) -> tuple[float, Floats]:
        """Return the widest gap that was found between the body and some points, and the unit vector across it, towards the points.

        Args:
            points: m, in the body's frame. Shape (n, 3).
            ways: Unit vectors to look along, beside the normals of the body's faces. Shape (m, 3).
        """
        every = np.concatenate([self.body.normals, ways, _EVERYWHERE] if self.is_round else [self.body.normals, ways])
        gaps = np.min(every @ points.T, axis=1) - self.body.reaches(every, self.corners)
        best, gap = every[int(np.argmax(gaps))], float(gaps.max())
        for spread in _SPREADS if self.is_round else ():
            near = best + spread * _EVERYWHERE
            near /= np.linalg.norm(near, axis=1, keepdims=True)
            gaps = np.min(near @ points.T, axis=1) - self.body.reaches(near, self.corners)
            if gaps.max() > gap:
                best, gap = near[int(np.argmax(gaps))], float(gaps.max())
        return gap, best


def _fibonacci(count: int) -> Floats:
    """Return unit vectors spread evenly. Shape (count, 3)."""
    turns = np.arange(count) + 0.5
    up = 1.0 - 2.0 * turns / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * turns
    flat = np.sqrt(1.0 - up**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), up], axis=1)


_EVERYWHERE = _fibonacci(200)
_SPREADS = (0.2, 0.05, 0.01, 0.002)
"""Round the best direction so far, directions are looked at that differ by so much."""


@dataclass(frozen=True, eq=False, slots=True)
class Measures:
    """A region's body around its centre.

    Attributes:
        parts: Its parts.
        covers: Convex bodies within it that are deepest somewhere: the parts, and those across shared faces.
        inner_radius: How deep the centre lies, m.
        outer_radius: No point is farther from the centre, m.
        half_lengths: Half the edges of a box around the centre, along the world's axes, that holds it, m.
        volume: Roughly, of the boxes around its parts, beside that of a ball of radius 1 m.
    """

    parts: tuple[ConvexBody, ...]
    covers: tuple[ConvexBody, ...]
    inner_radius: float
    outer_radius: float
    half_lengths: tuple[float, float, float]
    volume: float

    def depths(self, points: Floats) -> Floats:
        """Return how deep points, relative to the centre, lie in the body; below zero outside. Shape (..., 3) to (...)."""
        flat = points.reshape(-1, 3)
        return np.maximum.reduce([body.depths(flat) for body in self.covers]).reshape(points.shape[:-1])

    def levels(self, points: Floats) -> Floats:
        """Return a square that is at most 1 inside; its root changes by at most d over the inner radius within d. Shape (..., 3) to (...)."""
        return np.maximum(1.0 - self.depths(points) / self.inner_radius, 0.0) ** 2


def convex_body(inequalities: tuple[Inequality, ...]) -> ConvexBody:
    """Return a convex part as arrays.

    Raises:
        BadInput: An inequality is none that is understood.
    """
    normals, distances, matrices, centres, roots, scales = [], [], [], [], [], []
    for inequality in inequalities:
        found = condition(inequality)
        if isinstance(found, HalfSpace):
            length = math.hypot(*inequality.linear)
            normals.append([x / length for x in inequality.linear])
            distances.append(inequality.bound / length)
        else:
            matrices.append(inequality.quadratic)
            centres.append([float(x) for x in found.centre])
            roots.append(math.sqrt(found.square))
            scales.append(float(found.scale))
    return ConvexBody(
        np.array(normals).reshape(-1, 3),
        np.array(distances),
        np.array(matrices).reshape(-1, 3, 3),
        np.array(centres).reshape(-1, 3),
        np.array(roots),
        np.array(scales),
    )


@lru_cache(maxsize=4096)
def measures(parts: Parts) -> Measures:
    """Measure a body.

    Raises:
        BadInput: It is none that a region can be: not convex in each part, without an end, flat, too small, too large, of too many
            parts, or its centre lies outside.
    """
    if not 1 <= len(parts) <= MOST_PARTS or not all(1 <= len(part) <= MOST_INEQUALITIES for part in parts):
        raise BadInput(
            f"A region has 1 to {MOST_PARTS} parts, each of 1 to {MOST_INEQUALITIES} inequalities; this one has {len(parts)} parts, of "
            f"{', '.join(str(len(part)) for part in parts[:5])} inequalities."
        )
    bodies = tuple(convex_body(part) for part in parts)
    corners = [body.corners() for body in bodies]
    for index, found in enumerate(corners):
        which = f"Part {index + 1} of {len(parts)}" if len(parts) > 1 else "The region"
        if len(found) == 0:
            raise BadInput(f"{which} has no points: its inequalities contradict each other.")
        if not np.abs(found).max() <= GREATEST_RADIUS:
            raise BadInput(f"{which} has no end, or one farther than {GREATEST_RADIUS:g} m from its centre.")
        deep = float(bodies[index].depths(found.mean(axis=0)[None])[0])
        if not deep >= LEAST_RADIUS:
            raise BadInput(f"{which} is flat: its middle is {deep:g} m inside it, and {LEAST_RADIUS:g} m is the least.")
    around = tuple(map(convex_body, covers(parts)))
    inner = float(max(body.depths(np.zeros((1, 3)))[0] for body in around))
    if not inner >= LEAST_RADIUS:
        raise BadInput(
            f"A region's centre must lie inside it, by {LEAST_RADIUS:g} m at the least; this one's is {inner:g} m inside (below zero: outside)."
        )
    every = np.concatenate(corners)
    half = np.abs(every).max(axis=0).tolist()
    volume = sum(float(np.prod(np.ptp(found, axis=0))) for found in corners) * 3.0 / (4.0 * math.pi)
    return Measures(bodies, around, inner, float(np.linalg.norm(every, axis=1).max()), (half[0], half[1], half[2]), volume)


@lru_cache(maxsize=4096)
def solids(parts: Parts, growth: float = 0.0) -> tuple[Solid, ...]:
    """Return a region's convex parts, larger by so many m, around its centre.

    Args:
        parts: The region's.
        growth: m.
    """
    return tuple(Solid.of(convex_body(part).grown(growth)) for part in parts)


def widest_gap(one: Parts, other: Parts, between: Floats) -> float:
    """Return how wide a gap was found between two bodies, in m; not above zero where they touch or overlap.

    Args:
        one: A body.
        other: Another one.
        between: From the first centre to the second, m. Shape (3,).
    """
    return min(_gap(a, b, between) for a in solids(one) for b in solids(other))


def _gap(a: Solid, b: Solid, between: Floats) -> float:
    ways = [-b.body.normals, between[None] / max(float(np.linalg.norm(between)), 1e-12)]
    if len(a.edges) and len(b.edges):
        across = np.cross(a.edges[:, None], b.edges[None]).reshape(-1, 3)
        sizes = np.linalg.norm(across, axis=1)
        across = across[sizes > 1e-9] / sizes[sizes > 1e-9, None]
        ways += [across, -across]
    every = np.concatenate([a.body.normals, *ways])
    is_round = a.is_round or b.is_round
    if is_round:
        every = np.concatenate([every, _EVERYWHERE])

    def gaps(directions: Floats) -> Floats:
        return directions @ between - b.body.reaches(-directions, b.corners) - a.body.reaches(directions, a.corners)

    found = gaps(every)
    best, gap = every[int(np.argmax(found))], float(found.max())
    for spread in _SPREADS if is_round else ():
        near = best + spread * _EVERYWHERE
        near /= np.linalg.norm(near, axis=1, keepdims=True)
        found = gaps(near)
        if found.max() > gap:
            best, gap = near[int(np.argmax(found))], float(found.max())
    return gap
