"""Other words for a team whose planned ones no flight keeps: fewer robots in a region at once, or without one of the legs in conflict.

Whether robots have places beside each other, and ways past each other, is seen in refinement alone. What it says goes back to planning: a
region in which no places were found for so many robots holds fewer of them (`search.counts.capacities`), where the formula counts robots;
else each leg of the robots in conflict is shut in turn. Of the answers those are taken first whose visits can be made one after another so
that nobody rests where another one comes to, the cheapest ones first.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ltlplan.allocation import Context, Itinerary, Leg
from ltlplan.attempts.checked_plan import plan
from ltlplan.attempts.drafts import Draft
from ltlplan.logic.budget import Budget
from ltlplan.planner import SEQUENCE
from ltlplan.precedences import with_planned_waits
from ltlplan.search.counts.capacities import holding
from ltlplan.search.method import knowing, without_legs
from verify.data import BadInput, Infeasible, InternalError, LtlplanError, Mission, NotCertified, Plan, Unsatisfiable, Witness
from verify.data.choices import PLANNING_METHODS

_OTHERS = 4
"""Other plans that are tried."""
_LEGS = 6
"""Legs that are shut in turn, each for one search."""
_BUDGET, _COUNTED = Budget(states=20_000), Budget(states=4_000)
"""Of a search for other words, and where robots are counted, whose states take ten times as long."""
NO_WAITS = "Whatever robots wait for, these words do not satisfy the formula."
_NONE = (BadInput, Unsatisfiable, Infeasible, NotCertified, InternalError)


def flown_otherwise(draft: Draft, error: LtlplanError) -> Draft | None:
    """Return a plan of other words, in the place of one that robots cannot fly beside each other; None where there is none, or enough of them were tried.

    Args:
        draft: The plan, and what was tried before.
        error: What refinement or the judge said of it.
    """
    from refine.coordination.team_flights import has_an_order

    made, witness = draft.plan, _conflict(error)
    if witness is None or draft.others >= _OTHERS or len(made.robots) < 2:
        return None
    if made.method == SEQUENCE or made.method not in PLANNING_METHODS.built_in:
        return None
    draft = replace(draft, tried=(*draft.tried, _digest(made)))
    others = list(_with_fewer_in_a_region(draft, witness))
    if not others and not (made.mission.written.counts and witness.region is not None):  # a leg leaves no more room in it
        others = list(_without_a_leg(draft, witness))
    found = next((other for other in others if has_an_order(other.plan)), others[0] if others else None)
    if found is None:
        return None
    why = draft.given_up or str(error)
    note = f"The words planned first were given up for others, as no flight of theirs was found. {why}"
    bound = None if made.lower_bound is None else min(made.lower_bound, found.plan.cost)
    changes = {"lower_bound": bound, "complete": False, "method": made.method, "notes": (*found.plan.notes, note)}
    other = found.plan.model_copy(update=changes)
    return replace(found, plan=other, witnesses=(), begun=draft.rounds, others=draft.others + 1, given_up=why)


def hold_under_precedences(made: Plan) -> bool:
    """Tell whether a plan's words may satisfy the formula under some precedences; if not, no flight of them does."""
    try:
        with_planned_waits(made)
    except Unsatisfiable:
        return False
    return True


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
    sentence = " ".join(
        [draft.given_up or str(error), tried, *(_held_letter(draft.plan) if witness.claim == "formula" else ())]
    )
    return NotCertified(sentence, error.witnesses) if isinstance(error, NotCertified) else Infeasible(sentence, witness)


def _held_letter(made: Plan) -> list[str]:
    """Return which letter breaks a formula of `own` that the words satisfy in a single order, and whether `joint` has a plan."""
    from ltlplan.search.interleavings.planned_words import systems_of_words
    from ltlplan.search.refusals.held_letters import held_letter

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


def _conflict(error: LtlplanError) -> Witness | None:
    """Return what robots are refused for that others may have room for: they come too near each other, or wait in a circle."""
    witnesses = (
        error.witnesses if isinstance(error, NotCertified) else (error.witness,) if isinstance(error, Infeasible) else ()
    )
    return next((each for each in witnesses if each is not None and each.claim in ("separation", "formula")), None)


def _with_fewer_in_a_region(draft: Draft, witness: Witness) -> Iterator[Draft]:
    """Yield plans in which regions that are too full hold fewer robots."""
    made, known = draft.plan, dict(draft.rooms)
    for region, most in _too_full(made, witness, known) if made.mission.written.counts else ():
        rooms = {**known, region: most}
        try:
            with holding(rooms), knowing((), _budget(made)):
                other = plan(made.mission, method=made.method)
        except _NONE:
            continue
        if _digest(other) not in draft.tried:
            yield replace(draft, plan=other, rooms=tuple(rooms.items()))


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


def _without_a_leg(draft: Draft, witness: Witness) -> Iterator[Draft]:
    """Yield plans that do without a leg of the robots in conflict, the cheapest one first."""
    made, costs = draft.plan, list[tuple[float, frozenset[Leg]]]()
    for legs in _legs(made, witness):
        shut = draft.shut | legs
        try:
            with holding(dict(draft.rooms)), knowing((), _budget(made)):
                found = without_legs(shut)(made.mission, Context(np.random.default_rng(made.seed)))
        except _NONE:
            continue
        if not any(does.legs(made.mission, name) & shut for name, does in found.robots.items()):
            costs.append((found.cost, shut))
    for _, shut in sorted(costs, key=lambda each: each[0]):
        try:
            with holding(dict(draft.rooms)), knowing((), _budget(made)):
                other = plan(made.mission, method=without_legs(shut))
        except _NONE:
            continue
        if _digest(other) not in draft.tried and (witness.claim != "formula" or hold_under_precedences(other)):
            yield replace(draft, plan=other, shut=shut)


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


def _budget(made: Plan) -> Budget:
    return _COUNTED if made.mission.written.counts else _BUDGET


def _digest(made: Plan) -> str:
    """Return what tells plans apart: words, visits, and who waits for whom."""
    does = {name: (str(robot.word), [visit.model_dump() for visit in robot.visits]) for name, robot in made.robots.items()}
    waits = [wait.model_dump() for wait in (*made.precedences, *made.meetings)]
    return hashlib.sha256(json.dumps([does, waits], sort_keys=True).encode()).hexdigest()
