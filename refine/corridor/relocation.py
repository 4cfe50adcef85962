"""Another place for a visit: where a planned point lies in a region that is not meant, or where another robot hovers, a nearby
point of the visited region may not.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from refine.corridor.legs import CLEARANCE, bodies_of, leads_to
from refine.corridor.planned import DEEP
from refine.corridor.ways_around import way_around
from refine.obstacles.keep_out_bodies import Ball, Disc, GrownRegion, blocking, grown_ellipsoid
from refine.obstacles.solid_body import SolidBody
from verify.data import Mission, RobotPlan, Waypoint
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

_WAYS = 12
"""Places behind something solid to which a way around it is looked for."""
_UNIT_BOX = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3)))
_UNIT_BALL = np.array([p for p in itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3) if np.linalg.norm(p) <= 1.0])


def movable(mission: Mission, name: str, robot: RobotPlan, waypoint: Waypoint) -> bool:
    """Return whether a point makes a visit that might as well be made elsewhere in its region, and is not where the robot is to end.

    Args:
        mission: Gives regions and ends.
        name: The robot's.
        robot: Its plan.
        waypoint: One of its waypoints.
    """
    visited, end = {visit.region for visit in robot.visits}, mission.agents[name].end
    return (
        waypoint.region in mission.regions
        and waypoint.visit is not None
        and waypoint.role != "start"
        and not (end is not None and np.allclose(waypoint.position, end))
        and waypoint.region in visited
        and not leads_to(mission, waypoint)
    )


def moved_into_the_clear(mission: Mission, name: str, robot: RobotPlan) -> RobotPlan:
    """Return the plan with points of visits moved, where they lie in another region or a ring too, to where only theirs is.

    A visit takes place anywhere in its region, so the nearest point of it (less the margin) that is clear of all other
    regions and rings, or at least of those regions that are never visited, does as well as the planned one: nearest to fly to,
    where a wall stands in the region.

    Args:
        mission: Gives regions, rings, obstacles, margin and workspace.
        name: The robot's.
        robot: Its plan.
    """
    waypoints = [
        (moved_within(mission, name, robot, waypoint, ()) if movable(mission, name, robot, waypoint) else None) or waypoint
        for waypoint in robot.waypoints
    ]
    if robot.cycle_waypoint is not None:
        waypoints[-1] = waypoints[-1].model_copy(update={"position": waypoints[robot.cycle_waypoint].position})
    return robot.model_copy(update={"waypoints": tuple(waypoints)})


def relocations(
    mission: Mission, name: str, robot: RobotPlan, taken: tuple[Ball, ...], at_the_end: tuple[Ball, ...], count: int
) -> list[RobotPlan]:
    """Return the plan with all points of visits at other places of their regions, as far from each other as they can be.

    Args:
        mission: Gives regions, rings, obstacles, margin and workspace.
        name: The robot's.
        robot: Its plan; no lasso.
        taken: Places where other robots hover.
        at_the_end: Places that are no good to stay at, if there are others.
        count: Of plans, at most; none where no visit's point may move.
    """
    places: dict[int, list[list[float]]] = {}
    solids = _solids(mission, name)
    for index, waypoint in enumerate(robot.waypoints):
        if movable(mission, name, robot, waypoint):
            points = places_of(mission, name, robot, waypoint, taken)
            good = places_of(mission, name, robot, waypoint, at_the_end) if index == len(robot.waypoints) - 1 else points
            places[index] = _far_apart(np.array(waypoint.position), good if len(good) else points, count, solids)
    plans = []
    for choice in range(count if any(len(found) for found in places.values()) else 0):
        waypoints = list(robot.waypoints)
        for index, found in places.items():
            if len(found):
                waypoints[index] = waypoints[index].model_copy(update={"position": tuple(found[choice % len(found)])})
        plans.append(robot.model_copy(update={"waypoints": tuple(waypoints)}))
    return plans


def _far_apart(planned: Floats, points: Floats, count: int, solids: tuple[SolidBody, ...]) -> list[list[float]]:
    """Return points, each the farthest from the planned one and those before it; none behind a wall, if others are not."""
    if solids:
        seen = [blocking(planned, point, solids) is None for point in points]
        points = points[seen] if any(seen) else points
    chosen: list[list[float]] = []
    distance = np.linalg.norm(points - planned, axis=1)
    while len(chosen) < count and len(points) and distance.max() > 0.0:
        point = points[int(np.argmax(distance))]
        chosen.append(point.tolist())
        distance = np.minimum(distance, np.linalg.norm(points - point, axis=1))
    return chosen


def _nearest(mission: Mission, planned: Floats, points: Floats, solids: tuple[SolidBody, ...]) -> Floats:
    """Return the point to which the way from the planned one is the shortest: around solid bodies, where some are between them."""
    straight = np.linalg.norm(points - planned, axis=1)
    if not solids:
        return points[int(np.argmin(straight))]
    grow = mission.margin + CLEARANCE
    low, high = np.array(mission.workspace.min) + grow, np.array(mission.workspace.max) - grow
    best, shortest, looked = int(np.argmin(straight)), np.inf, 0
    for index in np.argsort(straight, kind="stable"):
        if straight[index] >= shortest:
            break
        length = float(straight[index])
        if blocking(planned, points[index], solids) is not None:
            looked += 1
            way = way_around(planned, points[index], solids, low, high) if looked <= _WAYS else None
            length = np.inf if way is None else _length([planned, *way, points[index]])
        if length < shortest:
            best, shortest = int(index), length
    return points[best]


def _length(way: list[Floats]) -> float:
    return float(np.linalg.norm(np.diff(np.array(way), axis=0), axis=1).sum())


def _solids(mission: Mission, name: str) -> tuple[SolidBody, ...]:
    """Return what is between two places: solid bodies, grown only so far that planned points lie outside."""
    return tuple(solid.grown(-CLEARANCE) for solid in bodies_of(mission, name, CLEARANCE).solids)


def moved_within(mission: Mission, name: str, robot: RobotPlan, waypoint: Waypoint, taken: tuple[Ball, ...]) -> Waypoint | None:
    """Return a visit's point at the place of its region that is clear, not taken, and nearest to fly to; None where there is none.

    Args:
        mission: Gives regions, rings, obstacles, margin and workspace.
        name: The robot's.
        robot: Its plan.
        waypoint: One of its waypoints, which is movable.
        taken: Where others are.
    """
    places = places_of(mission, name, robot, waypoint, taken)
    if not len(places):
        return None
    nearest = _nearest(mission, np.array(waypoint.position), places, _solids(mission, name))
    return waypoint.model_copy(update={"position": tuple(nearest.tolist())})


def places_of(mission: Mission, name: str, robot: RobotPlan, waypoint: Waypoint, taken: tuple[Ball, ...]) -> Floats:
    """Return where a visit's point may lie: within the region less the margin and the workspace, and not taken.

    Only places that are clear of obstacles and of all other regions and rings, or where there are none, those clear of rings and of regions
    that are never visited. Shape (places, 3).

    Args:
        mission: Gives regions, rings, obstacles, margin and workspace.
        name: The robot's.
        robot: Its plan.
        waypoint: One of its waypoints, which is movable.
        taken: Where others are.
    """
    region, visited = mission.regions[waypoint.region or ""], {visit.region for visit in robot.visits}
    inner = DEEP * (1.0 - (mission.margin + CLEARANCE) / region.inner_radius)
    if inner <= 0.0:
        return np.zeros((0, 3))
    grow = mission.margin + CLEARANCE
    grown = bodies_of(mission, name, CLEARANCE)
    bodies: dict[str, GrownRegion | Disc] = {**grown.regions, **{disc.name: disc for disc in grown.rings.values()}}
    cloud = np.array(region.center) + _cloud(region, inner)
    points = np.concatenate([np.array(waypoint.position)[None], cloud])
    free = np.all(
        (points >= np.array(mission.workspace.min) + grow) & (points <= np.array(mission.workspace.max) - grow), axis=1
    )
    for place in (*taken, *grown.solids):
        free &= place.signed_distance(points) > 0.0
    within = _also_visited(mission, robot, waypoint)
    for other in within:  # by no point of its own, so it is by this one
        body = mission.regions[other]
        free &= body.level(points) <= (DEEP * max(0.0, 1.0 - grow / body.inner_radius)) ** 2
    kept = {waypoint.region, *within}
    others = {name: body.signed_distance(points) > 0.0 for name, body in bodies.items() if name not in kept}
    for names in (set(others), set(others) - visited):
        clear = free & np.all([others[name] for name in names], axis=0) if names else free
        if clear.any():
            return points[clear]
    return np.zeros((0, 3))


def _also_visited(mission: Mission, robot: RobotPlan, waypoint: Waypoint) -> list[str]:
    """Return other regions that a visit's point lies in, as in a room of a house, and that no point of their own makes visits of."""
    own = {point.region for point in robot.waypoints}
    names = dict.fromkeys(visit.region for visit in robot.visits if visit.region in mission.regions and visit.region not in own)
    return [name for name in names if mission.regions[name].level(np.array(waypoint.position)) <= DEEP**2]


def _cloud(region: Region, inner: float) -> Floats:
    """Return points of a region around its centre, down to a share of its depth. Shape (points, 3)."""
    if region.is_ellipsoid:
        return inner * _UNIT_BALL @ np.linalg.inv(grown_ellipsoid("", region, 0.0).root)
    grid = _UNIT_BOX * region.half_lengths
    return grid[region.level(np.array(region.center) + grid) <= inner**2]
