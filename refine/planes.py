"""Planes that a piece of the path stays beyond, and what puts them: the nearest point of a straight leg to a convex body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_STEPS = np.linspace(0.0, 1.0, 33)
_ZOOMS = 6
"""Each narrows a segment to a sixteenth around its nearest point."""


@dataclass(frozen=True, eq=False)
class Plane:
    """A rule for a piece's Bernstein points, which the whole piece then keeps.

    Attributes:
        normal: Unit vector. Shape (3,).
        offset: m.
        monotone: False: each point has normal . point >= offset. True: each point is at least `offset` (0, usually) further
            along the normal than the one before it, so that the piece never goes back.
    """

    normal: Floats
    offset: float
    monotone: bool = False


def nearest_on_segment(a: Floats, b: Floats, distances: Callable[[Floats], Floats]) -> Floats:
    """Return the point of a segment that is nearest to a convex body.

    Args:
        a: One end, m. Shape (3,).
        b: The other.
        distances: From points, shape (n, 3), to their distances from the body, which are convex along the segment.
    """
    low, high = 0.0, 1.0
    for _ in range(_ZOOMS):
        shares = low + (high - low) * _STEPS
        least = int(np.argmin(distances(a + shares[:, None] * (b - a))))
        low, high = float(shares[max(least - 1, 0)]), float(shares[min(least + 1, len(shares) - 1)])
    return a + (low + high) / 2 * (b - a)
