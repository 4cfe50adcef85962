"""Encounters: robots that no departure times keep apart give way to each other, in time and in space.

`reciprocal_avoidance` fits the paths (of robots that meet as `meetings` says); here is who meets whom, when such an encounter begins, and how far it is slowed for the limits.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from refine.coordination.avoidance.conflict_intervals import Mover, mover
from refine.coordination.avoidance.reciprocal_avoidance import Yielding, avoid_by_rule, avoid_in_pair
from refine.coordination.common_clock import Flown, on_faster_clock
from refine.coordination.departures import DepartureConflict, departures
from refine.coordination.spacing import flight_of
from refine.corridor.leg_limits import slower_on_ways
from refine.corridor.planned import hovering_corridor
from refine.corridor.sampled_stays import violations
from refine.heading.yaw import heading_spline
from refine.limits.stretching import stretch_to_limits
from refine.single_robot.pacing import headed
from refine.single_robot.task import NOWHERE, Problem, RobotFlight
from refine.spline.spline import Spline
from verify.data import Infeasible, Plan, Witness
from verify.data.plan import Meeting, Precedence
from verify.data.validation.spacing import Spacing

Together = tuple[dict[str, RobotFlight], dict[str, float]]
"""Robots with their paths, and departures in s by robot."""

_CLEARANCE = 0.04
"""m on top of the distance in an encounter: what sampling it in the schedule cannot see."""
_SHARES = np.linspace(0.0, 1.0, 17)
"""Of each piece, at which speeds are looked at."""
_STEPS = 8
"""Pieces of a robot that steps aside for another one."""


def resolve_encounters(
    problem: Problem, robots: dict[str, RobotFlight], conflict: DepartureConflict
) -> tuple[dict[str, RobotFlight], dict[str, float]]:
    """Return the team with the paths of robots in conflict fitted again, each on its side of the others.

    Two robots in conflict meet in an encounter of their own, which is slowed as a whole until all of it keeps its limits and
    begins when the encounters before it allow; the robots that need none depart around them. A robot in conflict with an
    encounter joins it. (A team's laps are refined as finite flights, so none of this meets laps.)

    Args:
        problem: What is refined.
        robots: The team's flights.
        conflict: Two robots that no departures keep apart.

    Raises:
        Infeasible: No order and no rule of giving way keeps the distance; names two robots, the time and their distance.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    plan, spacing, precedences = problem.plan, problem.spacing, problem.feedback.precedences
    team, given, found = robots, {}, conflict
    groups: list[tuple[str, ...]] = []
    tried: set[frozenset[str]] = set()
    while isinstance(found, DepartureConflict):
        met = set(found.pair).union(*(group for group in groups if set(group) & set(found.pair)))
        while frozenset(met) in tried and len(groups) > 1:
            met = met.union(*groups)
        if found.pair[0] == found.pair[1] or frozenset(met) in tried:
            raise too_near(conflict, spacing.distance)
        tried.add(frozenset(met))
        names = tuple(name for name in robots if name in met)
        groups = [group for group in groups if not set(group) & met]
        given = {name: start for name, start in given.items() if name not in met}
        team = {**team, **{name: robots[name] for name in names}}
        answer = _encounter(problem, team, names, given)
        if answer is None:
            groups.append(names)  # to be joined by another group, or given up
            continue
        team, starts = answer
        given |= starts
        groups.append(names)
        flights = [flight_of(plan, robot) for robot in team.values()]
        found = departures(
            flights,
            distance=spacing.distance,
            z_scale=spacing.z_scale,
            skew=spacing.skew,
            precedences=precedences,
            given=given,
        )
    return team, found


def _encounter(
    problem: Problem, team: dict[str, RobotFlight], names: tuple[str, ...], given: dict[str, float]
) -> tuple[dict[str, RobotFlight], dict[str, float]] | None:
    """Return the team where these robots give way to each other, and when they depart so that the given ones are not met."""
    for group in _at_times(tuple(team[name] for name in names)):
        found = _encounter_of(problem, team, group, given)
        if found is not None:
            return found
    return None


def _at_times(group: tuple[RobotFlight, ...]) -> Iterator[tuple[RobotFlight, ...]]:
    """Yield robots as they fly, but first at the plan's own even times where their pace is another: a common clock hurries them after.

    Waits on the way are as long as the robots' pace asks for. Where one waits there, the plan's own times ask for others, and are not tried.
    """
    planned = tuple(robot if robot.planned is None else replace(robot, path=robot.planned) for robot in group)
    if any(robot.planned is not None for robot in group) and all(map(_without_waits, group)):
        yield planned
    yield group


def _without_waits(robot: RobotFlight) -> bool:
    return robot.planned is None or len(robot.planned) == len(robot.path)


def _encounter_of(
    problem: Problem, team: dict[str, RobotFlight], group: tuple[RobotFlight, ...], given: dict[str, float]
) -> tuple[dict[str, RobotFlight], dict[str, float]] | None:
    """Return the team where a group gives way at the times of its flights, and when it departs."""
    plan, spacing, names = problem.plan, problem.spacing, tuple(robot.name for robot in group)
    starts = departures(
        [flight_of(plan, robot) for robot in group],
        distance=-np.inf,
        z_scale=spacing.z_scale,
        skew=spacing.skew,
        precedences=among(problem, names),
    )
    if isinstance(starts, DepartureConflict) or all(robot.corridor is None for robot in group):
        return None
    until = max(starts[robot.name] + robot.path.duration for robot in group)
    movers = tuple(mover_of(plan, robot, starts, until) for robot in group)
    busy = max((given[name] + team[name].path.duration for name in given), default=0.0)
    known = (*given, *names)
    for paths in _ways(movers, spacing):
        for fitted, begins in _timings(problem, group, dict(zip(names, paths, strict=True)), starts):
            factor = max(by for _, by in fitted)
            trial = {**team, **{robot.name: paced(robot, factor) for robot, _ in fitted}}
            if any(violations(trial[name].path, plan.mission, name, plan.robots[name]) for name in names):
                continue
            flights = [flight_of(plan, trial[name]) for name in known]
            for late in np.arange(0.0, busy + 1.0):
                begun = {name: factor * begins[name] + float(late) for name in names}
                found = departures(
                    flights,
                    distance=spacing.distance,
                    z_scale=spacing.z_scale,
                    skew=spacing.skew,
                    precedences=among(problem, known),
                    given={**given, **begun},
                )
                if not isinstance(found, DepartureConflict):
                    return trial, begun
    return None


def hurried(problem: Problem, robots: dict[str, RobotFlight], starts: dict[str, float]) -> Together | None:
    """Return a team that is kept apart on a faster common clock; None where none is faster, or where it would not be kept apart.

    Args:
        problem: What is refined.
        robots: The team's flights.
        starts: Their departures, s.
    """
    plan = problem.plan
    if any(robot.plan.hold > 0.0 or robot.cycle is not None for robot in robots.values()):
        return None
    faster = timed_faster(problem, tuple(robots.values()), {name: robot.path for name, robot in robots.items()}, starts)
    if faster is None:
        return None
    fitted, begins = faster
    factor = max(by for _, by in fitted)
    team = {robot.name: _with_halts_of(robots[robot.name], paced(robot, factor)) for robot, _ in fitted}
    begun = {name: factor * start for name, start in begins.items()}
    if arrival((team, begun)) >= arrival((robots, starts)):
        return None
    if any(violations(robot.path, plan.mission, name, plan.robots[name]) for name, robot in team.items()):
        return None
    found = departures_of(problem, team, begun)
    return None if isinstance(found, DepartureConflict) else (team, begun)


def _with_halts_of(robot: RobotFlight, faster: RobotFlight) -> RobotFlight:
    """Return a robot on a faster clock with its halts: all nodes of its path are there, with others between them."""
    found, at = dict[int, int](), len(faster.path.nodes)
    for node in reversed(range(len(robot.path.nodes))):
        at = max(each for each in range(at) if np.array_equal(faster.path.nodes[each], robot.path.nodes[node]))
        found[node] = at
    return replace(faster, halts={visit: found[node] for visit, node in robot.halts.items()})


def arrival(team: Together) -> float:
    """Return when the last robot arrives, s."""
    robots, starts = team
    return max(starts[name] + robot.path.duration for name, robot in robots.items())


Timed = tuple[list[tuple[RobotFlight, float]], dict[str, float]]
"""Robots, each with by how much it must be slowed, and their departures before that, s."""


def _timings(
    problem: Problem, group: tuple[RobotFlight, ...], paths: dict[str, Spline], starts: dict[str, float]
) -> Iterator[Timed]:
    """Yield robots on their paths: on a faster clock first, where none flies at the plan's own times."""
    faster = timed_faster(problem, group, paths, starts)
    if faster is not None:
        yield faster
    yield [along(problem, robot, paths[robot.name]) for robot in group], starts


def timed_faster(
    problem: Problem, group: Collection[RobotFlight], paths: dict[str, Spline], starts: dict[str, float]
) -> Timed | None:
    """Return robots on a common clock that is as fast as limits allow.

    It is None where one is nominal, has no pace on that clock, or would fly more pieces than it holds.

    Args:
        problem: What is refined.
        group: The robots, kept apart.
        paths: What each flies.
        starts: When each departs, s.
    """
    mission, options = problem.plan.mission, problem.options
    shares = {robot.name: options.share(mission, robot.name) for robot in group}
    team = {
        robot.name: Flown(paths[robot.name], starts[robot.name], robot.limits, share, _room(options.held(mission, robot.name)))
        for robot in group
        if (share := shares[robot.name]) is not None
    }
    if len(team) < len(group):
        return None
    faster = on_faster_clock(team)
    if any((held := options.held(mission, name)) is not None and len(path) >= held for name, (path, _) in faster.items()):
        return None
    try:
        return [along(problem, robot, faster[robot.name][0]) for robot in group], {name: at for name, (_, at) in faster.items()}
    except Infeasible:  # the times that there are stand
        return None


def _room(held: int | None) -> int | None:
    """Return how many pieces a path may have of those that a vehicle holds: one is the wait before it departs."""
    return None if held is None else held - 1


def _ways(movers: tuple[Mover, ...], spacing: Spacing) -> Iterator[tuple[Spline, ...]]:
    """Yield paths of robots that give way to each other; whoever only hovers does so last."""
    fastest = [float(np.linalg.norm(robot.path.sample(_SHARES, 1), axis=-1).max()) for robot in movers]
    drift = spacing.skew * sorted(fastest)[-2] * max(1.0, spacing.z_scale)  # of two, the slower one's is enough
    distance = spacing.distance + _CLEARANCE + drift
    if len(movers) != 2:
        yield from avoid_by_rule(movers, distance, spacing.z_scale)
        return
    one, other = movers
    idle = [len({tuple(point) for point in robot.corridor.points}) == 1 for robot in movers]
    ways: tuple[Yielding, ...] = ("second", "both", "first") if idle[0] else ("first", "both", "second")
    yield from avoid_in_pair((one, other), distance, spacing.z_scale, ways if any(idle) else ("both", "first", "second"))


def among(problem: Problem, names: tuple[str, ...]) -> tuple[Precedence | Meeting, ...]:
    """Return the waits that concern only these robots."""
    return tuple(p for p in problem.feedback.precedences if p.first[0] in names and p.then[0] in names)


def departures_of(
    problem: Problem, robots: dict[str, RobotFlight], given: dict[str, float] | None = None
) -> dict[str, float] | DepartureConflict:
    """Return departures in s at which robots keep apart, waiting for each other as is asked, or who cannot be kept apart.

    Args:
        problem: What is refined.
        robots: All or some of the team's flights.
        given: Departures that are settled.
    """
    spacing, flights = problem.spacing, [flight_of(problem.plan, robot) for robot in robots.values()]
    precedences = among(problem, tuple(robots))
    return departures(
        flights, distance=spacing.distance, z_scale=spacing.z_scale, skew=spacing.skew, precedences=precedences, given=given
    )


def mover_of(plan: Plan, robot: RobotFlight, starts: dict[str, float], until: float) -> Mover:
    """Return a robot as the encounter sees it; one that hovers is free to step aside and come back.

    Args:
        plan: Carries the mission.
        robot: Its flight.
        starts: Departures, s.
        until: When the encounter is over, s.
    """
    if robot.corridor is not None:
        hovers = np.flatnonzero(np.all(robot.path.nodes[1:] == robot.path.nodes[:-1], axis=1))
        rests = frozenset(robot.halts.values()).union(hovers.tolist(), (hovers + 1).tolist())
        return mover(robot.corridor, robot.path, starts[robot.name], rests)
    place = robot.path.nodes[0]
    corridor = hovering_corridor(plan.mission, robot.name, place, _STEPS)
    path = Spline(np.full(_STEPS, until / _STEPS), np.repeat(robot.path.states[:1], _STEPS + 1, axis=0))
    return mover(corridor, path, 0.0, NOWHERE)


def along(problem: Problem, robot: RobotFlight, path: Spline) -> tuple[RobotFlight, float]:
    """Return a robot on a path, not slowed yet, and by how much it must be; below 1 where its pace lets it fly faster.

    Args:
        problem: Carries the mission, and says the robot's pace.
        robot: What it flew before.
        path: What it flies now.

    Raises:
        Infeasible: No pace keeps its limits.
    """
    mission, share = problem.plan.mission, problem.options.share(problem.plan.mission, robot.name)
    agent, own = mission.agents[robot.name], mission.seen_by(robot.name)
    if share is None:
        yaw = heading_spline(path, agent.heading, agent.yaw)
        flown = replace(robot, path=path, yaw=yaw, halts={})
        return flown, max(stretch_to_limits(path, yaw, robot.limits), slower_on_ways(own, robot.plan, path))
    yaw, factor = headed(agent, path, robot.limits)
    flown = replace(robot, path=path, yaw=yaw, halts={})
    return flown, factor * slower_on_ways(own, robot.plan, path.stretched(factor)) / share


def paced(robot: RobotFlight, factor: float) -> RobotFlight:
    """Return a robot on the same path, so many times slower.

    Args:
        robot: Its flight.
        factor: Above 0.
    """
    return replace(robot, path=robot.path.stretched(factor), yaw=None if robot.yaw is None else robot.yaw.stretched(factor))


def too_near(conflict: DepartureConflict, distance: float) -> Infeasible:
    """Return the error that names two robots which nothing keeps apart.

    Args:
        conflict: The two, how near they come and when.
        distance: What they should keep, m.
    """
    a, b = conflict.pair
    if a == b:
        sentence = (
            f"No departure times of {a} keep every planned precedence: it would have to wait in the middle of its flight."
        )
        return Infeasible(sentence, Witness(claim="formula", sentence=sentence, robot=a))
    least = max(conflict.distance, 0.0)  # a lower bound, which may be below zero
    sentence = (
        f"No departure times keep {a} and {b} apart, and no giving way does: they come within {least:.3f} m at {conflict.time:.2f} s, "
        f"{distance:.3f} m is needed (separation and twice the margin)."
    )
    witness = Witness(
        claim="separation", sentence=sentence, robot=a, other=b, time=conflict.time, bound=conflict.distance, limit=distance
    )
    return Infeasible(sentence, witness)
