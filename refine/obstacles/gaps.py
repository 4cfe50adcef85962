"""Gaps between bodies, in floats: how wide one can be found between two of them, or between one and some points."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from verify.data.shapes.convex_parts import ConvexBody, Floats, convex_body, spread_evenly
from verify.data.shapes.inequalities import Parts

_EVERYWHERE = spread_evenly(200)
_SPREADS = (0.2, 0.05, 0.01, 0.002)
"""Round the best direction so far, directions are looked at that differ by so much."""


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
        return cls(body, body.corners(), _edges(body) if not len(body.matrices) else np.zeros((0, 3)))

    @property
    def is_round(self) -> bool:
        """Return whether it is no polyhedron."""
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


def _edges(body: ConvexBody) -> Floats:
    """Return unit vectors along the edges of a polyhedron: across all pairs of its faces' normals. Shape (edges, 3)."""
    pairs = np.array(list(itertools.combinations(range(len(body.normals)), 2)), dtype=np.intp).reshape(-1, 2)
    across = np.cross(body.normals[pairs[:, 0]], body.normals[pairs[:, 1]])
    sizes = np.linalg.norm(across, axis=1)
    return np.unique(np.round(across[sizes > 1e-9] / sizes[sizes > 1e-9, None], 9), axis=0)
