"""Yaw rates of drones by their files: headings between which each turns evenly."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

from verify.arithmetic.balls import Floats
from verify.third_party.extremes import Extreme
from verify.third_party.fleet import Fleet


def yaw_extremes(fleet: Fleet, limits: Floats) -> list[Extreme]:
    """Bound the greatest rate of turning of each drone whose file says its heading.

    Rates of even turns are quotients of numbers in the file, and compared without rounding.

    Args:
        fleet: The drones.
        limits: deg/s. Shape (drones,).
    """
    return [_extreme(drone, yaw, float(limits[drone])) for drone, yaw in fleet.yaws.items()]


def _extreme(drone: int, yaw: Floats, limit: float) -> Extreme:
    rate, time = Fraction(0), Fraction(float(yaw[0, 0]))
    rows = [(Fraction(t), Fraction(angle)) for t, angle in yaw.tolist()]
    for (begin, one), (end, other) in pairwise(rows):
        if (found := abs(other - one) / (end - begin)) > rate:
            rate, time = found, begin
    reached = float(rate)
    above = reached if Fraction(reached) >= rate else math.nextafter(reached, math.inf)
    kept = rate <= Fraction(limit)
    return Extreme(
        drone, "yaw rate", limit, min(above, limit) if kept else reached, reached, float(time), "holds" if kept else "fails"
    )
