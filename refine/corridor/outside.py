"""Places just outside regions, where robots hover that have left them: apart from each other, and from whom else is there."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from refine.corridor.legs import CLEARANCE, bodies_of
from refine.obstacles.keep_out_bodies import Ball, keep_out
from verify.data import Mission, Plan, RobotPlan, Waypoint
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

_AROUND = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
"""Ways out of a region."""
_FURTHER = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8)
"""m beyond the distance at which a leg ends outside: a robot that hovers beside a small region is in the way of who comes into it."""
_HALVINGS = 40
ASIDE = 0.15
"""m beyond what robots keep from others' straight ways, which smooth ones leave."""
_IN_THE_WAY = 10.0
"""m that a place may lie farther for each m that it lies farther from others' ways."""
_ON_A_LEG = 8
"""Places on a leg that are kept clear of obstacles."""
_STEP = 0.1
"""m between places on a leg that are kept clear."""


def left_last(mission: Mission, robot: RobotPlan) -> str | None:
    """Return the region just outside of which a robot ends its flight, which it has left for that; None where it ends elsewhere.

    Args:
        mission: Gives the regions.
        robot: Its plan.
    """
    after = [*itertools.takewhile(lambda waypoint: waypoint.role == "via", reversed(robot.waypoints))]
    if not after or len(after) == len(robot.waypoints):
        return None
    visited = robot.waypoints[-len(after) - 1]
    left = visited.role == "centre" and all(waypoint.region in (visited.region, None) for waypoint in after)
    return visited.region if left and visited.region in mission.regions else None


def comes_after(plan: Plan, name: str, visit: int) -> frozenset[tuple[str, int]]:
    """Return the visits that other robots enter only when a robot has left one of its own, or later.

    Args:
        plan: Its precedences.
        name: The robot.
        visit: Which of its visits.
    """
    found, new = set[tuple[str, int]](), [(name, visit)]
    while new:
        at = new.pop()
        then = [wait.then for wait in plan.precedences if wait.first == at and (wait.done, wait.due) == ("left", "enters")]
        onwards = [(at[0], at[1] + 1)] if at[1] + 1 < len(plan.robots[at[0]].visits) else []
        more = [each for each in (*then, *onwards) if each not in found]
        found.update(more)
        new += more
    return frozenset(each for each in found if each[0] != name)


def moved_outside(
    mission: Mission, name: str, region: str, leg: tuple[Waypoint, Waypoint], taken: Sequence[Ball], flown: Sequence[Ball] = ()
) -> Waypoint | None:
    """Return the last point of a leg out of a region as far outside in another direction, or further, not taken and near; None where there is none.

    Places near the ways of others are taken only where there are no more.

    Args:
        mission: Gives regions, rings, obstacles, margin and workspace.
        name: The robot's.
        region: The region that is left.
        leg: Its last point inside, and the one outside.
        taken: Where others hover.
        flown: Where others fly.
    """
    before, point = (np.array(each.position) for each in leg)
    body, middle = mission.regions[region], np.array(mission.regions[region].center)
    ways = np.concatenate([[point - middle, before - middle], _AROUND])
    far = np.linalg.norm(ways, axis=1)
    ways = ways[far > 0.0] * (body.outer_radius / far[far > 0.0, None])
    edges = _at_level(body, float(body.level(point)), ways)
    lengths = np.linalg.norm(edges, axis=1)
    places = middle + np.concatenate([edges * (1.0 + further / lengths)[:, None] for further in _FURTHER])
    bodies, grow = bodies_of(mission, name, CLEARANCE), mission.margin + CLEARANCE
    low, high = np.array(mission.workspace.min) + grow, np.array(mission.workspace.max) - grow
    free = np.all((places >= low) & (places <= high), axis=1)
    solid = [other for which, other in bodies.regions.items() if which != region]
    for each in (*taken, *solid, *bodies.rings.values(), *bodies.solids):
        free &= each.signed_distance(places) > 0.0
    legs = before + np.linspace(0.0, 1.0, _ON_A_LEG)[:, None, None] * (places - before)
    for each in bodies.solids:
        free &= each.signed_distance(legs.reshape(-1, 3)).reshape(_ON_A_LEG, -1).min(axis=0) > 0.0
    if not free.any():
        return None
    nearest = np.where(free, np.linalg.norm(places - before, axis=1), np.inf)
    if flown:
        room = np.min([each.signed_distance(places) for each in flown], axis=0)
        nearest += _IN_THE_WAY * np.maximum(ASIDE - room, 0.0)
    nearest = np.argmin(nearest)
    return leg[1].model_copy(update={"position": tuple(places[int(nearest)].tolist())})


def _at_level(body: Region, level: float, ways: Floats) -> Floats:
    """Return the points, relative to a region's centre, along some ways that lie as far outside as a level says. Shape (n, 3)."""
    middle = np.array(body.center)
    scales = np.sqrt(level / body.level(middle + ways))  # of a body whose level grows as a square: an ellipsoid
    if not np.allclose(body.level(middle + ways * scales[:, None]), level, rtol=1e-9):
        low, high = np.zeros(len(ways)), 4.0 * scales + body.outer_radius / np.linalg.norm(ways, axis=1)
        for _ in range(_HALVINGS):
            scales = (low + high) / 2.0
            inside = body.level(middle + ways * scales[:, None]) < level
            low, high = np.where(inside, scales, low), np.where(inside, high, scales)
        scales = high
    return ways * scales[:, None]


def flown_over(robot: RobotPlan, kept: tuple[float, float], near: tuple[Floats, float]) -> list[Ball]:
    """Return what to keep clear of a robot's straight legs near a place.

    Args:
        robot: Its plan.
        kept: m that robots keep, and how many times distances in z count.
        near: A place, m, shape (3,), and how far from it, m.
    """
    (distance, z_scale), (middle, reach) = kept, near
    points = [np.array(waypoint.position) for waypoint in robot.waypoints]
    lines = [
        a + np.linspace(0.0, 1.0, int(np.linalg.norm(b - a) / _STEP) + 2)[:, None] * (b - a)
        for a, b in itertools.pairwise(points)
    ]
    places = np.concatenate(lines) if lines else np.array(points)
    return [keep_out("", at, distance, z_scale) for at in places[np.linalg.norm(places - middle, axis=1) <= reach + distance]]


def part_outside(plan: Plan, region: str, moved: Mapping[str, list[Waypoint]], kept: tuple[float, float]) -> None:
    """Move the points just outside a region, to which robots leave it before they come back, apart from each other and from who is in it.

    Args:
        plan: Whose robots wait there.
        region: Which region.
        moved: Each robot's waypoints, which are changed.
        kept: m that robots keep, and how many times distances in z count.
    """
    mission, (distance, z_scale) = plan.mission, kept
    inside = {
        name: [np.array(w.position) for w in points if w.region == region and w.role == "centre"]
        for name, points in moved.items()
    }
    outside: dict[str, list[Floats]] = {name: [] for name in moved}
    for name, points in moved.items():
        for index, point in enumerate(points):
            around = points[index - 1 : index + 2]
            if point.role != "via" or [w.region for w in around] != [region] * 3 or around[0].role != "centre":
                continue
            others = [at for each in (inside, outside) for other, found in each.items() if other != name for at in found]
            taken = [keep_out(name, at, distance, z_scale) for at in others]
            points[index] = moved_outside(mission, name, region, (around[0], point), taken) or point
            outside[name].append(np.array(points[index].position))
