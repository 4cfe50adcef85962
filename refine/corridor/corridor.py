"""A corridor: points to go through, and for each leg between them what it must stay out of.

It is data for `fitting`: it says nothing about polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.corridor.legs import Leg
from refine.obstacles.keep_out_bodies import Ball

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Corridor:
    """Points in order and the rules of the legs between them.

    Attributes:
        robot: Name, for messages.
        points: m. Shape (points, 3).
        durations: Nominal, s. Shape (points - 1,).
        legs: One entry a leg.
        low: Lower corner of the space to stay in, m. Shape (3,).
        high: Upper corner.
        cycle: Index of the point at which the cycle begins; the last point repeats it. None for a finite flight.
        needed: Whether a point must be gone through; others only lead around something. Shape (points,).
        rooms: Where a visit's point may lie instead, in flights that look for it: the visited region less the margin, or for
            a passage a disc across the hoop's axis, within its opening less margin and radius. None for a fixed point.
    """

    robot: str
    points: Floats
    durations: Floats
    legs: tuple[Leg, ...]
    low: Floats
    high: Floats
    cycle: int | None
    needed: tuple[bool, ...]
    rooms: tuple[Ball | None, ...]

    def __len__(self) -> int:
        return len(self.legs)
