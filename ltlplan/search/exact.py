"""From a mission to words: who visits what, in which order, at the smallest cost.

`assign` is exact: it returns a cheapest plan among all whose words keep the formula in every order of the robots, over the
letters that will really be flown, or says that there is none and why. Nothing here knows about time; a later check of the
timed claim may still add waits. How each mission is read, and what is tried in turn, stands in `_tries`; a reading is loaded where it is tried.

`exact` finds the cheapest words by straight lines between regions, or where ways are blocked, by the ways that are not. That is the method for costs of length and time; what it makes of other terms is in `ltlplan.paths.k_best_words`.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType

from ltlplan.allocation import Allocation, Context, Leg, PlanningMethod, key_of
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.endurance import require_endurance
from ltlplan.search.problem import NoWords, Problem
from ltlplan.systems.robot_systems import Systems, unit_cost
from ltlplan.systems.transition_systems import Cost, Point
from verify.data import Infeasible, Mission, Unsatisfiable, Word

_NO_PRECEDENCES = "No words satisfy the formula under any precedences between the robots' events."
_COMPARED = Budget(states=50_000)
"""Of searches for what missions cost that ask for less than one without a plan."""
SHUT = 1e5
"""m; longer than any plan, so that a shut leg is taken only where no word does without."""


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
    problem = Problem(mission, budget, cost, metre, capacities, partial(_cheapest, budget), _no_plan)
    return _first_planned(problem, _tries(problem), explained=explained)


def _first_planned(problem: Problem, tries: Sequence[Callable[[Problem], Allocation]], *, explained: bool = True) -> Allocation:
    """Return what the first try plans that has words; where none has, the first one says why."""
    nothing: NoWords | None = None
    for plan in tries:
        try:
            found = plan(problem)
        except NoWords as error:
            nothing = nothing or error
            continue
        require_endurance(problem.mission, problem.systems, found.robots)
        return in_units_of(problem.mission, found) if problem.cost is None else found
    assert nothing is not None  # something is tried
    raise (nothing.why() if explained else nothing) from None


def in_units_of(mission: Mission, found: Allocation) -> Allocation:
    """Return what was searched by metres with the mission's own costs; the same where a metre costs 1.

    Args:
        mission: Gives weights and speeds.
        found: Counted as `Systems` does without a cost.
    """
    unit = unit_cost(mission)
    robots = {name: replace(does, cost=does.cost * unit) for name, does in found.robots.items()}
    bound = None if found.lower_bound is None else found.lower_bound * unit
    return replace(found, robots=robots, cost=found.cost * unit, lower_bound=bound)


def _tries(problem: Problem) -> tuple[Callable[[Problem], Allocation], ...]:
    """Return what is tried for a mission: each after the one before has found that it has no words."""
    if problem.mission.spec.trace == "infinite":
        from ltlplan.search.cycles import planning as cycles

        return (cycles.plan,)
    if problem.several and problem.mission.written.counts:
        from ltlplan.search.counting.stages import plan_stages

        return (plan_stages,)
    if problem.several and problem.mission.spec.team == "joint":
        from ltlplan.search.joint import planning as joint

        return joint.plan, _under_precedences
    from ltlplan.search.own import planning as own

    return (own.plan, _under_precedences) if problem.several else (own.plan,)


def _under_precedences(problem: Problem) -> Allocation:
    """Plan words that hold under precedences, or where these would wait for actions that nobody can wait for, stage by stage."""
    from ltlplan.search.orders import planning as orders

    try:
        found = orders.plan(problem)
    except Infeasible:
        if problem.mission.spec.team == "joint":
            from ltlplan.search.counting.stages import HoversOutside, plan_stages

            with contextlib.suppress(TooLarge, NoWords, HoversOutside):
                return plan_stages(problem)
        raise
    if found is None:
        raise NoWords(lambda: Unsatisfiable(_NO_PRECEDENCES))
    return found


def _cheapest(beside: Budget, mission: Mission) -> float | None:
    """Return what the cheapest plan costs; None where there is none."""
    try:
        return assign(mission, budget=beside.beside(_COMPARED), explained=False).cost
    except (Unsatisfiable, Infeasible):
        return None


def _no_plan(problem: Problem, order: Sequence[tuple[str, Word]]) -> Unsatisfiable:
    """Return the error that says why there is no plan."""
    from ltlplan.search.explanations.no_plan import no_plan

    return no_plan(problem, order)


def exact(mission: Mission, context: Context) -> Allocation:
    """Share a mission among its robots at the smallest cost, by straight lines.

    Args:
        mission: What is asked.
        context: Progress, and legs that are blocked; draws nothing.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says why.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    context.progress("searching words and robots", 0.05)
    if context.blocked:
        return _assigned(mission, context)
    known, unit = context.known, unit_cost(mission)

    def report(explored: int, bound: float) -> None:
        context.progress(f"searching: {explored:,} states, no words cost less than {bound * unit:.3f}", 0.05)

    found = known.found.get(key_of(mission))
    budget = replace(known.budget, report=report)
    return _assigned(mission, replace(context, known=replace(known, budget=budget))) if found is None else found


def under_precedences(mission: Mission, context: Context) -> Allocation:
    """Share a finite mission by the cheapest words that hold under precedences, for words that hold in every order and cannot be flown.

    Args:
        mission: Of several robots.
        context: Progress, and legs that are blocked; draws nothing.

    Raises:
        Unsatisfiable: There are no such words.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    context.progress("searching words and who waits for whom", 0.05)
    return _assigned(mission, context, ordered=True)


def _assigned(mission: Mission, context: Context, *, ordered: bool = False) -> Allocation:
    """Return the cheapest allocation without the legs that are blocked, if there is one, within what is known."""
    known, cost = context.known, shutting(Systems(mission).leg, context.blocked.__contains__) if context.blocked else None
    problem = Problem(mission, known.budget, cost, None, known.capacities, partial(_cheapest, known.budget), _no_plan)
    found = _first_planned(problem, (_under_precedences,) if ordered else _tries(problem))
    return found if cost is None else in_units_of(mission, found)


def without_legs(shut: frozenset[Leg]) -> PlanningMethod:
    """Return the exact method that does without some legs, where words do.

    Args:
        shut: The legs.
    """

    def shut_out(mission: Mission, context: Context) -> Allocation:
        return exact(mission, replace(context, blocked=context.blocked | shut))

    return shut_out


def shutting(cost: Cost, is_shut: Callable[[Leg], bool]) -> Cost:
    """Return a cost of legs by which some are dearer than any plan.

    Args:
        cost: Of all legs.
        is_shut: Tells whether plans are to do without a leg.
    """

    def dear(robot: str, start: Point | str, region: str) -> float:
        return cost(robot, start, region) + (SHUT if is_shut((robot, start, region)) else 0.0)

    return dear
