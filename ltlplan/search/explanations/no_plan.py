"""Why a finite mission has no plan: neither one that holds in every order of the robots, nor one that holds under precedences."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.explanations.held_letters import held_letter
from ltlplan.search.explanations.relaxation import relaxed
from ltlplan.search.explanations.requirements import all_of
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan, explain, in_one_order, refused_in_some_order
from ltlplan.search.joint.reading import JointTask
from ltlplan.search.orders.planning import ordered_possible
from ltlplan.search.team_planning import least_in_one_order
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission, Word

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

    def feasible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
        possible = _joint_feasible if joint else in_one_order
        return possible(parts, worlds) or (len(worlds) > 1 and _under_precedences(parts, worlds, joint=joint))

    error = refused_in_some_order(mission, refused) if refused else explain(mission, systems, each, feasible=feasible)
    if not joint and len(each) > 1:
        held = held_letter(mission, each, asked, lambda other: cheapest(other) is not None)
        error = NoPlan(error.core, (*error.reasons, *held), error.edges)
    return relaxed(mission, error, cheapest)


def _joint_feasible(parts: Sequence[Formula], worlds: Sequence[TransitionSystem]) -> bool:
    try:
        task = JointTask(worlds, conjunct_automata(all_of(parts), "finite"))
        return least_in_one_order(task, Budget(states=50_000)) is not None
    except TooLarge:
        return True  # not known to be impossible


def _under_precedences(parts: Sequence[Formula], worlds: Sequence[TransitionSystem], *, joint: bool) -> bool:
    try:
        return ordered_possible(worlds, conjunct_automata(all_of(parts), "finite"), joint=joint, most=_STATES)
    except TooLarge:
        return True  # not known to be impossible
