"""Other words for a team whose planned ones no flight keeps: fewer robots in a region at once, or without one of the legs in conflict.

Whether robots have places beside each other, and ways past each other, is seen in refinement alone. What it says goes back to planning: a
region in which no places were found for so many robots holds fewer of them (`search.counting.capacities`), where the formula counts robots;
else each leg of the robots in conflict is shut in turn. Of the answers those are taken first whose visits can be made one after another so
that nobody rests where another one comes to, the cheapest ones first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from ltlplan.allocation import Context, Itinerary, Known, Leg
from ltlplan.logic.budget import Budget
from ltlplan.planner import SEQUENCE
from ltlplan.precedences import hold_under_precedences
from ltlplan.replanning.checked_plan import plan
from ltlplan.replanning.cuts import Candidate, digest
from ltlplan.replanning.refusals import Refusal
from ltlplan.search.lawler import Partition
from ltlplan.search.method import without_legs
from verify.data import BadInput, Infeasible, InternalError, LtlplanError, Mission, NotCertified, Plan, Unsatisfiable, Witness
from verify.data.choices import PLANNING_METHODS

_OTHERS = 4
"""Other plans that are tried."""
_LEGS = 6
"""Legs that are shut in turn, each for one search."""
_BUDGET, _COUNTED = Budget(states=20_000), Budget(states=4_000)
"""Of a search for other words, and where robots are counted, whose states take ten times as long."""
_NONE = (BadInput, Unsatisfiable, Infeasible, NotCertified, InternalError)


def fewer_in_a_region(refusal: Refusal) -> Candidate | None:
    """Return a plan in which a region that is too full holds fewer robots; None where there is none, or enough others were tried.

    Args:
        refusal: The plan, and what refinement or the judge said of it.
    """
    return _first_flyable(_with_fewer(refusal)) if _asks_for_room(refusal) and refusal.plan.mission.written.counts else None


def without_a_leg_in_conflict(refusal: Refusal) -> Candidate | None:
    """Return the cheapest plan that does without a leg of the robots in conflict; None where there is none, or enough others were tried.

    Args:
        refusal: The plan, and what refinement or the judge said of it.
    """
    if not _asks_for_room(refusal):
        return None
    full = refusal.conflict is not None and refusal.conflict.region is not None
    if refusal.plan.mission.written.counts and full:
        return None  # a leg leaves no more room in it
    return _first_flyable(_without_a_leg(refusal))


def no_other_words(refusal: Refusal) -> LtlplanError:
    """Return the error for a plan that was given up, with what became of other words.

    Args:
        refusal: The last plan that was tried, and what was said of it.
    """
    made, witness, error = refusal.plan, refusal.conflict, refusal.error
    if witness is None or made.mission.soft_parts or len(made.robots) < 2 or made.method == SEQUENCE:
        return error
    others = refusal.tried.others
    tried = (
        "No other words were found that would mend it."
        if others == 0
        else f"Of {others} other {'plan' if others == 1 else 'plans'}, with other words, no flight was found either."
    )
    held = _held_letter(made) if witness.claim == "formula" else []
    sentence = " ".join([_given_up(refusal.tried) or str(error), tried, *held])
    return NotCertified(sentence, error.witnesses) if isinstance(error, NotCertified) else Infeasible(sentence, witness)


def _asks_for_room(refusal: Refusal) -> bool:
    made = refusal.plan
    if made.mission.soft_parts or refusal.conflict is None or refusal.tried.others >= _OTHERS or len(made.robots) < 2:
        return False
    return made.method != SEQUENCE and made.method in PLANNING_METHODS.built_in


def _first_flyable(others: Iterable[Candidate | None]) -> Candidate | None:
    """Return the first candidate whose visits can be made one after another, else the first one; with a note on the words that are given up."""
    from refine.coordination.alternative_ways import has_an_order

    found = [other for other in others if other is not None]
    best = next((other for other in found if has_an_order(other.plan)), found[0] if found else None)
    if best is None:
        return None
    note = f"The words planned first were given up for others, as no flight of theirs was found. {_given_up(best)}"
    return replace(best, plan=best.plan.model_copy(update={"complete": False, "notes": (*best.plan.notes, note)}))


def _held_letter(made: Plan) -> list[str]:
    """Return which letter breaks a formula of `own` that the words satisfy in a single order, and whether `joint` has a plan."""
    from ltlplan.search.explanations.held_letters import held_letter
    from ltlplan.search.partial_orders.planned_words import systems_of_words

    if made.mission.spec.team == "joint" or made.mission.spec.trace == "infinite" or hold_under_precedences(made):
        return []
    systems = systems_of_words(made)
    return [] if systems is None else held_letter(made.mission, systems, made.mission.formula, _can_be_planned)


def _can_be_planned(mission: Mission) -> bool:
    try:
        plan(mission)
    except _NONE:
        return False
    return True


def _given_up(candidate: Candidate) -> str | None:
    """Return why the words planned first were given up; None before that."""
    return next((cut.why for cut in candidate.since("legs", "capacity")), None)


def _answered(refusal: Refusal, other: Plan, **forbidden: object) -> Candidate | None:
    """Return the candidate of other words, under the first ones' bound; None where they were tried before."""
    made, own = refusal.plan, digest(refusal.plan)
    if digest(other) in {own, *(before.plan for before in refusal.tried.cuts)}:
        return None
    bound = None if made.lower_bound is None else min(made.lower_bound, other.cost)
    other = other.model_copy(update={"lower_bound": bound, "method": made.method})
    kind = "capacity" if "capacity" in forbidden else "legs"
    return refusal.answered(kind, other, why=str(refusal.error), anew=True, plan=own, **forbidden)


def _with_fewer(refusal: Refusal) -> Iterator[Candidate | None]:
    """Yield plans in which regions that are too full hold fewer robots."""
    made, known, witness = refusal.plan, refusal.tried.capacities, refusal.conflict
    for region, most in _too_full(made, witness, known) if witness is not None else ():
        given = Known(budget=_COUNTED, capacities={**known, region: most})
        try:
            other = plan(made.mission, method=made.method, known=given)
        except _NONE:
            continue
        yield _answered(refusal, other, capacity=(region, most))


def _too_full(made: Plan, witness: Witness, known: Mapping[str, int]) -> Iterator[tuple[str, int]]:
    """Yield regions which are too full for those who come too near each other, with how many robots they may hold."""
    pair = [made.robots[name] for name in (witness.robot, witness.other) if name is not None and name in made.robots]
    own = [{visit.region for visit in robot.visits} for robot in pair]
    common = set[str].intersection(*own) if len(own) == 2 else set[str]()
    for region in [witness.region] if witness.region is not None else sorted(common):
        robots = sum(any(visit.region == region for visit in robot.visits) for robot in made.robots.values())
        ending = sum(robot.waypoints[-1].region == region for robot in made.robots.values())
        found = ending if all(robot.waypoints[-1].region == region for robot in pair) else robots
        most = min(found, known.get(region, found)) - 1
        if most >= 1:
            yield region, most


def _without_a_leg(refusal: Refusal) -> Iterator[Candidate | None]:
    """Yield plans that do without a leg of the robots in conflict, the cheapest one first."""
    made, candidate = refusal.plan, refusal.tried
    budget = _COUNTED if made.mission.written.counts else _BUDGET
    known = Known(budget=budget, capacities=candidate.capacities)
    about_words = refusal.conflict is not None and refusal.conflict.claim == "formula"

    def solve(shut: frozenset[Leg]) -> Iterator[tuple[float, frozenset[Leg]]]:
        try:
            found = without_legs(shut)(made.mission, Context(np.random.default_rng(made.seed), known=known))
        except _NONE:
            return
        if not any(does.legs(made.mission, name) & shut for name, does in found.robots.items()):
            yield found.cost, shut

    spaces = (candidate.legs | legs for legs in _legs(refusal))
    for _, _, shut, _ in Partition(spaces, solve, searches=_LEGS):
        try:
            other = plan(made.mission, method=without_legs(shut), known=known)
        except _NONE:
            continue
        if not about_words or hold_under_precedences(other):
            yield _answered(refusal, other, legs=shut)


def _legs(refusal: Refusal) -> Iterator[frozenset[Leg]]:
    """Yield legs of the robots in conflict to be shut; where robots are counted, for all that are like them."""
    made, mission, witness = refusal.plan, refusal.plan.mission, refusal.conflict
    pair = () if witness is None else (witness.robot, witness.other)
    for name in [name for name in pair if name in made.robots] or list(made.robots):
        does = made.robots[name]
        for robot, before, region in sorted(Itinerary(does.visits, does.word, does.cycle_visit).legs(mission, name), key=str):
            counted = mission.written.counts and isinstance(before, str)
            alike = [o for o in mission.agents if mission.alike_as(o) == mission.alike_as(robot)] if counted else [robot]
            yield frozenset((other, before, region) for other in alike)
