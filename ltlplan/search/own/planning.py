"""Plans for `team: own`, the cheapest ones whose words satisfy the formula in every order of the robots."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.allocation import Allocation
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget
from ltlplan.logic.product_automaton import Task
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.problem import Problem
from ltlplan.search.reduced_graph import Team
from ltlplan.search.team_planning import assigned, least_in_one_order
from ltlplan.systems.transition_systems import TransitionSystem


def plan(problem: Problem) -> Allocation:
    """Plan words that hold in every order of the robots, by the mission's objective and within the endurance of vehicles.

    Raises:
        NoWords: There are none.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    return assigned(problem, _task(problem.each, problem.automata))


def own_possible(systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget) -> bool:
    """Tell whether any plan keeps the formula in the systems' order.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        budget: Bound on the states.

    Raises:
        TooLarge: The budget was used up.
    """
    return least_in_one_order(_task(systems, automata), budget) is not None


def _task(systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> OwnTask:
    team = Team(systems)
    return OwnTask.of(team, Task(automata, team.letters, team.walls))
