"""Reasons that a finite mission has no plan: neither one that holds in every order of the robots, nor one under precedences."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.explanations.held_letters import held_letter
from ltlplan.search.explanations.inquiry import BUDGET, all_of
from ltlplan.search.explanations.relaxation import relaxed
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan, explain, refused_in_some_order
from ltlplan.search.joint.reading import JointTask
from ltlplan.search.orders.planning import OrderedTeam
from ltlplan.search.own.planning import own_task
from ltlplan.search.team_planning import least_in_one_order
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission, Word

_JOINT_BUDGET = Budget(states=50_000)
_STATES = 1_500
"""States of each search for precedences while it is found out which parts of a formula cannot hold together."""


def no_plan(
    mission: Mission,
    systems: Systems,
    each: Sequence[TransitionSystem],
    asked: Formula,
    refused: Sequence[tuple[str, Word]],
    cheapest: Callable[[Mission], float | None],
) -> NoPlan:
    """Return the error that says why there is no plan.

    Args:
        mission: Whose formula cannot be met.
        systems: What its robots can do.
        each: One system for each robot.
        asked: The formula that was planned.
        refused: The order of the robots, with words, that breaks the cheapest plan of a fixed order; empty where there is none.
        cheapest: From a mission to what its cheapest plan costs; None where there is none.
    """
    joint = mission.spec.team == "joint" and len(each) > 1

    def possible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        automata = conjunct_automata(all_of(parts), "finite")
        task = JointTask(worlds, automata) if joint else own_task(worlds, automata)
        if least_in_one_order(task, _JOINT_BUDGET if joint else BUDGET) is not None:
            return True
        return len(worlds) > 1 and OrderedTeam(worlds, Marks(automata, {}), joint=joint).is_possible(_STATES)

    error = refused_in_some_order(mission, refused) if refused else explain(mission, systems, each, possible)
    if not joint and len(each) > 1:
        held = held_letter(mission, each, asked, lambda other: cheapest(other) is not None)
        error = NoPlan(error.core, (*error.reasons, *held), error.edges)
    return relaxed(mission, error, cheapest)
