"""From one robot's plan to a course: points to go through, and for each leg between them what it must stay out of.

A course is data for `corridor`: it says nothing about polynomials. Straight legs from point to point keep every rule of a
course (detours are put in where the planner's own straight lines do not), so a curve that keeps them exists: at worst the
one that rests at each point.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refine.obstacles import Ball, Disc, Obstacle, grown_region, ring
from refine.roadmap import way_around
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Witness
from verify.data.mission import Hoop, Region
from verify.data.plan import Role

Floats = NDArray[np.float64]

PAD = 1e-3
"""m kept on top of the margin, so that rounding and engine tolerances cannot use the margin up."""
SHORTEST = 0.1
"""Least nominal duration of a leg, s: the coefficients of much shorter ones drown in float32."""
_CROWDED = 0.04
"""m from a neighbour at which a point that is not needed is left out."""
_COINCIDENT = 1e-6
DEEP = 0.9
"""Share of a region less the margin in which a visit's point lies, so that the visit takes some time."""
_ACROSS = 0.03
"""m by which a passage's point may move along the hoop's axis."""
_PASSAGE: tuple[Role, ...] = ("rear", "centre", "front")  # along the normal


@dataclass(frozen=True, eq=False)
class Tube:
    """The cylinder that a passage stays in: within `radius` of the axis through `centre` along `normal`."""

    centre: Floats
    normal: Floats
    radius: float


@dataclass(frozen=True, eq=False)
class Leg:
    """What one leg must keep.

    Attributes:
        obstacles: Bodies to stay out of.
        tube: Cylinder to stay in, during a passage.
        visit: The visit that is being approached or made; None after the last one and between points that belong to no visit.
    """

    obstacles: tuple[Obstacle, ...]
    tube: Tube | None
    visit: int | None


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


@dataclass(frozen=True)
class _Stop:
    position: Floats
    time: float
    role: Role
    region: str | None
    visit: int | None


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
    low, high = low + mission.margin + min(pad, 1e-4), high - mission.margin - min(pad, 1e-4)
    for stop in stops:
        if np.any(stop.position < low - 1e-3) or np.any(stop.position > high + 1e-3):
            raise _infeasible(
                "workspace",
                name,
                stop,
                f"{name}: waypoint {_show(stop.position)} leaves the workspace less the margin {mission.margin:g} m.",
            )
    bodies = _bodies(mission, pad)
    points, durations, legs, needed = [stops[0].position], [], [], [True]
    rooms: list[Ball | None] = [None]
    cycle_point = 0 if cycle == 0 else None
    for index, (here, there) in enumerate(itertools.pairwise(stops)):
        leg = _leg(mission, name, robot, bodies, here, there, extra, pad)
        inner = [] if leg.tube is not None else _detour(name, here, there, leg.obstacles, low, high)
        chain = [here.position, *inner, there.position]
        lengths = np.array([np.linalg.norm(q - p) for p, q in itertools.pairwise(chain)])
        nominal = there.time - here.time
        if nominal <= 0.0:
            nominal = float(lengths.sum()) / mission.planner.speed
        straight = float(np.linalg.norm(there.position - here.position))
        durations += list(nominal * lengths / max(straight, 1e-9) if inner else [nominal])
        points += chain[1:]
        needed += [False] * len(inner) + [_needed(mission, robot, there) or index == len(stops) - 2 or cycle == index + 1]
        rooms += [None] * len(inner) + [_room(mission, robot, there, pad)]
        legs += [leg] * len(lengths)
        if cycle == index + 1:
            cycle_point = len(points) - 1
    times = np.maximum(np.array(durations), SHORTEST)
    course = Course(name, np.array(points), times, tuple(legs), low, high, cycle_point, tuple(needed), tuple(rooms))
    return _without_crowding(course)


def standing_course(mission: Mission, name: str, point: Floats, pieces: int, *, pad: float = PAD) -> Course:
    """Return the course of a robot that hovers and may be asked to step aside and come back, keeping out of all regions."""
    bodies = _bodies(mission, pad)
    outside = [body for body in (*bodies.regions.values(), *bodies.rings.values()) if body.clearance(point) > 0.0]
    low, high = (np.array(corner) for corner in (mission.workspace.min, mission.workspace.max))
    shrink = mission.margin + min(pad, 1e-4)
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
    if _blocking(course.points[node - 1], course.points[node + 1], obstacles) is not None:
        return None
    leg = Leg(obstacles, before.tube, before.visit if before.visit == after.visit else after.visit)
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


def _needed(mission: Mission, robot: RobotPlan, stop: _Stop) -> bool:
    """Tell whether a stop makes a visit; a passage is made by its two outer points, the tube sees to the rest."""
    if stop.role in ("avoid", "via") and stop.visit is None:
        return False
    if stop.visit is None or stop.visit >= len(robot.visits):
        return stop.role in ("start", "end", "rear", "front")
    through = robot.visits[stop.visit].direction is not None and robot.visits[stop.visit].region in mission.hoops
    return not (through and stop.role == "centre")


def _stops(mission: Mission, name: str, robot: RobotPlan) -> tuple[list[_Stop], int | None]:
    """Return the waypoints without coincident neighbours, visits moved deep enough into their regions."""
    if len(robot.times) != len(robot.waypoints):
        raise BadInput(f"{name}: {len(robot.times)} times for {len(robot.waypoints)} waypoints.")
    if any(later < earlier for earlier, later in itertools.pairwise(robot.times)):
        raise BadInput(f"{name}: nominal times go back.")
    stops: list[_Stop] = []
    cycle = None
    for index, (waypoint, time) in enumerate(zip(robot.waypoints, robot.times, strict=True)):
        position = np.array(waypoint.position, dtype=np.float64)
        region = None if waypoint.region is None else mission.all_regions.get(waypoint.region)
        if waypoint.role in ("centre", "end", "via", "start") and waypoint.visit is not None and region is not None:
            visited = robot.visits[waypoint.visit].region == waypoint.region
            if visited and waypoint.role != "start":
                position = _deep_enough(mission, name, waypoint.region or "", region, position)
        stop = _Stop(position, float(time), waypoint.role, waypoint.region, waypoint.visit)
        if stops and np.linalg.norm(position - stops[-1].position) < _COINCIDENT:
            if stops[-1].visit is None:
                stops[-1] = replace(stops[-1], visit=stop.visit, region=stop.region, role=stop.role)
        else:
            stops.append(stop)
        if robot.cycle_waypoint == index:
            cycle = len(stops) - 1
    return stops, cycle


def _leaving_out(
    mission: Mission, robot: RobotPlan, stops: list[_Stop], cycle: int | None, extra: tuple[Ball, ...]
) -> tuple[list[_Stop], int | None]:
    """Leave out points that only lead the way and lie where another robot hovers: the detour leads around it."""
    kept = [
        index
        for index, stop in enumerate(stops)
        if index in (0, cycle, len(stops) - 1)
        or _needed(mission, robot, stop)
        or all(body.clearance(stop.position) > 0.0 for body in extra)
    ]
    return [stops[index] for index in kept], None if cycle is None else kept.index(cycle)


def _room(mission: Mission, robot: RobotPlan, stop: _Stop, pad: float) -> Ball | None:
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
    if not through or stop.role not in _PASSAGE:
        return None
    radius = DEEP * (hoop.opening - mission.margin - mission.vehicle.radius - pad)
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


@dataclass(frozen=True)
class _Bodies:
    regions: dict[str, Ball]
    rings: dict[str, Disc]


def _bodies(mission: Mission, pad: float) -> _Bodies:
    grow = mission.margin + pad
    return _Bodies(
        {name: grown_region(name, region, grow) for name, region in mission.all_regions.items()},
        {name: ring(name, hoop, grow + mission.vehicle.radius) for name, hoop in mission.hoops.items()},
    )


def _leg(
    mission: Mission,
    name: str,
    robot: RobotPlan,
    bodies: _Bodies,
    here: _Stop,
    there: _Stop,
    extra: tuple[Ball, ...],
    pad: float,
) -> Leg:
    """Return the rules of the leg from one stop to the next."""
    visit = there.visit if there.visit is not None else here.visit
    passing = _passing(mission, robot, here, there)
    ends = np.stack([here.position, there.position])
    visited = {robot.visits[v].region for v in (here.visit, there.visit) if v is not None and v < len(robot.visits)}
    everywhere = {visit.region for visit in robot.visits}  # regions may overlap: which of them come when, the stays tell
    obstacles: list[Obstacle] = []
    for region, body in bodies.regions.items():
        inside = body.clearance(ends) <= 0.0
        planned = inside[0] <= (region in everywhere or here.role == "start") and inside[1] <= (region in everywhere)
        if region == passing or (inside.any() and planned):
            continue
        if inside.any():
            stop = there if inside[1] else here
            raise _infeasible(
                "visits",
                name,
                stop,
                f"{name}: waypoint {_show(stop.position)} lies within the margin of '{region}', which is not visited there.",
            )
        obstacles.append(body)
    for hoop, disc in bodies.rings.items():
        if hoop == passing or (hoop in visited and np.any(disc.clearance(ends) <= 0.0)):
            continue
        near = float(disc.clearance(ends[0]))
        if here.role == "start" and near <= 0.0:  # in front of an opening, where only the rim is as far as it must be
            disc = replace(disc, growth=disc.growth + near - PAD)
        obstacles.append(disc)
    obstacles += [body for body in extra if np.all(body.clearance(ends) > 0.0)]
    tube = None if passing is None else _tube(mission, name, passing, pad)
    return Leg(tuple(obstacles), tube, visit)


def _passing(mission: Mission, robot: RobotPlan, here: _Stop, there: _Stop) -> str | None:
    """Return the hoop that a leg flies through, if any."""
    if here.visit is None or here.visit != there.visit or here.role not in _PASSAGE or there.role not in _PASSAGE:
        return None
    visit = robot.visits[here.visit]
    onward = _PASSAGE.index(there.role) - _PASSAGE.index(here.role)  # a lap's last leg leads back to the same hoop
    if visit.direction is None or visit.region not in mission.hoops or (onward > 0) != (visit.direction == "F"):
        return None
    return visit.region


def _tube(mission: Mission, name: str, hoop_name: str, pad: float) -> Tube:
    hoop: Hoop = mission.hoops[hoop_name]
    radius = hoop.opening - mission.margin - mission.vehicle.radius - pad
    if radius <= 0.0:
        raise Infeasible(
            f"'{hoop_name}' has an opening of {hoop.opening:g} m; vehicle radius {mission.vehicle.radius:g} m and margin "
            f"{mission.margin:g} m leave no room in it.",
            Witness(claim="passages", sentence="opening too small", robot=name, region=hoop_name),
        )
    return Tube(np.array(hoop.center), np.array(hoop.normal), radius)


_DEPTH = 3
_ANGLES = np.arange(16) * (np.pi / 8)
_BESIDE = 0.05
"""m by which a detour passes clear of what it goes around."""


def _detour(name: str, here: _Stop, there: _Stop, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats) -> list[Floats]:
    """Return points to put between two stops so that straight lines meet no obstacle."""
    blocked = _blocking(here.position, there.position, obstacles)
    if blocked is None:
        return []
    found = _around(here.position, there.position, obstacles, low, high, _DEPTH)
    if found is None:
        found = way_around(here.position, there.position, obstacles, low, high)
    if found is None:
        raise _infeasible(
            "visits",
            name,
            there,
            f"{name}: '{blocked.name}' is in the way from {_show(here.position)} to {_show(there.position)}, and no way around was found.",
        )
    return found


def _blocking(a: Floats, b: Floats, obstacles: tuple[Obstacle, ...]) -> Obstacle | None:
    return next((body for body in obstacles if body.plane(a, b) is None), None)


def _around(
    a: Floats, b: Floats, obstacles: tuple[Obstacle, ...], low: Floats, high: Floats, depth: int
) -> list[Floats] | None:
    """Return via points from a to b, the shortest of the sides that work first; None where none does."""
    body = _blocking(a, b, obstacles)
    if body is None:
        return []
    if depth == 0:
        return None
    step = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
    foot = a + np.clip((body.centre - a) @ step, 0.0, np.linalg.norm(b - a)) * step
    first = np.cross(step, [0.0, 0.0, 1.0] if abs(step[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(step, first)
    sides = np.cos(_ANGLES)[:, None] * first + np.sin(_ANGLES)[:, None] * second
    reach = np.arange(1, 61) * 0.05
    options: list[tuple[float, int, Floats]] = []
    for index, side in enumerate(sides):
        line = foot + reach[:, None] * side
        clear = np.all((line >= low) & (line <= high), axis=1)
        for other in obstacles:
            clear &= other.clearance(line) >= _BESIDE
        if clear.any():
            via = line[int(np.argmax(clear))]
            options.append((float(np.linalg.norm(via - a) + np.linalg.norm(b - via)), index, via))
    for _, _, via in sorted(options, key=lambda option: option[:2])[:6]:
        before = _around(a, via, obstacles, low, high, depth - 1)
        after = None if before is None else _around(via, b, obstacles, low, high, depth - 1)
        if before is not None and after is not None:
            return [*before, via, *after]
    return None


def _infeasible(claim: str, name: str, stop: _Stop, sentence: str) -> Infeasible:
    return Infeasible(sentence, Witness(claim=claim, sentence=sentence, robot=name, region=stop.region, visit=stop.visit))


def _show(point: Floats) -> str:
    return "(" + ", ".join(f"{x:.3f}" for x in point) + ")"
