"""Places for several robots beside each other, where those from the middle outwards leave some without one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

_TRIES = 3_000
"""Places that are tried, of all robots together."""

_KEPT = 64
"""Questions whose answers are kept."""
_BLOCK = 64
"""Places whose distances from all others are found at once."""


def packed(middle: Floats, free: Sequence[Floats], distance: float, z_scale: float) -> list[Floats] | None:
    """Return a place for each robot, apart from those of the others; None where none were found.

    The first robot is as far out as can be, each further one as near to those before it, and where one finds no place those before it
    take others.

    Args:
        middle: Of the region, m. Shape (3,).
        free: For each robot the places where it may be, m. Shapes (places, 3).
        distance: m that robots keep.
        z_scale: Distances in z count this many times.
    """
    whole = [np.ascontiguousarray(points, dtype=np.float64).tobytes() for points in (middle, *free)]
    found = _packed(whole[0], tuple(whole[1:]), distance, z_scale)
    return None if found is None else [place.copy() for place in found]


@lru_cache(maxsize=_KEPT)
def _packed(middle: bytes, free: tuple[bytes, ...], distance: float, z_scale: float) -> tuple[Floats, ...] | None:
    """Return places for the same question: one team is asked it for each way in which it may wait, and each time for all that is too far apart."""
    points = [np.frombuffer(places).reshape(-1, 3) for places in free]
    found = _Places(np.frombuffer(middle), points, distance, z_scale).found((), [np.arange(len(places)) for places in points])
    return None if found is None else tuple(found)


class _Places:
    """Places where robots may be, and their distances, found once for each place that is tried."""

    def __init__(self, middle: Floats, free: Sequence[Floats], distance: float, z_scale: float) -> None:
        self._free = free
        scale = (
            np.array([1.0, 1.0, z_scale]) / distance
        )  # what `refine.obstacles.keep_out_bodies.keep_out` keeps free is a unit ball then
        self._scaled, self._least = [points * scale for points in free], float(1.0 / scale.max())
        self._outwards = [-np.linalg.norm(points - middle, axis=1) for points in free]
        self._known: dict[tuple[int, int], list[Floats]] = {}
        self._tries = iter(range(_TRIES))

    def found(self, taken: tuple[tuple[int, int], ...], left: Sequence[Numbers]) -> list[Floats] | None:
        """Return places for the robots that have none yet.

        Args:
            taken: Robots, and which of its places each has.
            left: For each robot that has none, which of its places are apart from those.
        """
        if not left:
            return []
        robot = len(taken)
        away = np.sum([self._apart(*place)[robot] for place in taken], axis=0) if taken else self._outwards[robot]
        for place in left[0][np.argsort(away[left[0]], kind="stable")].tolist():
            if next(self._tries, None) is None:
                return None
            apart = self._apart(robot, place)
            still = [numbers[apart[other][numbers] > 0.0] for other, numbers in enumerate(left[1:], start=robot + 1)]
            if all(map(len, still)):
                others = self.found((*taken, (robot, place)), still)
                if others is not None:
                    return [self._free[robot][place], *others]
        return None

    def _apart(self, robot: int, place: int) -> list[Floats]:
        """Return how far the places of the robots after one are from what it keeps free at one of its own, m."""
        from scipy.spatial.distance import cdist  # here: it takes long to load, and few teams need it

        block, row = divmod(place, _BLOCK)
        if (robot, block) not in self._known:
            own = self._scaled[robot][block * _BLOCK : (block + 1) * _BLOCK]
            distances = (np.asarray(cdist(own, points), dtype=np.float64) for points in self._scaled[robot + 1 :])
            self._known[robot, block] = [(found - 1.0) * self._least for found in distances]
        none = [np.empty(0)] * (robot + 1)
        return [*none, *(apart[row] for apart in self._known[robot, block])]
