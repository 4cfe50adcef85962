"""`refine`: from a plan to polynomials for the whole team.

Reads downwards: each robot gets a course and a smooth path that keeps it, is slowed until its limits hold, turns its
heading; then the team's departures are chosen so that robots keep their distance, and everything is rounded to float32.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from numbers import Integral, Real
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from refine.clock import ClockRanOut
from refine.course import standing_course
from refine.elsewhere import moved_apart
from refine.giving_way import Mover, Way, mover, passing, roundabout
from refine.labels import stays, troubles
from refine.obstacles import Ball, keep_out
from refine.quantise import quantise
from refine.schedule import GRID, Conflict, Flight, departures
from refine.single import HOVER, NONE, Ask, Pace, Robot, TooLong, single
from refine.spline import Spline
from refine.timing import stretch_to_limits
from refine.wishes import Wishes, wishes_of
from refine.yaw import heading_spline
from verify.data import BadInput, DoesNotFit, Infeasible, Mission, Plan, Trajectory, Witness
from verify.data.plan import Precedence

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

PIECES = 31
"""Pieces that a Crazyflie's trajectory memory holds."""

_LONGEST = 86400.0
"""s, a day: the longest flight that a plan may ask for."""
_BERTH = 0.04
"""m on top of the distance in an encounter: what sampling it in the schedule cannot see."""
_HOVERING = 0.02
"""m on top of the distance around a robot that hovers."""
_STEPS = 8
"""Pieces of a robot that steps aside for another one."""


def refine(
    plan: Plan,
    *,
    witnesses: Iterable[Witness] = (),
    previous: Mapping[str, Trajectory] | None = None,
    progress: Progress | None = None,
    pace: Pace = "nominal",
    weight: float = 1000.0,
    max_pieces: int = PIECES,
    too_long: TooLong = "refuse",
) -> dict[str, Trajectory]:
    """Turn a plan into polynomials that keep its labels, its limits and the team's separation.

    Args:
        plan: Who visits what, with waypoints and nominal times.
        witnesses: What the judge refused so far; each is repaired (limits tightened, clearances widened, waits added).
            Hand in those of all earlier attempts together.
        previous: The flights that were refused; only for callers that want to say so, the repair starts from the plan.
        progress: Told a sentence and a share of the work.
        pace: "nominal": the plan's times, longer where limits ask for it; "time": as fast as limits and labels allow;
            "blend": least of the integral of |snap|^2 plus `weight` times the duration. In the latter two the points of
            visits may move within their regions and openings, less margin and radius; where the programme with movable
            points does not converge within its budget, the answer with the planned points stands. Where that is not found
            either, it is an error: no other pace is taken in its place. Where stretching the answer for rotor
            thrusts would cost more than 2 %, "blend" takes them into the programme and "time" gives snap more weight.
        weight: For "blend", m^2/s^8.
        max_pieces: Pieces that the target holds for one robot. Points that only lead the way are left out, where straight legs
            allow it, until a flight fits.
        too_long: What becomes of a finite flight that still does not fit: "refuse" it, or let it "rest" at points so that
            `split` can cut it into parts that fit. The rests cost time, and a lap is never cut.

    Returns:
        One flight for each robot, in the mission's order, in exact float32 values. For the compressed format, `on_grid` puts
        each on that format's grid; it is that flight which has to be certified then.

    Raises:
        BadInput: Something asked is no plan, no pace or no positive number, or the plan's numbers do not fit each other.
        Infeasible: A limit or a label cannot be kept; carries a witness.
        ClockRanOut: An engine's seconds ran out before its iterations.
        DoesNotFit: A flight needs more than `max_pieces` pieces, and is not to rest.
    """
    del previous
    _check(plan, pace, weight, max_pieces, too_long)
    wishes = wishes_of(plan, tuple(witnesses))
    plan = _with_room(plan, wishes)
    tell, ask = progress or _quiet, Ask(pace, weight, max_pieces, too_long)
    robots = _alone(plan, wishes, ask, tell)
    tell("choosing departures", 0.7)
    try:
        robots, starts = _kept_apart(plan, robots, wishes, ask)
    except ClockRanOut:
        raise
    except Infeasible:  # other shares of time bend paths otherwise; the plan's own ones may keep robots apart
        ask = replace(ask, even=False)
        slower = _alone(plan, wishes, ask, tell)
        if all(slower[name].path.duration == robot.path.duration for name, robot in robots.items()):
            raise
        robots, starts = _kept_apart(plan, slower, wishes, ask)
    tell("rounding to the vehicle's numbers", 0.95)
    flights = {name: _assemble(robot, plan.mission.agents[name].yaw, starts[name]) for name, robot in robots.items()}
    laps = plan.mission.spec.repeat
    for name, flight in flights.items():
        flown = len(flight.flattened(laps))
        if flown > max_pieces and (too_long == "refuse" or flight.cycle is not None):
            of = f" for {laps} laps" if flight.cycle is not None and laps > 1 else ""
            raise DoesNotFit(
                f"{name} needs {flown} pieces{of}; the target holds {max_pieces}. Let it rest (too_long='rest') and split it (`refine.split`), or stream it."
            )
    tell("refined", 1.0)
    return flights


def _with_room(plan: Plan, wishes: Wishes) -> Plan:
    """Return the plan with visits moved away from where other robots hover in the end."""
    distance, z_scale = _distance(plan.mission, wishes)
    return moved_apart(plan, distance + _HOVERING, z_scale) if len(plan.robots) > 1 else plan


def _alone(plan: Plan, wishes: Wishes, ask: Ask, tell: Progress) -> dict[str, Robot]:
    """Return each robot's flight as if the others were not there, but for those that never move."""
    robots: dict[str, Robot] = {}
    for index, name in enumerate(plan.robots):
        tell(f"smoothing the path of {name}", 0.7 * index / len(plan.robots))
        idle = _idle_others(plan, name, wishes)
        try:
            robots[name] = single(plan, name, wishes, idle, ask)
        except ClockRanOut:
            raise
        except Infeasible:
            if not idle:
                raise
            robots[name] = single(plan, name, wishes, (), ask)  # whoever hovers in the way may have to step aside
    return robots


def _check(plan: object, pace: object, weight: object, max_pieces: object, too_long: object) -> None:
    """Refuse what is no question; whoever has no type checker gets a sentence as well."""
    if not isinstance(plan, Plan):
        raise BadInput(f"refine takes a Plan, not {type(plan).__name__} (points without a mission: refine.minimum_snap).")
    for name, value, allowed in (("pace", pace, get_args(Pace)), ("too_long", too_long, get_args(TooLong))):
        if value not in allowed:
            raise BadInput(f"{name} is {value!r}; it must be one of {', '.join(map(repr, allowed))}.")
    if not isinstance(weight, Real) or not 0.0 < float(weight) < np.inf:
        raise BadInput(f"weight is {weight!r}; it must be a positive number, in m^2/s^8.")
    if not isinstance(max_pieces, Integral) or int(max_pieces) < 1:
        raise BadInput(f"max_pieces is {max_pieces!r}; it must be a whole number of at least 1.")
    for name, robot in plan.robots.items():
        if robot.times[-1] > _LONGEST:
            raise BadInput(f"{name} would fly for {robot.times[-1]:.3g} s; plans of up to {_LONGEST:.0f} s are refined.")


def _quiet(_sentence: str, _share: float) -> None:
    """Report nothing."""


def _idle_others(plan: Plan, name: str, wishes: Wishes) -> tuple[Ball, ...]:
    """Return the places of robots that never move, to be kept clear of."""
    distance, z_scale = _distance(plan.mission, wishes)
    idle = [other for other, robot in plan.robots.items() if other != name and robot.still]
    return tuple(
        keep_out(
            f"{other}, which hovers there", np.array(plan.robots[other].waypoints[0].position), distance + _HOVERING, z_scale
        )
        for other in idle
    )


def _distance(mission: Mission, wishes: Wishes) -> tuple[float, float]:
    """Return the distance that nominal paths keep, and how much z counts."""
    z_scale = 1.0 if mission.separation_z in (None, 0.0) else mission.separation / float(mission.separation_z)
    return mission.separation + 2 * mission.margin * max(1.0, z_scale) + 1e-3 + wishes.distance, z_scale


def _kept_apart(plan: Plan, robots: dict[str, Robot], wishes: Wishes, ask: Ask) -> tuple[dict[str, Robot], dict[str, float]]:
    """Return the team and departures at which robots keep their distance.

    Departures come first. Where none help, the two robots in conflict get paths that also keep clear of where the other
    one starts and ends, for as long as that changes anything; then the robots in conflict give way to each other.
    """
    if len(robots) == 1:
        return robots, {name: robot.plan.hold for name, robot in robots.items()}
    distance, z_scale = _distance(plan.mission, wishes)
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    waiting = False
    while True:
        flights = [_flight(plan, robot) for robot in robots.values()]
        found = departures(flights, distance=distance, z_scale=z_scale, precedences=wishes.precedences)
        if not isinstance(found, Conflict):
            return robots, found
        changed = False
        if found.pair[0] == found.pair[1] and not waiting:
            robots, waiting = _with_waits(plan, robots, wishes, ask), True
            continue
        for name, other in (found.pair, found.pair[::-1]):
            if name == other or other in clear_of[name]:
                continue
            clear_of[name] = (*clear_of[name], other)
            places = [place for who in clear_of[name] for place in _hovers(robots[who], distance, z_scale)]
            try:
                robots = {**robots, name: single(plan, name, wishes, (*_idle_others(plan, name, wishes), *places), ask)}
                changed, waiting = True, False
            except ClockRanOut:
                raise
            except Infeasible:
                continue  # its own path stays; the other robot's may still move
        if not changed:
            return _given_way(plan, robots, wishes, found, distance, z_scale)


def _given_way(
    plan: Plan, robots: dict[str, Robot], wishes: Wishes, conflict: Conflict, distance: float, z_scale: float
) -> tuple[dict[str, Robot], dict[str, float]]:
    """Return the team with the paths of robots in conflict fitted again, each on its side of the others.

    Two robots in conflict meet in an encounter of their own, which is slowed as a whole until all of it keeps its limits and
    begins when the encounters before it allow; the robots that need none depart around them. A robot in conflict with an
    encounter joins it. (A lasso belongs to a team of one, so none of this meets laps.)

    Raises:
        Infeasible: No order and no rule of giving way keeps the distance; names two robots, the time and their distance.
    """
    team, given, found = robots, {}, conflict
    groups: list[tuple[str, ...]] = []
    tried: set[frozenset[str]] = set()
    while isinstance(found, Conflict):
        met = set(found.pair).union(*(group for group in groups if set(group) & set(found.pair)))
        while frozenset(met) in tried and len(groups) > 1:
            met = met.union(*groups)
        if found.pair[0] == found.pair[1] or frozenset(met) in tried:
            raise _too_near(conflict, distance)
        tried.add(frozenset(met))
        names = tuple(name for name in robots if name in met)
        groups = [group for group in groups if not set(group) & met]
        given = {name: start for name, start in given.items() if name not in met}
        team = {**team, **{name: robots[name] for name in names}}
        answer = _encounter(plan, team, wishes, names, given, distance, z_scale)
        if answer is None:
            groups.append(names)  # to be joined by another group, or given up
            continue
        team, starts = answer
        given |= starts
        groups.append(names)
        flights = [_flight(plan, robot) for robot in team.values()]
        found = departures(flights, distance=distance, z_scale=z_scale, precedences=wishes.precedences, given=given)
    return team, found


def _encounter(
    plan: Plan,
    team: dict[str, Robot],
    wishes: Wishes,
    names: tuple[str, ...],
    given: dict[str, float],
    distance: float,
    z_scale: float,
) -> tuple[dict[str, Robot], dict[str, float]] | None:
    """Return the team where these robots give way to each other, and when they depart so that the given ones are not met."""
    group = tuple(team[name] for name in names)
    starts = departures(
        [_flight(plan, robot) for robot in group], distance=-np.inf, z_scale=z_scale, precedences=_among(wishes, names)
    )
    if isinstance(starts, Conflict) or all(robot.course is None for robot in group):
        return None
    until = max(starts[robot.name] + robot.path.duration for robot in group)
    movers = tuple(_mover(plan, robot, starts, until) for robot in group)
    busy = max((given[name] + team[name].path.duration for name in given), default=0.0)
    known = (*given, *names)
    for paths in _ways(movers, distance + _BERTH, z_scale):
        fitted = tuple(_along(plan, robot, path) for robot, path in zip(group, paths, strict=True))
        factor = max(by for _, by in fitted)
        trial = {**team, **{robot.name: _paced(robot, factor) for robot, _ in fitted}}
        if any(troubles(trial[name].path, plan.mission, name, plan.robots[name]) for name in names):
            continue
        flights = [_flight(plan, trial[name]) for name in known]
        for late in np.arange(0.0, busy + 1.0):
            begun = {name: factor * starts[name] + float(late) for name in names}
            found = departures(
                flights,
                distance=distance,
                z_scale=z_scale,
                precedences=_among(wishes, known),
                given={**given, **begun},
            )
            if not isinstance(found, Conflict):
                return trial, begun
    return None


def _ways(movers: tuple[Mover, ...], distance: float, z_scale: float) -> Iterator[tuple[Spline, ...]]:
    """Yield paths of robots that give way to each other; whoever only hovers does so last."""
    if len(movers) != 2:
        yield from roundabout(movers, distance, z_scale)
        return
    one, other = movers
    idle = [len({tuple(point) for point in robot.course.points}) == 1 for robot in movers]
    ways: tuple[Way, ...] = ("second", "both", "first") if idle[0] else ("first", "both", "second")
    yield from passing((one, other), distance, z_scale, ways if any(idle) else ("both", "first", "second"))


def _among(wishes: Wishes, pair: tuple[str, ...]) -> tuple[Precedence, ...]:
    return tuple(p for p in wishes.precedences if p.first[0] in pair and p.then[0] in pair)


def _mover(plan: Plan, robot: Robot, starts: dict[str, float], until: float) -> Mover:
    """Return a robot as the encounter sees it; one that hovers is free to step aside and come back."""
    if robot.course is not None:
        return mover(robot.course, robot.path, starts[robot.name], frozenset(robot.halts.values()))
    place = robot.path.nodes[0]
    course = standing_course(plan.mission, robot.name, place, _STEPS)
    path = Spline(np.full(_STEPS, until / _STEPS), np.repeat(robot.path.states[:1], _STEPS + 1, axis=0))
    return mover(course, path, 0.0, NONE)


def _along(plan: Plan, robot: Robot, path: Spline) -> tuple[Robot, float]:
    """Return a robot on a path, not slowed yet, and by how much it must be."""
    agent = plan.mission.agents[robot.name]
    yaw = heading_spline(path, agent.heading, agent.yaw)
    return replace(robot, path=path, yaw=yaw, halts={}), stretch_to_limits(path, yaw, robot.limits)


def _paced(robot: Robot, factor: float) -> Robot:
    return replace(robot, path=robot.path.stretched(factor), yaw=None if robot.yaw is None else robot.yaw.stretched(factor))


def _with_waits(plan: Plan, robots: dict[str, Robot], wishes: Wishes, ask: Ask) -> dict[str, Robot]:
    """Return the team with hovers in the middle of flights, just long enough for the planned precedences.

    Each robot that must wait for another rests where it sets out for the visit concerned. Waits are made longer until all
    precedences hold with everyone departing at once; precedences that go round in a circle never settle.
    """
    stops: dict[str, frozenset[int]] = dict.fromkeys(robots, NONE)
    for precedence in wishes.precedences:
        name, visit = precedence.then
        stops[name] |= {visit}
    resting = {
        name: robot if robot.course is None else single(plan, name, wishes, _idle_others(plan, name, wishes), ask, stops[name])
        for name, robot in robots.items()
    }
    waits: dict[tuple[str, int], float] = {}
    for _ in range(4 * len(wishes.precedences) ** 2 + 4):
        held = {name: _holding(robot, waits) for name, robot in resting.items()}
        visits = {name: _flight(plan, robot).visits for name, robot in held.items()}
        late = False
        for precedence in wishes.precedences:
            (first, left), then = precedence.first, precedence.then
            short = visits[first][left][1] + GRID - visits[then[0]][then[1]][0]
            if short > 0.0:
                waits[then] = waits.get(then, 0.0) + float(np.ceil(short / GRID) * GRID)
                late = True
        if not late:
            return held
    sentence = "The planned precedences go round in a circle: no waits keep them all."
    raise Infeasible(sentence, Witness(claim="formula", sentence=sentence))


def _holding(robot: Robot, waits: dict[tuple[str, int], float]) -> Robot:
    """Return a robot with hover pieces put in where it waits for a visit."""
    path, yaw, cycle = robot.path, robot.yaw, robot.cycle
    for visit, node in sorted(robot.halts.items(), key=lambda item: -item[1]):
        wait = waits.get((robot.name, visit), 0.0)
        if wait > 0.0:
            path, yaw = _hover_at(path, node, wait), None if yaw is None else _hover_at(yaw, node, wait)
            cycle = None if cycle is None else cycle + (node <= cycle)
    return replace(robot, path=path, yaw=yaw, cycle=cycle)


def _hover_at(path: Spline, node: int, duration: float) -> Spline:
    return Spline(np.insert(path.durations, node, duration), np.insert(path.states, node, path.states[node], axis=0))


def _flight(plan: Plan, robot: Robot) -> Flight:
    found = stays(robot.path, plan.mission.all_regions, plan.mission.margin)
    return Flight(robot.name, robot.path, tuple((stay.start, stay.end) for stay in found), robot.plan.hold)


def _hovers(robot: Robot, distance: float, z_scale: float) -> tuple[Ball, ...]:
    """Return where a robot hovers before and after its flight, to be kept clear of."""
    ends = (("starts", robot.path.nodes[0]), ("ends", robot.path.nodes[-1]))
    return tuple(keep_out(f"{robot.name}, which {what} there", place, distance + _HOVERING, z_scale) for what, place in ends)


def _too_near(conflict: Conflict, distance: float) -> Infeasible:
    a, b = conflict.pair
    if a == b:
        sentence = (
            f"No departure times of {a} keep every planned precedence: it would have to wait in the middle of its flight."
        )
        return Infeasible(sentence, Witness(claim="formula", sentence=sentence, robot=a))
    sentence = (
        f"No departure times keep {a} and {b} apart, and no giving way does: they come within {conflict.distance:.3f} m at {conflict.time:.2f} s, "
        f"{distance:.3f} m is needed (separation and twice the margin)."
    )
    witness = Witness(
        claim="separation", sentence=sentence, robot=a, other=b, time=conflict.time, bound=conflict.distance, limit=distance
    )
    return Infeasible(sentence, witness)


def _assemble(robot: Robot, start_yaw: float, departure: float) -> Trajectory:
    """Join hold, path and yaw, and round.

    Never fewer than two pieces, because crazyswarm2's loader fails on files with one: a hover is flown in two halves, any
    other single piece is followed by a hover.
    """
    path = robot.path
    yaw = np.zeros((len(path) + 1, 4, 1)) if robot.yaw is None else robot.yaw.states
    if robot.yaw is None:
        yaw[:, 0] = start_yaw
    states, durations, cycle = np.concatenate([path.states, yaw], axis=2), path.durations, robot.cycle
    if departure > 0.0:
        states = np.concatenate([states[:1], states])
        durations = np.concatenate([[departure], durations])
        cycle = None if cycle is None else cycle + 1
    if len(durations) == 1:
        if cycle is not None or np.array_equal(states[0], states[1]):
            halves = Spline(durations, states).split(2)
            durations, states = halves.durations, halves.states
        else:
            durations, states = np.append(durations, HOVER), np.concatenate([states, states[-1:]])
    return quantise(Spline(durations, states), cycle=cycle)
