"""Convex bodies in the world, grown by a clearance, and which straight segments meet them.

A solid body grown by c is the polyhedron of its faces moved out by c, with bevels along its edges and corners, so that it is hardly
larger than the points within c of the body (at a right angle 1.08 c from the edge instead of 1.41 c); quadrics are moved out like a
region's. A region has no bevels: near its corners, too, only a point outside of a face that was moved out is outside for sure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.gaps import Solid, solids
from verify.data.shapes.convex_parts import ConvexBody
from verify.data.shapes.inequalities import Parts, Point

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Integers = NDArray[np.int64]

_MANY = 1_000_000
"""Pairs of a segment and a body whose boxes are all compared; of more, those that lie near each other are looked for first."""
_CHUNK = 50_000
"""Pairs that are looked at at a time, so that the arrays stay small."""
_TOUCHING = 1e-9
"""m; corners this near to a face lie on it."""
_NONE: tuple[Floats, Floats] = (np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True, eq=False, slots=True)
class InflatedBody:
    """A convex body in the world's frame.

    Attributes:
        name: Whose part it is.
        convex: Faces and quadrics, in the world's frame.
        low: Lower corner of a box around it, m. Shape (3,).
        high: Upper corner, m. Shape (3,).
        corners: Of its faces without bevels, m. Shape (corners, 3).
        faces: How many of its faces, the first ones, are no bevels.
        growth: m by which it was grown, where it has bevels.
    """

    name: str
    convex: ConvexBody
    low: Floats
    high: Floats
    corners: Floats
    faces: int
    growth: float

    @classmethod
    def of(
        cls, name: str, at: Floats, grown: Solid, bevels: tuple[Floats, Floats] = _NONE, growth: float = 0.0
    ) -> InflatedBody:
        """Return a grown convex part in the world's frame.

        Args:
            name: Whose part it is.
            at: The origin of the part's own frame, m. Shape (3,).
            grown: The part, its faces and quadrics moved outwards.
            bevels: Unit normals of faces that cut its edges and corners, and how far they are from its origin, m.
            growth: m by which it was grown, where it has bevels.
        """
        body, (normals, distances), corners = grown.body, bevels, grown.corners + at
        convex = ConvexBody(
            np.concatenate([body.normals, normals]),
            np.concatenate([body.distances + body.normals @ at, distances + normals @ at]),
            body.matrices,
            body.centres + at,
            body.roots,
            body.scales,
        )
        return cls(name, convex, corners.min(axis=0), corners.max(axis=0), corners, len(body.normals), growth)

    def holds(self, points: Floats) -> Booleans:
        """Return which points lie in it, its surface excluded. Shape (n, 3) to (n,)."""
        return self.convex.depths(points) > 0.0

    def spans(self, starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
        """Return from which to which share segments are in the body; the first is above the second where one is never.

        Args:
            starts: m. Shape (n, 3).
            ends: m. Shape (n, 3).

        Returns:
            Shares, 0 to 1. Shapes (n,) and (n,).
        """
        step, convex = ends - starts, self.convex
        first, last = np.zeros(len(starts)), np.ones(len(starts))
        with np.errstate(divide="ignore", invalid="ignore"):
            if len(convex.normals):
                inside, along = convex.distances - starts @ convex.normals.T, step @ convex.normals.T
                at = inside / along
                last = np.minimum(last, np.min(np.where(along > 0.0, at, np.inf), axis=1))
                first = np.maximum(first, np.max(np.where(along < 0.0, at, -np.inf), axis=1))
                last[np.any((along == 0.0) & (inside <= 0.0), axis=1)] = -1.0
            for matrix, centre, root in zip(convex.matrices, convex.centres, convex.roots, strict=True):
                offset = starts - centre
                a = np.einsum("ni,ij,nj->n", step, matrix, step)
                b = np.einsum("ni,ij,nj->n", offset, matrix, step)
                c = np.einsum("ni,ij,nj->n", offset, matrix, offset) - root**2
                first, last = _within_quadric(a, b, c, first, last)
        return first, last


class InflatedBodies:
    """Several bodies, asked together: their faces and quadrics side by side in arrays, filled up with what holds everywhere."""

    def __init__(self, bodies: Sequence[InflatedBody]) -> None:
        self.bodies = tuple(bodies)
        self.names = tuple(body.name for body in bodies)
        self.low = np.array([body.low for body in bodies]).reshape(-1, 3)
        self.high = np.array([body.high for body in bodies]).reshape(-1, 3)
        count = len(self.bodies)
        faces = max((len(body.convex.normals) for body in bodies), default=0)
        self._plain = max((body.faces for body in bodies), default=0)
        quadrics = max((len(body.convex.matrices) for body in bodies), default=0)
        self._normals, self._distances = np.zeros((count, faces, 3)), np.ones((count, faces))
        self._matrices, self._centres = np.zeros((count, quadrics, 3, 3)), np.zeros((count, quadrics, 3))
        self._squares = np.ones((count, quadrics))
        for k, body in enumerate(bodies):
            convex, own, round_ = body.convex, len(body.convex.normals), len(body.convex.matrices)
            self._normals[k, :own], self._distances[k, :own] = convex.normals, convex.distances
            self._matrices[k, :round_], self._centres[k, :round_] = convex.matrices, convex.centres
            self._squares[k, :round_] = convex.roots**2

    def __len__(self) -> int:
        return len(self.bodies)

    def meets(self, starts: Floats, ends: Floats) -> Booleans:
        """Return which segments have points inside any body. Shapes (n, 3) twice to (n,)."""
        met = np.zeros(len(starts), dtype=np.bool_)
        met[self.pairs(starts, ends)[0]] = True
        return met

    def pairs(self, starts: Floats, ends: Floats) -> tuple[Integers, Integers]:
        """Return all pairs of a segment and a body that meet, as indices: segments, bodies. Shapes (n, 3) twice to (pairs,) twice."""
        segments, bodies = self._near(starts, ends)
        met = np.zeros(len(segments), dtype=np.bool_)
        for begin in range(0, len(segments), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            own = segments[part]
            met[part] = self._meet(starts[own], ends[own] - starts[own], bodies[part])
        return segments[met], bodies[met]

    def holding(self, point: Floats) -> tuple[int, ...]:
        """Return the bodies that hold a point. Shape (3,)."""
        near = np.flatnonzero(np.all((self.low < point) & (point < self.high), axis=1))
        return tuple(int(k) for k in near if self.bodies[k].holds(point[None])[0])

    def _meet(self, starts: Floats, steps: Floats, bodies: Integers) -> Booleans:
        """Tell of pairs of a segment and a body which meet. Shapes (pairs, 3) twice and (pairs,) to (pairs,)."""
        first, last = np.zeros(len(starts)), np.ones(len(starts))
        with np.errstate(divide="ignore", invalid="ignore"):
            for part in (slice(0, self._plain), slice(self._plain, None)):  # bevels only where faces do not decide
                left = np.flatnonzero(last > first)
                normals = self._normals[bodies[left], part]
                if not normals.size:
                    continue
                inside = self._distances[bodies[left], part] - np.einsum("pfk,pk->pf", normals, starts[left])
                along = np.einsum("pfk,pk->pf", normals, steps[left])
                at = inside / along
                until = np.min(np.where(along > 0.0, at, np.inf), axis=1)
                until[np.any((along == 0.0) & (inside <= 0.0), axis=1)] = -1.0
                last[left] = np.minimum(last[left], until)
                first[left] = np.maximum(first[left], np.max(np.where(along < 0.0, at, -np.inf), axis=1))
            for q in range(self._matrices.shape[1]):
                matrix, offset = self._matrices[bodies, q], starts - self._centres[bodies, q]
                pulled = np.einsum("pij,pj->pi", matrix, steps)
                a, b = np.einsum("pi,pi->p", steps, pulled), np.einsum("pi,pi->p", offset, pulled)
                c = np.einsum("pi,pij,pj->p", offset, matrix, offset) - self._squares[bodies, q]
                first, last = _within_quadric(a, b, c, first, last)
        return last > first

    def _near(self, starts: Floats, ends: Floats) -> tuple[Integers, Integers]:
        """Return the pairs of a segment and a body whose boxes overlap, as indices: segments, bodies. Shapes (pairs,) twice."""
        if not len(self.bodies) or not len(starts):
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        low, high = np.minimum(starts, ends), np.maximum(starts, ends)
        if len(self.bodies) * len(starts) <= _MANY:
            near = np.ones((len(self.bodies), len(starts)), dtype=np.bool_)
            for axis in range(3):
                near &= self.low[:, None, axis] < high[None, :, axis]
                near &= self.high[:, None, axis] > low[None, :, axis]
            bodies, segments = np.nonzero(near)
            return segments, bodies
        from scipy.spatial import KDTree  # here: it takes long to load, and most missions have few bodies

        middles, reach = (low + high) / 2.0, np.max(high - low, axis=1) / 2.0
        sizes = np.ceil(np.log2(np.maximum(reach, 1e-3))).astype(np.int64)
        found: list[tuple[Integers, Integers]] = []
        for size in np.unique(sizes).tolist():  # segments of about one length at a time, so that few are looked at in vain
            own = np.flatnonzero(sizes == size)
            half = np.max(self.high - self.low, axis=1) / 2.0 + 2.0**size
            around = KDTree(middles[own]).query_ball_point((self.low + self.high) / 2.0, half, p=np.inf, return_sorted=True)
            for body, members in enumerate(around):
                near = own[np.array(members, dtype=np.int64)]
                near = near[np.all((self.low[body] < high[near]) & (self.high[body] > low[near]), axis=1)]
                found.append((near, np.full(len(near), body)))
        return np.concatenate([near for near, _ in found]), np.concatenate([body for _, body in found])


def _within_quadric(a: Floats, b: Floats, c: Floats, first: Floats, last: Floats) -> tuple[Floats, Floats]:
    """Return what is left of spans from first to last where a t^2 + 2 b t + c < 0. All of shape (n,)."""
    square = b * b - a * c
    flat = a <= 1e-18 * (1.0 + np.abs(c))
    width = np.sqrt(np.maximum(square, 0.0))
    first = np.where(flat, first, np.maximum(first, (-b - width) / a))
    last = np.where(flat, last, np.minimum(last, (-b + width) / a))
    return first, np.where(np.where(flat, c >= 0.0, square <= 0.0), -1.0, last)


def grown_bodies(name: str, center: Point, parts: Parts, by: float, *, bevelled: bool = True) -> list[InflatedBody]:
    """Return what a region's or an obstacle's convex parts become when they are grown, in the world's frame.

    Args:
        name: Whose parts.
        center: m.
        parts: Inequalities around the centre.
        by: m.
        bevelled: Whether edges and corners are cut.
    """
    found: list[InflatedBody] = []
    for solid, large in zip(solids(parts), solids(parts, by), strict=True):
        bevels, depths = _bevels(solid.body, solid.corners) if bevelled and not solid.is_round else _NONE
        found.append(InflatedBody.of(name, np.array(center), large, (bevels, depths + by), by * bevelled))
    return found


def disc(name: str, center: Floats, normal: Floats, radius: float, half: float) -> InflatedBody:
    """Return a flat cylinder, such as a hoop's ring with its clearance and its opening.

    Args:
        name: Whose.
        center: m. Shape (3,).
        normal: Unit vector along its axis. Shape (3,).
        radius: m.
        half: Half its thickness, m.
    """
    across = np.eye(3) - np.outer(normal, normal)
    sides = np.stack([normal, -normal])
    convex = ConvexBody(sides, sides @ center + half, across[None], center[None], np.array([radius]), np.array([1.0]))
    reach = radius * np.sqrt(np.maximum(0.0, 1.0 - normal**2)) + half * np.abs(normal)
    corners = np.stack([center - reach, center + reach])
    return InflatedBody(name, convex, corners[0], corners[1], corners, 2, 0.0)


def _bevels(body: ConvexBody, corners: Floats) -> tuple[Floats, Floats]:
    """Return unit normals halfway between those of the faces that meet at edges and corners, and how far the body reaches along them."""
    on = np.abs(corners @ body.normals.T - body.distances) <= _TOUCHING * (1.0 + np.abs(corners).max())  # corners, faces
    pairs = np.argwhere(np.triu(on.T.astype(np.int64) @ on.astype(np.int64) >= 2, 1))
    normals = [body.normals[i] + body.normals[j] for i, j in pairs]
    normals += [body.normals[row].sum(axis=0) for row in np.unique(on, axis=0)]
    found = np.array(normals).reshape(-1, 3)
    sizes = np.linalg.norm(found, axis=1)
    found = found[sizes > 1e-9] / sizes[sizes > 1e-9, None]
    return found, np.max(found @ corners.T, axis=1) if len(found) else np.zeros(0)
