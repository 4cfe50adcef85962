"""Places for several robots beside each other, where those from the middle outwards leave some without one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from refine.bodies import Ball, keep_out

Floats = NDArray[np.float64]

_TRIES = 3_000
"""Places that are tried, of all robots together."""


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
    return _beside((), middle, free, (distance, z_scale), iter(range(_TRIES)))


def _beside(
    taken: tuple[Ball, ...], middle: Floats, free: Sequence[Floats], kept: tuple[float, float], tries: Iterator[int]
) -> list[Floats] | None:
    if not free:
        return []
    outwards = -np.linalg.norm(free[0] - middle, axis=1)
    away = np.sum([ball.signed_distance(free[0]) for ball in taken], axis=0) if taken else outwards
    for place in free[0][np.argsort(away, kind="stable")]:
        if next(tries, None) is None:
            return None
        own = keep_out("", place, *kept)
        left = [points[own.signed_distance(points) > 0.0] for points in free[1:]]
        if all(map(len, left)):
            others = _beside((*taken, own), middle, left, kept, tries)
            if others is not None:
                return [place, *others]
    return None
