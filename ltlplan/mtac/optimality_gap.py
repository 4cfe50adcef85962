"""Optimality gap of an assignment: its cost and the best one, both by straight lines or by paths around obstacles, as the exact search counts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from ltlplan.allocation import Allocation, Itinerary
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.paths.costs import cost_by_legs
from ltlplan.systems.objective import is_counted_by_legs
from ltlplan.systems.robot_systems import Systems, weighted_metres
from ltlplan.systems.transition_systems import Cost
from verify.data import Mission
from verify.data.shapes.inequalities import Point

_STATES_FOR_MANY = 100_000
"""Of eight tasks; of more it falls with their square, as what looking at one state takes grows."""


def straight_line_costs(mission: Mission) -> Cost:
    """Return what one leg costs under each robot's own weights as the exact search counts it: the metres of a shortest way, and their time.

    Returns:
        Function of a robot, a position (m) or region and the region that it flies to.
    """
    regions, weights, systems = mission.all_regions, weighted_metres(mission), Systems(mission)
    middles = {region.center: name for name, region in regions.items()}

    @cache
    def leg(robot: str, start: Point | str, region: str) -> float:
        start = middles.get(start, start) if isinstance(start, tuple) else start
        if start == region and mission.obstacles and region in mission.hoops:  # around to its other side
            return weights[robot] * min(systems.graph_of(robot).lengths(start, region), default=math.inf)
        return weights[robot] * systems.metres(robot, systems.leg(robot, start, region))

    return leg


@dataclass(frozen=True, slots=True)
class BestKnown:
    """Best known assignment of a mission and its bound, by straight lines or by shortest ways around obstacles.

    Attributes:
        mission: What is asked.
        exact: The best assignment, or the best that was found where the search was stopped; None where it found none.
        bound: No assignment costs less; None where that is not known.
    """

    mission: Mission
    exact: Allocation | None
    bound: float | None

    def gap(self, robots: Mapping[str, Itinerary]) -> str:
        """Return how near an assignment is to it, as a sentence for a person.

        Args:
            robots: What each of them does.
        """
        if not is_counted_by_legs(self.mission):
            return (
                "No lower bound on the costs was found."
                if self.bound is None
                else f"No assignment costs less than {self.bound:.3f}."
            )
        ours, exact, bound = straight_cost(self.mission, robots), self.exact, self.bound
        lines = "shortest ways around obstacles" if self.mission.obstacles else "straight lines"
        costs = f"By {lines} this assignment costs {ours:.3f}"
        if exact is not None and (exact.complete or bound is None):
            gap = 100.0 * (ours / exact.cost - 1.0) if exact.cost > 0 else 0.0
            best = "best" if exact.complete else "best known"
            return f"{costs}, the {best} one {exact.cost:.3f}: a gap of {round(gap, 1) + 0.0:.1f} %."
        if bound is None or bound <= 0:
            return f"{costs}; no lower bound was found."
        most = max(0.0, 100.0 * (ours / bound - 1.0))
        return f"{costs}, and none costs less than {bound:.3f}: a gap of at most {most:.1f} %."


def best_known(mission: Mission, *, least: float | None = None, beside: Budget = DEFAULT_BUDGET) -> BestKnown:
    """Ask the exact search for the best assignment; where costs are not counted leg by leg, only for a bound.

    Args:
        mission: What is asked.
        least: Of many tasks: no assignment costs less by straight lines. The exact search is asked for a few states only then.
        beside: Budget of the search beside which this is asked.

    Raises:
        Unsatisfiable: There is no exact assignment.
        TooLarge: A budget was used up before one was found.
    """
    budget = DEFAULT_BUDGET
    if least is not None:
        budget = Budget(states=max(1, _STATES_FOR_MANY * 64 // max(8, len(conjunct_automata(mission.formula, "finite"))) ** 2))
    budget = beside.beside(budget)
    if not is_counted_by_legs(mission):
        from ltlplan.paths.k_best_words import lower_bound

        return BestKnown(mission, None, lower_bound(mission, budget=budget))
    from ltlplan.search.exact import assign

    try:
        exact = assign(mission, budget=budget, explained=least is None)
    except TooLarge:
        if least is None:
            raise
        return BestKnown(mission, None, least)
    known = [bound for bound in (least, exact.lower_bound) if bound is not None]
    return BestKnown(mission, exact, max(known, default=None))


def straight_cost(mission: Mission, robots: Mapping[str, Itinerary]) -> float:
    """Return the objective of what robots do when every leg is a straight line, or a shortest way, as the exact search counts.

    Args:
        mission: Gives starts, regions and weights.
        robots: What each of them does.
    """
    return cost_by_legs(mission, robots, straight_line_costs(mission))
