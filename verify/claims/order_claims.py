"""Claims about the order of events: the planned words satisfy the formula under the plan's precedences, and the flight keeps each of them.

The times of an event are enclosed (`flown_visits`). A precedence is kept where the second event comes later than the first by more than
the clocks may be off, wherever in their enclosures both are; of visits of a lap, in every lap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction

from verify.claims.claim import Claim, at_least, claim_of
from verify.claims.evidence import Evidence
from verify.claims.flown_visits import FlownVisits, Wait
from verify.data.plan import Plan
from verify.model_checking.timeline import Enclosure, Timeline
from verify.motion.visits import Matching
from verify.trace_checking.planned_order import check_planned_order
from verify.trace_checking.team_verdict import check_team


def ordered_claims(plan: Plan) -> tuple[Claim, ...]:
    """Every team word that keeps the plan's precedences and meetings satisfies the formula.

    None where the plan has none, where the budget does not suffice, and where they are not what the words rest on: words that satisfy
    the formula in every order of the robots may have waits for their flight's sake alone.

    Args:
        plan: What was planned; carries the mission.
    """
    if plan.mission.spec.trace == "infinite" or not (plan.precedences or plan.meetings):
        return ()
    verdict = check_planned_order(plan)
    if verdict.outcome == "undecided":
        return ()
    if verdict.outcome == "fails" and check_team(plan.mission.formula, plan.words, plan.mission.spec.team).sequential:
        return ()
    witness = None if verdict.outcome == "holds" else verdict.witness()
    return (Claim("ordered", verdict.outcome, verdict.sentence, robot=verdict.robot, witness=witness),)


def precedence_claims(
    evidence: Evidence, matchings: Mapping[str, Matching], timelines: Mapping[str, Timeline], clock_error: Fraction
) -> Iterator[Claim]:
    """Yield for each precedence and meeting of a plan that the flight keeps it by more than the clocks may be off, in every lap.

    Args:
        evidence: What was planned and is flown.
        matchings: Each robot's planned visits and their stays.
        timelines: Each robot's actions, and when the flight ends.
        clock_error: How far apart the robots' clocks may be, s.
    """
    plan, paths = evidence.plan, evidence.paths
    waits = (*plan.precedences, *plan.meetings)
    names = {name for wait in waits for name in (wait.first[0], wait.then[0])}
    flown = {
        name: FlownVisits.of(matchings[name], timelines[name], paths.trajectories[index], paths.knots[index])
        for index, name in enumerate(paths.robots)
        if name in names
    }
    for wait in waits:
        (first, i), (then, j) = wait.first, wait.then
        sentence = wait.sentence(plan.robots)
        if flown[first].makes(i) and flown[then].makes(j):
            yield _kept(wait, sentence, _times(wait, flown[first], flown[then]), clock_error)
        else:
            sentence = f"That {sentence} is not proved: not all of these visits are made."
            yield claim_of("precedences", "undecided", sentence, robot=then, other=first, visit=j)


def _times(wait: Wait, first: FlownVisits, then: FlownVisits) -> list[tuple[Enclosure | None, Enclosure]]:
    """Return when what is waited for is done and what waits happens: once, or of a lap's visit in the first and in the second lap.

    All later laps are flown as the second one. What never happens has to wait for nothing.
    """
    (_, i), (_, j) = wait.first, wait.then
    times: list[tuple[Enclosure | None, Enclosure]] = []
    for lap in (0, 1) if then.repeats(j) else (0,):
        due = then.due(j, wait, lap)
        if due is not None:
            times.append((first.done(i, wait, lap if first.repeats(i) else 0), due))
    return times


def _kept(wait: Wait, text: str, times: list[tuple[Enclosure | None, Enclosure]], clock_error: Fraction) -> Claim:
    (first, _), (then, visit) = wait.first, wait.then
    if not times:
        return claim_of("precedences", "holds", f"{then} never does what would have to wait: {text}.", robot=then, other=first)
    known = [(done, due) for done, due in times if done is not None]
    if len(known) < len(times):
        sentence = f"It is not so that {text}: {first} never does what is waited for."
        return claim_of("precedences", "fails", sentence, robot=then, other=first, visit=visit)
    done, due = min(known, key=lambda pair: pair[1].low - pair[0].high)
    gap = due.low - done.high
    if gap > clock_error:
        outcome, where = "holds", None
        what = f"In flight {text}, by at least {at_least(gap)} s{_of_clocks(clock_error)}."
    else:
        outcome = "fails" if any(due.high - done.low <= clock_error for done, due in known) else "undecided"
        late = f"that may come at {float(due.low):.4f} s, and what it waits for as late as {float(done.high):.4f} s"
        what, where = f"It is not {_NOT[outcome]} that {text}, by more than {float(clock_error):g} s: {late}.", visit
    return claim_of(
        "precedences", outcome, what, robot=then, other=first, unit="s", bound=_rounded_down(gap), limit=float(clock_error),
        margin=_rounded_down(gap - clock_error), time=float(due.low), visit=where, what="wait" if where is not None else "",
    )  # fmt: skip


def _of_clocks(error: Fraction) -> str:
    return f", of which clocks that differ may take {float(error):g} s" if error else ""


def _rounded_down(value: Fraction) -> float:
    near = float(value)
    return near if near <= value else math.nextafter(near, -math.inf)


_NOT = {"fails": "so", "undecided": "proved"}
