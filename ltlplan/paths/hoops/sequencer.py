"""The sequence-of-hoops planner (Algorithm 1 of the 2019 paper): from visits to waypoints and nominal times.

    start -> [avoid ..] -> rear, centre, front of the first hoop -> [avoid ..] -> .. -> end

Each leg between two passages goes straight, or past the avoid points of what stands in its way. Each segment is one of four
primitives, whose length gives its time. The spline of least snap through the waypoints at these times is then judged for
all times, and mended where it cuts a corner too closely (`spline_repair`).
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ltlplan.allocation import Itinerary
from ltlplan.free_space.free_space import FreeSpace
from ltlplan.paths.costs import cost_of, plan_cost
from ltlplan.paths.final_hover import then_hovering
from ltlplan.paths.hoops.avoidance import Blocked, NarrowRoom
from ltlplan.paths.hoops.keep_out import Room, room
from ltlplan.paths.hoops.legs import Legs
from ltlplan.paths.hoops.passage_directions import Directions, choose_sides
from ltlplan.paths.hoops.primitives import Primitive
from ltlplan.paths.hoops.spline_repair import SplineBlocked, repaired
from ltlplan.paths.hoops.stops import Stop, holds, hoop_axes, primitives_between
from ltlplan.systems.forbidden_regions import regions_to_avoid
from ltlplan.systems.touching_points import routes_may_touch
from ltlplan.systems.visit_words import word_of
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Visit, Waypoint, Word
from verify.data.errors import did_you_mean
from verify.data.language.lasting import lasting_regions
from verify.data.obstruction import Obstruction
from verify.data.shapes.inequalities import point_of

_SLACKS = (0.04, 0.02, 0.0)
"""m beyond the mission's margin that the nominal spline keeps, where there is room: refinement changes it a little."""
_TIGHT = 0.002
"""m that are kept as well where obstacles leave hardly more than is needed: refinement keeps a millimetre itself."""
_SHORTEST, _SHORTEST_IN_GAPS = 0.08, 0.02
"""m; a shorter segment is not divided again, elsewhere and where obstacles leave hardly more than is needed."""


def route(
    mission: Mission,
    robot: str,
    visits: Sequence[Visit],
    cycle_visit: int | None = None,
    *,
    directions: Directions | None = None,
    word: Word | None = None,
) -> RobotPlan:
    """Lead one robot through its visits: sides of hoops, waypoints and nominal times.

    Args:
        mission: Hoops, regions, workspace, margin and nominal speed.
        robot: Name of the agent.
        visits: Regions in order; a visit's `direction` is kept where it is given and chosen where it is None.
        cycle_visit: First visit of a lasso's cycle; the number of visits for a cycle that only hovers; None for a
            finite flight.
        directions: `nearest` takes the nearest control point of each hoop in turn, `cheapest` the shortest whole
            sequence; None takes the mission's `planner.directions`.
        word: The letters that the robot will show; computed from the visits where it is None. Where its last letter
            is the last visit's region, the flight ends inside that region.

    Returns:
        The plan, with a cost under the mission's cost function for this robot. For a lasso the last waypoint repeats
        `waypoints[cycle_waypoint]`.

    Raises:
        BadInput: No such robot or region, a direction for a region that has no ring, or a cycle for a robot that has an `end`.
        Infeasible: A hoop cannot be reached without crossing another one, or the spline has no room; names the hoop.
    """
    _check(mission, robot, visits, cycle_visit)
    visits = tuple(visits)
    if cycle_visit == 0 and visits and holds(mission, np.array(mission.agents[robot].start), visits[0].region):
        # the lap would begin where the robot hovers at the start: it begins with the second visit instead
        visits, cycle_visit, word = (*visits, visits[0]), 1, None
    if word is None:
        leaves = mission.agents[robot].end is not None and cycle_visit is None and not _ends_at_last(mission, robot, visits)
        word = word_of(mission, robot, visits, cycle_visit, stays=False if leaves else None)
    return _laid(mission, robot, Itinerary(visits, word, cycle_visit), directions)


def route_itinerary(mission: Mission, robot: str, does: Itinerary, *, directions: Directions | None = None) -> RobotPlan:
    """Lead one robot along what it was allocated: as `route`, but to the middles of those regions only in which it stops.

    Args:
        mission: Hoops, regions, workspace, margin and nominal speed.
        robot: Name of the agent.
        does: Its visits, word and stops.
        directions: As for `route`.

    Raises:
        BadInput: As `route`.
        Infeasible: As `route`.
    """
    stops = _apart(mission, does)
    if stops == tuple(range(len(does.visits))):
        return route(mission, robot, does.visits, does.cycle_visit, directions=directions, word=does.word)
    _check(mission, robot, does.visits, does.cycle_visit)
    return _laid(mission, robot, replace(does, stops=stops), directions)


def _apart(mission: Mission, does: Itinerary) -> tuple[int, ...]:
    """Return an itinerary's stops, of which it flies once to a middle that two regions in turn share, as of a room in the middle of a house."""
    if does.cycle_visit is not None:
        return does.all_stops
    regions = [mission.regions.get(does.visits[stop].region) for stop in does.all_stops]
    twice = [a is not None and b is not None and a is not b and a.center == b.center for a, b in itertools.pairwise(regions)]
    return tuple(itertools.compress(does.all_stops, [not again for again in twice] + [True]))


def _laid(mission: Mission, robot: str, does: Itinerary, directions: Directions | None) -> RobotPlan:
    """Return the path of an itinerary; of laps the shorter one of those that begin before their first region, and in it."""
    first = _laid_as(mission, robot, does, directions)
    inside = _begun_inside(mission, does)
    if inside is None:
        return first
    try:
        return min(first, _laid_as(mission, robot, inside, directions), key=partial(metres_of_laps, mission.spec.repeat))
    except Infeasible:
        return first


def _begun_inside(mission: Mission, does: Itinerary) -> Itinerary | None:
    """Return an itinerary whose laps begin in the region that they came to first, and end there.

    None where that is a hoop, or something is done there, and where routes lead to middles: bounds in seconds may ask for a hover in a stay that is not cut in two.
    """
    first, cycle = does.cycle_visit, does.word.cycle or ()
    if first is None or first >= len(does.visits) or does.stops is not None or not routes_may_touch(mission):
        return None
    visit = does.visits[first]
    if visit.region in mission.hoops or visit.actions or len(cycle) < 2 or visit.region not in cycle[0] - cycle[1]:
        return None
    word = Word((*does.word.prefix, cycle[0]), (*cycle[1:], cycle[0]))
    return replace(does, visits=(*does.visits, visit), word=word, cycle_visit=first + 1)


def metres_of_laps(laps: int, plan: RobotPlan) -> float:
    """Return the length of a lasso's path from waypoint to waypoint, with all its laps, m.

    Args:
        laps: How many are flown.
        plan: Waypoints, and where the lap begins.
    """
    points = np.array([waypoint.position for waypoint in plan.waypoints])
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return float(legs.sum() + (laps - 1) * legs[plan.cycle_waypoint or 0 :].sum())


def _laid_as(mission: Mission, robot: str, does: Itinerary, directions: Directions | None) -> RobotPlan:
    mission, problem = mission.seen_by(robot), None
    ways = [(slack, _SHORTEST) for slack in _SLACKS]
    if mission.obstacles:
        ways[-1:] = [(_TIGHT, _SHORTEST), (_TIGHT, _SHORTEST_IN_GAPS)]
        if _stands_near(mission, robot):
            ways.append((0.0, _SHORTEST_IN_GAPS))
    for slack, shortest in ways:
        where = room(mission, slack, robot=robot)
        try:
            return _route(mission, robot, does, directions or mission.planner.directions, where, shortest)
        except Infeasible as error:
            if mission.obstacles or problem is None or type(error) is type(problem):
                problem = error  # what stops it where least is kept; without obstacles, of the kind that was met first
    assert problem is not None
    if isinstance(problem, SplineBlocked):
        problem = problem.beside(mission, mission.vehicle_of(robot).radius)
    if isinstance(problem, NarrowRoom | Blocked):
        problem = problem.explained()
    raise problem if problem.obstruction is not None else problem.because(_obstruction(mission, robot, problem))


def _obstruction(mission: Mission, robot: str, problem: Infeasible) -> Obstruction:
    """Return what stands in the way of a robot's path."""
    what, least = str(problem), ("a smaller `margin`",) if mission.margin > 0.0 else ()
    if isinstance(problem, SplineBlocked):
        return Obstruction(what, (robot,))
    if isinstance(problem, NarrowRoom):
        return Obstruction(what, (robot,), helps=problem.helps)
    if not isinstance(problem, Blocked):
        return Obstruction(what, (robot,), helps=("more room", *least))
    forbidden = regions_to_avoid(mission, robot) | lasting_regions(mission, robot, inside=False)
    allowed = (f"a formula that lets {robot} enter it",) if problem.region in forbidden else ()
    where = f"more room beside '{problem.region}'" if problem.region in mission.all_regions else "more room"
    return Obstruction(what, (robot,), helps=(where, *allowed, *(() if problem.shut else least)))


def _stands_near(mission: Mission, robot: str) -> bool:
    """Tell whether a robot starts, or is to end, hardly farther from an obstacle than it must."""
    agent, space = mission.agents[robot], FreeSpace.of(mission, mission.vehicle_of(robot).radius)
    points = np.array([point for point in (agent.start, agent.end) if point is not None])
    return any(bool(np.any(part.met(points))) for part in space.solids(_TIGHT).parts)


def route_sequence(mission: Mission) -> RobotPlan:
    """Fly exactly the mission's `sequence` of passages with its one robot.

    Raises:
        BadInput: The mission has no sequence or several agents.
        Infeasible: See `route`.
    """
    sequence = mission.passages
    if sequence is None:
        raise BadInput(f"Mission '{mission.name}' has no `sequence`; write one such as `sequence: hoop0F hoop1R`.")
    if len(mission.agents) != 1:
        raise BadInput(f"A sequence is flown by one robot; mission '{mission.name}' has {len(mission.agents)}.")
    passages = sequence.prefix + (sequence.cycle or ())
    visits = tuple(Visit(region=passage.hoop, direction=passage.direction) for passage in passages)
    return route(mission, next(iter(mission.agents)), visits, None if sequence.cycle is None else len(sequence.prefix))


def segments(mission: Mission, plan: RobotPlan) -> tuple[Primitive, ...]:
    """Return the primitive of each segment between a plan's waypoints, for drawings and tables."""
    stops = [Stop(np.array(w.position), w.role, w.region, axes=hoop_axes(mission, w.region)) for w in plan.waypoints]
    return tuple(primitives_between(stops))


def _route(mission: Mission, robot: str, does: Itinerary, directions: Directions, where: Room, shortest: float) -> RobotPlan:
    visits, cycle_visit, word, served = does.visits, does.cycle_visit, does.word, does.all_stops
    flown = tuple(visits[stop] for stop in served)
    first = does.first_of_lap
    legs = Legs(mission, robot, does, where, _ends_inside(mission, robot, flown, first, word))
    sides = choose_sides(legs, directions)
    stops, cycle = legs.stops(sides)
    stops, times, cycle = repaired(stops, cycle, where, mission.planner.speed, Counter(v.region for v in visits), shortest)
    side_of = dict(zip(served, sides, strict=True))
    hovers = cycle_visit == len(visits)
    plan = RobotPlan(
        word=Word(word.letters).compressed() if hovers else word,
        visits=tuple(visit.model_copy(update={"direction": side_of.get(k)}) for k, visit in enumerate(visits)),
        waypoints=tuple(
            Waypoint(
                position=point_of(s.position), role=s.role, region=s.region, visit=None if s.visit is None else served[s.visit]
            )
            for s in stops
        ),
        times=tuple(times),
        cycle_visit=None if hovers else cycle_visit,
        cycle_waypoint=cycle,
    )
    plan = then_hovering(plan) if hovers else plan
    return plan.model_copy(update={"cost": plan_cost(plan, cost_of(mission, robot))})


def _ends_inside(mission: Mission, robot: str, visits: Sequence[Visit], cycle_visit: int | None, word: Word) -> bool:
    """Tell whether the flight ends (or its hovering cycle is) in the last visit's region."""
    if not visits or (cycle_visit is not None and cycle_visit < len(visits)) or visits[-1].direction is not None:
        return False
    if mission.agents[robot].end is not None and not _ends_at_last(mission, robot, visits):
        return False
    return visits[-1].region in word.letters[-1]


def _ends_at_last(mission: Mission, robot: str, visits: Sequence[Visit]) -> bool:
    """Tell whether the robot's end waypoint lies in the region that it visits last."""
    end = mission.agents[robot].end
    return end is not None and bool(visits) and holds(mission, np.array(end), visits[-1].region)


def _check(mission: Mission, robot: str, visits: Sequence[Visit], cycle_visit: int | None) -> None:
    if robot not in mission.agents:
        raise BadInput(f"'{robot}' is not an agent.{did_you_mean(robot, mission.agents)} Agents: {', '.join(mission.agents)}.")
    known = mission.all_regions
    for visit in visits:
        if visit.region not in known:
            raise BadInput(f"'{visit.region}' is not a region.{did_you_mean(visit.region, known)} Regions: {', '.join(known)}.")
        if visit.direction is not None and visit.region not in mission.hoops:
            raise BadInput(f"'{visit.region}' has no ring, so it has no side {visit.direction}.")
    if cycle_visit is not None and not 0 <= cycle_visit <= len(visits):
        raise BadInput(f"cycle_visit must be 0 to {len(visits)}, not {cycle_visit}.")
    if cycle_visit is not None and mission.agents[robot].end is not None:
        raise BadInput(f"{robot} has an `end` where it must finish, and a cycle never ends; leave one of them out.")
