"""A team's flights together: who departs when, and what else is tried where no departures keep robots apart.

Of many robots those that meet swerve, all at once, so that nobody waits, unless departures alone let all arrive by when the longest
flight ends anyhow. Few depart one after the other, and swerve where that would take much longer. In this order, until one succeeds: departures; paths that also keep clear of where the others hover; the plan's own shares of
time instead of even ones; other places for visits within their regions; giving way to each other; waits at every point. Then they take
turns, in an order in which nobody rests where another one comes to; and robots that meet fly one at a time between meetings, by name or the
last ones first, and exchange their places.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from refine.coordination.conflict_resolution import departures_of, resolve_encounters, too_near
from refine.coordination.departures import DepartureConflict
from refine.coordination.joint_avoidance import avoid_jointly
from refine.coordination.meeting_orders import in_turn, one_at_a_time
from refine.coordination.midway_waits import with_waits
from refine.coordination.safe_intervals import schedule_safe_intervals
from refine.coordination.spacing import firm_pairs, hovers_of, idle_others, spacing_for
from refine.coordination.visit_ordering import Turns
from refine.coordination.visit_relocation import resting_teams, with_visits_relocated
from refine.corridor.legs import HOVERING
from refine.corridor.meeting_places import moved_apart, moved_to_meet
from refine.feedback import Feedback, feedback_of
from refine.obstacles.keep_out_bodies import Ball
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RefinementOptions, RobotFlight
from verify.data import Infeasible, Plan, Witness
from verify.data.plan import Meeting, Precedence
from verify.data.progress import Progress
from verify.data.validation.spacing import Spacing, needed, spacing_of

Together = tuple[dict[str, RobotFlight], dict[str, float]]
"""Robots with their paths, and departures in s by robot."""

_FEW = 4
"""Robots that depart one after the other where they can: all of their orders are tried."""
_CROWD = 16
"""Robots above which departures are all that is tried where swerving does not part them, unless they have to wait on the way."""
_LATE = 1.25
"""How much longer than the longest flight a team that waits for each other may take before swerving is tried instead."""
_MEETINGS = 40
"""Times that one robot's path is laid around where another one waits."""


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
        return _together(plan, feedback, options, tell, _Way(gives_way="to pass"))
    except Infeasible:
        waits = tuple(wait for wait in feedback.precedences if isinstance(wait, Precedence))
        for way in _other_ways(plan, feedback):
            other = plan if way.meetings is None else plan.model_copy(update={"meetings": way.meetings})
            asked = feedback if way.meetings is None else replace(feedback, precedences=(*waits, *way.meetings))
            try:
                tell(way.sentence, 0.0)
                return _together(other, asked, options, tell, way)
            except Infeasible:
                continue
        raise


@dataclass(frozen=True, slots=True)
class _Way:
    """How a team flies: who waits for whose arrivals (None: as planned), and whether each robot rests where it is nearest.

    Robots may be kept from giving way to each other on their ways: always, or where they share places.
    """

    sentence: str = ""
    meetings: tuple[Meeting, ...] | None = None
    nearest: bool = False
    gives_way: Literal["never", "to pass", "anywhere"] = "anywhere"


def _other_ways(plan: Plan, feedback: Feedback) -> Iterator[_Way]:
    """Yield ways to fly that are tried where the planned one finds no flights that keep apart."""
    if not plan.meetings and _waits_anywhere(plan):
        yield _Way("letting robots wait where each is nearest", nearest=True)
    in_order = []
    if _takes_turns(plan):
        in_order = list(_turns(plan, feedback))
        yield from in_order
        if _share_places(plan, spacing_for(plan, feedback)):
            yield _Way("letting robots give way")
    if not plan.meetings:
        return
    yield _Way("letting robots meet where each is nearest", nearest=True)
    by_name, backwards = (one_at_a_time(plan, last_first=last_first) for last_first in (False, True))
    for meetings, nearest in ((by_name, False), (by_name, True), (backwards, False)) if in_order else ():
        yield _Way("letting one robot fly at a time between meetings", meetings, nearest)


def has_an_order(plan: Plan) -> bool:
    """Tell whether a team's visits can be made one after another so that nobody rests where another one comes to; sooner than by flights.

    Args:
        plan: Who visits what, in laps or once.
    """
    return not _takes_turns(plan) or next(_turns(plan, feedback_of(plan, ())), None) is not None


def _takes_turns(plan: Plan) -> bool:
    return len(plan.robots) > 1 and bool(plan.mission.spec.formula) and plan.mission.spec.trace == "finite"


def _turns(plan: Plan, feedback: Feedback) -> Iterator[_Way]:
    """Yield orders in which nobody rests where another one comes to: visits that are in each other's way one after another, or all."""
    spacing = spacing_for(plan, feedback)
    for nearest in (False, True):
        try:
            turns = Turns(_placed(plan, spacing, nearest=nearest, parted=True), spacing.distance + HOVERING, spacing.z_scale)
        except Infeasible:
            continue
        order = turns.order()
        if order is not None:
            ways = dict.fromkeys((turns.meetings(order), in_turn(plan, order)))
            yield from (_Way("letting robots take turns", meetings, nearest, gives_way="never") for meetings in ways)


def _share_places(plan: Plan, spacing: Spacing) -> bool:
    """Tell whether two robots make visits at places too near each other, also where they are moved apart: by turns, or not at all."""
    try:
        placed = _placed(plan, spacing, nearest=False, parted=True)
    except Infeasible:
        return False
    return Turns(placed, spacing.distance + HOVERING, spacing.z_scale).share_places()


def _placed(plan: Plan, spacing: Spacing, *, nearest: bool, parted: bool = False) -> Plan:
    """Return the plan with ends apart, and where robots meet, or are to be `parted`, visits at places beside each other."""
    mission, distance = plan.mission, spacing.distance + HOVERING
    waits = parted or len(plan.meetings) > 0
    if mission.written.counts or (waits and mission.spec.formula):  # of laps, without a formula here, places are chosen
        plan = moved_to_meet(plan, distance, spacing.z_scale, nearest=nearest)
    return moved_apart(plan, distance, spacing.z_scale)


def _together(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress, way: _Way) -> Together:
    """Return the team's robots and their departures, waiting for each other as the plan says."""
    spacing, planned = spacing_for(plan, feedback), plan
    if len(plan.robots) > 1:
        plan = _placed(plan, spacing, nearest=way.nearest)
        _refuse_what_no_flight_mends(plan)
    problem = Problem(plan, feedback, options, spacing)
    alone = _alone(problem, tell)
    tell("choosing departures", 0.7)
    if len(plan.robots) == 1:
        return alone, {name: robot.plan.hold for name, robot in alone.items()}
    if len(alone) > _FEW and not plan.meetings:
        if len(alone) <= _CROWD:
            robots, starts = _departing(problem, alone)
            if not isinstance(starts, DepartureConflict) and _arrival((robots, starts)) <= _longest(alone):
                return robots, starts
        tell("letting robots swerve together", 0.7)
        swerving = avoid_jointly(problem, alone)
        if not isinstance(swerving, DepartureConflict):
            return swerving
        if len(alone) > _CROWD and not feedback.precedences:
            tell("choosing departures", 0.75)
            starts = departures_of(problem, alone)
            if isinstance(starts, DepartureConflict):
                raise too_near(swerving, spacing.distance)
            return alone, starts
    met: list[tuple[dict[str, RobotFlight], DepartureConflict]] = []
    # Other shares of time bend paths otherwise; the plan's own may keep robots apart.
    uneven = replace(problem, options=replace(options, even=False))
    for shares in (problem,) if way.gives_way == "never" else (problem, uneven):
        robots = alone if shares is problem else _plans_own(uneven, alone, tell)
        if robots is not None:
            robots, starts = _departing(shares, robots)
            if not isinstance(starts, DepartureConflict):
                return _sooner(problem, alone, (robots, starts))
            met.append((robots, starts))
    if way.gives_way == "never":
        raise too_near(met[0][1], spacing.distance)
    tell("trying other places for visits", 0.75)
    moved = with_visits_relocated(problem, alone)
    if moved is not None:
        return moved
    if way.gives_way == "to pass" and _takes_turns(planned) and _share_places(planned, spacing):
        raise too_near(met[0][1], spacing.distance)
    tell("letting robots give way", 0.8)
    failures: list[Infeasible] = []
    for robots, conflict in met:
        try:
            return resolve_encounters(problem, robots, conflict)
        except Infeasible as error:
            failures.append(error)
    if not feedback.precedences and options.pace == "nominal":  # no other pace is taken for the one that was asked for
        tell("letting robots wait on the way", 0.9)
        resting = resting_teams(replace(problem, options=replace(options, rests=True)))
        held = [options.held(plan.mission, name) for name in plan.robots]
        most = min((pieces for pieces in held if pieces is not None), default=None)
        for pieces in (most,) if options.too_long == "refuse" or most is None else (most, None):
            waiting = schedule_safe_intervals(plan, resting, spacing, pieces)
            if waiting is not None:
                return waiting
    raise failures[0]


def _sooner(problem: Problem, alone: dict[str, RobotFlight], departing: Together) -> Together:
    """Return a team that departs one after the other, or that swerves where it would take much longer than its longest flight."""
    if _arrival(departing) <= _LATE * _longest(alone) or problem.plan.meetings or len(alone) > _FEW:
        return departing
    swerving = avoid_jointly(problem, alone)
    if isinstance(swerving, DepartureConflict) or _arrival(swerving) >= _arrival(departing):
        return departing
    return swerving


def _longest(alone: dict[str, RobotFlight]) -> float:
    """Return when the last robot would arrive if it had no others to wait for, s: no flights of this team can end sooner."""
    return max(robot.plan.hold + robot.path.duration for robot in alone.values())


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
        found = departures_of(problem, robots)
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
        found = departures_of(problem, held, given)
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
