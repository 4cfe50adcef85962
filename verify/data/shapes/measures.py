"""Measures of a region's body in floats, for planning: depth of points in it, extents, size.

The depth of a point is the radius of a ball around it that the body holds, or minus that of one that it does not touch; where
corners are near it may be less than the greatest. It changes by at most d within d. Nothing here is a proof.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from verify.data.errors import BadInput
from verify.data.shapes.convex_parts import ConvexBody, Floats, convex_body
from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import GREATEST_RADIUS, LEAST_RADIUS, Parts

MOST_PARTS, MOST_INEQUALITIES = 64, 64
"""A region may have so many parts, and each so many inequalities."""


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
