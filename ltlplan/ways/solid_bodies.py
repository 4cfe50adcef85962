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
from scipy.spatial import KDTree

from verify.data.shapes.inequalities import Parts, Point
from verify.data.shapes.measures import ConvexBody, solids

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Integers = NDArray[np.int64]

_MANY = 1_000_000
"""Pairs of a segment and a body whose boxes are all compared; of more, those that lie near each other are looked for first."""
_TOUCHING = 1e-9
"""m; corners this near to a face lie on it."""


@dataclass(frozen=True, eq=False, slots=True)
class SolidBody:
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

    def holds(self, points: Floats) -> Booleans:
        """Tell which points lie in it, its surface excluded. Shape (n, 3) to (n,)."""
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
                square = b * b - a * c
                flat = a <= 1e-18 * (1.0 + np.abs(c))
                width = np.sqrt(np.maximum(square, 0.0))
                first = np.where(flat, first, np.maximum(first, (-b - width) / a))
                last = np.where(flat, last, np.minimum(last, (-b + width) / a))
                last = np.where(np.where(flat, c >= 0.0, square <= 0.0), -1.0, last)
        return first, last

    def meets(self, starts: Floats, ends: Floats) -> Booleans:
        """Tell which segments have points inside it. Shapes (n, 3) twice to (n,)."""
        first, last = self.spans(starts, ends)
        return last > first


class SolidBodies:
    """Several bodies, asked together."""

    def __init__(self, bodies: Sequence[SolidBody]) -> None:
        self.bodies = tuple(bodies)
        self.names = tuple(body.name for body in bodies)
        self.low = np.array([body.low for body in bodies]).reshape(-1, 3)
        self.high = np.array([body.high for body in bodies]).reshape(-1, 3)

    def __len__(self) -> int:
        return len(self.bodies)

    def meets(self, starts: Floats, ends: Floats) -> Booleans:
        """Tell which segments have points inside any body. Shapes (n, 3) twice to (n,)."""
        met = np.zeros(len(starts), dtype=np.bool_)
        for body, near in self._near(starts, ends):
            left = near[~met[near]]
            met[left] = self.bodies[body].meets(starts[left], ends[left])
        return met

    def pairs(self, starts: Floats, ends: Floats) -> tuple[Integers, Integers]:
        """Return all pairs of a segment and a body that meet, as indices: segments, bodies. Shapes (n, 3) twice to (pairs,) twice."""
        segments: list[Integers] = []
        bodies: list[Integers] = []
        for body, near in self._near(starts, ends):
            found = near[self.bodies[body].meets(starts[near], ends[near])]
            segments.append(found)
            bodies.append(np.full(len(found), body))
        if not segments:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        return np.concatenate(segments), np.concatenate(bodies)

    def holding(self, point: Floats) -> tuple[int, ...]:
        """Return the bodies that hold a point. Shape (3,)."""
        near = np.flatnonzero(np.all((self.low < point) & (point < self.high), axis=1))
        return tuple(int(k) for k in near if self.bodies[k].holds(point[None])[0])

    def _near(self, starts: Floats, ends: Floats) -> list[tuple[int, Integers]]:
        """Return each body that may meet segments, with these: those whose boxes overlap its box."""
        if not len(self.bodies) or not len(starts):
            return []
        low, high = np.minimum(starts, ends), np.maximum(starts, ends)
        if len(self.bodies) * len(starts) <= _MANY:
            near = np.ones((len(self.bodies), len(starts)), dtype=np.bool_)
            for axis in range(3):
                near &= self.low[:, None, axis] < high[None, :, axis]
                near &= self.high[:, None, axis] > low[None, :, axis]
            return [(body, np.flatnonzero(near[body])) for body in np.flatnonzero(near.any(axis=1)).tolist()]
        middles, reach = (low + high) / 2.0, np.max(high - low, axis=1) / 2.0
        sizes = np.ceil(np.log2(np.maximum(reach, 1e-3))).astype(np.int64)
        found: list[list[Integers]] = [[] for _ in self.bodies]
        for size in np.unique(sizes).tolist():  # segments of about one length at a time, so that few are looked at in vain
            own = np.flatnonzero(sizes == size)
            half = np.max(self.high - self.low, axis=1) / 2.0 + 2.0**size
            around = KDTree(middles[own]).query_ball_point((self.low + self.high) / 2.0, half, p=np.inf, return_sorted=True)
            for body, members in enumerate(around):
                near = own[np.array(members, dtype=np.int64)]
                meets = np.all((self.low[body] < high[near]) & (self.high[body] > low[near]), axis=1)
                found[body].append(near[meets])
        return [(body, np.concatenate(parts)) for body, parts in enumerate(found) if sum(map(len, parts))]


def grown_bodies(name: str, center: Point, parts: Parts, by: float, *, bevelled: bool = True) -> list[SolidBody]:
    """Return what a region's or an obstacle's convex parts become when they are grown, in the world's frame.

    Args:
        name: Whose parts.
        center: m.
        parts: Inequalities around the centre.
        by: m.
        bevelled: Whether edges and corners are cut.
    """
    at = np.array(center)
    found: list[SolidBody] = []
    for solid, large in zip(solids(parts), solids(parts, by), strict=True):
        bevels, depths = _bevels(solid.body, solid.corners) if bevelled and not solid.is_round else _NONE
        grown = large.body
        convex = ConvexBody(
            np.concatenate([grown.normals, bevels]),
            np.concatenate([grown.distances + grown.normals @ at, depths + by + bevels @ at]),
            grown.matrices,
            grown.centres + at,
            grown.roots,
            grown.scales,
        )
        corners = large.corners + at
        found.append(
            SolidBody(name, convex, corners.min(axis=0), corners.max(axis=0), corners, len(grown.normals), by * bevelled)
        )
    return found


def disc(name: str, center: Floats, normal: Floats, radius: float, half: float) -> SolidBody:
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
    return SolidBody(name, convex, corners[0], corners[1], corners, 2, 0.0)


_NONE: tuple[Floats, Floats] = (np.zeros((0, 3)), np.zeros(0))


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
