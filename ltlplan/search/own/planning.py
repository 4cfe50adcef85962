"""Plans for `team: own`, the cheapest ones whose words satisfy the formula in every order of the robots."""

from __future__ import annotations

from ltlplan.allocation import Allocation
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.problem import Problem
from ltlplan.search.team_planning import assigned


def plan(problem: Problem) -> Allocation:
    """Plan words that hold in every order of the robots, by the mission's objective and within the endurance of vehicles.

    Raises:
        NoWords: There are none.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    return assigned(problem, OwnTask(problem.each, problem.automata))
