"""Lower bounds on ways between places, and on their times: between balls and boxes around regions, and from points to regions' bodies."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from verify.data import Mission
from verify.data.shapes.inequalities import Point

Travel = Callable[[str, str | None, str], float]
"""Seconds from a region, or a robot's start, to another region; of what robot."""


def least_metres(mission: Mission, start: Point | str, region: str) -> float:
    """Return a lower bound on every way between two places at their nearest, m.

    Args:
        mission: Gives regions.
        start: A point in m, or a region.
        region: Where the way ends.
    """
    metres, goal = gap_of(mission, start, region, dict.fromkeys(mission.all_regions, 0.0)), mission.all_regions[region]
    if isinstance(start, str):
        return metres
    return max(metres, -float(goal.measures.depths(np.subtract(start, goal.center)[None])[0]))


def gap_of(mission: Mission, start: Point | str, region: str, deep: Mapping[str, float]) -> float:
    """Return a lower bound on the distance between two places, in m: of balls and of boxes around them.

    Args:
        mission: Gives regions.
        start: A point in m, or a region.
        region: Where the way ends.
        deep: How far within it each region is come to; others are come to in their middles.
    """
    places, radii, halves = [] if isinstance(start, str) else [np.array(start)], 0.0, np.zeros(3)
    for name in (start, region):
        if isinstance(name, str):
            body = mission.all_regions[name]
            places = [*places, np.array(body.center)]
            if name in deep:
                radii += body.outer_radius - deep[name]
                halves += np.array(body.half_lengths) - deep[name]
    way = places[-1] - places[-2]
    return max(0.0, float(np.linalg.norm(way)) - radii, float(np.linalg.norm(np.maximum(np.abs(way) - halves, 0.0))))


def straight_travel(mission: Mission) -> Travel:
    """Return a lower bound on the time of each way: straight between the regions' nearest points, at the greatest speed.

    Args:
        mission: Gives regions and limits.
    """

    @cache
    def seconds(robot: str, start: str | None, region: str) -> float:
        begin = mission.agents[robot].start if start is None else start
        metres = 0.0 if begin == region else least_metres(mission, begin, region)
        limits = mission.limits_of(robot)
        if start is not None or metres == 0.0:
            return metres / limits.speed
        until = min(limits.speed**2 / (2 * limits.acceleration), metres)  # from rest; m until it is at its greatest speed
        return math.sqrt(2 * until / limits.acceleration) + (metres - until) / limits.speed

    return seconds
