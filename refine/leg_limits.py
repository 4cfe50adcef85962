"""Limits of legs of their own (`limits.legs`): which legs of a course they bind, and how much slower those must be flown.

A leg of the mission begins with the last earlier visit that is over before the next one begins, as the judge counts: where two
regions come within the margin of each other, what leads to the first leads to the second as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

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
    """Tell which legs lead to a visit from the last one before it whose region lies apart."""
    legs = _from_the_one_before(robot, course, visit)
    for earlier in _near_before(mission, robot, visit):
        legs = legs | _from_the_one_before(robot, course, earlier)
    return legs


def _near_before(mission: Mission, robot: RobotPlan, visit: int) -> Iterator[int]:
    """Yield the visits before one that may last until it begins: those back to the first whose region lies apart."""
    rows: list[Sequence[int]] = [range(visit - 1, -1, -1)]
    if robot.cycle_visit is not None and visit >= robot.cycle_visit:
        rows.append([*range(visit - 1, robot.cycle_visit - 1, -1), *range(len(robot.visits) - 1, visit, -1)])
    region = mission.all_regions[robot.visits[visit].region]
    for row in rows:
        for earlier in row:
            other = mission.all_regions[robot.visits[earlier].region]
            if other == region or _apart(region, other, mission.margin):
                break
            yield earlier


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


def _from_the_one_before(robot: RobotPlan, course: Course, visit: int) -> NDArray[np.bool_]:
    """Tell which legs lead from the planned visit before to this one, the one that leaves its region or hoop included."""
    serves = np.array([-1 if leg.visit is None else leg.visit for leg in course.legs])
    legs = serves == visit
    if not legs.any():
        return legs
    ends = [int(np.flatnonzero(legs)[0])] + ([len(serves)] if visit == robot.cycle_visit else [])
    for end in ends:  # back over legs between points that belong to no visit, to the one that leaves the previous visit
        index = end - 1
        while index >= 0 and serves[index] == -1:
            legs[index] = True
            index -= 1
        if 0 <= index < end - 1:
            legs[index] = True
    before = [visit - 1] + ([len(robot.visits) - 1] if visit == robot.cycle_visit else [])
    for earlier in before:
        passages = [index for index, leg in enumerate(course.legs) if leg.visit == earlier and leg.tube is not None]
        if passages:
            legs[passages[-1]] = True
    return legs
