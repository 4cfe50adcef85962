"""The cheapest words by straight lines between regions, or where ways are blocked, by the ways that are not.

That is the exact method for costs of length and time; what it makes of other terms is in `ltlplan.paths.k_best_words`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ltlplan.allocation import Allocation, Context, Leg, PlanningMethod, key_of
from ltlplan.search.exact import assign, assign_under_precedences, in_units_of
from ltlplan.systems.robot_systems import Systems
from verify.data import Mission

if TYPE_CHECKING:
    from ltlplan.systems.transition_systems import Cost, Point

SHUT = 1e5
"""m; longer than any plan, so that a shut leg is taken only where no word does without."""


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
    known = context.known
    if context.blocked:
        cost = _avoiding(mission, context.blocked)
        return in_units_of(mission, assign(mission, cost=cost, budget=known.budget, capacities=known.capacities))
    context.progress("searching words and robots", 0.05)
    before = known.found.get(key_of(mission))
    return before or assign(mission, budget=known.budget, capacities=known.capacities)


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
    cost = _avoiding(mission, context.blocked) if context.blocked else None
    found = assign_under_precedences(mission, cost=cost, budget=context.known.budget)
    return found if cost is None else in_units_of(mission, found)


def without_legs(shut: frozenset[Leg]) -> PlanningMethod:
    """Return the exact method that does without some legs, where words do.

    Args:
        shut: The legs.
    """

    def shut_out(mission: Mission, context: Context) -> Allocation:
        return exact(mission, replace(context, blocked=context.blocked | shut))

    return shut_out


def _avoiding(mission: Mission, blocked: frozenset[Leg]) -> Cost:
    straight = Systems(mission)

    def cost(robot: str, start: Point | str, region: str) -> float:
        return straight.leg(robot, start, region) + (SHUT if (robot, start, region) in blocked else 0.0)

    return cost
