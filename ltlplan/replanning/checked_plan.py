"""A mission's plan, whose words were checked as words: what the pipeline begins with, and asks for again where no flight keeps a plan."""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING

from ltlplan.missions import load_mission
from ltlplan.planner import SEQUENCE, make_plan, with_pace, with_seed
from ltlplan.replanning.faster_flights import planned_faster
from verify.data import BadInput, Infeasible, InternalError, Mission, NotCertified, Plan, Unsatisfiable, check_mission
from verify.data.choices import PLANNING_METHODS
from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from flight.processes import Workers
    from ltlplan.allocation import Known, PlanningMethod

Asked = Mission | str | os.PathLike[str]
NO_PLAN = (BadInput, Unsatisfiable, Infeasible, NotCertified, InternalError)
"""Why there may be no other plan."""


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
    from verify import check_team, check_word
    from verify.trace_checking.planned_order import check_planned_order

    mission = with_pace(as_mission(mission), pace)
    if mission.soft_parts and mission.passages is None:
        from ltlplan.replanning.soft_parts import plan_with_soft_parts

        return plan_with_soft_parts(mission, partial(plan, method=method, seed=seed), progress or silent)
    made_at = partial(make_plan, method=method, seed=seed, progress=progress, workers=workers, known=known)
    try:
        made = made_at(mission)
    except Infeasible as error:
        made = planned_faster(with_seed(mission, seed), made_at, error)
    words = made.words
    if mission.spec.trace == "infinite" and len(words) > 1:
        return made  # its words are laps that begin together, which the certificate proves of the flight
    if mission.spec.trace == "infinite":
        (word,) = words.values()
        verdict = check_word(mission.formula, word.prefix, word.cycle)
    elif made.precedences or made.meetings:
        verdict = check_planned_order(made)
        if verdict.outcome == "undecided":
            doubt = f"That the words hold when robots wait for each other so is proved of the flight alone: {verdict.sentence}"
            made = made.model_copy(update={"notes": (*made.notes, doubt)})
    else:
        verdict = check_team(mission.formula, words, team=mission.spec.team).sequential
    if verdict.outcome == "fails" and made.method == SEQUENCE:
        raise NotCertified(f"The sequence breaks the formula: {verdict.sentence}")
    if verdict.outcome == "fails" and (method is None or isinstance(method, str)) and made.method in PLANNING_METHODS.built_in:
        raise InternalError(f"The planner's words fail in the checker: {verdict.sentence}")
    if verdict.outcome == "fails":
        raise NotCertified(f"The words of the planning method '{made.method}' break the formula: {verdict.sentence}")
    vacuous = tuple(f"Holds only vacuously: {part}" for part in verdict.vacuous)
    return made.model_copy(update={"notes": (*made.notes, *vacuous)}) if vacuous else made


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
