"""A team's flights together: who departs when, and what else is tried where no departures keep robots apart.

Of many robots those that meet swerve, all at once, so that nobody waits, unless departures alone let all arrive by when the longest
flight ends anyhow. Few depart one after the other, and swerve where that would take much longer. `MEANS` lists what is tried to keep
robots apart that fly as planned. Where none of it does, `ALTERNATIVES` lists other ways to fly: they wait nearer, take turns, in an order in
which nobody rests where another one comes to, or fly one at a time between meetings.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

from refine.alternatives import first_feasible
from refine.coordination.alternative_ways import (
    ALTERNATIVES,
    SOON_TRIED,
    Way,
    placed,
    share_places,
    takes_turns,
    waits_anywhere,
)
from refine.coordination.avoidance.conflict_resolution import (
    Together,
    arrival,
    departures_of,
    hurried,
    resolve_encounters,
    too_near,
)
from refine.coordination.avoidance.joint_avoidance import avoid_jointly
from refine.coordination.clocks.own_clocks import on_own_clocks
from refine.coordination.departing_teams import depart, fly_to_meetings
from refine.coordination.departures import DepartureConflict
from refine.coordination.safe_intervals import schedule_safe_intervals
from refine.coordination.spacing import firm_pairs, idle_others, spacing_for
from refine.coordination.visit_relocation import resting_teams, with_visits_relocated
from refine.feedback import Feedback
from refine.single_robot.flight import robot_flight
from refine.single_robot.task import Problem, RefinementOptions, RobotFlight
from verify.data import Infeasible, Plan, Witness
from verify.data.plan import Precedence
from verify.data.progress import Progress
from verify.data.validation.spacing import needed, spacing_of

_FEW = 4
"""Robots that depart one after the other where they can: all of their orders are tried."""
_CROWD = 16
"""Robots above which departures are all that is tried where swerving does not part them, unless they have to wait on the way."""
_LATE = 1.25
"""How much longer than the longest flight a team that waits for each other may take before swerving is tried instead."""
_PLANNED = "On their fastest paths robots were not kept apart, or later than at the plan's own times: these are flown."
_HURRIED = "On their fastest paths robots were not kept apart: they fly those of the plan's own times, hurried on one clock."
_SOON = 1.05
"""The same for a team on own clocks that is taken before others are looked for."""
_LATER = 1.5
"""The same for a team that swerves before others of its robots give way to each other."""


def together(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress) -> Together:
    """Return the team's robots and their departures, with all robots kept apart.

    Args:
        plan: Who visits what.
        feedback: What witnesses asked for.
        options: What the caller asked for.
        tell: Receives a sentence and a share of the work.

    Raises:
        BadInput: The plan's numbers do not fit each other.
        Infeasible: A robot cannot fly as planned even alone, two of them start or end too near each other, or nothing that was
            tried keeps them apart.
        SolverTimeout: An engine's seconds ran out.
    """
    shares = [share for name in plan.robots if (share := options.share(plan.mission, name)) is not None]
    try:
        found = _in_some_way(plan, feedback, options, tell)
    except Infeasible:
        if not shares:
            raise
        found = None
    if found is not None and (not shares or min(shares) * arrival(found) <= planned_arrival(found)):
        return found
    tell("trying the plan's own times", 0.9)
    planned = _noted(_in_some_way(plan, feedback, replace(options, pace="nominal"), tell), _PLANNED)
    faster = hurried(Problem(plan, feedback, options, spacing_for(plan, feedback)), *planned)
    teams = [] if faster is None else [_noted(faster, _HURRIED)]
    teams += [] if found is None else [found]
    best = min(teams, key=arrival, default=planned)
    slow = min(shares) == 1.0 or min(shares) * arrival(best) > arrival(planned)  # even as fast as its limits allow
    return min(best, planned, key=arrival) if slow else best


def _noted(team: Together, sentence: str) -> Together:
    robots, starts = team
    return {name: replace(robot, note=sentence) for name, robot in robots.items()}, starts


def _in_some_way(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress) -> Together:
    """Return the team at the paces of some options, in the first way to fly that keeps it apart."""
    ways = (way for each in (SOON_TRIED if _hasty(plan, options) else ALTERNATIVES) for way in each(plan, feedback))
    return first_feasible(((way.sentence, partial(_together, plan, feedback, options, tell, way)) for way in ways), tell)


def _hasty(plan: Plan, options: RefinementOptions) -> bool:
    """Return whether so many robots meet at a pace that only own clocks are tried: where these fail, the plan's own times are hurried."""
    paced = any(options.share(plan.mission, name) is not None for name in plan.robots)
    return paced and bool(plan.meetings) and len(plan.robots) > _CROWD


def planned_arrival(team: Together) -> float:
    """Return when the last robot would arrive at the plan's own times if it had no others to wait for, s.

    Args:
        team: The robots at their paces.
    """
    robots, _ = team
    return max(robot.plan.hold + (robot.planned or robot.path).duration for robot in robots.values())


def _together(plan: Plan, feedback: Feedback, options: RefinementOptions, tell: Progress, way: Way) -> Together:
    """Return the team's robots and their departures, waiting for each other as a way to fly says."""
    if way.meetings is not None:
        waits = tuple(wait for wait in feedback.precedences if isinstance(wait, Precedence))
        plan = plan.model_copy(update={"meetings": way.meetings})
        feedback = replace(feedback, precedences=(*waits, *way.meetings))
    spacing, planned = spacing_for(plan, feedback), plan
    if len(plan.robots) > 1:
        plan = placed(plan, spacing, nearest=way.nearest)
        _refuse_what_no_flight_mends(plan)
    problem = Problem(plan, feedback, options, spacing)
    alone = _alone(problem, tell)
    tell("choosing departures", 0.7)
    if len(plan.robots) == 1:
        return alone, {name: robot.plan.hold for name, robot in alone.items()}
    attempt = _Attempt(problem, planned, way, alone, tell)
    for means in MEANS:
        found = means(attempt)
        if found is not None:
            return found
    raise attempt.refused[0]


@dataclass(frozen=True, eq=False)
class _Attempt:
    """A team whose robots can each fly alone, while means are tried to keep them apart.

    Attributes:
        problem: What is refined.
        planned: The plan, its visits where they were.
        way: How the team flies.
        alone: Each robot's flight as if alone.
        tell: Told a sentence and a share of the work.
        met: Teams that no departures keep apart, with who meets.
        refused: Why they cannot give way to each other.
        late: Teams that are kept apart, and arrive later than others might.
    """

    problem: Problem
    planned: Plan
    way: Way
    alone: dict[str, RobotFlight]
    tell: Progress
    met: list[tuple[dict[str, RobotFlight], DepartureConflict]] = field(default_factory=list)
    refused: list[Infeasible] = field(default_factory=list)
    late: list[Together] = field(default_factory=list)

    @property
    def many(self) -> bool:
        """Return whether so many robots fly that those that meet swerve, all at once."""
        return len(self.alone) > _FEW and not self.problem.plan.meetings


def _departing_without_delay(attempt: _Attempt) -> Together | None:
    """Depart one after another where all of many arrive by when the longest flight ends anyhow."""
    if not attempt.many or len(attempt.alone) > _CROWD:
        return None
    robots, starts = depart(attempt.problem, attempt.alone)
    if isinstance(starts, DepartureConflict) or arrival((robots, starts)) > _longest(attempt.alone):
        return None
    return robots, starts


def _swerving(attempt: _Attempt) -> Together | None:
    """Swerve, all of many at once; of a crowd that cannot, depart one after another, and refuse where that does not do."""
    if not attempt.many:
        return None
    problem, alone = attempt.problem, attempt.alone
    attempt.tell("letting robots swerve together", 0.7)
    swerving = avoid_jointly(problem, alone)
    if not isinstance(swerving, DepartureConflict):
        return swerving
    if len(alone) <= _CROWD or problem.feedback.precedences:
        return None
    attempt.tell("choosing departures", 0.75)
    starts = departures_of(problem, alone)
    if isinstance(starts, DepartureConflict):
        raise too_near(swerving, problem.spacing.distance)
    return alone, starts


def _departing_in_time(attempt: _Attempt) -> Together | None:
    """Depart one after another, at even shares of time and at the plan's own, which bend paths otherwise."""
    problem, alone = attempt.problem, attempt.alone
    uneven = replace(problem, options=replace(problem.options, even=False))
    for shares in (problem,) if attempt.way.gives_way == "never" else (problem, uneven):
        robots = alone if shares is problem else _plans_own(uneven, alone, attempt.tell)
        if robots is not None:
            robots, starts = depart(shares, robots)
            if not isinstance(starts, DepartureConflict):
                return _sooner(problem, alone, (robots, starts))
            attempt.met.append((robots, starts))
    if attempt.way.gives_way == "never":
        raise too_near(attempt.met[0][1], problem.spacing.distance)
    return None


def _on_own_clocks(attempt: _Attempt) -> Together | None:
    """Keep all paths, and let each robot fly more slowly before it would come too near another one."""
    if not attempt.problem.plan.meetings or attempt.way.gives_way == "never":
        return None
    attempt.tell("retiming all robots", 0.71)
    problem = attempt.problem
    found = on_own_clocks(problem, attempt.alone)
    if found is None and _hasty(problem.plan, problem.options):
        raise Infeasible("No clocks of their own keep the robots apart on their fastest paths.")
    return found


def _swerving_fast(attempt: _Attempt) -> Together | None:
    """Swerve, of few robots too, where all are hurried on one clock after; at the plan's own times they give way in turns."""
    problem = attempt.problem
    nominal = any(problem.options.share(problem.plan.mission, name) is None for name in attempt.alone)
    if nominal or attempt.many or problem.plan.meetings or attempt.way.gives_way == "never":
        return None
    attempt.tell("letting robots swerve together", 0.72)
    found = avoid_jointly(problem, attempt.alone)
    if isinstance(found, DepartureConflict):
        return None
    if arrival(found) <= _LATER * _longest(attempt.alone):
        return found
    attempt.late.append(found)
    return None


def _waiting_in_flight(attempt: _Attempt) -> Together | None:
    """Keep all paths on own clocks, of a team without meetings too: at once where nobody arrives late, else if nothing sooner is found."""
    problem = attempt.problem
    if problem.plan.meetings or attempt.way.gives_way == "never":
        return None
    attempt.tell("retiming all robots", 0.73)
    found = on_own_clocks(problem, attempt.alone)
    if found is None or arrival(found) <= _SOON * _longest(attempt.alone):
        return found
    attempt.late.append(found)
    return None


def _visiting_elsewhere(attempt: _Attempt) -> Together | None:
    attempt.tell("trying other places for visits", 0.75)
    return with_visits_relocated(attempt.problem, attempt.alone)


def _giving_way(attempt: _Attempt) -> Together | None:
    problem, planned = attempt.problem, attempt.planned
    if attempt.way.gives_way == "to pass" and takes_turns(planned) and share_places(planned, problem.spacing):
        raise too_near(attempt.met[0][1], problem.spacing.distance)
    attempt.tell("letting robots give way", 0.8)
    for robots, conflict in attempt.met:
        try:
            found = resolve_encounters(problem, robots, conflict)
        except Infeasible as error:
            attempt.refused.append(error)
            continue
        return min((found, *attempt.late), key=arrival)
    return min(attempt.late, key=arrival, default=None)


def _waiting_longer(attempt: _Attempt) -> Together | None:
    """Have robots that wait for each other anywhere wait longer, until those that they would meet have passed."""
    if not waits_anywhere(attempt.problem.plan) or attempt.problem.plan.meetings:
        return None
    attempt.tell("letting robots wait longer", 0.85)
    robots, starts = fly_to_meetings(attempt.problem, attempt.alone, patient=True)
    return None if isinstance(starts, DepartureConflict) else (robots, starts)


def _waiting_on_the_way(attempt: _Attempt) -> Together | None:
    problem, options = attempt.problem, attempt.problem.options
    paced = any(options.share(problem.plan.mission, name) is not None for name in problem.plan.robots)
    if problem.feedback.precedences or paced:  # no other pace is taken for the one that was asked for
        return None
    attempt.tell("letting robots wait on the way", 0.9)
    resting = resting_teams(replace(problem, options=replace(options, rests=True)))
    held = [options.held(problem.plan.mission, name) for name in problem.plan.robots]
    most = min((pieces for pieces in held if pieces is not None), default=None)
    for pieces in (most,) if options.too_long == "refuse" or most is None else (most, None):
        waiting = schedule_safe_intervals(problem.plan, resting, problem.spacing, pieces)
        if waiting is not None:
            return waiting
    return None


MEANS = (
    _departing_without_delay,
    _swerving,
    _on_own_clocks,
    _departing_in_time,
    _swerving_fast,
    _waiting_in_flight,
    _visiting_elsewhere,
    _giving_way,
    _waiting_longer,
    _waiting_on_the_way,
)
"""What keeps robots apart, tried in this order; each returns None where it does not apply or does not do."""


def _sooner(problem: Problem, alone: dict[str, RobotFlight], departing: Together) -> Together:
    """Return a team that departs one after the other, or that swerves or waits in flight where it would take much longer than its longest flight."""
    late, few = arrival(departing) / _longest(alone), len(alone) <= _FEW
    if late <= (_SOON if few else _LATE) or problem.plan.meetings:
        return departing
    swerving = avoid_jointly(problem, alone) if late > _LATE and few else None  # many have tried that before
    teams = [team for team in (on_own_clocks(problem, alone), swerving) if isinstance(team, tuple)]
    return min((departing, *teams), key=arrival)


def _longest(alone: dict[str, RobotFlight]) -> float:
    """Return when the last robot would arrive if it had no others to wait for, s: no flights of this team can end sooner."""
    return max(robot.plan.hold + robot.path.duration for robot in alone.values())


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
