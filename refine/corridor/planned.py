"""From one robot's plan to a corridor: points to go through, and for each leg between them what it must stay out of.

Straight legs from point to point keep every rule of a
corridor (detours are put in where the planner's own straight lines do not), so a curve that keeps them exists: at worst the
one that rests at each point.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.approach import through_approach_corridors
from refine.corridor.corridor import Corridor
from refine.corridor.legs import (
    CLEARANCE,
    PASSAGE,
    Leg,
    TimedWaypoint,
    leads_to,
    leg_between,
    passage_radius,
    refused,
    show,
    space_for,
    trimmed,
)
from refine.corridor.points import without_crowding
from refine.obstacles.keep_out_bodies import Ball, convex_parts, grown_ellipsoid
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Witness
from verify.data.shapes.region import Region

Floats = NDArray[np.float64]

SHORTEST = 0.1
"""Least nominal duration of a leg, s: the coefficients of much shorter ones drown in float32."""
_COINCIDENT = 1e-6
DEEP = 0.9
"""Share of a region less the margin in which a visit's point lies, so that the visit takes some time."""
_ACROSS = 0.03
"""m by which a passage's point may move along the hoop's axis."""


def corridor_of(
    mission: Mission, name: str, robot: RobotPlan, *, clearance: float = CLEARANCE, extra: tuple[Ball, ...] = ()
) -> Corridor:
    """Return the corridor of one robot of a plan.

    Args:
        mission: Gives regions, hoops, margin, vehicle radius and workspace.
        name: The robot's.
        robot: Its visits, waypoints and nominal times.
        clearance: m on top of the margin.
        extra: More bodies to stay out of on every leg, such as other robots that hover.

    Raises:
        BadInput: Waypoints and times do not fit each other, or a number is not finite.
        Infeasible: A waypoint lies where it must not be, a region or an opening is too small for the margin, or no detour
            was found around a region in the way.
    """
    stops, cycle = _leaving_out(mission, robot, *_timed_waypoints(mission, name, robot), extra)
    space = space_for(mission, name, clearance)
    for stop in stops:
        if np.any(stop.position < space.low - 1e-3) or np.any(stop.position > space.high + 1e-3):
            raise refused(
                "workspace",
                name,
                stop,
                f"{name}: waypoint {show(stop.position)} leaves the workspace less the margin {mission.margin:g} m.",
            )
    points, durations, legs, needed = [stops[0].position], [], [], [True]
    rooms: list[Ball | None] = [None]
    cycle_point = 0 if cycle == 0 else None
    for index, (here, there) in enumerate(itertools.pairwise(stops)):
        leg = leg_between(space, robot, here, there, extra)
        chain = [(here.position, leg), *through_approach_corridors(space, leg, here, there)]
        lengths = np.array([np.linalg.norm(q - p) for (p, _), (q, _) in itertools.pairwise(chain)])
        nominal = there.time - here.time
        if nominal <= 0.0:
            nominal = float(lengths.sum()) / mission.planner.speed
        straight = float(np.linalg.norm(there.position - here.position))
        inner = len(chain) - 2
        durations += list(nominal * lengths / max(straight, 1e-9) if inner else [nominal])
        points += [point for point, _ in chain[1:]]
        needed += [False] * inner + [_needed(mission, robot, there) or index == len(stops) - 2 or cycle == index + 1]
        rooms += [None] * inner + [visit_room(mission, name, robot, there, clearance)]
        legs += [part for _, part in chain[1:]]
        if cycle == index + 1:
            cycle_point = len(points) - 1
    if mission.agents[name].end is not None:
        rooms[-1] = None
    times = np.maximum(np.array(durations), SHORTEST)
    corridor = Corridor(
        name, np.array(points), times, tuple(legs), space.low, space.high, cycle_point, tuple(needed), tuple(rooms)
    )
    return without_crowding(corridor)


def hovering_corridor(mission: Mission, name: str, point: Floats, pieces: int, *, clearance: float = CLEARANCE) -> Corridor:
    """Return the corridor of a robot that hovers and may be asked to step aside and come back, keeping out of all regions.

    Args:
        mission: Gives regions, hoops, margin and workspace.
        name: The robot's.
        point: Where it hovers, m. Shape (3,).
        pieces: Legs that it may have.
        clearance: m on top of the margin.
    """
    space = space_for(mission, name, clearance)
    here = np.stack([point, point])
    solids = [trimmed(body, here, clearance) for body in space.bodies.solids]
    bodies = (*space.bodies.regions.values(), *space.bodies.rings.values(), *solids)
    outside = [part for body in bodies if body.signed_distance(point) > 0.0 for part in convex_parts(body)]
    needed = (True, *(False for _ in range(pieces - 1)), True)
    legs = (Leg(tuple(outside), None, None),) * pieces
    return Corridor(
        name,
        np.repeat(point[None], pieces + 1, axis=0),
        np.ones(pieces),
        legs,
        space.low,
        space.high,
        None,
        needed,
        (None,) * (pieces + 1),
    )


def _needed(mission: Mission, robot: RobotPlan, stop: TimedWaypoint) -> bool:
    """Return whether a stop makes a visit; a passage is made by its two outer points, the cylinder sees to the rest."""
    if stop.role in ("avoid", "via") and stop.visit is None:
        return False
    if stop.visit is None or stop.visit >= len(robot.visits):
        return stop.role in ("start", "end", "rear", "front")
    return not (_flies_through(mission, robot, stop.visit) and stop.role == "centre")


def _flies_through(mission: Mission, robot: RobotPlan, visit: int | None) -> bool:
    """Return whether a visit is a passage through a hoop."""
    if visit is None or visit >= len(robot.visits):
        return False
    return robot.visits[visit].direction is not None and robot.visits[visit].region in mission.hoops


def _timed_waypoints(mission: Mission, name: str, robot: RobotPlan) -> tuple[list[TimedWaypoint], int | None]:
    """Return the waypoints without coincident neighbours, visits moved deep enough into their regions."""
    if len(robot.times) != len(robot.waypoints):
        raise BadInput(f"{name}: {len(robot.times)} times for {len(robot.waypoints)} waypoints.")
    if any(later < earlier for earlier, later in itertools.pairwise(robot.times)):
        raise BadInput(f"{name}: nominal times go back.")
    stops: list[TimedWaypoint] = []
    cycle, end = None, mission.agents[name].end
    for index, (waypoint, time) in enumerate(zip(robot.waypoints, robot.times, strict=True)):
        position = np.array(waypoint.position, dtype=np.float64)
        region = None if waypoint.region is None else mission.all_regions.get(waypoint.region)
        if waypoint.role in ("centre", "end", "via", "start") and waypoint.visit is not None and region is not None:
            visited = robot.visits[waypoint.visit].region == waypoint.region
            if visited and waypoint.role != "start" and waypoint.position != end and not leads_to(mission, waypoint):
                position = _deep_enough(mission, name, waypoint.region or "", region, position)
        if waypoint.role == "via" and region is None and _flies_through(mission, robot, waypoint.visit):
            continue  # the planner's help on a straight line through an opening: there the cylinder leads the way
        stop = TimedWaypoint(position, float(time), waypoint.role, waypoint.region, waypoint.visit)
        if stops and np.linalg.norm(position - stops[-1].position) < _COINCIDENT:
            if stops[-1].visit is None:
                stops[-1] = replace(stops[-1], visit=stop.visit, region=stop.region, role=stop.role)
        else:
            stops.append(stop)
        if robot.cycle_waypoint == index:
            cycle = len(stops) - 1
    return stops, cycle


def _leaving_out(
    mission: Mission, robot: RobotPlan, stops: list[TimedWaypoint], cycle: int | None, extra: tuple[Ball, ...]
) -> tuple[list[TimedWaypoint], int | None]:
    """Leave out points that only lead the way and lie where another robot hovers: the detour leads around it."""
    kept = [
        index
        for index, stop in enumerate(stops)
        if index in (0, cycle, len(stops) - 1)
        or _needed(mission, robot, stop)
        or all(body.signed_distance(stop.position) > 0.0 for body in extra)
    ]
    return [stops[index] for index in kept], None if cycle is None else kept.index(cycle)


def visit_room(mission: Mission, name: str, robot: RobotPlan, stop: TimedWaypoint, clearance: float) -> Ball | None:
    """Return where the point of a visit may lie instead; None where it must not move.

    Args:
        mission: Gives regions, hoops, margin and vehicle.
        name: The robot's.
        robot: Its visits.
        stop: The point.
        clearance: m on top of the margin.
    """
    if stop.visit is None or stop.visit >= len(robot.visits) or stop.region is None:
        return None
    if stop.region != robot.visits[stop.visit].region:
        return None
    region, through = mission.all_regions[stop.region], robot.visits[stop.visit].direction is not None
    inner = DEEP * (1.0 - (mission.margin + CLEARANCE) / region.inner_radius)
    hoop = mission.hoops.get(stop.region)
    if hoop is None:
        if stop.role not in ("centre", "via") or inner <= 0.0:
            return None
        if not region.is_ellipsoid:
            return _ball_inside(mission, stop, region)
        whole = grown_ellipsoid(stop.region, region, 0.0)
        return replace(whole, root=whole.root / inner)
    if not through or stop.role not in PASSAGE:
        return None
    radius = DEEP * passage_radius(mission, name, hoop, clearance)
    if stop.role == "centre":
        radius = min(radius, inner * region.inner_radius)
    if radius <= 0.0:
        return None
    normal, centre = np.array(hoop.normal), np.array(hoop.center)
    along = np.outer(normal, normal)
    foot = centre + along @ (stop.position - centre)
    return Ball(stop.region, foot, (np.eye(3) - along) / radius + along / _ACROSS)


def _ball_inside(mission: Mission, stop: TimedWaypoint, region: Region) -> Ball | None:
    """Return a ball around a visit's point in which all of it is deep enough in a region of any shape; None where none is left."""
    deep = float(region.measures.depths((stop.position - np.array(region.center))[None])[0])
    radius = DEEP * (deep - mission.margin - CLEARANCE)
    return None if radius <= 0.0 else Ball(stop.region or "", stop.position, np.eye(3) / radius)


def _deep_enough(mission: Mission, name: str, region_name: str, region: Region, position: Floats) -> Floats:
    """Return the point, moved towards the region's centre until the margin around it lies inside."""
    scale = 1.0 - (mission.margin + CLEARANCE) / region.inner_radius
    if scale <= 0.0:
        raise Infeasible(
            f"'{region_name}' has a least radius of {region.inner_radius:g} m, and a visit needs more than {mission.margin + CLEARANCE:g} m: "
            f"the margin, {mission.margin:g} m, and {1000 * CLEARANCE:g} mm. Ask for a smaller `margin`, or make '{region_name}' wider.",
            Witness(claim="visits", sentence="region smaller than the margin", robot=name, region=region_name),
        )
    level = float(np.sqrt(region.level(position)))
    depth = DEEP * scale
    if level <= depth:
        return position
    centre = np.array(region.center)
    moved = centre + (position - centre) * depth / level
    return moved if region.is_ellipsoid or region.level(moved) <= (1 + 1e-9) * depth**2 else centre
