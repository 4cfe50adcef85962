"""Other words for a team whose planned ones no flight keeps: fewer robots in a region at once, or without one of the legs in conflict.

Whether robots have places beside each other, and ways past each other, is seen in refinement alone. What it says goes back to planning: a
region in which no places were found for so many robots holds fewer of them (`search.counts.capacities`), where the formula counts robots;
else each leg of the robots in conflict is shut in turn, and the cheapest answer is taken.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ltlplan.allocation import Context, Itinerary, Leg
from ltlplan.checked_plan import plan
from ltlplan.drafts import Draft
from ltlplan.logic.budget import Budget
from ltlplan.planner import SEQUENCE
from ltlplan.search.counts.capacities import holding
from ltlplan.search.method import knowing, without_legs
from verify.data import BadInput, Infeasible, InternalError, LtlplanError, NotCertified, Plan, Unsatisfiable, Witness
from verify.data.choices import PLANNING_METHODS

_OTHERS = 4
"""Other plans that are tried."""
_LEGS = 8
"""Legs that are shut in turn, each for one search."""
_BUDGET = Budget(states=20_000)
_NONE = (BadInput, Unsatisfiable, Infeasible, NotCertified, InternalError)


def flown_otherwise(draft: Draft, error: LtlplanError) -> Draft | None:
    """Return a plan of other words, in the place of one that robots cannot fly beside each other; None where there is none, or enough of them were tried.

    Args:
        draft: The plan, and what was tried before.
        error: What refinement or the judge said of it.
    """
    made, witness = draft.plan, _conflict(error)
    if witness is None or draft.others >= _OTHERS or len(made.robots) < 2:
        return None
    if made.method == SEQUENCE or made.method not in PLANNING_METHODS.built_in:
        return None
    found = _with_fewer_in_a_region(draft, witness) or _without_a_leg(draft, witness)
    if found is None:
        return None
    why = draft.given_up or str(error)
    note = f"The words planned first were given up for others, as no flight of theirs was found. {why}"
    bound = None if draft.plan.lower_bound is None else min(draft.plan.lower_bound, found.plan.cost)
    changes = {"lower_bound": bound, "complete": False, "method": made.method, "notes": (*found.plan.notes, note)}
    other = found.plan.model_copy(update=changes)
    return replace(found, plan=other, witnesses=(), begun=draft.rounds, others=draft.others + 1, given_up=why)


def no_other_words(draft: Draft, error: LtlplanError) -> LtlplanError:
    """Return the error for a plan that was given up, with what became of other words.

    Args:
        draft: The last plan that was tried.
        error: What was said of it.
    """
    witness = _conflict(error)
    if witness is None or draft.plan.mission.soft_parts or len(draft.plan.robots) < 2 or draft.plan.method == SEQUENCE:
        return error
    tried = (
        "No other words were found that would mend it."
        if draft.others == 0
        else f"Of {draft.others} other {'plan' if draft.others == 1 else 'plans'}, with other words, no flight was found either."
    )
    sentence = f"{draft.given_up or error} {tried}"
    return NotCertified(sentence, error.witnesses) if isinstance(error, NotCertified) else Infeasible(sentence, witness)


def _conflict(error: LtlplanError) -> Witness | None:
    """Return what robots are refused for that others may have room for: they come too near each other, or wait in a circle."""
    witnesses = (
        error.witnesses if isinstance(error, NotCertified) else (error.witness,) if isinstance(error, Infeasible) else ()
    )
    return next((each for each in witnesses if each is not None and each.claim in ("separation", "formula")), None)


def _with_fewer_in_a_region(draft: Draft, witness: Witness) -> Draft | None:
    made, known = draft.plan, dict(draft.rooms)
    if not made.mission.written.counts:
        return None
    for region, most in _too_full(made, witness, known):
        rooms = {**known, region: most}
        try:
            with holding(rooms), knowing((), _BUDGET):
                other = plan(made.mission, method=made.method)
        except _NONE:
            continue
        if _does(other) != _does(made):
            return replace(draft, plan=other, rooms=tuple(rooms.items()))
    return None


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


def _without_a_leg(draft: Draft, witness: Witness) -> Draft | None:
    made, best = draft.plan, None
    for legs in _legs(made, witness):
        shut = draft.shut | legs
        try:
            with holding(dict(draft.rooms)), knowing((), _BUDGET):
                found = without_legs(shut)(made.mission, Context(np.random.default_rng(made.seed)))
        except _NONE:
            continue
        if any(does.legs(made.mission, name) & shut for name, does in found.robots.items()):
            continue
        if best is None or found.cost < best[0]:
            best = found.cost, shut
    if best is None:
        return None
    try:
        with holding(dict(draft.rooms)), knowing((), _BUDGET):
            other = plan(made.mission, method=without_legs(best[1]))
    except _NONE:
        return None
    return None if _does(other) == _does(made) else replace(draft, plan=other, shut=best[1])


def _legs(made: Plan, witness: Witness) -> Iterator[frozenset[Leg]]:
    """Yield legs of the robots in conflict to be shut, last ones first; where robots are counted, for all that are like them."""
    mission = made.mission
    names = [name for name in (witness.robot, witness.other) if name in made.robots] or list(made.robots)
    found: dict[frozenset[Leg], None] = {}
    for name in names:
        does = made.robots[name]
        for robot, before, region in sorted(Itinerary(does.visits, does.word, does.cycle_visit).legs(mission, name), key=str):
            counted = mission.written.counts and isinstance(before, str)
            alike = [o for o in mission.agents if mission.alike_as(o) == mission.alike_as(robot)] if counted else [robot]
            found[frozenset((other, before, region) for other in alike)] = None
    yield from list(found)[:_LEGS]


def _does(made: Plan) -> tuple[object, ...]:
    """Return what tells two plans apart: words, visits, and who waits for whom."""
    return made.words, [robot.visits for robot in made.robots.values()], made.precedences, made.meetings
