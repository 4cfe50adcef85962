"""A mission's plan, whose words were checked as words: what the pipeline begins with, and asks for again where no flight keeps a plan.

Missions that last longer than a vehicle can stay in the air are planned for faster flights: at a greater pace, then at higher nominal speeds.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from ltlplan.allocation import Itinerary, Leg
from ltlplan.missions import load_mission
from ltlplan.paths.costs import for_mission
from ltlplan.planner import SEQUENCE, make_plan, with_pace, with_seed
from ltlplan.search.exact import without_legs
from ltlplan.search.lawler import Member, Partition
from verify.data import BadInput, Infeasible, InternalError, Mission, NotCertified, Plan, Unsatisfiable, check_mission
from verify.data.names.choices import PLANNING_METHODS
from verify.data.progress import Progress, silent
from verify.data.sections import Pace

if TYPE_CHECKING:
    from flight.processes import Workers
    from ltlplan.allocation import Known, PlanningMethod

Asked = Mission | str | os.PathLike[str]
NO_PLAN = (BadInput, Unsatisfiable, Infeasible, NotCertified, InternalError)
"""Why there may be no other plan."""
_STEP = 1.15
"""By which each speed that is tried is higher than the one before."""


def planned_faster(mission: Mission, make: Callable[[Mission], Plan], refused: Infeasible) -> Plan:
    """Return the plan of the first of some faster flights that keeps all endurances; it carries the mission as it is.

    Refinement and the certificate keep all limits of the flight as ever, also where it is planned to be faster.

    Args:
        mission: What is asked.
        make: Plans a mission.
        refused: What planning said of the mission itself.

    Raises:
        Infeasible: The endurance is too short at all paces and speeds up to the limits; says what the least time was.
    """
    witness, least = refused.witness, refused
    if witness is None or witness.claim != "limits.endurance":
        raise refused
    for faster, how in _faster(mission):
        try:
            made = make(faster)
        except Infeasible as error:
            if error.witness is None or error.witness.claim != "limits.endurance":
                raise refused from error
            least = min(least, error, key=_lasts)
            continue
        note = f"Planned at {how}, at which the flight would outlast a vehicle's endurance."
        return for_mission(made.noting(note), mission)
    tried = (
        f"Faster flights, up to the limits on speed, were tried: the least time of the robot that flies longest is {_lasts(least):.4g} s, "
        f"against {witness.limit:.4g} s."
    )
    raise Infeasible(f"{refused} {tried}", witness) from refused


def paced(mission: Mission, pace: Pace, names: Iterable[str]) -> Mission:
    """Return the mission with some robots at another pace.

    Args:
        mission: What is asked.
        pace: Of these robots.
        names: Which they are.
    """
    changed = {name: mission.agents[name].model_copy(update={"pace": pace}) for name in names}
    return mission.changed(agents={**mission.agents, **changed})


def _faster(mission: Mission) -> Iterator[tuple[Mission, str]]:
    """Yield the mission at pace 1, and for nominal robots at speeds up to the greatest of their limits, with what that replaces."""
    paces = {name: pace for name in mission.agents if not isinstance(pace := mission.pace_of(name), str)}
    least, greatest = min(paces.values(), default=1.0), paced(mission, 1.0, paces)
    if least < 1.0:
        yield greatest, f"pace 1 instead of {least:g} (`planner.pace`)"
    own = mission.planner.speed
    for speed in _speeds(mission):
        faster = greatest.changed(planner=mission.planner.model_copy(update={"speed": speed}))
        yield faster, f"{speed:.3g} m/s instead of {own:g} m/s (`planner.speed`)"


def _speeds(mission: Mission) -> list[float]:
    """Return nominal speeds above the mission's own, up to the greatest limit on speed of a robot that flies by them, m/s."""
    own = mission.planner.speed
    limits = (mission.limits_of(name).speed for name in mission.agents if mission.pace_of(name) == "nominal")
    most = max(limits, default=own)
    speeds: list[float] = []
    while (speed := own * _STEP ** (len(speeds) + 1)) < most:
        speeds.append(speed)
    return [speed for speed in [*speeds, most] if speed > own]


def _lasts(error: Infeasible) -> float:
    """Return how long the robot flies that flies too long, s."""
    assert error.witness is not None
    assert error.witness.bound is not None
    return error.witness.bound


def plan(
    mission: Asked,
    *,
    method: PlanningMethod | str | None = None,
    seed: int | None = None,
    pace: float | str | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
    known: Known | None = None,
) -> Plan:
    """Plan a mission and check the planned words, as words.

    Args:
        mission: What is asked: a mission, or the path or name that `load_mission` reads one by.
        method: Planning method, as a function or by its name, instead of the mission's own.
        seed: Source of every draw, instead of the mission's own.
        pace: Instead of `planner.pace`: a share of the fastest flight, above 0 up to 1, or "nominal".
        progress: Told a sentence and the share done, 0 to 1.
        workers: Who improves robots' paths side by side; None does it here. The plan does not depend on it.
        known: What earlier searches and refinements found, where this is not the first plan that is asked for.

    Raises:
        BadInput: There is no such mission, or its file is at fault.
        Unsatisfiable: No word that these robots can fly satisfies the formula.
        Infeasible: A word exists, but no way between the hoops was found, or no speed within the limits keeps a vehicle's endurance.
        NotCertified: The sequence, or the words of a method of another package, break the formula.
        InternalError: The words of one of our methods fail in the checker.
    """
    import verify

    mission = with_pace(as_mission(mission), pace)
    if mission.soft_parts and mission.passages is None:
        from ltlplan.replanning.soft_parts import plan_with_soft_parts

        return plan_with_soft_parts(mission, partial(plan, method=method, seed=seed), progress or silent, known)
    made_at = partial(_made, partial(make_plan, method=method, seed=seed, progress=progress, workers=workers, known=known))
    try:
        made = made_at(mission)
    except Infeasible as error:
        made = planned_faster(with_seed(mission, seed), made_at, error)
    words = made.words
    if mission.spec.trace == "infinite" and len(words) > 1:
        return made  # its words are laps that begin together, which the certificate proves of the flight
    if made.precedences or made.meetings:
        verdict = verify.check_planned_order(made)
        if verdict.outcome == "undecided":
            doubt = f"That the words hold when robots wait for each other so is proved of the flight alone: {verdict.sentence}"
            made = made.noting(doubt)
    else:
        verdict = verify.check_team(mission.formula, words, team=mission.spec.team).sequential
    if verdict.outcome == "fails" and made.method == SEQUENCE:
        raise NotCertified(f"The sequence breaks the formula: {verdict.sentence}")
    if verdict.outcome == "fails" and (method is None or isinstance(method, str)) and made.method in PLANNING_METHODS.built_in:
        raise InternalError(f"The planner's words fail in the checker: {verdict.sentence}")
    if verdict.outcome == "fails":
        raise NotCertified(f"The words of the planning method '{made.method}' break the formula: {verdict.sentence}")
    return made.noting(*(f"Holds only vacuously: {part}" for part in verdict.vacuous))


def _made(make: Callable[[Mission], Plan], mission: Mission) -> Plan:
    """Return a mission's plan; where its formula is bounded in seconds, one whose flights are likely to come in time, where there is one."""
    if mission.timed_parts:
        from ltlplan.replanning.timing.plans_in_time import plan_in_time

        return plan_in_time(mission, make)
    return make(mission)


def plan_or_none(mission: Mission, *, method: PlanningMethod | str | None = None, known: Known | None = None) -> Plan | None:
    """Plan a mission where others were refused; None where there is no plan.

    Args:
        mission: What is asked.
        method: Planning method, as a function or by its name, instead of the mission's own.
        known: What earlier searches and refinements found.
    """
    try:
        return plan(mission, method=method, known=known)
    except NO_PLAN:
        return None


def plans_without(
    mission: Mission, spaces: Iterable[frozenset[Leg]], *, searches: int, known: Known | None = None
) -> Iterator[Member[frozenset[Leg], Plan]]:
    """Yield plans of the exact search that do without some legs, the cheapest first; those are left out that cannot.

    Args:
        mission: What is asked.
        spaces: Sets of legs to do without.
        searches: How many of them are tried.
        known: What earlier searches and refinements found.
    """

    def solve(shut: frozenset[Leg]) -> Iterator[tuple[float, Plan]]:
        other = plan_or_none(mission, method=without_legs(shut), known=known)
        if other is not None and not any(legs_of(other, name) & shut for name in other.robots):
            yield other.cost, other

    return iter(Partition(spaces, solve, searches=searches))


def legs_of(made: Plan, robot: str) -> frozenset[Leg]:
    """Return the legs that one robot of a plan flies from visit to visit.

    Args:
        made: The plan.
        robot: Its name.
    """
    does = made.robots[robot]
    return Itinerary(does.visits, does.word, does.cycle_visit).legs(made.mission, robot)


def as_mission(mission: Asked) -> Mission:
    """Return the mission that an argument means.

    Raises:
        BadInput: It means none, or one that is not allowed; all faults are listed.
    """
    if isinstance(mission, Mission):
        return check_mission(mission)
    if not isinstance(mission, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers may not check
        raise BadInput(f"A mission is a Mission, a path, or the name of a shipped mission, not {type(mission).__name__}.")
    return load_mission(mission)
