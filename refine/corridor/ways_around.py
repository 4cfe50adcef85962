"""A way between two points past convex bodies, over a visibility graph: where leading around one body at a time does not get through."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.keep_out_bodies import Obstacle, blocking

Floats = NDArray[np.float64]


def way_around(a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats) -> list[Floats] | None:
    """Return points between two others such that straight legs meet no body, or None where the roadmap has no such way.

    Args:
        a: m. Shape (3,).
        b: m. Shape (3,).
        obstacles: Bodies that hold neither of them.
        low: Lower corner of the space to stay in, m.
        high: Upper corner.
    """
    from refine.obstacles.visibility_graph import Roadmap  # here: it takes long to load, and few legs need it

    roadmap = Roadmap(low, high, [body.inflated for body in obstacles], (), np.unique([a[2], b[2]]))
    way = roadmap.way(a, b)
    if way is None or any(blocking(p, q, obstacles) for p, q in itertools.pairwise(way)):
        return None
    return list(way[1:-1])
