"""Limits of legs of their own (`limits.legs`): which legs of a corridor they bind, and how much slower those must be flown.

A leg of the mission begins with the last earlier visit that is over before the next one begins, as the judge counts: where two
regions come within the margin of each other, what leads to the first leads to the second as well.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from refine.corridor.corridor import Corridor
from refine.corridor.sampled_stays import SampledStay, stays
from refine.limits.limits import Limits
from refine.limits.stretching import SAFETY
from refine.limits.usage import shares_used
from refine.obstacles.gaps import widest_gap
from refine.spline.spline import Spline
from verify.data import Mission, RobotPlan
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

_SAMPLES = np.linspace(0.0, 1.0, 101)
_TURNS = 50
"""Steps towards a plane between two regions."""


def own_limits(mission: Mission, robot: RobotPlan, corridor: Corridor) -> tuple[Floats, Floats]:
    """Return the limits on speed (m/s) and acceleration (m/s^2) of each leg's own; inf for none. Shapes (legs,).

    Args:
        mission: Whose `limits.legs` count.
        robot: Its visits.
        corridor: Its legs.
    """
    speeds, accelerations = np.full((2, len(corridor)), np.inf)
    for visit in range(len(robot.visits)):
        own = mission.limits.legs.get(robot.visits[visit].region)
        if own is None:
            continue
        legs = _on_the_way(mission, robot, corridor, visit)
        for least, limit in ((speeds, own.speed), (accelerations, own.acceleration)):
            if limit is not None:
                least[legs] = np.minimum(least[legs], limit)
    return speeds, accelerations


def slow_legs(mission: Mission, robot: RobotPlan, corridor: Corridor, path: Spline) -> Floats:
    """Return how much longer each leg must last for the limits of its own. Shape (legs,).

    Args:
        mission: Whose `limits.legs` count.
        robot: Its visits.
        corridor: Its legs.
        path: Three axes, one piece a leg.
    """
    factors = np.ones(len(corridor))
    if not mission.limits.legs:
        return factors
    for visit in range(len(robot.visits)):
        own = mission.limits.legs.get(robot.visits[visit].region)
        legs = _on_the_way(mission, robot, corridor, visit)
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


def slower_on_ways(mission: Mission, robot: RobotPlan, path: Spline) -> float:
    """Return how many times slower a finite flight must be for the limits on its ways, wherever its corridor has led it.

    A path that gives way to others, or that swings inside a region, may be on a way where its corridor knows of none.

    Args:
        mission: Whose `limits.legs` count.
        robot: Its visits.
        path: Three axes.
    """
    factor = 1.0
    limited = [visit for visit in range(len(robot.visits)) if robot.visits[visit].region in mission.limits.legs]
    if not limited:
        return factor
    found = stays(path, mission.all_regions, mission.margin)
    if [stay.region for stay in found] != [visit.region for visit in robot.visits]:
        return factor  # the judge refuses its visits anyhow
    times = (path.knots[:-1, None] + path.durations[:, None] * _SAMPLES).ravel()
    points, speed, acceleration = path.sample(_SAMPLES)[..., :3].reshape(-1, 3), _size(path, 1), _size(path, 2)
    for visit in limited:
        own, on = mission.limits.legs[robot.visits[visit].region], _way(mission, found, visit, times, points)
        for value, limit, power in ((speed, own.speed, 1.0), (acceleration, own.acceleration, 0.5)):
            if limit is not None and on.any():
                factor = max(factor, (float(value[on].max()) / limit) ** power * (1 + 2 * SAFETY))
    return factor


def _size(path: Spline, order: int) -> Floats:
    return np.linalg.norm(path.sample(_SAMPLES, order)[..., :3], axis=-1).ravel()


def _way(mission: Mission, found: tuple[SampledStay, ...], visit: int, times: Floats, points: Floats) -> NDArray[np.bool_]:
    """Tell at which samples a robot may be on the way to a visit, as the judge counts: there, and back after excursions."""
    stay = found[visit]
    level, sure = _levels(mission, stay, times, points)
    on = np.zeros(len(times), dtype=bool)
    before = next((other for other in found[visit - 1 :: -1] if other.end < stay.start), None) if visit else None
    arrival = int(np.argmax(sure)) if sure.any() else int(np.searchsorted(times, stay.end))
    if before is None:
        on[: arrival + 1] = True
    else:
        _, inside = _levels(mission, before, times, points)
        left = int(np.argmax(inside)) if inside.any() else int(np.searchsorted(times, before.start))
        on[left : arrival + 1] = ~inside[left : arrival + 1]
    if sure.any():
        last = len(sure) - 1 - int(np.argmax(sure[::-1]))
        on[arrival:last] |= ~sure[arrival:last]
        here = (times >= stay.start) & (times <= stay.end)
        back = np.flatnonzero(here & (level <= 1.0) & (np.arange(len(times)) > last))
        out = np.flatnonzero(here & (level > 1.0) & (np.arange(len(times)) > last))
        if len(back) and len(out) and out[0] < back[-1]:
            on[out[0] : back[-1] + 1] = True
    return np.convolve(on, np.ones(3), "same") > 0  # a sample more at both ends


def _levels(mission: Mission, stay: SampledStay, times: Floats, points: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the level of a stay's region at all samples, and where in the stay the robot is in it for sure."""
    region = mission.all_regions[stay.region]
    level = np.sqrt(region.level(points))
    return level, (level < 1.0 - mission.margin / region.inner_radius) & (times >= stay.start) & (times <= stay.end)


def _on_the_way(mission: Mission, robot: RobotPlan, corridor: Corridor, visit: int) -> NDArray[np.bool_]:
    """Return which legs lead to a visit, from the one that leaves the last region before it that lies apart."""
    legs = np.zeros(len(corridor), dtype=bool)
    arrival = _arrival(mission, robot, corridor, visit)
    if arrival is None:
        return legs
    before = _apart_before(mission, robot, visit, range(visit - 1, -1, -1))
    legs[0 if before is None else _leaving(mission, robot, corridor, before) : arrival + 1] = True
    first = robot.cycle_visit
    if first is None or corridor.cycle is None or visit < first:
        return legs
    if _apart_before(mission, robot, visit, range(visit - 1, first - 1, -1)) is None:  # it is come to from the lap before
        before = _apart_before(mission, robot, visit, range(len(robot.visits) - 1, visit, -1))
        legs[_leaving(mission, robot, corridor, visit if before is None else before) :] = True
        legs[corridor.cycle : arrival + 1] = True
    return legs


def _arrival(mission: Mission, robot: RobotPlan, corridor: Corridor, visit: int) -> int | None:
    """Return the leg that comes to a visit's region; None where no leg does."""
    serving = [index for index, leg in enumerate(corridor.legs) if leg.visit == visit]
    region = mission.all_regions[robot.visits[visit].region]
    found = (i for i in serving if corridor.legs[i].cylinder is not None or region.level(corridor.points[i + 1]) <= 1.0)
    return next(found, serving[-1] if serving else None)


def _leaving(mission: Mission, robot: RobotPlan, corridor: Corridor, visit: int) -> int:
    """Return the leg that leaves a visit's region: the last part of a passage, or the first that ends outside."""
    passages = [index for index, leg in enumerate(corridor.legs) if leg.visit == visit and leg.cylinder is not None]
    if passages:
        return passages[-1]
    arrival = _arrival(mission, robot, corridor, visit)
    index = 0 if arrival is None else min(arrival + 1, len(corridor) - 1)
    region = mission.all_regions[robot.visits[visit].region]
    while index + 1 < len(corridor) and region.level(corridor.points[index + 1]) <= 1.0:
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
    """Return whether a plane is found between two regions, both grown by the margin."""
    if not (region.is_ellipsoid and other.is_ellipsoid):
        between = np.array(other.center) - np.array(region.center)
        return widest_gap(region.body, other.body, between) > 2.0 * margin
    spreads = [np.linalg.inv(r.shape) * (1.0 + margin / r.inner_radius) ** 2 for r in (region, other)]
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
