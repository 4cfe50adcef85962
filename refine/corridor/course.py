"""From one robot's plan to a course: points to go through, and for each leg between them what it must stay out of.

A course is data for `fitting`: it says nothing about polynomials. Straight legs from point to point keep every rule of a
course (detours are put in where the planner's own straight lines do not), so a curve that keeps them exists: at worst the
one that rests at each point.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refine.corridor.approach import through_bays
from refine.corridor.bodies import Ball, blocking, grown_region
from refine.corridor.legs import PAD, PASSAGE, Leg, Stop, bodies_of, leads_to, leg_between, passage_radius, refused, show
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Witness
from verify.data.mission import Region
from verify.data.rules.spacing import ROUNDING

Floats = NDArray[np.float64]

SHORTEST = 0.1
"""Least nominal duration of a leg, s: the coefficients of much shorter ones drown in float32."""
_CROWDED = 0.04
"""m from a neighbour at which a point that is not needed is left out."""
_COINCIDENT = 1e-6
_PARTS = 64
"""Parts of a leg whose ends are looked at for a place to wait."""
DEEP = 0.9
"""Share of a region less the margin in which a visit's point lies, so that the visit takes some time."""
_ACROSS = 0.03
"""m by which a passage's point may move along the hoop's axis."""


@dataclass(frozen=True, eq=False)
class Course:
    """Points in order and the rules of the legs between them.

    Attributes:
        robot: Name, for messages.
        points: m. Shape (points, 3).
        durations: Nominal, s. Shape (points - 1,).
        legs: One entry a leg.
        low: Lower corner of the space to stay in, m. Shape (3,).
        high: Upper corner.
        cycle: Index of the point at which the cycle begins; the last point repeats it. None for a finite flight.
        needed: Whether a point must be gone through; others only lead around something. Shape (points,).
        rooms: Where a visit's point may lie instead, in flights that look for it: the visited region less the margin, or for
            a passage a disc across the hoop's axis, within its opening less margin and radius. None for a fixed point.
    """

    robot: str
    points: Floats
    durations: Floats
    legs: tuple[Leg, ...]
    low: Floats
    high: Floats
    cycle: int | None
    needed: tuple[bool, ...]
    rooms: tuple[Ball | None, ...]

    def __len__(self) -> int:
        return len(self.legs)


def course_of(mission: Mission, name: str, robot: RobotPlan, *, pad: float = PAD, extra: tuple[Ball, ...] = ()) -> Course:
    """Return the course of one robot of a plan.

    Args:
        mission: Gives regions, hoops, margin, vehicle radius and workspace.
        name: The robot's.
        robot: Its visits, waypoints and nominal times.
        pad: m on top of the margin.
        extra: More bodies to stay out of on every leg, such as other robots that hover.

    Raises:
        BadInput: Waypoints and times do not fit each other, or a number is not finite.
        Infeasible: A waypoint lies where it must not be, a region or an opening is too small for the margin, or no detour
            was found around a region in the way.
    """
    stops, cycle = _leaving_out(mission, robot, *_stops(mission, name, robot), extra)
    low, high = (np.array(corner) for corner in (mission.workspace.min, mission.workspace.max))
    low, high = low + mission.margin + min(pad, ROUNDING), high - mission.margin - min(pad, ROUNDING)
    for stop in stops:
        if np.any(stop.position < low - 1e-3) or np.any(stop.position > high + 1e-3):
            raise refused(
                "workspace",
                name,
                stop,
                f"{name}: waypoint {show(stop.position)} leaves the workspace less the margin {mission.margin:g} m.",
            )
    bodies = bodies_of(mission, pad)
    points, durations, legs, needed = [stops[0].position], [], [], [True]
    rooms: list[Ball | None] = [None]
    cycle_point = 0 if cycle == 0 else None
    for index, (here, there) in enumerate(itertools.pairwise(stops)):
        leg = leg_between(mission, name, robot, bodies, here, there, extra, pad)
        chain = [(here.position, leg), *through_bays(mission, name, bodies, leg, here, there, low, high, pad)]
        lengths = np.array([np.linalg.norm(q - p) for (p, _), (q, _) in itertools.pairwise(chain)])
        nominal = there.time - here.time
        if nominal <= 0.0:
            nominal = float(lengths.sum()) / mission.planner.speed
        straight = float(np.linalg.norm(there.position - here.position))
        inner = len(chain) - 2
        durations += list(nominal * lengths / max(straight, 1e-9) if inner else [nominal])
        points += [point for point, _ in chain[1:]]
        needed += [False] * inner + [_needed(mission, robot, there) or index == len(stops) - 2 or cycle == index + 1]
        rooms += [None] * inner + [_room(mission, robot, there, pad)]
        legs += [part for _, part in chain[1:]]
        if cycle == index + 1:
            cycle_point = len(points) - 1
    times = np.maximum(np.array(durations), SHORTEST)
    course = Course(name, np.array(points), times, tuple(legs), low, high, cycle_point, tuple(needed), tuple(rooms))
    return _without_crowding(course)


def standing_course(mission: Mission, name: str, point: Floats, pieces: int, *, pad: float = PAD) -> Course:
    """Return the course of a robot that hovers and may be asked to step aside and come back, keeping out of all regions."""
    bodies = bodies_of(mission, pad)
    outside = [body for body in (*bodies.regions.values(), *bodies.rings.values()) if body.clearance(point) > 0.0]
    low, high = (np.array(corner) for corner in (mission.workspace.min, mission.workspace.max))
    shrink = mission.margin + min(pad, ROUNDING)
    needed = (True, *(False for _ in range(pieces - 1)), True)
    legs = (Leg(tuple(outside), None, None),) * pieces
    return Course(
        name,
        np.repeat(point[None], pieces + 1, axis=0),
        np.ones(pieces),
        legs,
        low + shrink,
        high - shrink,
        None,
        needed,
        (None,) * (pieces + 1),
    )


def with_stops(course: Course, mission: Mission, visits: frozenset[int]) -> tuple[Course, dict[int, int]]:
    """Return the course with a point at which to wait for each of these visits, and which point that is.

    It is where the robot sets out for the visit, or where that lies in a region, the first place on the way that does not:
    others may have to wait until it has left.
    """
    bodies = bodies_of(mission, PAD)
    outside = (*bodies.regions.values(), *bodies.rings.values())
    first = {visit: next((i for i, leg in enumerate(course.legs) if leg.visit == visit), 0) for visit in visits}
    stops: dict[int, int] = {}
    for visit in sorted(visits, key=lambda each: (-first[each], each)):
        node = first[visit]
        shares = np.linspace(0.0, 1.0, _PARTS + 1)[:-1]
        places = course.points[node] + shares[:, None] * (course.points[node + 1] - course.points[node])
        clear = np.all([body.clearance(places) > 0.0 for body in outside], axis=0) if outside else np.ones(_PARTS, dtype=bool)
        share = float(shares[int(np.argmax(clear))]) if clear.any() and course.legs[node].tube is None else 0.0
        if share > 0.0:
            course = _cut(course, node, share)
            stops = {other: place + 1 for other, place in stops.items()}
        stops[visit] = node + (share > 0.0)
    return course, stops


def _cut(course: Course, leg: int, share: float) -> Course:
    """Return the course with one more point on a leg."""
    a, b, duration = course.points[leg], course.points[leg + 1], course.durations[leg]
    return replace(
        course,
        points=np.insert(course.points, leg + 1, a + share * (b - a), axis=0),
        durations=np.concatenate(
            [course.durations[:leg], [share * duration, (1.0 - share) * duration], course.durations[leg + 1 :]]
        ),
        legs=(*course.legs[: leg + 1], *course.legs[leg:]),
        needed=(*course.needed[: leg + 1], True, *course.needed[leg + 1 :]),
        rooms=(*course.rooms[: leg + 1], None, *course.rooms[leg + 1 :]),
        cycle=None if course.cycle is None else course.cycle + (course.cycle > leg),
    )


def thinned(course: Course, pieces: int, laps: int = 1) -> Course:
    """Return the course with points left out, where straight legs allow it, until at most so many legs are flown.

    A leg of the cycle is flown `laps` times and counts as many. The points that lose least length for each leg saved go
    first. What cannot be left out stays, so the result may be longer.
    """

    def repeats(node: int) -> int:
        return laps if course.cycle is not None and node > course.cycle else 1

    while sum(repeats(node) for node in range(1, len(course) + 1)) > pieces:
        options = [
            (_detour_length(course, node) / repeats(node), node)
            for node in range(1, len(course))
            if not course.needed[node] and node != course.cycle
        ]
        shorter = next((merged for _, node in sorted(options) if (merged := _without(course, node)) is not None), None)
        if shorter is None:
            return course
        course = shorter
    return course


def _without_crowding(course: Course) -> Course:
    """Leave out points that are hardly apart from a neighbour: very short pieces lose their precision in float32."""
    node = 1
    while node < len(course):
        near = min(np.linalg.norm(course.points[node] - course.points[node + side]) for side in (-1, 1)) < _CROWDED
        merged = _without(course, node) if near and not course.needed[node] else None
        course, node = (course, node + 1) if merged is None else (merged, node)
    return course


def _detour_length(course: Course, node: int) -> float:
    a, b, c = course.points[node - 1 : node + 2]
    return float(np.linalg.norm(b - a) + np.linalg.norm(c - b) - np.linalg.norm(c - a))


def _without(course: Course, node: int) -> Course | None:
    """Return the course without one point, or None where the straight leg past it would break a rule."""
    before, after = course.legs[node - 1], course.legs[node]
    if (before.tube is None) != (after.tube is None):
        return None
    obstacles = (*before.obstacles, *(body for body in after.obstacles if all(body is not other for other in before.obstacles)))
    if blocking(course.points[node - 1], course.points[node + 1], obstacles) is not None:
        return None
    bays = tuple(tube for tube in before.bays if any(np.array_equal(tube.centre, other.centre) for other in after.bays))
    leg = Leg(obstacles, before.tube, before.visit if before.visit == after.visit else after.visit, bays)
    cycle = course.cycle
    return replace(
        course,
        points=np.delete(course.points, node, axis=0),
        durations=np.concatenate(
            [course.durations[: node - 1], [course.durations[node - 1] + course.durations[node]], course.durations[node + 1 :]]
        ),
        legs=(*course.legs[: node - 1], leg, *course.legs[node + 1 :]),
        cycle=None if cycle is None else cycle - (cycle > node),
        needed=(*course.needed[:node], *course.needed[node + 1 :]),
        rooms=(*course.rooms[:node], *course.rooms[node + 1 :]),
    )


def _needed(mission: Mission, robot: RobotPlan, stop: Stop) -> bool:
    """Tell whether a stop makes a visit; a passage is made by its two outer points, the tube sees to the rest."""
    if stop.role in ("avoid", "via") and stop.visit is None:
        return False
    if stop.visit is None or stop.visit >= len(robot.visits):
        return stop.role in ("start", "end", "rear", "front")
    return not (_flies_through(mission, robot, stop.visit) and stop.role == "centre")


def _flies_through(mission: Mission, robot: RobotPlan, visit: int | None) -> bool:
    """Tell whether a visit is a passage through a hoop."""
    if visit is None or visit >= len(robot.visits):
        return False
    return robot.visits[visit].direction is not None and robot.visits[visit].region in mission.hoops


def _stops(mission: Mission, name: str, robot: RobotPlan) -> tuple[list[Stop], int | None]:
    """Return the waypoints without coincident neighbours, visits moved deep enough into their regions."""
    if len(robot.times) != len(robot.waypoints):
        raise BadInput(f"{name}: {len(robot.times)} times for {len(robot.waypoints)} waypoints.")
    if any(later < earlier for earlier, later in itertools.pairwise(robot.times)):
        raise BadInput(f"{name}: nominal times go back.")
    stops: list[Stop] = []
    cycle = None
    for index, (waypoint, time) in enumerate(zip(robot.waypoints, robot.times, strict=True)):
        position = np.array(waypoint.position, dtype=np.float64)
        region = None if waypoint.region is None else mission.all_regions.get(waypoint.region)
        if waypoint.role in ("centre", "end", "via", "start") and waypoint.visit is not None and region is not None:
            visited = robot.visits[waypoint.visit].region == waypoint.region
            if visited and waypoint.role != "start" and not leads_to(mission, waypoint):
                position = _deep_enough(mission, name, waypoint.region or "", region, position)
        if waypoint.role == "via" and region is None and _flies_through(mission, robot, waypoint.visit):
            continue  # the planner's help on a straight line through an opening: there the tube leads the way
        stop = Stop(position, float(time), waypoint.role, waypoint.region, waypoint.visit)
        if stops and np.linalg.norm(position - stops[-1].position) < _COINCIDENT:
            if stops[-1].visit is None:
                stops[-1] = replace(stops[-1], visit=stop.visit, region=stop.region, role=stop.role)
        else:
            stops.append(stop)
        if robot.cycle_waypoint == index:
            cycle = len(stops) - 1
    return stops, cycle


def _leaving_out(
    mission: Mission, robot: RobotPlan, stops: list[Stop], cycle: int | None, extra: tuple[Ball, ...]
) -> tuple[list[Stop], int | None]:
    """Leave out points that only lead the way and lie where another robot hovers: the detour leads around it."""
    kept = [
        index
        for index, stop in enumerate(stops)
        if index in (0, cycle, len(stops) - 1)
        or _needed(mission, robot, stop)
        or all(body.clearance(stop.position) > 0.0 for body in extra)
    ]
    return [stops[index] for index in kept], None if cycle is None else kept.index(cycle)


def _room(mission: Mission, robot: RobotPlan, stop: Stop, pad: float) -> Ball | None:
    """Return where the point of a visit may lie instead; None where it must not move."""
    if stop.visit is None or stop.visit >= len(robot.visits) or stop.region is None:
        return None
    if stop.region != robot.visits[stop.visit].region:
        return None
    region, through = mission.all_regions[stop.region], robot.visits[stop.visit].direction is not None
    inner = DEEP * (1.0 - (mission.margin + PAD) / min(region.radii))
    hoop = mission.hoops.get(stop.region)
    if hoop is None:
        if stop.role not in ("centre", "via") or inner <= 0.0:
            return None
        whole = grown_region(stop.region, region, 0.0)
        return replace(whole, root=whole.root / inner)
    if not through or stop.role not in PASSAGE:
        return None
    radius = DEEP * passage_radius(mission, hoop, pad)
    if stop.role == "centre":
        radius = min(radius, inner * min(region.radii))
    if radius <= 0.0:
        return None
    normal, centre = np.array(hoop.normal), np.array(hoop.center)
    along = np.outer(normal, normal)
    foot = centre + along @ (stop.position - centre)
    return Ball(stop.region, foot, (np.eye(3) - along) / radius + along / _ACROSS)


def _deep_enough(mission: Mission, name: str, region_name: str, region: Region, position: Floats) -> Floats:
    """Return the point, moved towards the region's centre until the margin around it lies inside."""
    scale = 1.0 - (mission.margin + PAD) / min(region.radii)
    if scale <= 0.0:
        raise Infeasible(
            f"'{region_name}' has a least radius of {min(region.radii):g} m: no point of it is {mission.margin:g} m inside. "
            "Ask for a smaller margin or a larger region.",
            Witness(claim="visits", sentence="region smaller than the margin", robot=name, region=region_name),
        )
    level = float(np.sqrt(region.level(position)))
    depth = DEEP * scale
    if level <= depth:
        return position
    centre = np.array(region.center)
    return centre + (position - centre) * depth / level
