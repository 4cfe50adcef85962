"""A way between two points past convex bodies, over a roadmap of evenly spread points: where leading around one body at a
time does not get through.

The points are the same for everyone (a Halton sequence), so the way is too. Edges are first looked at by samples; the ones
on the shortest way are then held against each body for good.
"""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from refine.keep_out_bodies import Obstacle, blocking

Floats = NDArray[np.float64]

POINTS = 240
_ABOUT = 0.6
"""m around the two ends in which as many points again are spread."""
_NEIGHBOURS = 16
_CLEAR = 0.01
"""m that points of the roadmap keep from bodies."""
_SAMPLES = np.linspace(0.0, 1.0, 33)[:, None]
_ROUNDS = 12


def way_around(a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats) -> list[Floats] | None:
    """Return points between two others such that straight legs meet no body, or None where the roadmap has no such way.

    Args:
        a: m. Shape (3,).
        b: m. Shape (3,).
        obstacles: Bodies that hold neither of them.
        low: Lower corner of the space to stay in, m.
        high: Upper corner.
    """
    unit = _spread_evenly()
    about = np.maximum(low, np.minimum(a, b) - _ABOUT), np.minimum(high, np.maximum(a, b) + _ABOUT)
    spread = np.concatenate([low + unit * (high - low), about[0] + unit * (about[1] - about[0])])
    clear = np.all([body.signed_distance(spread) >= _CLEAR for body in obstacles], axis=0)
    points = np.concatenate([[a, b], spread[clear]])
    lengths = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.argsort(lengths, axis=1, kind="stable")[:, 1 : _NEIGHBOURS + 1]
    edges = {(min(i, int(j)), max(i, int(j))) for i in range(len(points)) for j in near[i]}
    edges |= {(end, j) for end in (0, 1) for j in range(end + 1, len(points))}
    first, second = np.array(sorted(edges)).T
    along = points[first][None] + _SAMPLES[:, :, None] * (points[second] - points[first])[None]
    inner = along[1:-1]  # an end may touch a body
    kept = np.all([(body.signed_distance(inner) > 0.0).all(axis=0) for body in obstacles], axis=0)
    graph = np.zeros(lengths.shape)
    graph[first[kept], second[kept]] = lengths[first[kept], second[kept]]
    for _ in range(_ROUNDS):
        total, before = dijkstra(csr_matrix(graph), directed=False, indices=0, return_predecessors=True)
        if not np.isfinite(total[1]):
            return None
        way = [1]
        while way[-1] != 0:
            way.append(int(before[way[-1]]))
        way.reverse()
        blocked = [(i, j) for i, j in itertools.pairwise(way) if blocking(points[i], points[j], obstacles)]
        if not blocked:
            return _shortened([points[i] for i in way], obstacles)
        for i, j in blocked:
            graph[min(i, j), max(i, j)] = 0.0
    return None


@cache
def _spread_evenly() -> Floats:
    """Return points of the unit cube, the first of a Halton sequence: digits of 0, 1, 2 ... mirrored at the point. Shape (POINTS, 3)."""
    points = np.zeros((POINTS, 3))
    for axis, base in enumerate((2, 3, 5)):
        left, weight = np.arange(POINTS), 1.0 / base
        while left.any():
            points[:, axis] += left % base * weight
            left, weight = left // base, weight / base
    return points


def _shortened(way: list[Floats], obstacles: tuple[Obstacle, ...]) -> list[Floats]:
    """Return the inner points of a way, less those that straight legs can do without."""
    index = 1
    while index < len(way) - 1:
        if blocking(way[index - 1], way[index + 1], obstacles) is None:
            del way[index]
        else:
            index += 1
    return way[1:-1]
