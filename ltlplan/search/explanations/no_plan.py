"""Reasons that a finite mission has no plan: neither one that holds in every order of the robots, nor one under precedences."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.explanations.held_letters import held_letter
from ltlplan.search.explanations.inquiry import BUDGET, all_of
from ltlplan.search.explanations.relaxation import relaxed
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan, explain, refused_in_some_order
from ltlplan.search.joint.reading import JointTask
from ltlplan.search.orders.planning import OrderedTeam
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.problem import Problem
from ltlplan.search.team_planning import least_in_one_order
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Word

_JOINT_BUDGET = Budget(states=50_000)
_BUDGET = Budget(states=1_500)
"""Of each search for precedences while it is found out which parts of a formula cannot hold together."""


def no_plan(problem: Problem, refused: Sequence[tuple[str, Word]]) -> NoPlan:
    """Return the error that says why there is no plan.

    Args:
        problem: Whose formula cannot be met.
        refused: The order of the robots, with words, that breaks the cheapest plan of a fixed order; empty where there is none.
    """
    mission, each, joint = problem.mission, problem.each, problem.several and problem.mission.spec.team == "joint"

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        automata = conjunct_automata(all_of(parts), "finite")
        task = (JointTask if joint else OwnTask)(worlds, automata)
        if least_in_one_order(task, problem.budget.beside(_JOINT_BUDGET if joint else BUDGET)) is not None:
            return True
        return len(worlds) > 1 and OrderedTeam(worlds, Marks(automata, {}), joint=joint).is_possible(_BUDGET)

    error = refused_in_some_order(mission, refused) if refused else explain(mission, problem.systems, each, possible)
    if problem.several and not joint:
        held = held_letter(mission, each, problem.asked, lambda other: problem.cheapest(other) is not None)
        error = NoPlan(error.core, (*error.reasons, *held), error.edges)
    return relaxed(problem, error)
