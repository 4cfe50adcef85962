"""Candidates for certification, one after another: what is refused of one decides which alternative comes next.

    for candidate in candidates(first, refused): refused.append(refine and judge the candidate)

`_ALTERNATIVES` lists what may be tried, by the reason of the refusal, in the order in which it is tried. The first alternative that has
a plan makes the next candidate: its words are others, or the same with one wait, precedence or counterexample more, and each kind of change has
a bound, so that every stream ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.paths.costs import for_mission
from ltlplan.replanning.checked_plan import paced, plan_or_none
from ltlplan.replanning.conflict_alternatives import (
    fewer_in_a_region,
    no_other_words,
    with_a_robot_aside,
    without_a_leg_in_conflict,
)
from ltlplan.replanning.cuts import Candidate, Conflict, Flight, greatest_pace
from ltlplan.replanning.refusal import Reason, Refusal
from ltlplan.replanning.soft_alternatives import (
    fewer_soft_parts,
    other_words,
    same_words_under_precedences,
    without_a_leg,
    words_under_precedences,
)
from ltlplan.replanning.timing.other_orders import in_another_order, no_other_order, shared_for_time
from ltlplan.replanning.timing.timetable import timetable
from ltlplan.search.orders.planned_words import with_planned_waits
from verify.data import LtlplanError, Plan, Unsatisfiable
from verify.data.plan import Hover
from verify.data.sections import GENTLE

_PLACES = 3
"""Decimals of hovers, s, and of paces; both are rounded up."""

_GENTLER = 2
"""How often times are chosen anew before a flight of the same words has to be as fast as it may be."""

Alternative = Callable[[Refusal], Candidate | None]
"""From a refusal to the next candidate; None where the alternative has none, or does not apply."""


def candidates(first: Candidate, refused: Iterable[Flight | Conflict], budget: Budget = DEFAULT_BUDGET) -> Iterator[Candidate]:
    """Yield a plan, then what follows from each refusal; lazily, and the same for the same plan, cuts and refusals.

    The stream ends where nothing is left to try. That proves nothing of the mission, as some cuts were only tried: the bound of a plan whose
    words were changed stays the bound of the first problem.

    Args:
        first: The mission's plan, or a stored candidate to go on from.
        refused: What became of each candidate so far; it may grow while the stream is read.
        budget: Bounds on the searches for other plans.
    """
    yield first
    for found in refused:
        refusal, best = Refusal.of(first, found, budget), first.better_of(found)
        answers = (alternative(refusal) for alternative in _ALTERNATIVES[refusal.reason])
        candidate = next((answer for answer in answers if answer is not None), None)
        if candidate is None:
            return
        first = replace(candidate, certified=best)
        yield first


def no_flight(last: Candidate, found: Flight | Conflict) -> LtlplanError:
    """Return why a stream of candidates ended without a certified one.

    Args:
        last: The last candidate.
        found: What became of it.
    """
    refusal = Refusal.of(last, found)
    timed = bool(refusal.plan.mission.timed_parts and last.since("visits"))
    return no_other_order(refusal) if timed else no_other_words(refusal)


def _as_fast_as_may_be(refusal: Refusal) -> Candidate | None:
    """Return the same plan at pace 1; None where it was flown so."""
    mission = refusal.plan.mission
    if refusal.tried.pace is not None or all(mission.pace_of(name) == 1.0 for name in mission.agents):
        return None
    note = "Flown as fast as the limits allow: at the mission's pace the flight would outlast a vehicle's endurance."
    return refusal.answered("pace", refusal.plan.noting(note))


def _shared_by_nominal_times(refusal: Refusal) -> Candidate | None:
    """Return another plan, which keeps endurances at nominal times too: planning counted on faster flights than were found."""
    other = None if refusal.tried.since("sharing") else _at_nominal_times(refusal)
    return None if other is None or other.robots == refusal.plan.robots else refusal.answered("sharing", other, anew=True)


def _flown_at_nominal_times(refusal: Refusal) -> Candidate | None:
    """Return a plan of nominal times that is flown so; None where one was tried, as refinement does where it finds no flight."""
    mission, tried = refusal.plan.mission, refusal.tried.pace == "nominal" or not isinstance(refusal.found, Flight)
    if tried or all(mission.pace_of(name) == "nominal" for name in mission.agents):
        return None
    other = _at_nominal_times(refusal)
    if other is None or (refusal.impossible and other.words == refusal.plan.words):
        return None
    note = "No faster flight was certified: the plan's own times are flown."
    return refusal.answered("tracking", other.noting(note), anew=True)


def _at_nominal_times(refusal: Refusal) -> Plan | None:
    """Return a plan's mission planned at nominal times; None where there is no such plan."""
    made = refusal.plan
    other = plan_or_none(paced(made.mission, "nominal", made.mission.agents), method=made.method, known=refusal.known)
    return None if other is None else for_mission(other, made.mission).model_copy(update={"lower_bound": made.lower_bound})


def _on_time(refusal: Refusal) -> Candidate | None:
    """Return the same words, flown as gently as what is bounded in seconds allows, with the hovers that it asks for; None without such times."""
    found = refusal.found
    if not isinstance(found, Flight) or not found.plan.mission.timed_parts:
        return None
    flown, greatest, tried = refusal.tried.pace_flown, greatest_pace(found.plan.mission), refusal.tried.timed
    gentle = min(GENTLE, greatest)
    least = gentle + (greatest - gentle) * min(len(tried) / _GENTLER, 1.0)
    times = timetable((found.plan, found.team, found.certificate), paces=(least, greatest), flown=flown)
    if times is None:
        return None
    pace = min(_up(flown / times.stretch), greatest)
    hovers = tuple(Hover(robot=robot, visit=visit, seconds=_up(seconds)) for (robot, visit), seconds in times.hovers.items())
    plan = refusal.plan.model_copy(update={"hovers": hovers})
    if hovers == refusal.plan.hovers and pace == flown:
        return None
    return refusal.answered("times", plan, pace=pace)


def _up(value: float) -> float:
    """Return seconds, or a pace, rounded up."""
    return math.ceil(value * 10**_PLACES) / 10**_PLACES


def _planned_order(refusal: Refusal) -> Candidate | None:
    """Return words that may break the formula with precedences that planning finds for them, or others that hold under precedences."""
    if not refusal.breaks_formula:
        return None
    if refusal.impossible:
        return refusal.answered("order", words_under_precedences(refusal), proved=True)
    try:
        plan = with_planned_waits(refusal.plan)
    except Unsatisfiable:
        plan = words_under_precedences(refusal)
    return refusal.answered("order", plan)


def _same_words(refusal: Refusal) -> Candidate | None:
    """Return the same words, whose next flight keeps clear of the counterexamples."""
    return None if refusal.impossible else refusal.answered("waits", refusal.plan, witnesses=refusal.witnesses)


_OTHER_WORDS: tuple[Alternative, ...] = (
    fewer_in_a_region,
    without_a_leg_in_conflict,
    with_a_robot_aside,
    other_words,
    without_a_leg,
    fewer_soft_parts,
)
_ALTERNATIVES: dict[Reason, tuple[Alternative, ...]] = {
    "certified": (),
    "endurance": (_as_fast_as_may_be, _shared_by_nominal_times, *_OTHER_WORDS, _flown_at_nominal_times),
    "times": (_on_time, shared_for_time, in_another_order),
    "claims": (_planned_order, _same_words, *_OTHER_WORDS, _flown_at_nominal_times, in_another_order),
    "tracking": (),
    "no flight": (*_OTHER_WORDS, _flown_at_nominal_times, in_another_order),
    "soft parts": (same_words_under_precedences, other_words, without_a_leg),
    "no better": (without_a_leg,),
}
