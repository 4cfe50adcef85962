"""Worlds of upright boxes with a second opinion on them: distances by formula, ways by search on a fine grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from verify.data.shapes.region import Region

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Boxes:
    """Boxes turned about z.

    Attributes:
        centers: m. Shape (n, 3).
        sizes: Full lengths, m. Shape (n, 3).
        yaws: rad. Shape (n,).
    """

    centers: Floats
    sizes: Floats
    yaws: Floats

    @classmethod
    def random(cls, rng: np.random.Generator, count: int, side: float) -> Boxes:
        """Draw boxes in a square room of this side, from floor to ceiling at 2 m."""
        centers = np.column_stack([rng.uniform(0.0, side, (count, 2)), np.full(count, 1.0)])
        sizes = np.column_stack([rng.uniform(0.1, side / 2.5, count), rng.uniform(0.05, 0.6, count), np.full(count, 2.4)])
        return cls(centers, sizes, rng.choice([0.0, np.pi / 2, 0.4, 2.0], count))

    def regions(self) -> list[Region]:
        """Return the boxes as bodies."""
        return [
            Region.model_validate({"center": tuple(c), "size": tuple(s), "yaw_deg": float(np.degrees(y))})
            for c, s, y in zip(self.centers.tolist(), self.sizes.tolist(), self.yaws, strict=True)
        ]

    def distances(self, points: Floats) -> Floats:
        """Return how far points are from the nearest box, 0 inside, m. Shape (n, 3) to (n,)."""
        found = np.full(len(points), np.inf)
        for center, size, yaw in zip(self.centers, self.sizes, self.yaws, strict=True):
            cos, sin = np.cos(yaw), np.sin(yaw)
            offset = points - center
            own = np.column_stack(
                [cos * offset[:, 0] + sin * offset[:, 1], cos * offset[:, 1] - sin * offset[:, 0], offset[:, 2]]
            )
            found = np.minimum(found, np.linalg.norm(np.maximum(np.abs(own) - size / 2, 0.0), axis=1))
        return found


def grid_length(boxes: Boxes, clearance: float, ends: tuple[Floats, Floats], side: float, step: float) -> float:
    """Return the length of a shortest way on a grid at one height, m; infinite where there is none.

    Args:
        boxes: What stands in the way.
        clearance: m, kept from it.
        ends: Where it begins and ends, m; moved to the next point of the grid. Shapes (3,).
        side: Of the square room, m.
        step: Of the grid, m.
    """
    axis = np.arange(0.0, side + step / 2, step)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, ends[0][2])])
    free = (boxes.distances(points) > clearance).reshape(x.shape)
    number = np.arange(x.size).reshape(x.shape)
    rows, columns, costs = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        here = (slice(0, x.shape[0] - dx), slice(max(0, -dy), x.shape[1] - max(0, dy)))
        there = (slice(dx, None), slice(max(0, dy), x.shape[1] + min(0, dy)))
        both = free[here] & free[there]
        rows.append(number[here][both])
        columns.append(number[there][both])
        costs.append(np.full(int(both.sum()), step * np.hypot(dx, dy)))
    graph = csr_matrix((np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), shape=(x.size, x.size))
    start, end = (int(number[tuple(np.round(point[:2] / step).astype(int))]) for point in ends)
    return float(dijkstra(graph, directed=False, indices=start)[end])
