"""Another place for a visit: where a planned point lies in a region that is not meant, or where another robot hovers, a nearby
point of the visited region may not.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from refine.course import DEEP
from refine.legs import PAD
from refine.obstacles import Ball, Obstacle, grown_region, keep_out, ring
from verify.data import Mission, Plan, RobotPlan, Waypoint

Floats = NDArray[np.float64]

_UNIT_BALL = np.array([p for p in itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3) if np.linalg.norm(p) <= 1.0])


def moved_into_the_clear(mission: Mission, robot: RobotPlan) -> RobotPlan:
    """Return the plan with points of visits moved, where they lie in another region or a ring too, to where only theirs is.

    A visit takes place anywhere in its region, so the nearest point of it (less the margin) that is clear of all other
    regions and rings, or at least of those regions that are never visited, does as well as the planned one.
    """
    waypoints = [
        (_moved(mission, robot, waypoint, ()) if _movable(mission, robot, waypoint) else None) or waypoint
        for waypoint in robot.waypoints
    ]
    if robot.cycle_waypoint is not None:
        waypoints[-1] = waypoints[-1].model_copy(update={"position": waypoints[robot.cycle_waypoint].position})
    return robot.model_copy(update={"waypoints": tuple(waypoints)})


def moved_apart(plan: Plan, distance: float, z_scale: float) -> Plan:
    """Return the plan with points of visits moved that lie too near another robot's last hover.

    A robot that never leaves its start is there for every visit; one that ends its flight is there when another one ends its
    own. Robots that do not move have the first say, then flights whose last point may not be moved; the others follow in the
    plan's order. What cannot be moved stays.

    Args:
        plan: No robot of it flies a lasso, unless it is alone.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.
    """
    mission, robots = plan.mission, dict(plan.robots)
    still = [name for name, robot in robots.items() if robot.still]
    firm = [name for name, robot in robots.items() if not _movable(mission, robot, robot.waypoints[-1])]
    ends: dict[str, Ball] = {}
    for name in dict.fromkeys((*still, *firm, *robots)):
        robot = robots[name]
        hovering = tuple(ends[other] for other in ends if other in still)
        waypoints = list(robot.waypoints)
        for index, waypoint in enumerate(waypoints):
            taken = tuple(ends.values()) if index == len(waypoints) - 1 else hovering
            meets = any(place.clearance(np.array(waypoint.position)) <= 0.0 for place in taken)
            if name not in still and meets and _movable(mission, robot, waypoint):
                waypoints[index] = _moved(mission, robot, waypoint, taken) or waypoint
        robots[name] = robot.model_copy(update={"waypoints": tuple(waypoints)})
        ends[name] = keep_out(name, np.array(waypoints[-1].position), distance, z_scale)
    return plan.model_copy(update={"robots": {name: robots[name] for name in plan.robots}})


def _movable(mission: Mission, robot: RobotPlan, waypoint: Waypoint) -> bool:
    """Tell whether a point makes a visit that might as well be made elsewhere in its region."""
    visited = {visit.region for visit in robot.visits}
    return (
        waypoint.region in mission.regions
        and waypoint.visit is not None
        and waypoint.role != "start"
        and waypoint.region in visited
    )


def _moved(mission: Mission, robot: RobotPlan, waypoint: Waypoint, taken: tuple[Ball, ...]) -> Waypoint | None:
    """Return a visit's point at the nearest place of its region that is clear and not taken; None where there is none."""
    region, visited = mission.regions[waypoint.region or ""], {visit.region for visit in robot.visits}
    inner = DEEP * (1.0 - (mission.margin + PAD) / min(region.radii))
    if inner <= 0.0:
        return None
    grow = mission.margin + PAD
    bodies: dict[str, Obstacle] = {name: grown_region(name, region, grow) for name, region in mission.all_regions.items()}
    bodies |= {f"ring of {name}": ring(name, hoop, grow + mission.vehicle.radius) for name, hoop in mission.hoops.items()}
    planned = np.array(waypoint.position)
    cloud = np.array(region.center) + inner * _UNIT_BALL @ np.linalg.inv(grown_region("", region, 0.0).root)
    points = np.concatenate([planned[None], cloud[np.argsort(np.linalg.norm(cloud - planned, axis=1), kind="stable")]])
    free = np.all(
        (points >= np.array(mission.workspace.min) + grow) & (points <= np.array(mission.workspace.max) - grow), axis=1
    )
    for place in taken:
        free &= place.clearance(points) > 0.0
    others = {name: body.clearance(points) > 0.0 for name, body in bodies.items() if name != waypoint.region}
    for names in (set(others), set(others) - visited):
        clear = free & np.all([others[name] for name in names], axis=0) if names else free
        if clear.any():
            point = tuple(float(x) for x in points[int(np.argmax(clear))])
            return waypoint.model_copy(update={"position": point})
    return None
