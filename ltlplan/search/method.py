"""The exact method: the cheapest words by straight lines between regions, or where ways are blocked, by the ways that are not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ltlplan.allocation import Allocation, Context, Leg
from ltlplan.search.exact import assign
from ltlplan.systems.robot_systems import Systems
from verify.data import Mission

if TYPE_CHECKING:
    from ltlplan.systems.transition_systems import Cost, Point

_SHUT = 1e5  # m; longer than any plan, so that a shut leg is taken only where no word does without


def exact(mission: Mission, context: Context) -> Allocation:
    """Share a mission among its robots at the smallest cost, by straight lines.

    Args:
        mission: What is asked.
        context: Progress, and legs that are blocked; draws nothing.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says why.
        TooLarge: A budget was used up before an answer was found.
    """
    if not context.blocked:
        context.progress("searching words and robots", 0.05)
    found = assign(mission, cost=_avoiding(mission, context.blocked) if context.blocked else None)
    return Allocation(
        robots=found.robots, cost=found.cost, lower_bound=found.lower_bound, complete=found.complete, notes=found.notes
    )


def _avoiding(mission: Mission, blocked: frozenset[Leg]) -> Cost:
    straight = Systems(mission)

    def cost(robot: str, start: Point | str, region: str) -> float:
        return straight.leg(robot, start, region) + (_SHUT if (robot, start, region) in blocked else 0.0)

    return cost
