"""Another place for a visit: where a planned point lies in a region that is not meant, or where another robot hovers, a nearby
point of the visited region may not.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from refine.bodies import Ball, Disc, GrownRegion, blocking, grown_ellipsoid, keep_out
from refine.corridor.legs import CLEARANCE, bodies_of, leads_to
from refine.corridor.outside import left_last, moved_outside, part_outside
from refine.corridor.packing import packed
from refine.corridor.planned import DEEP
from refine.corridor.roadmap import way_around
from refine.obstacles import SolidBody
from verify.data import Infeasible, Mission, Plan, RobotPlan, Waypoint, Witness
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

_WAYS = 12
"""Places behind something solid to which a way around it is looked for."""
_WIDER = (0.25, 0.1, 0.0)
"""m beyond what robots keep that places to meet at lie apart, where there is so much room: others fly between."""
_How = Literal["middle", "apart", "packed"]
"""From the middle outwards, as far out as can be, or by trying."""
_HOW: tuple[_How, ...] = ("middle", "apart", "packed")
_FORBIDDEN = 1e9
"""m^2; more than any ways."""
_UNIT_BOX = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3)))
_UNIT_BALL = np.array([p for p in itertools.product(np.linspace(-1.0, 1.0, 13), repeat=3) if np.linalg.norm(p) <= 1.0])


def movable(mission: Mission, robot: RobotPlan, waypoint: Waypoint) -> bool:
    """Tell whether a point makes a visit that might as well be made elsewhere in its region.

    Args:
        mission: Gives the regions.
        robot: Its plan.
        waypoint: One of its waypoints.
    """
    visited = {visit.region for visit in robot.visits}
    return (
        waypoint.region in mission.regions
        and waypoint.visit is not None
        and waypoint.role != "start"
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
        (_moved(mission, name, robot, waypoint, ()) if movable(mission, robot, waypoint) else None) or waypoint
        for waypoint in robot.waypoints
    ]
    if robot.cycle_waypoint is not None:
        waypoints[-1] = waypoints[-1].model_copy(update={"position": waypoints[robot.cycle_waypoint].position})
    return robot.model_copy(update={"waypoints": tuple(waypoints)})


def moved_apart(plan: Plan, distance: float, z_scale: float) -> Plan:
    """Return the plan with points of visits moved that lie too near another robot's last hover.

    A robot that never leaves its start is there for every visit; one that ends its flight is there when another one ends its
    own. Robots that do not move have the first say, then flights whose last point may not be moved, then those that end just outside a
    region that they have left; the others follow in the plan's order, and where that leaves one without a place, those who end in
    its region take places beside each other. What cannot be moved stays.

    Args:
        plan: A finite one, or one robot's.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.

    Raises:
        Infeasible: More robots are to end in a region than it was found to have places for.
    """
    moved, stuck = _moved_apart(plan, distance, z_scale)
    for region in stuck:
        last = {
            name: len(robot.waypoints) - 1
            for name, robot in moved.robots.items()
            if robot.waypoints[-1].region == region and movable(plan.mission, robot, robot.waypoints[-1])
        }
        hovering = {name: [np.array(robot.waypoints[-1].position)] for name, robot in moved.robots.items() if robot.still}
        places = _own_places(moved, region, last, (distance, z_scale), how="packed", nearby=hovering)
        if places is None:
            _refuse_what_is_too_small(moved, region, last, (distance, z_scale))
            continue
        robots = {name: _ending_at(robot, places.get(name)) for name, robot in moved.robots.items()}
        moved = _moved_apart(moved.model_copy(update={"robots": robots}), distance, z_scale)[0]
    return moved


def _ending_at(robot: RobotPlan, place: tuple[float, ...] | None) -> RobotPlan:
    if place is None:
        return robot
    last = robot.waypoints[-1].model_copy(update={"position": place})
    return robot.model_copy(update={"waypoints": (*robot.waypoints[:-1], last)})


def _moved_apart(plan: Plan, distance: float, z_scale: float) -> tuple[Plan, list[str]]:
    """Return the plan with robots that follow moved, and the regions in which that left one at another's last hover."""
    mission, robots, stuck = plan.mission, dict(plan.robots), list[str]()
    still = [name for name, robot in robots.items() if robot.still]
    firm = [name for name, robot in robots.items() if not movable(mission, robot, robot.waypoints[-1])]
    ends: dict[str, Ball] = {}
    firm.sort(key=lambda name: left_last(mission, robots[name]) is not None)
    for name in dict.fromkeys((*still, *firm, *robots)):
        robot = robots[name]
        hovering = tuple(ends[other] for other in ends if other in still)
        waypoints = list(robot.waypoints)
        for index, waypoint in enumerate(waypoints):
            taken = tuple(ends.values()) if index == len(waypoints) - 1 else hovering
            meets = any(place.signed_distance(np.array(waypoint.position)) <= 0.0 for place in taken)
            if name not in still and meets and movable(mission, robot, waypoint):
                other = _moved(mission, name, robot, waypoint, taken)
                waypoints[index] = other or waypoint
                if other is None and index == len(waypoints) - 1 and waypoint.region is not None:
                    stuck.append(waypoint.region)
            elif meets and index == len(waypoints) - 1 and (left := left_last(mission, robot)) is not None:
                leg = waypoints[index - 1], waypoint
                waypoints[index] = moved_outside(mission, name, left, leg, tuple(ends.values())) or waypoint
        robots[name] = robot.model_copy(update={"waypoints": tuple(waypoints)})
        ends[name] = keep_out(name, np.array(waypoints[-1].position), distance, z_scale)
    return plan.model_copy(update={"robots": {name: robots[name] for name in plan.robots}}), stuck


def moved_to_meet(plan: Plan, distance: float, z_scale: float, *, nearest: bool = False) -> Plan:
    """Return the plan with each robot's visits of a region made at a place of its own, where the region has as many places.

    Robots take places from the region's middle outwards; where that leaves some without one, as far from each other as they can.

    Args:
        plan: Whose robots meet.
        distance: m that robots keep.
        z_scale: Distances in z count this many times.
        nearest: Whether robots then exchange these places so that the squares of their ways there are least in all: straight ways of
            robots that set out together then do not cross (Turpin et al. 2014).

    Raises:
        Infeasible: More robots are to end in a region than it was found to have places for.
    """
    mission = plan.mission
    moved = {name: list(robot.waypoints) for name, robot in plan.robots.items()}
    for region in mission.regions:
        visits = {
            name: [
                i
                for i, waypoint in enumerate(robot.waypoints)
                if waypoint.region == region and movable(mission, robot, waypoint)
            ]
            for name, robot in plan.robots.items()
        }
        guests = {name: found[0] for name, found in visits.items() if found}
        nearby = _visits_within(mission, region, moved)
        if not guests or len({*guests, *nearby}) < 2:
            continue
        for wider, how in itertools.product(_WIDER, _HOW):
            kept = distance + wider, z_scale
            places = _own_places(plan, region, guests, kept, how=how, nearby=nearby)
            if places is not None:
                places = _exchanged(plan, guests, places) if nearest else places
                for name, place in places.items():
                    for i in visits[name]:
                        moved[name][i] = moved[name][i].model_copy(update={"position": place})
                break
        else:
            _refuse_what_is_too_small(plan, region, guests, (distance, z_scale))
    for region in mission.regions if plan.precedences else ():  # robots may wait for each other just outside regions
        part_outside(plan, region, moved, (distance, z_scale))
    robots = {name: robot.model_copy(update={"waypoints": tuple(moved[name])}) for name, robot in plan.robots.items()}
    return plan.model_copy(update={"robots": robots})


def _visits_within(mission: Mission, region: str, waypoints: Mapping[str, list[Waypoint]]) -> dict[str, list[Floats]]:
    """Return for robots the points in a region at which they visit others: a room's in a house, a house's in a room."""
    body = mission.regions[region]
    return {
        name: found
        for name, points in waypoints.items()
        if (
            found := [
                np.array(point.position)
                for point in points
                if point.role == "centre" and point.region != region and body.level(np.array(point.position)) <= 1.0
            ]
        )
    }


def _refuse_what_is_too_small(plan: Plan, region: str, guests: Mapping[str, int], kept: tuple[float, float]) -> None:
    """Raise where robots that end in a region, and so are in it together, find no places there that lie far enough apart."""
    last = {name: index for name, index in guests.items() if plan.robots[name].waypoints[-1].region == region}
    if len(last) < 2 or any(_own_places(plan, region, last, kept, how=how) is not None for how in _HOW):
        return
    sentence = (
        f"'{region}' is too small: {len(last)} robots are to be in it together ({', '.join(last)}), and no {len(last)} places {kept[0]:.3f} m "
        "apart were found in it (separation, twice the margin, and room for hovering). Make the region larger, or ask for fewer robots."
    )
    raise Infeasible(sentence, Witness(claim="separation", sentence=sentence, region=region))


def _own_places(
    plan: Plan,
    region: str,
    guests: Mapping[str, int],
    kept: tuple[float, float],
    *,
    how: _How,
    nearby: Mapping[str, list[Floats]] | None = None,
) -> dict[str, tuple[float, ...]] | None:
    """Return a place in a region for each robot that visits it (by one of its waypoints there); None where they are too few.

    `nearby` are points in it at which robots visit other regions.
    """
    distance, z_scale = kept
    taken: list[Ball] = []
    found: dict[str, tuple[float, ...]] = {}
    middle = np.array(plan.mission.regions[region].center)

    def free(name: str) -> Floats:
        others = [keep_out(o, at, distance, z_scale) for o, points in (nearby or {}).items() if o != name for at in points]
        return _places(plan.mission, name, plan.robots[name], plan.robots[name].waypoints[guests[name]], (*taken, *others))

    if how == "packed":
        packing = packed(middle, [free(name) for name in guests], distance, z_scale)
        if packing is None:
            return None
        return {name: tuple(place.tolist()) for name, place in zip(guests, packing, strict=True)}
    for name in guests:
        places = free(name)
        if not len(places):
            return None
        away = np.linalg.norm(places - middle, axis=1)
        if how == "apart" and taken:  # next to those who are there already, and as far out as can be
            away = np.sum([place.signed_distance(places) for place in taken], axis=0)
        chosen = places[int(np.argmax(away) if how == "apart" and not taken else np.argmin(away))]
        found[name] = tuple(chosen.tolist())
        taken.append(keep_out(name, chosen, distance, z_scale))
    return found


def _exchanged(plan: Plan, guests: Mapping[str, int], places: Mapping[str, tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
    """Return the same places, given to robots so that their ways from the points before are short; each only one where it may be."""
    from scipy.optimize import linear_sum_assignment

    names, found = list(places), list(places.values())
    costs = np.zeros((len(names), len(names)))
    for row, name in enumerate(names):
        robot, index = plan.robots[name], guests[name]
        before = np.array(robot.waypoints[index - 1].position)
        for column, place in enumerate(found):
            waypoint = robot.waypoints[index].model_copy(update={"position": place})
            allowed = place == places[name] or np.any(
                np.all(_places(plan.mission, name, robot, waypoint, ()) == np.array(place), axis=1)
            )
            costs[row, column] = float(np.sum((np.array(place) - before) ** 2)) if allowed else _FORBIDDEN
    rows, columns = linear_sum_assignment(costs)
    return {names[row]: found[column] for row, column in zip(rows, columns, strict=True)}


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
        if movable(mission, robot, waypoint):
            points = _places(mission, name, robot, waypoint, taken)
            good = _places(mission, name, robot, waypoint, at_the_end) if index == len(robot.waypoints) - 1 else points
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


def _moved(mission: Mission, name: str, robot: RobotPlan, waypoint: Waypoint, taken: tuple[Ball, ...]) -> Waypoint | None:
    """Return a visit's point at the place of its region that is clear, not taken, and nearest to fly to; None where there is none."""
    places = _places(mission, name, robot, waypoint, taken)
    if not len(places):
        return None
    nearest = _nearest(mission, np.array(waypoint.position), places, _solids(mission, name))
    return waypoint.model_copy(update={"position": tuple(nearest.tolist())})


def _places(mission: Mission, name: str, robot: RobotPlan, waypoint: Waypoint, taken: tuple[Ball, ...]) -> Floats:
    """Return where a visit's point may lie: within the region less the margin and the workspace, and not taken.

    Only places that are clear of obstacles and of all other regions and rings, or where there are none, those clear of rings and of regions
    that are never visited. Shape (places, 3).
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
