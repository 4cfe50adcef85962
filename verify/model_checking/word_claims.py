"""The two claims about words that a certificate makes, decided on label timelines.

`judge_formula`: every team word that the timelines leave possible satisfies the mission's formula. `judge_transitions`:
every word of every robot is a trace of its A = E x R, environment times robot. Timelines say *may* where the margin
leaves it open, and both claims must hold whatever the robot does there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from verify.data.errors import BadInput
from verify.data.language.counting import atoms
from verify.data.language.formula import FALSE
from verify.data.mission import Mission
from verify.logic.progression import OutOfBudget
from verify.logic.verdict import Verdict
from verify.model_checking.formula_judge import Detail, FormulaJudge, Times
from verify.model_checking.inclusion import DEFAULT_BUDGET
from verify.model_checking.team_laps import require_common_laps
from verify.model_checking.timeline import Relations, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge
from verify.model_checking.transitions import judge_transitions

__all__ = ["judge_formula", "judge_transitions", "judged_as_one"]

_MANY = 100
"""Names in a formula up to which all of them are followed."""


# seven parameters: three say what is checked, the rest how, each by its keyword
def judge_formula(
    mission: Mission,
    timelines: Mapping[str, Timeline],
    relations: Relations,
    *,
    clock_error: Fraction = Fraction(0),
    times: Times = "timed",
    budget: int = DEFAULT_BUDGET,
    detail: Detail = "counterexample",
) -> list[Verdict]:
    """Decide whether every team word satisfies the mission's formula, and the flight each part that is bounded in seconds.

    Args:
        mission: Carries the formula, the trace and the reading.
        timelines: One for each robot.
        relations: What is proved of the regions at large.
        clock_error: How far each robot's clock may be off, in s; widens what can be simultaneous.
        times: "timed" for the certified times, "parallel" for any times that keep each robot's own order.
        budget: Configurations that each part of the formula may take before the answer is `undecided`.
        detail: What is said of a formula that fails: nothing else ("answer", for a search), or a counterexample.

    Returns:
        One verdict for the claim "formula", then one for the claim "timing" of each part that is bounded in seconds.

    Raises:
        InternalError: Our progression and Spot disagree, or the timelines contradict themselves.
        MissingEngine: Spot is absent.
    """
    if not timelines:
        raise BadInput("There are no timelines to check: a team has at least one robot.")
    asked = mission.spec.trace == "infinite"
    if any((timeline.cycle is not None) != asked for timeline in timelines.values()):
        raise BadInput(
            f"The mission's trace is {mission.spec.trace}, so its flights must {'' if asked else 'not '}have a cycle."
        )
    if clock_error < 0:
        raise BadInput(f"clock_error must not be negative, not {float(clock_error):g} s.")
    if asked and len(timelines) > 1:
        require_common_laps(timelines)
        if times == "parallel":
            raise BadInput("Synchronised cycles are checked by their times; `parallel` is for finite traces.")
    formula = mission.formula
    if len(formula.names()) > _MANY:  # of a thousand regions a flight comes to a few
        formula = formula.substitute(dict.fromkeys(_never_shown(timelines), FALSE))
    try:
        verdict = FormulaJudge(mission, timelines, relations, clock_error, times, budget, detail, atoms(formula)).judge(formula)
    except OutOfBudget as error:
        verdict = Verdict("undecided", f"The formula could not be decided: {error}.")
    parts = mission.timed_parts
    if parts and times == "parallel":
        raise BadInput("Bounds in seconds are checked by the times of a flight; `parallel` asks for no times.")
    judge = TimedJudge(timelines, relations, clock_error)
    return [verdict, *(judge.judge(part, slack=detail != "answer") for part in parts)]


def judged_as_one(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the verdict that decides for all of them: the first that fails, else the first that is undecided, else the first."""
    return min(verdicts, key=lambda verdict: ("fails", "undecided", "holds").index(verdict.outcome))


def _never_shown(timelines: Mapping[str, Timeline]) -> frozenset[str]:
    """Return the regions that no robot can be in at any time."""
    every = {region for timeline in timelines.values() for region in timeline.initial}
    shown = {region for t in timelines.values() for region, status in t.initial.items() if status != "no"}
    return frozenset(every - shown - {change.region for timeline in timelines.values() for change in timeline.changes})
