"""Limits of legs of their own (`limits.legs`): which legs of a course they bind, and how much slower those must be flown.

A leg of the mission begins with the last earlier visit that is over before the next one begins, as the judge counts: where two
regions come within the margin of each other, what leads to the first leads to the second as well.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from refine.course import Course
from refine.limits import Limits
from refine.peaks import shares_used
from refine.spline import Spline
from refine.timing import SAFETY
from verify.data import Mission, RobotPlan
from verify.data.mission import Region

Floats = NDArray[np.float64]

_TURNS = 50
"""Steps towards a plane between two regions."""


def leg_speeds(mission: Mission, robot: RobotPlan, course: Course) -> Floats | None:
    """Return the limit on speed of each leg; None where there is none of its own."""
    if not mission.limits.legs:
        return None
    speeds = np.full(len(course), np.inf)
    for visit in range(len(robot.visits)):
        own = mission.limits.legs.get(robot.visits[visit].region)
        if own is not None and own.speed is not None:
            legs = _on_the_way(mission, robot, course, visit)
            speeds[legs] = np.minimum(speeds[legs], own.speed)
    return speeds


def slow_legs(mission: Mission, robot: RobotPlan, course: Course, path: Spline) -> Floats:
    """Return how much longer each leg must last for the limits of its own. Shape (legs,)."""
    factors = np.ones(len(course))
    if not mission.limits.legs:
        return factors
    for visit in range(len(robot.visits)):
        own = mission.limits.legs.get(robot.visits[visit].region)
        legs = _on_the_way(mission, robot, course, visit)
        if own is None or not legs.any():
            continue
        limits = Limits(
            speed=np.inf if own.speed is None else own.speed,
            acceleration=np.inf if own.acceleration is None else own.acceleration,
        )
        used = shares_used(path, None, limits)
        if "speed" in used:
            factors[legs] = np.maximum(factors[legs], used["speed"][2][legs].max() * (1 + 2 * SAFETY))
        if "acceleration" in used:
            factors[legs] = np.maximum(factors[legs], np.sqrt(used["acceleration"][2][legs].max()) * (1 + 2 * SAFETY))
    return np.where(factors > 1.0 + SAFETY, factors * 1.02, factors * (factors > 1.0) + 1.0 * (factors <= 1.0))


def _on_the_way(mission: Mission, robot: RobotPlan, course: Course, visit: int) -> NDArray[np.bool_]:
    """Tell which legs lead to a visit, from the one that leaves the last region before it that lies apart."""
    legs = np.zeros(len(course), dtype=bool)
    arrival = _arrival(mission, robot, course, visit)
    if arrival is None:
        return legs
    before = _apart_before(mission, robot, visit, range(visit - 1, -1, -1))
    legs[0 if before is None else _leaving(mission, robot, course, before) : arrival + 1] = True
    first = robot.cycle_visit
    if first is None or course.cycle is None or visit < first:
        return legs
    if _apart_before(mission, robot, visit, range(visit - 1, first - 1, -1)) is None:  # it is come to from the lap before
        before = _apart_before(mission, robot, visit, range(len(robot.visits) - 1, visit, -1))
        legs[_leaving(mission, robot, course, visit if before is None else before) :] = True
        legs[course.cycle : arrival + 1] = True
    return legs


def _arrival(mission: Mission, robot: RobotPlan, course: Course, visit: int) -> int | None:
    """Return the leg that comes to a visit's region; None where no leg does."""
    serving = [index for index, leg in enumerate(course.legs) if leg.visit == visit]
    region = mission.all_regions[robot.visits[visit].region]
    found = (i for i in serving if course.legs[i].tube is not None or region.level(course.points[i + 1]) <= 1.0)
    return next(found, serving[-1] if serving else None)


def _leaving(mission: Mission, robot: RobotPlan, course: Course, visit: int) -> int:
    """Return the leg that leaves a visit's region: the last part of a passage, or the first that ends outside."""
    passages = [index for index, leg in enumerate(course.legs) if leg.visit == visit and leg.tube is not None]
    if passages:
        return passages[-1]
    arrival = _arrival(mission, robot, course, visit)
    index = 0 if arrival is None else min(arrival + 1, len(course) - 1)
    region = mission.all_regions[robot.visits[visit].region]
    while index + 1 < len(course) and region.level(course.points[index + 1]) <= 1.0:
        index += 1
    return index


def _apart_before(mission: Mission, robot: RobotPlan, visit: int, earlier: Iterable[int]) -> int | None:
    """Return the first of some visits, taken backwards, that is over before this one begins: its region lies apart."""
    region = mission.all_regions[robot.visits[visit].region]
    for index in earlier:
        other = mission.all_regions[robot.visits[index].region]
        if other == region or _apart(region, other, mission.margin):
            return index
    return None


def _apart(region: Region, other: Region, margin: float) -> bool:
    """Tell whether a plane is found between two regions, both grown by the margin."""
    spreads = [np.linalg.inv(r.shape) * (1.0 + margin / min(r.radii)) ** 2 for r in (region, other)]
    between = np.array(other.center) - np.array(region.center)
    normal = between
    for _ in range(_TURNS):
        reaches = [float(np.sqrt(normal @ spread @ normal)) for spread in spreads]
        if not all(reaches):
            return False
        if normal @ between > sum(reaches):
            return True
        normal = np.linalg.solve(sum(spread / reach for spread, reach in zip(spreads, reaches, strict=True)), between)
    return False
