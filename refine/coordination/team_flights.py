"""A team's flights together: who departs when, and what else is tried where no departures keep robots apart.

Of many robots those that meet swerve, all at once, so that nobody waits. Few depart one after the other, and swerve where that would
take much longer. In this order, until one succeeds: departures; paths that also keep clear of where the others hover; the plan's own shares of
time instead of even ones; other places for visits within their regions; giving way to each other; waits at every point. Robots that
meet then fly one at a time between meetings, by name or the last ones first, and exchange their places.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from refine.bodies import Ball, keep_out
from refine.coordination.departures import DepartureConflict, departures
from refine.coordination.encounters import among, resolve_encounters, too_near
from refine.coordination.joint_avoidance import avoid_jointly
from refine.coordination.midway_waits import with_waits
from refine.coordination.orders import one_at_a_time
from refine.coordination.safe_intervals import schedule_safe_intervals
from refine.coordination.spacing import firm_pairs, flight_of, hovers_of, idle_others, spacing_for
from refine.corridor.legs import HOVERING
from refine.corridor.relocation import moved_apart, moved_to_meet, relocations
from refine.feedback import Feedback
from refine.single.flight import robot_flight
from refine.single.values import Problem, RefinementOptions, RobotFlight
from verify.data import Infeasible, Plan, Witness
from verify.data.plan import Precedence
from verify.data.progress import Progress
from verify.data.rules.spacing import Spacing, needed, spacing_of

Together = tuple[dict[str, RobotFlight], dict[str, float]]
"""Robots with their paths, and departures in s by robot."""

_FEW = 4
"""Robots that depart one after the other where they can: all of their orders are tried."""
_CROWD = 16
"""Robots above which departures are all that is tried where swerving does not part them, unless they have to wait on the way."""
_LATE = 1.25
"""How much longer than the longest flight a team that waits for each other may take before swerving is tried instead."""
_PLACES = 3
"""Other places that each visit of a robot in conflict is tried at."""
_MEETINGS = 40
"""Times that one robot's path is laid around where another one waits."""
_LOOKED_AT = 4096
_COMBINATIONS = 64
_RESTING = 16
"""Combinations of places that are tried with waits on the way."""


def together(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress) -> Together:
    """Return the team's robots and their departures, with all robots kept apart.

    Args:
        plan: Who visits what.
        feedback: What witnesses asked for.
        options: What the caller asked for.
        tell: Told a sentence and a share of the work.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A robot cannot fly as planned even alone, two of them start or end too near each other, or nothing that was
            tried keeps them apart.
        SolverTimeout: An engine's seconds ran out.
    """
    try:
        return _together(plan, feedback, options, tell)
    except Infeasible:
        if not plan.meetings and _waits_anywhere(plan):
            tell("letting robots wait where each is nearest", 0.0)
            return _together(plan, feedback, options, tell, nearest=True)
        if not plan.meetings:
            raise
        waits = tuple(wait for wait in feedback.precedences if isinstance(wait, Precedence))
        in_turn, backwards = (one_at_a_time(plan, last_first=last_first) for last_first in (False, True))
        for sentence, meetings, nearest in (
            ("letting one robot fly at a time between meetings", in_turn, False),
            ("letting robots meet where each is nearest", None, True),
            ("letting one robot fly at a time to where it is nearest", in_turn, True),
            ("letting one robot fly at a time, the last ones first", backwards, False),
        ):
            other = plan if meetings is None else plan.model_copy(update={"meetings": meetings})
            asked = feedback if meetings is None else replace(feedback, precedences=(*waits, *meetings))
            try:
                tell(sentence, 0.0)
                return _together(other, asked, options, tell, nearest=nearest)
            except Infeasible:
                continue
        raise


def _together(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress, *, nearest: bool = False) -> Together:
    """Return the team's robots and their departures, waiting for each other as the plan says."""
    spacing = spacing_for(plan, feedback)
    if len(plan.robots) > 1:
        mission = plan.mission
        if mission.written.counts or (
            plan.meetings and mission.spec.formula
        ):  # of laps, without a formula here, places are chosen already
            plan = moved_to_meet(plan, spacing.distance + HOVERING, spacing.z_scale, nearest=nearest)
        plan = moved_apart(plan, spacing.distance + HOVERING, spacing.z_scale)
        _refuse_what_no_flight_mends(plan)
    problem = Problem(plan, feedback, options, spacing)
    alone = _alone(problem, tell)
    tell("choosing departures", 0.7)
    if len(plan.robots) == 1:
        return alone, {name: robot.plan.hold for name, robot in alone.items()}
    if len(alone) > _FEW and not plan.meetings:
        tell("letting robots swerve together", 0.7)
        swerving = avoid_jointly(problem, alone)
        if not isinstance(swerving, DepartureConflict):
            return swerving
        if len(alone) > _CROWD and not feedback.precedences:
            tell("choosing departures", 0.75)
            starts = _departures(problem, alone)
            if isinstance(starts, DepartureConflict):
                raise too_near(swerving, spacing.distance)
            return alone, starts
    met: list[tuple[dict[str, RobotFlight], DepartureConflict]] = []
    # Other shares of time bend paths otherwise; the plan's own may keep robots apart.
    uneven = replace(problem, options=replace(options, even=False))
    for shares in (problem, uneven):
        robots = alone if shares is problem else _plans_own(uneven, alone, tell)
        if robots is not None:
            robots, starts = _departing(shares, robots)
            if not isinstance(starts, DepartureConflict):
                return _sooner(problem, alone, (robots, starts))
            met.append((robots, starts))
    tell("trying other places for visits", 0.75)
    moved = _with_visits_relocated(problem, alone)
    if moved is not None:
        return moved
    tell("letting robots give way", 0.8)
    failures: list[Infeasible] = []
    for robots, conflict in met:
        try:
            return resolve_encounters(problem, robots, conflict)
        except Infeasible as error:
            failures.append(error)
    if not feedback.precedences and options.pace == "nominal":  # no other pace is taken for the one that was asked for
        tell("letting robots wait on the way", 0.9)
        resting = _resting(replace(problem, options=replace(options, rests=True)))
        held = [options.held(plan.mission, name) for name in plan.robots]
        most = min((pieces for pieces in held if pieces is not None), default=None)
        for pieces in (most,) if options.too_long == "refuse" or most is None else (most, None):
            waiting = schedule_safe_intervals(plan, resting, spacing, pieces)
            if waiting is not None:
                return waiting
    raise failures[0]


def _sooner(problem: Problem, alone: dict[str, RobotFlight], departing: Together) -> Together:
    """Return a team that departs one after the other, or that swerves where it would take much longer than its longest flight."""
    longest = max(robot.plan.hold + robot.path.duration for robot in alone.values())
    if _arrival(departing) <= _LATE * longest or problem.plan.meetings or len(alone) > _FEW:
        return departing
    swerving = avoid_jointly(problem, alone)
    if isinstance(swerving, DepartureConflict) or _arrival(swerving) >= _arrival(departing):
        return departing
    return swerving


def _arrival(team: Together) -> float:
    """Return when the last robot arrives, s."""
    robots, starts = team
    return max(starts[name] + robot.path.duration for name, robot in robots.items())


def _refuse_what_no_flight_mends(plan: Plan) -> None:
    """Raise where two robots start or end nearer to each other than they may, and no visit can be moved."""
    mission, kept = plan.mission, spacing_of(plan.mission)
    for name, other, what, a, b in firm_pairs(plan):
        gap = kept.between(a, b)
        if gap < kept.at_rest:
            sentence = (
                f"{name} and {other} {what} {gap:.4f} m from each other; {needed(kept, mission.separation, mission.margin)}."
            )
            witness = Witness(claim="separation", sentence=sentence, robot=name, other=other, bound=gap, limit=kept.at_rest)
            raise Infeasible(sentence, witness)


def _alone(problem: Problem, tell: Progress) -> dict[str, RobotFlight]:
    """Return each robot's flight as if the others were not there, but for those that never move."""
    robots: dict[str, RobotFlight] = {}
    names = list(problem.plan.robots)
    for index, name in enumerate(names):
        tell(f"smoothing the path of {name}", 0.7 * index / len(names))
        idle = idle_others(problem, name)
        try:
            robots[name] = robot_flight(problem, name, idle)
        except Infeasible:
            if not idle:
                raise
            robots[name] = robot_flight(problem, name)  # whoever hovers in the way may have to step aside
    return robots


def _plans_own(problem: Problem, robots: dict[str, RobotFlight], tell: Progress) -> dict[str, RobotFlight] | None:
    """Return the robots with the plan's own shares of time; None where that changes nothing or is not possible."""
    try:
        slower = _alone(problem, tell)
    except Infeasible:
        return None
    return None if all(slower[name].path.duration == robot.path.duration for name, robot in robots.items()) else slower


def _departing(
    problem: Problem, robots: dict[str, RobotFlight]
) -> tuple[dict[str, RobotFlight], dict[str, float] | DepartureConflict]:
    """Return the team and departures at which robots keep their distance, or who cannot be kept apart.

    Where no departures help, the two robots in conflict get paths that also keep clear of where the other one starts and ends,
    for as long as that changes anything.
    """
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    if problem.plan.meetings or _waits_anywhere(problem.plan):
        return _meeting(problem, robots)
    waiting = False
    while True:
        found = _departures(problem, robots)
        if not isinstance(found, DepartureConflict):
            return robots, found
        if found.pair[0] == found.pair[1] and not waiting:
            robots, waiting = with_waits(problem, robots), True
            continue
        changed = False
        for name, other in (found.pair, found.pair[::-1]):
            if name == other or other in clear_of[name]:
                continue
            clear_of[name] = (*clear_of[name], other)
            places = [
                place for who in clear_of[name] for place in hovers_of(robots[who], problem.spacing, problem.plan.meetings)
            ]
            try:
                robots = {**robots, name: robot_flight(problem, name, (*idle_others(problem, name), *places))}
                changed, waiting = True, False
            except Infeasible:
                continue  # its own path stays; the other robot's may still move
        if not changed:
            return robots, found


def _waits_anywhere(plan: Plan) -> bool:
    """Tell whether robots that count wait for each other's events, outside of regions too."""
    return plan.mission.written.counts and len(plan.precedences) > 0


def _meeting(
    problem: Problem, robots: dict[str, RobotFlight]
) -> tuple[dict[str, RobotFlight], dict[str, float] | DepartureConflict]:
    """Return a team that waits for its meetings in flight, everyone departing at once, or who cannot be kept apart.

    Of two robots that come too near each other one gets a path that keeps clear of where the other one starts, waits and ends.
    """
    together = dict(robots)
    clear_of: dict[str, tuple[str, ...]] = dict.fromkeys(robots, ())
    given = dict.fromkeys(robots, 0.0)
    kept_clear: dict[str, tuple[Ball, ...]] = {}
    anywhere = _waits_anywhere(problem.plan)
    tried: set[tuple[str, str, bytes]] = set()

    while True:
        held = with_waits(problem, together, kept_clear)
        found = _departures(problem, held, given)
        if not isinstance(found, DepartureConflict):
            return held, found
        changed = False
        for name, other in (found.pair, found.pair[::-1]):
            key = name, other, together[other].path.nodes.tobytes()  # where the other one hovers may have changed since
            if name == other or changed or key in tried or len(tried) >= _MEETINGS:
                continue
            tried.add(key)
            clear_of[name] = tuple(dict.fromkeys((*clear_of[name], other)))
            places = tuple(
                place
                for who in clear_of[name]
                for place in hovers_of(held[who], problem.spacing, problem.plan.meetings, anywhere=anywhere)
            )
            try:
                together = {**together, name: robot_flight(problem, name, (*idle_others(problem, name), *places))}
                kept_clear[name], changed = places, True
            except Infeasible:
                continue  # the other robot's path may still move
        if not changed:
            return held, found


def _departures(
    problem: Problem, robots: dict[str, RobotFlight], given: dict[str, float] | None = None
) -> dict[str, float] | DepartureConflict:
    spacing, flights = problem.spacing, [flight_of(problem.plan, robot) for robot in robots.values()]
    precedences = among(problem, tuple(robots))
    return departures(
        flights, distance=spacing.distance, z_scale=spacing.z_scale, skew=spacing.skew, precedences=precedences, given=given
    )


def _with_visits_relocated(problem: Problem, robots: dict[str, RobotFlight]) -> Together | None:
    """Return the team with visits of robots in conflict made elsewhere in their regions; None where that does not part them.

    Combinations are tried from the planned places outwards; one in which some two robots cannot be parted even by themselves
    is passed over.
    """
    apart: dict[tuple[str, int, str, int], bool] = {}
    choices = {name: [robot] for name, robot in robots.items()}

    def parted(one: str, i: int, other: str, j: int) -> bool:
        key = (one, i, other, j)
        if key not in apart:
            pair = {one: choices[one][i], other: choices[other][j]}
            apart[key] = not isinstance(_departures(problem, pair), DepartureConflict)
        return apart[key]

    pairs = list(itertools.combinations(robots, 2))
    met = {name for one, other in pairs if not parted(one, 0, other, 0) for name in (one, other)}
    for name in (name for name in robots if name in met or not met):
        choices[name] += _relocated(problem, name)
    worth_trying = (
        at
        for at in itertools.islice(_combined(choices), 1, _LOOKED_AT)
        if all(parted(one, at[one], other, at[other]) for one, other in pairs)
    )
    for at in itertools.islice(worth_trying, _COMBINATIONS):
        team = {name: choices[name][index] for name, index in at.items()}
        found = _departures(problem, team)
        if not isinstance(found, DepartureConflict):
            return team, found
    return None


def _relocated(problem: Problem, name: str) -> list[RobotFlight]:
    """Return flights of one robot whose visits are made at other places of their regions."""
    plan, idle = problem.plan, idle_others(problem, name)
    ways = [place for other in plan.robots if other != name for place in _passages(plan, other, problem.spacing)]
    flights = []
    for relocated in relocations(plan.mission, name, plan.robots[name], idle, (*idle, *ways), _PLACES):
        changed = plan.model_copy(update={"robots": {**plan.robots, name: relocated}})
        try:
            flights.append(robot_flight(replace(problem, plan=changed), name, idle))
        except Infeasible:
            continue  # the other places may do
    return flights


def _combined(choices: dict[str, list[RobotFlight]]) -> Iterator[dict[str, int]]:
    """Yield combinations of choices, those nearest to everyone's first one first."""
    sizes = [len(each) for each in choices.values()]
    for total in range(sum(sizes) - len(sizes) + 1):
        for choice in _summing_to(total, sizes):
            yield dict(zip(choices, choice, strict=True))


def _summing_to(total: int, sizes: list[int]) -> Iterator[tuple[int, ...]]:
    """Yield tuples of indices below these sizes with a given sum, in order."""
    if not sizes:
        yield from [()] if total == 0 else []
        return
    for first in range(min(total, sizes[0] - 1) + 1):
        for others in _summing_to(total - first, sizes[1:]):
            yield (first, *others)


def _resting(problem: Problem) -> list[dict[str, RobotFlight]]:
    """Return teams whose robots rest at every point, with visits at the planned places and at others."""
    choices: dict[str, list[RobotFlight]] = {}
    for name in problem.plan.robots:
        choices[name] = _relocated(problem, name)
        try:
            choices[name].insert(0, robot_flight(problem, name, idle_others(problem, name)))
        except Infeasible:
            continue  # the other places may do
    return [{name: choices[name][index] for name, index in at.items()} for at in itertools.islice(_combined(choices), _RESTING)]


def _passages(plan: Plan, name: str, spacing: Spacing) -> list[Ball]:
    """Return the places that a robot cannot but fly through: where it passes hoops."""
    points = plan.robots[name].waypoints
    through = [
        (np.array(a.position), np.array(b.position))
        for a, b in itertools.pairwise(points)
        if a.visit is not None and a.visit == b.visit and a.region in plan.mission.hoops
    ]
    return [
        keep_out(f"the passage of {name}", a + share * (b - a), spacing.distance + HOVERING, spacing.z_scale)
        for a, b in through
        for share in (0.0, 0.5, 1.0)
    ]
