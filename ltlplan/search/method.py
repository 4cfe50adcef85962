"""The cheapest words by straight lines between regions, or where ways are blocked, by the ways that are not.

That is the exact method for costs of length and time; what it makes of other terms is in `ltlplan.paths.priced_words`.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from ltlplan.allocation import Allocation, Context, Leg, PlanningMethod
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.search.exact import Assignment, assign, assign_under_precedences, in_units_of
from ltlplan.systems.robot_systems import Systems
from verify.data import Mission, Unsatisfiable

if TYPE_CHECKING:
    from ltlplan.systems.transition_systems import Cost, Point

_Found = Mapping[tuple[str, tuple[str, ...]], Assignment]  # by formula and robots
_FOUND: ContextVar[_Found] = ContextVar("found", default=MappingProxyType({}))
_BUDGET: ContextVar[Budget] = ContextVar("budget", default=DEFAULT_BUDGET)

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
    if not context.blocked:
        context.progress("searching words and robots", 0.05)
    if context.blocked:
        found = in_units_of(mission, assign(mission, cost=_avoiding(mission, context.blocked), budget=_BUDGET.get()))
    else:
        found = _FOUND.get().get(_asked(mission)) or assign(mission, budget=_BUDGET.get())
    return _allocation(found)


@contextmanager
def knowing(found: Iterable[tuple[Mission, Assignment]], budget: Budget = DEFAULT_BUDGET) -> Generator[None]:
    """Let the exact method take what was found already, instead of searching for it again.

    Args:
        found: Missions that differ in their formulas alone, and their assignments.
        budget: Bounds on its searches for all others.
    """
    token = _FOUND.set({_asked(mission): assignment for mission, assignment in found})
    bounds = _BUDGET.set(budget)
    try:
        yield
    finally:
        _FOUND.reset(token)
        _BUDGET.reset(bounds)


def _asked(mission: Mission) -> tuple[str, tuple[str, ...]]:
    return mission.spec.formula or "", tuple(mission.agents)


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
    found = assign_under_precedences(mission, cost=cost, budget=_BUDGET.get())
    if found is None:
        raise Unsatisfiable("No words satisfy the formula under any precedences between the robots' events.")
    return _allocation(in_units_of(mission, found) if context.blocked else found)


def without_legs(shut: frozenset[Leg]) -> PlanningMethod:
    """Return the exact method that does without some legs, where words do.

    Args:
        shut: The legs.
    """

    def shut_out(mission: Mission, context: Context) -> Allocation:
        return exact(mission, replace(context, blocked=context.blocked | shut))

    return shut_out


def _allocation(found: Assignment) -> Allocation:
    return Allocation(
        robots=found.robots,
        cost=found.cost,
        lower_bound=found.lower_bound,
        complete=found.complete,
        notes=found.notes,
        meetings=found.meetings,
        precedences=found.precedences,
    )


def _avoiding(mission: Mission, blocked: frozenset[Leg]) -> Cost:
    straight = Systems(mission)

    def cost(robot: str, start: Point | str, region: str) -> float:
        return straight.leg(robot, start, region) + (SHUT if (robot, start, region) in blocked else 0.0)

    return cost
