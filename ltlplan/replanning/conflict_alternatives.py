"""Other words for a team whose planned ones no flight keeps: fewer robots in a region at once, or without one of the legs in conflict.

Whether robots have places beside each other, and ways past each other, is seen in refinement alone. What it says goes back to planning: a
region in which no places were found for so many robots holds fewer of them (`search.counts.capacities`), where the formula counts robots;
else each leg of the robots in conflict is shut in turn. Of the answers those are taken first whose visits can be made one after another so
that nobody rests where another one comes to, the cheapest ones first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ltlplan.allocation import Context, Itinerary, Known, Leg
from ltlplan.logic.budget import Budget
from ltlplan.planner import SEQUENCE
from ltlplan.precedences import with_planned_waits
from ltlplan.replanning.candidates import Candidate, Cut, digest
from ltlplan.replanning.checked_plan import plan
from ltlplan.search.method import without_legs
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


def flown_otherwise(candidate: Candidate, error: LtlplanError) -> Candidate | None:
    """Return a plan of other words, in the place of one that robots cannot fly beside each other; None where there is none, or enough of them were tried.

    Args:
        candidate: The plan, and what was tried before.
        error: What refinement or the judge said of it.
    """
    from refine.coordination.alternative_ways import has_an_order

    made, witness = candidate.plan, _conflict(error)
    if witness is None or candidate.others >= _OTHERS or len(made.robots) < 2:
        return None
    if made.method == SEQUENCE or made.method not in PLANNING_METHODS.built_in:
        return None
    refused = Cut("legs", str(error), candidate.rounds, anew=True, plan=digest(made))
    others = list(_with_fewer_in_a_region(candidate, refused, witness))
    if not others and not (made.mission.written.counts and witness.region is not None):  # a leg leaves no more room in it
        others = list(_without_a_leg(candidate, refused, witness))
    found = next((other for other in others if has_an_order(other.plan)), others[0] if others else None)
    if found is None:
        return None
    note = f"The words planned first were given up for others, as no flight of theirs was found. {_given_up(found)}"
    bound = None if made.lower_bound is None else min(made.lower_bound, found.plan.cost)
    changes = {"lower_bound": bound, "complete": False, "method": made.method, "notes": (*found.plan.notes, note)}
    return replace(found, plan=found.plan.model_copy(update=changes))


def hold_under_precedences(made: Plan) -> bool:
    """Tell whether a plan's words may satisfy the formula under some precedences; if not, no flight of them does."""
    try:
        with_planned_waits(made)
    except Unsatisfiable:
        return False
    return True


def no_other_words(candidate: Candidate, error: LtlplanError) -> LtlplanError:
    """Return the error for a plan that was given up, with what became of other words.

    Args:
        candidate: The last plan that was tried.
        error: What was said of it.
    """
    made, witness = candidate.plan, _conflict(error)
    if witness is None or made.mission.soft_parts or len(made.robots) < 2 or made.method == SEQUENCE:
        return error
    tried = (
        "No other words were found that would mend it."
        if candidate.others == 0
        else f"Of {candidate.others} other {'plan' if candidate.others == 1 else 'plans'}, with other words, no flight was found either."
    )
    held = _held_letter(made) if witness.claim == "formula" else []
    sentence = " ".join([_given_up(candidate) or str(error), tried, *held])
    return NotCertified(sentence, error.witnesses) if isinstance(error, NotCertified) else Infeasible(sentence, witness)


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


def _conflict(error: LtlplanError) -> Witness | None:
    """Return what robots are refused for that others may have room for: they come too near each other, or wait in a circle."""
    witnesses = (
        error.witnesses if isinstance(error, NotCertified) else (error.witness,) if isinstance(error, Infeasible) else ()
    )
    return next((each for each in witnesses if each is not None and each.claim in ("separation", "formula")), None)


def _with_fewer_in_a_region(candidate: Candidate, refused: Cut, witness: Witness) -> Iterator[Candidate]:
    """Yield plans in which regions that are too full hold fewer robots."""
    made, known = candidate.plan, candidate.capacities
    for region, most in _too_full(made, witness, known) if made.mission.written.counts else ():
        given = Known(budget=_budget(made), capacities={**known, region: most})
        try:
            other = plan(made.mission, method=made.method, known=given)
        except _NONE:
            continue
        yield from _unless_tried(candidate, replace(refused, kind="capacity", capacity=(region, most)), other)


def _unless_tried(candidate: Candidate, cut: Cut, other: Plan) -> Iterator[Candidate]:
    if digest(other) not in {cut.plan, *(before.plan for before in candidate.cuts)}:
        yield candidate.cut(cut, other)


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


def _without_a_leg(candidate: Candidate, refused: Cut, witness: Witness) -> Iterator[Candidate]:
    """Yield plans that do without a leg of the robots in conflict, the cheapest one first."""
    made, costs = candidate.plan, list[tuple[float, frozenset[Leg]]]()
    known = Known(budget=_budget(made), capacities=candidate.capacities)
    for legs in _legs(made, witness):
        shut = candidate.legs | legs
        try:
            found = without_legs(shut)(made.mission, Context(np.random.default_rng(made.seed), known=known))
        except _NONE:
            continue
        if not any(does.legs(made.mission, name) & shut for name, does in found.robots.items()):
            costs.append((found.cost, shut))
    for _, shut in sorted(costs, key=lambda each: each[0]):
        try:
            other = plan(made.mission, method=without_legs(shut), known=known)
        except _NONE:
            continue
        if witness.claim != "formula" or hold_under_precedences(other):
            yield from _unless_tried(candidate, replace(refused, legs=shut), other)


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
