"""Other words for a team whose planned ones no flight keeps: fewer robots in a region at once, or without one of the legs in conflict.

Whether robots have places beside each other, and ways past each other, is seen in refinement alone. What it says goes back to planning: a
region in which no places were found for so many robots holds fewer of them (`search.counting.capacities`), where the formula counts robots;
else each leg of the robots in conflict is shut in turn. Where that does not do, one of them steps aside (`stepping_aside`). Of the answers those are taken first whose visits can be made one after another so
that nobody rests where another one comes to, the cheapest ones first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from ltlplan.allocation import Known, Leg
from ltlplan.logic.budget import Budget
from ltlplan.replanning.checked_plan import legs_of, plan_or_none, plans_without
from ltlplan.replanning.cuts import Candidate, Cut, CutKind, digest
from ltlplan.replanning.refusal import Refusal
from ltlplan.replanning.stepping_aside import aside
from ltlplan.search.orders.planned_words import hold_under_precedences, systems_of_words
from verify.data import Infeasible, LtlplanError, NotCertified, Plan, Witness
from verify.data.names.choices import PLANNING_METHODS

_OTHERS = 4
"""Other plans that are tried."""
_LEGS = 6
"""Legs that are shut in turn, each for one search."""
_BUDGET, _COUNTED = Budget(states=20_000), Budget(states=4_000)
"""Of a search for other words, and where robots are counted, whose states take ten times as long."""


def fewer_in_a_region(refusal: Refusal) -> Candidate | None:
    """Return a plan in which a region that is too full holds fewer robots; None where there is none, or enough others were tried.

    Args:
        refusal: The plan, and what refinement or the judge said of it.
    """
    witness = _conflict(refusal)
    return None if witness is None or not refusal.plan.mission.written.counts else _first_flyable(_with_fewer(refusal, witness))


def without_a_leg_in_conflict(refusal: Refusal) -> Candidate | None:
    """Return the cheapest plan that does without a leg of the robots in conflict; None where there is none, or enough others were tried.

    Args:
        refusal: The plan, and what refinement or the judge said of it.
    """
    witness = _conflict(refusal)
    if witness is None or (refusal.plan.mission.written.counts and witness.region is not None):
        return None  # a leg leaves no more room in a region
    return _first_flyable(_without_a_leg(refusal, witness))


def with_a_robot_aside(refusal: Refusal) -> Candidate | None:
    """Return a plan in which one of two robots in conflict steps aside; None where none has a place for that, or enough others were tried.

    Args:
        refusal: The plan, and what refinement or the judge said of it.
    """
    witness, made = _conflict(refusal), refusal.plan
    if witness is None or witness.claim != "separation" or witness.region is not None:
        return None
    if made.mission.spec.trace == "infinite" or made.meetings or made.precedences or len(_close(made, witness)) < 2:
        return None
    return _with_an_order(_answered(refusal, "aside", other) for other in aside(made, _close(made, witness)))


def no_other_words(refusal: Refusal) -> LtlplanError:
    """Return the error for a plan that was given up, with what became of other words.

    Args:
        refusal: The last plan that was tried, and what was said of it.
    """
    made, witness, error = refusal.plan, refusal.conflict, refusal.error
    if witness is None or made.mission.soft_parts or len(made.robots) < 2 or made.mission.passages is not None:
        return error
    others = refusal.tried.others
    words = "other words or a robot that steps aside" if refusal.tried.since("aside") else "other words"
    tried = (
        "No other words were found that would mend it."
        if others == 0
        else f"Of {others} other {'plan' if others == 1 else 'plans'}, with {words}, no flight was found either."
    )
    held = _held_letter(made) if witness.claim == "formula" else []
    first = _given_up(refusal.tried)
    sentence = " ".join([str(error) if first is None else first.why, tried, *held])
    if isinstance(error, NotCertified):
        return NotCertified(sentence, error.witnesses)
    obstruction = getattr(error, "obstruction", None) if first is None else first.obstruction
    found = Infeasible(sentence, witness)
    return found if obstruction is None else found.because(obstruction.saying(tried, *held))


def _conflict(refusal: Refusal) -> Witness | None:
    """Return what other words may mend; None where no more of them are tried."""
    made = refusal.plan
    if made.mission.soft_parts or refusal.tried.others >= _OTHERS or len(made.robots) < 2:
        return None
    return refusal.conflict if made.method in PLANNING_METHODS.built_in else None


def _first_flyable(others: Iterable[Candidate | None]) -> Candidate | None:
    """Return the first candidate whose visits can be made one after another, else the first one; with a note on the words that are given up."""
    best = _with_an_order(others)
    if best is None:
        return None
    first = _given_up(best)
    why = "" if first is None else first.why if first.obstruction is None else first.obstruction.what
    note = f"The words planned first were given up for others, as no flight of theirs was found. {why}".rstrip()
    return replace(best, plan=best.plan.noting(note).model_copy(update={"complete": False}))


def _with_an_order(others: Iterable[Candidate | None]) -> Candidate | None:
    """Return the first candidate whose visits can be made one after another, else the first one."""
    from refine.coordination.alternative_ways import has_an_order

    found = [other for other in others if other is not None]
    return next((other for other in found if has_an_order(other.plan)), found[0] if found else None)


def _held_letter(made: Plan) -> list[str]:
    """Return which letter breaks a formula of `own` that the words satisfy in a single order, and whether `joint` has a plan."""
    from ltlplan.search.explanations.held_letters import held_letter

    mission, systems = made.mission, systems_of_words(made)
    if mission.spec.team == "joint" or mission.spec.trace == "infinite" or systems is None or hold_under_precedences(made):
        return []
    return held_letter(
        mission, systems, mission.formula, lambda asked: plan_or_none(asked, known=Known(budget=_BUDGET)) is not None
    )


def _given_up(candidate: Candidate) -> Cut | None:
    """Return the cut by which the words planned first were given up; None before that."""
    return next(iter(candidate.since("legs", "aside", "capacity")), None)


def _answered(refusal: Refusal, kind: CutKind, other: Plan | None, **forbidden: Any) -> Candidate | None:
    """Return the candidate of other words, under the first ones' bound; None where they were tried before."""
    made, own = refusal.plan, digest(refusal.plan)
    if other is None or digest(other) in {own, *(before.plan for before in refusal.tried.cuts)}:
        return None
    bound = None if made.lower_bound is None else min(made.lower_bound, other.cost)
    other = other.model_copy(update={"lower_bound": bound, "method": made.method})
    return refusal.answered(kind, other, anew=True, plan=own, **forbidden)


def _with_fewer(refusal: Refusal, witness: Witness) -> Iterator[Candidate | None]:
    """Yield plans in which regions that are too full hold fewer robots."""
    made, capacities = refusal.plan, refusal.tried.capacities
    for region in _shared_regions(made, witness):
        ends = [robot.ends_in == region for robot in made.robots.values()]
        visits = [any(visit.region == region for visit in robot.visits) for robot in made.robots.values()]
        close = [made.robots[name] for name in _close(made, witness)]
        found = sum(ends if all(robot.ends_in == region for robot in close) else visits)
        most = min(found, capacities.get(region, found)) - 1
        if most >= 1:
            known = Known(budget=refusal.budget.beside(_COUNTED), capacities={**capacities, region: most})
            yield _answered(
                refusal, "capacity", plan_or_none(made.mission, method=made.method, known=known), capacity=(region, most)
            )


def _close(made: Plan, witness: Witness) -> list[str]:
    """Return the robots that come too near each other."""
    return [name for name in (witness.robot, witness.other) if name in made.robots]


def _shared_regions(made: Plan, witness: Witness) -> list[str]:
    """Return the region that is too full, or those that both robots visit which come too near each other."""
    if witness.region is not None:
        return [witness.region]
    visited = [{visit.region for visit in made.robots[name].visits} for name in _close(made, witness)]
    return sorted(set.intersection(*visited)) if len(visited) == 2 else []


def _without_a_leg(refusal: Refusal, witness: Witness) -> Iterator[Candidate | None]:
    """Yield plans that do without a leg of the robots in conflict, the cheapest one first."""
    made, mission, candidate = refusal.plan, refusal.plan.mission, refusal.tried
    budget = refusal.budget.beside(_COUNTED if mission.written.counts else _BUDGET)
    known = Known(budget=budget, capacities=candidate.capacities)

    spaces = (candidate.legs | legs for legs in _legs(made, witness))
    for _, _, shut, other in plans_without(mission, spaces, searches=_LEGS, known=known):
        if witness.claim != "formula" or hold_under_precedences(other):
            yield _answered(refusal, "legs", other, legs=shut)


def _legs(made: Plan, witness: Witness) -> Iterator[frozenset[Leg]]:
    """Yield legs of the robots in conflict to be shut; where robots are counted, for all that are like them."""
    mission = made.mission
    for name in _close(made, witness) or made.robots:
        for robot, before, region in sorted(legs_of(made, name), key=str):
            counted = mission.written.counts and isinstance(before, str)
            alike = [o for o in mission.agents if mission.alike_as(o) == mission.alike_as(robot)] if counted else [robot]
            yield frozenset((other, before, region) for other in alike)
