"""Nearest points of convex bodies to points outside them, in floats: round edges and corners, which faces alone do not give.

A polyhedron is nearest on a face or on an edge; a quadric where its gradient points to the point, found by Newton's method; an
upright cylinder is both, each in its own coordinates. Bodies of other inequalities are met by Dykstra's alternating projections.
Nothing here is a proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from verify.data.shapes.convex_parts import ConvexBody, Floats, convex_body
from verify.data.shapes.inequalities import Inequality

_NEWTON = 40
_DYKSTRA = 300
_ON = 1e-9
"""m; a corner as near as this to a face lies on it."""


@dataclass(frozen=True, eq=False, slots=True)
class Surface:
    """A convex body with what its nearest points are looked for on.

    Attributes:
        body: The body.
        edges: Both ends of each of its edges, where it is a polyhedron, m. Shape (edges, 2, 3).
        corners: Of a polyhedron around it, m. Shape (corners, 3).
    """

    body: ConvexBody
    edges: Floats
    corners: Floats

    def reaches(self, way: Floats) -> float:
        """Return how far the body reaches in a direction of length 1, at the most, in m. Shape (3,)."""
        return float(self.body.reaches(way[None], self.corners)[0])

    def nearest(self, points: Floats) -> Floats:
        """Return the body's points that are nearest to some points; those that lie in it are their own.

        Args:
            points: m, in the body's frame. Shape (n, 3).

        Returns:
            m. Shape (n, 3).
        """
        found = points.copy()
        outside = np.flatnonzero(self.body.depths(points) < 0)
        if len(outside):
            found[outside] = self._nearest(points[outside])
        return found

    def distances(self, points: Floats) -> Floats:
        """Return how far points are from the body, in m; below zero how deep they lie in it. Shape (n, 3) to (n,)."""
        depths = self.body.depths(points)
        outside = np.flatnonzero(depths < 0)
        found = -depths
        if len(outside):
            found[outside] = np.linalg.norm(self._nearest(points[outside]) - points[outside], axis=1)
        return found

    def _nearest(self, points: Floats) -> Floats:
        body = self.body
        if not len(body.matrices):
            return self._on_polyhedron(points)
        axes = np.flatnonzero(np.diag(body.matrices[0]))
        rest = np.setdiff1d(np.arange(3), axes)
        if len(body.matrices) > 1 or np.any(body.normals[:, axes]) or len(rest) > 1:
            return _dykstra(body, points)
        found = points.copy()
        found[:, axes] = _on_quadric(body, 0, points)[:, axes]
        for axis in rest:  # one at most, so that its faces are a floor and a ceiling
            signs = body.normals[:, axis]
            low = np.max(-body.distances[signs < 0], initial=-np.inf)
            high = np.min(body.distances[signs > 0], initial=np.inf)
            found[:, axis] = np.clip(points[:, axis], low, high)
        return found

    def _on_polyhedron(self, points: Floats) -> Floats:
        body = self.body
        over = points @ body.normals.T - body.distances
        on_faces = points[:, None] - over[..., None] * body.normals  # (n, faces, 3)
        inside = np.max(on_faces @ body.normals.T - body.distances, axis=-1) <= _ON
        first, along = self.edges[:, 0], self.edges[:, 1] - self.edges[:, 0]
        share = np.einsum("nej,ej->ne", points[:, None] - first, along) / np.einsum("ej,ej->e", along, along)
        on_edges = first + np.clip(share, 0.0, 1.0)[..., None] * along
        every = np.concatenate([on_faces, on_edges], axis=1)
        squares = np.sum((every - points[:, None]) ** 2, axis=-1)
        squares[:, : over.shape[1]][~inside | (over < 0)] = np.inf
        return every[np.arange(len(points)), np.argmin(squares, axis=1)]


@lru_cache(maxsize=16384)
def surface_of(inequalities: tuple[Inequality, ...]) -> Surface:
    """Return a convex part's surface, in the frame of its inequalities.

    Args:
        inequalities: The part's.
    """
    body = convex_body(inequalities)
    corners = body.corners()
    if len(body.matrices):
        return Surface(body, np.zeros((0, 2, 3)), corners)
    on = np.abs(corners @ body.normals.T - body.distances) <= _ON * (1 + np.abs(corners).max(initial=0.0))
    shared = np.triu(on.T.astype(np.int64) @ on, 1)
    ends = []
    for one, other in np.argwhere(shared >= 2):
        both = corners[on[:, one] & on[:, other]]
        far = both[int(np.argmax(np.sum((both - both[0]) ** 2, axis=1)))]
        back = both[int(np.argmax(np.sum((both - far) ** 2, axis=1)))]
        if np.sum((far - back) ** 2) > _ON**2:
            ends.append((far, back))
    return Surface(body, np.array(ends).reshape(-1, 2, 3), corners)


def _on_quadric(body: ConvexBody, index: int, points: Floats) -> Floats:
    """Return the points of a quadric that are nearest to points, in its own axes; those inside stay."""
    matrix, centre, root = body.matrices[index], body.centres[index], body.roots[index]
    values, ways = np.linalg.eigh(matrix)
    values = np.maximum(values, 0.0)
    offset = (points - centre) @ ways
    factor = np.zeros(len(points))
    for _ in range(_NEWTON):  # on 1 / |.|, which is nearly a straight line of the factor
        shrunk = 1.0 / (1.0 + factor[:, None] * values)
        level = np.sqrt(np.sum(values * (offset * shrunk) ** 2, axis=1))
        if not np.any(level > root * (1.0 + 4e-16)):
            break
        slope = np.sum(values**2 * offset**2 * shrunk**3, axis=1) / np.maximum(level, 1e-300)
        step = (level / root - 1.0) * level / np.maximum(slope, 1e-300)
        factor = np.where(level > root, factor + step, factor)
    return centre + (offset / (1.0 + factor[:, None] * values)) @ ways.T


def _dykstra(body: ConvexBody, points: Floats) -> Floats:
    faces, quadrics = len(body.normals), len(body.matrices)
    owed = np.zeros((faces + quadrics, *points.shape))
    found = points.copy()
    for _ in range(_DYKSTRA):
        for k in range(faces + quadrics):
            wanted = found + owed[k]
            if k < faces:
                over = np.maximum(wanted @ body.normals[k] - body.distances[k], 0.0)
                found = wanted - over[:, None] * body.normals[k]
            else:
                found = _on_quadric(body, k - faces, wanted)
            owed[k] = wanted - found
    return found
