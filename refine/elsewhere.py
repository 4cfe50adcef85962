"""Another place for a visit: where a planned point lies in a region that is not meant, a nearby point of its own may not."""

from __future__ import annotations

import itertools

import numpy as np

from refine.course import DEEP, PAD
from refine.obstacles import Obstacle, grown_region, ring
from verify.data import Mission, RobotPlan

_UNIT_BALL = np.array([p for p in itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3) if np.linalg.norm(p) <= 1.0])


def moved_into_the_clear(mission: Mission, robot: RobotPlan) -> RobotPlan:
    """Return the plan with points of visits moved, where they lie in another region or a ring too, to where only theirs is.

    A visit takes place anywhere in its region, so the nearest point of it (less the margin) that is clear of all other
    regions and rings, or at least of those regions that are never visited, does as well as the planned one.
    """
    visited = {visit.region for visit in robot.visits}
    grow = mission.margin + PAD
    bodies: dict[str, Obstacle] = {name: grown_region(name, region, grow) for name, region in mission.all_regions.items()}
    bodies |= {f"ring of {name}": ring(name, hoop, grow + mission.vehicle.radius) for name, hoop in mission.hoops.items()}
    waypoints = list(robot.waypoints)
    for index, waypoint in enumerate(waypoints):
        region = mission.regions.get(waypoint.region or "")
        if region is None or waypoint.visit is None or waypoint.role == "start" or waypoint.region not in visited:
            continue
        inner = DEEP * (1.0 - (mission.margin + PAD) / min(region.radii))
        if inner <= 0.0:
            continue
        planned = np.array(waypoint.position)
        cloud = np.array(region.center) + inner * _UNIT_BALL @ np.linalg.inv(grown_region("", region, 0.0).root)
        points = np.concatenate([planned[None], cloud[np.argsort(np.linalg.norm(cloud - planned, axis=1), kind="stable")]])
        others = {name: body.clearance(points) > 0.0 for name, body in bodies.items() if name != waypoint.region}
        for names in (set(others), set(others) - visited):
            clear = np.all([others[name] for name in names], axis=0) if names else np.ones(len(points), dtype=bool)
            if clear.any():
                point = tuple(float(x) for x in points[int(np.argmax(clear))])
                waypoints[index] = waypoint.model_copy(update={"position": point})
                break
    if robot.cycle_waypoint is not None:
        waypoints[-1] = waypoints[-1].model_copy(update={"position": waypoints[robot.cycle_waypoint].position})
    return robot.model_copy(update={"waypoints": tuple(waypoints)})
