"""From a mission to words: who visits what, in which order, at the smallest cost.

`assign` is exact: it returns a cheapest plan among all whose words keep the formula in every order of the robots, over the
letters that will really be flown, or says that there is none and why. Nothing here knows about time; a later check of the
timed claim may still add waits. How each mission is read, and what is tried in turn, stands in `_tries`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.counting.capacities import small_rooms
from ltlplan.search.counting.conflicting_conjuncts import no_counted_plan
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import plan_counts, plan_hovering, roomy_marks
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms
from ltlplan.search.counting.synchronisation import HoversOutside, precedences_of, waits_of
from ltlplan.search.cycles import planning as cycles
from ltlplan.search.endurance import require_endurance
from ltlplan.search.joint import planning as joint
from ltlplan.search.orders import planning as orders
from ltlplan.search.own import planning as own
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.systems.robot_systems import interchangeable, unit_cost
from ltlplan.systems.transition_systems import Cost
from verify.data import Infeasible, Mission, Unsatisfiable, Word

_HOVERING_STATES = 20_000
"""Of the search for plans in which robots also wait outside regions."""


def assign(
    mission: Mission,
    *,
    cost: Cost | None = None,
    metre: Mapping[str, float] | None = None,
    budget: Budget = DEFAULT_BUDGET,
    capacities: Mapping[str, int] = MappingProxyType({}),
    explained: bool = True,
) -> Allocation:
    """Share a mission among its robots at the smallest cost.

    Args:
        mission: With its formula, regions, environment, internal states and agents.
        cost: Cost of a leg, (robot, from a position or a region, to a region) -> float; where None, straight lines by the mission's
            weights of length and time (by metres, where some robot has neither).
        metre: What a metre costs each robot on the way to its end, where `cost` counts more than metres; endurance is not kept then.
        budget: Bounds on the search.
        capacities: Robots that regions hold, where refinement found no places for more; kept by formulas that count.
        explained: Whether it is found out why there is no plan, which takes many more searches.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says which parts of it cannot
            hold together, and which to leave out.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    problem = Problem(mission, budget, _cheapest, _no_plan, cost, metre, capacities)
    nothing: NoWords | None = None
    for plan in _tries(problem):
        try:
            found = plan(problem)
        except NoWords as error:
            nothing = nothing or error
            continue
        require_endurance(mission, problem.systems, found.robots)
        return in_units_of(mission, found) if cost is None else found
    assert nothing is not None  # something is tried
    raise (nothing.why() if explained else nothing) from None


def assign_under_precedences(
    mission: Mission, *, cost: Cost | None = None, budget: Budget = DEFAULT_BUDGET
) -> Allocation | None:
    """Share a finite mission by the cheapest words that hold under precedences, also where dearer or other words hold in every order.

    Args:
        mission: Of several robots.
        cost: Cost of a leg, as for `assign`.
        budget: Bounds on the search.

    Returns:
        None where there are no such words.

    Raises:
        Infeasible: It brings not all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    problem = Problem(mission, budget, _cheapest, _no_plan, cost)
    found = orders.plan(problem)
    if found is None:
        return None
    require_endurance(mission, problem.systems, found.robots)
    return in_units_of(mission, found) if cost is None else found


def in_units_of(mission: Mission, found: Allocation) -> Allocation:
    """Return what was searched by metres with the mission's own costs; the same where a metre costs 1.

    Args:
        mission: Gives weights and speeds.
        found: Counted as `Systems` does without a cost.
    """
    unit = unit_cost(mission)
    if unit == 1.0:
        return found
    robots = {name: replace(does, cost=does.cost * unit) for name, does in found.robots.items()}
    bound = None if found.lower_bound is None else found.lower_bound * unit
    return replace(found, robots=robots, cost=found.cost * unit, lower_bound=bound)


def _tries(problem: Problem) -> tuple[Callable[[Problem], Allocation], ...]:
    """Return what is tried for a mission: each after the one before has found that it has no words."""
    if problem.mission.spec.trace == "infinite":
        return (cycles.plan,)
    if not problem.several:
        return (own.plan,)
    if problem.mission.written.counts:
        return _stage_by_stage, _waiting_outside
    return joint.plan if problem.mission.spec.team == "joint" else own.plan, _under_precedences


def _under_precedences(problem: Problem) -> Allocation:
    """Plan words that hold under precedences, or where these would wait for actions that nobody can wait for, stage by stage."""
    try:
        found = orders.plan(problem)
    except Infeasible:
        if problem.mission.spec.team == "joint":
            with contextlib.suppress(TooLarge, NoWords, HoversOutside):
                return _stage_by_stage(problem)
        raise
    if found is None:
        raise NoWords(lambda: Unsatisfiable("No words satisfy the formula under any precedences between the robots' events."))
    return found


def _stage_by_stage(problem: Problem) -> Allocation:
    """Plan a formula that counts robots or names them: words, and who waits for whom."""
    mission, each = problem.mission, problem.each
    kinds, rooms = list(interchangeable(mission).values()), small_rooms(mission, each, problem.capacities)
    found = plan_counts(each, kinds, problem.automata, problem.known, problem.budget, rooms=rooms, longest=problem.longest)
    if found is None:
        from ltlplan.search.explanations.relaxation import relaxed

        raise NoWords(lambda: relaxed(mission, no_counted_plan(mission, each, kinds, problem.asked, rooms), problem.cheapest))
    try:
        waits, precedences = waits_of(each, found)
    except HoversOutside:  # but flights may be timed so that nobody has to, or it waits there
        with contextlib.suppress(TooLarge, Infeasible):
            ordered = orders.plan(problem)
            if ordered is not None:
                return ordered
        events = precedences_of(each, found)
        if events is None:
            raise
        waits, precedences = [], events
    robots = problem.itineraries(found.paths)
    total = (max if problem.longest else sum)(robot.cost for robot in robots.values())
    complete = total <= found.bound + TIES
    notes = [f"The search reached {found.reached:,} states: how many robots rest where, and what is done."]
    if not complete:
        notes.append(
            "A cheaper plan was not ruled out, one in which robots end just outside regions or where they act included."
        )
    if waits or precedences:
        notes.append(
            f"Robots wait for each other: the plan has {len(found.stages)} stages, each begun when the one before has ended."
        )
    said = (*notes, *problem.systems.unclear())
    return Allocation(
        robots=robots, cost=total, lower_bound=min(found.bound, total), complete=complete, notes=said, meetings=tuple(waits),
        precedences=tuple(precedences),
    )  # fmt: skip


def _waiting_outside(problem: Problem) -> Allocation:
    """Plan counts with robots that also wait just outside regions."""
    mission, each = problem.mission, problem.each
    rooms = Rooms(small_rooms(mission, each, problem.capacities), passing=True)
    with contextlib.suppress(TooLarge):
        team = CountedTeam(
            tuple(each), tuple(interchangeable(mission).values()), Marks(problem.automata, problem.known), rooms, skips=True
        )
        marks = roomy_marks(each, problem.automata, problem.known, rooms.most)
        found = plan_hovering(team, Budget(states=_HOVERING_STATES), marks)
        waits = None if found is None else precedences_of(each, found)
        ordered = orders.plan(problem) if found is not None and waits is None else None
        if ordered is not None:
            return ordered
        if found is not None and waits is not None:
            robots = problem.itineraries(found.paths)
            total = (max if problem.longest else sum)(robot.cost for robot in robots.values())
            note = (
                f"The search reached {found.reached:,} states. Robots wait for each other, also outside regions that they have left; a "
                "cheaper plan was not ruled out."
            )
            said = (note, *problem.systems.unclear())
            return Allocation(robots=robots, cost=total, notes=said, precedences=tuple(waits))
    raise NoWords(lambda: Unsatisfiable("No plan was found in which robots also wait just outside regions."))


def _cheapest(mission: Mission) -> float | None:
    """Return what the cheapest plan costs; None where there is none."""
    try:
        return assign(mission, budget=Budget(states=50_000), explained=False).cost
    except (Unsatisfiable, Infeasible):
        return None


def _no_plan(problem: Problem, order: Sequence[tuple[str, Word]]) -> Unsatisfiable:
    """Return the error that says why there is no plan."""
    from ltlplan.search.explanations.no_plan import no_plan

    return no_plan(problem.mission, problem.systems, problem.each, problem.asked, order, problem.cheapest)
