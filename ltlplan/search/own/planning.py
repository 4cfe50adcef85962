"""Plans for `team: own`, the cheapest ones whose words satisfy the formula in every order of the robots."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.allocation import Allocation
from ltlplan.logic.automaton import Automaton
from ltlplan.logic.product_automaton import Task
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.problem import Problem
from ltlplan.search.reduced_graph import ReducedGraph, Team, letter_classes
from ltlplan.search.team_planning import assigned
from ltlplan.systems.transition_systems import TransitionSystem


def plan(problem: Problem) -> Allocation:
    """Plan words that hold in every order of the robots, by the mission's objective and within the endurance of vehicles.

    Raises:
        NoWords: There are none.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    return assigned(problem, own_task(problem.each, problem.automata))


def own_task(systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> OwnTask:
    """Return the task of a team over the nodes that matter to it.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
    """
    team = Team(systems)
    task = Task(automata, team.letters, team.walls)
    return OwnTask(ReducedGraph(team, *letter_classes(task)), task)
