"""Precedences for words that are planned already: what a flight that may break the formula is given to keep."""

from __future__ import annotations

import itertools
from dataclasses import replace

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.orders.event_names import event_names
from ltlplan.search.orders.linearisations import Linearisations
from ltlplan.search.orders.planning import MOST_STATES, OrderedTeam
from ltlplan.search.orders.reading import shown_by
from ltlplan.search.orders.state_sets import all_or_none
from ltlplan.search.reduced_graph import staying
from ltlplan.systems.transition_systems import Node, TransitionSystem
from ltlplan.systems.visit_log import VisitLog
from verify.data import Infeasible, Letter, Plan, RobotPlan, Unsatisfiable
from verify.data.language.counting import atoms
from verify.data.plan import Precedence
from verify.data.sections import Action


def with_planned_waits(plan: Plan) -> Plan | None:
    """Return the plan with precedences that planning finds for its words, in the place of those that it has; None where that changes nothing.

    The assignment stays as it is; one robot's event is put after another's.

    Args:
        plan: The plan whose trajectories were rejected.

    Raises:
        Unsatisfiable: The words satisfy the formula under no precedences, so that other words are needed.
    """
    if plan.mission.spec.trace == "infinite" or len(plan.robots) < 2 or plan.meetings:
        return None
    found = precedences_for(plan)
    return None if not found or set(found) <= set(plan.precedences) else plan.model_copy(update={"precedences": found})


def hold_under_precedences(plan: Plan) -> bool:
    """Tell whether a plan's words may satisfy the formula under some precedences; if not, no flight of them does.

    Args:
        plan: The plan whose trajectories were refused.
    """
    try:
        with_planned_waits(plan)
    except Unsatisfiable:
        return False
    return True


def precedences_for(plan: Plan) -> tuple[Precedence, ...] | None:
    """Return few precedences under which every team word of a plan's words satisfies the formula; None where that is not known.

    Precedences only rule team words out. So those conjuncts alone are planned which some order breaks, for the robots that matter to them.

    Args:
        plan: Of a finite trace.

    Raises:
        Unsatisfiable: These words satisfy it under no precedences.
    """
    known = systems_of_words(plan)
    if known is None:
        return None
    formula, joint = plan.mission.formula, plan.mission.spec.team == "joint"
    automata, counted = conjunct_automata(formula, "finite"), atoms(formula)
    marks = Marks(automata, counted)
    words = Linearisations(marks, shown_by(marks, known), joint=joint)
    try:
        broken = [index for index in range(len(automata)) if words.breaking(index)]
        flying = frozenset[int]().union(*map(words.robots, broken))
        some = [own if robot in flying else replace(staying(own), final=None) for robot, own in enumerate(known)]
        team = OrderedTeam(some, Marks([automata[index] for index in broken], counted), joint=joint)
        found = team.cheapest(Budget(states=MOST_STATES))
    except (TooLarge, Infeasible):
        return None
    if found is None:
        raise Unsatisfiable("These words satisfy the formula under no precedences between their events.")
    return found.precedences


def systems_of_words(plan: Plan) -> tuple[TransitionSystem, ...] | None:
    """Return for each robot a system that can only give its planned word; None where one does not show the planned visits.

    Args:
        plan: Of a finite trace.
    """
    return all_or_none(_chain(plan, name, robot) for name, robot in plan.robots.items())


def _chain(plan: Plan, name: str, robot: RobotPlan) -> TransitionSystem | None:
    """Return a system that can only give the planned word; None where that does not show the planned visits."""
    letters, regions = robot.word.letters, frozenset(plan.mission.all_regions)
    internal = [letter - regions for letter in letters]
    states = plan.mission.robot_of(name).states
    made = (action for visit in robot.visits for action in visit.actions)
    acts = [action.at for action in made if set(states[action.source]) != set(states[action.target])]
    actions: list[Action] = []
    for before, after in itertools.pairwise(internal):
        if before != after:
            if not acts:
                return None
            actions.append(Action.model_validate({"from": _state(before), "to": _state(after), "at": acts.pop(0)}))
    nodes = tuple(
        Node(place="", flying=not letter & regions, internal=_state(own), regions=letter & regions, entered="")
        for letter, own in zip(letters, internal, strict=True)
    )
    last = len(letters) - 1
    if [visit.region for visit in VisitLog(node.regions for node in nodes).visits] != [visit.region for visit in robot.visits]:
        return None
    edges = tuple(((index + 1, 1.0),) if index < last else () for index in range(len(letters)))
    system = TransitionSystem(letters, edges, final={last: 0.0}, nodes=nodes, robot=name, actions=tuple(actions))
    try:
        event_names(system, range(len(letters)))
    except (KeyError, StopIteration):
        return None  # an action is not where its region is
    return system


def _state(shown: Letter) -> str:
    return " ".join(sorted(shown)) or "-"
