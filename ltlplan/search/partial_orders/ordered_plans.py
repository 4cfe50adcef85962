"""Plans that hold under precedences between events, where none holds in every order of the robots.

First a cheapest course of events is looked for all of whose team words satisfy the formula; where there is none, no words and no
precedences do. Then few of the precedences of that course are kept, so that robots wait for each other only where they must.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.partial_orders.abstraction import alike_merged
from ltlplan.search.partial_orders.event_names import Names
from ltlplan.search.partial_orders.event_sequences import Course, cheapest_course, course_of_least_dearest, is_event
from ltlplan.search.partial_orders.linearisations import Event, Linearisations
from ltlplan.search.partial_orders.minimal_precedences import needed_orders
from ltlplan.search.partial_orders.reachable_state_sets import Reading, Shown, shown_at
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible
from verify.data.language.counting import Atom
from verify.data.plan import Precedence

MOST_STATES = 10_000
"""States of a search over interleavings that are expanded before it says that it cannot tell."""


@dataclass(frozen=True, slots=True)
class OrderedPlan:
    """Words of a team, and what is waited for.

    Attributes:
        paths: Nodes of each robot's system.
        precedences: All team words that keep them satisfy the formula.
        cost: Sum over the robots; none that satisfies under precedences costs less.
        reached: States that were seen.
    """

    paths: tuple[tuple[int, ...], ...]
    precedences: tuple[Precedence, ...]
    cost: float
    reached: int


def plan_ordered(
    systems: Sequence[TransitionSystem],
    automata: Sequence[Automaton],
    atoms: dict[str, Atom],
    *,
    joint: bool,
    most: int = MOST_STATES,
) -> OrderedPlan | None:
    """Return a cheapest plan whose team words all satisfy the formula under some precedences; None where there are none.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        atoms: The formula's propositions of the whole team, where it counts.
        joint: Whether it reads the letter of the whole team.
        most: States that may be expanded.

    Raises:
        TooLarge: The budget was used up; nothing is known.
        Infeasible: There is such a plan, but its precedences cannot be said of visits and their actions.
    """
    marks = Marks(automata, atoms)
    reading = Reading(marks, joint=joint)
    shown = shown_by(marks, systems)
    if not _may_be_possible(systems, shown, reading, most):
        return None
    refused = False
    for robots in (systems, [_leaving_after_actions(system) for system in systems]):
        course = cheapest_course(robots, shown, reading, most)
        if course is None:
            break
        found = _precedences(marks, systems, course, joint=joint)
        if found is not None:
            return OrderedPlan(_paths(systems, course), found, course.cost, course.reached)
        refused = True
    if refused:
        raise Infeasible(
            "Words satisfy the formula where one robot's event follows another's, but it is an action that nobody can wait for: one of several "
            "in its visit, or one of a visit that lasts to the end."
        )
    return None


def plan_ordered_for_dearest(  # as `plan_ordered`, and the limit
    systems: Sequence[TransitionSystem],
    automata: Sequence[Automaton],
    atoms: dict[str, Atom],
    *,
    joint: bool,
    most: int,
    below: float,
) -> tuple[OrderedPlan | None, float]:
    """Return a plan under precedences whose dearest robot costs least, if that is below a limit, and what it costs at the least.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        atoms: The formula's propositions of the whole team, where it counts.
        joint: Whether it reads the letter of the whole team.
        most: Ways that may be gone on with.
        below: What the dearest robot of another plan costs.

    Returns:
        None where no such plan is found. The bound holds for all plans, and is the limit where none is below it.
    """
    marks = Marks(automata, atoms)
    course, bound = course_of_least_dearest(systems, shown_by(marks, systems), Reading(marks, joint=joint), most, below)
    bound = min(bound, below)
    kept = None if course is None else _precedences(marks, systems, course, joint=joint)
    if course is None or kept is None:  # an action that nobody can wait for
        return None, bound
    return OrderedPlan(_paths(systems, course), kept, course.cost, course.reached), bound


def _leaving_after_actions(system: TransitionSystem) -> TransitionSystem:
    """Return the system without ends in regions where it acts: an action is over for sure when its region is left."""
    acting = {action.at for action in system.actions}
    if not acting:
        return system
    ends = dict.fromkeys(range(len(system.labels)), 0.0) if system.final is None else system.final
    return replace(system, final={n: cost for n, cost in ends.items() if acting.isdisjoint(system.nodes[n].regions)})


def ordered_possible(
    systems: Sequence[TransitionSystem], automata: Sequence[Automaton], *, joint: bool, most: int = MOST_STATES
) -> bool:
    """Tell whether there are words whose team words all satisfy a formula without counts under some precedences.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        joint: Whether it reads the letter of the whole team.
        most: States that may be expanded.

    Raises:
        TooLarge: The budget was used up; nothing is known.
    """
    marks = Marks(automata, {})
    reading, shown = Reading(marks, joint=joint), shown_by(marks, systems)
    if not _may_be_possible(systems, shown, reading, most):
        return False
    return cheapest_course(systems, shown, reading, most) is not None


def shown_by(marks: Marks, systems: Sequence[TransitionSystem]) -> list[list[Shown]]:
    """Return what each robot shows at each node of its system."""
    return [[shown_at(marks, system, node) for node in range(len(system.labels))] for system in systems]


def words_and_order(marks: Marks, systems: Sequence[TransitionSystem], course: Course) -> tuple[list[list[Shown]], list[Event]]:
    """Return what each robot shows, letter by letter, along a course, and its events in their order.

    Args:
        marks: What the formula sees.
        systems: One for each robot.
        course: Steps of the robots.
    """
    words = [[shown_at(marks, system, system.initial)] for system in systems]
    at = [system.initial for system in systems]
    order: list[Event] = []
    for robot, node in course.steps:
        if is_event(systems[robot], at[robot], node):
            words[robot].append(shown_at(marks, systems[robot], node))
            order.append((robot, len(words[robot]) - 1))
        at[robot] = node
    return words, order


def _may_be_possible(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> bool:
    """Tell whether smaller systems that can do more can do it; True where that takes too long to find out."""
    merged = [alike_merged(system, own, reading.is_idle) for system, own in zip(systems, shown, strict=True)]
    reachable = [own for _, own in merged]
    if not reading.some_word(reachable):
        return False
    try:
        return cheapest_course([system for system, _ in merged], reachable, reading, most) is not None
    except TooLarge:
        return True


def _precedences(
    marks: Marks, systems: Sequence[TransitionSystem], course: Course, *, joint: bool
) -> tuple[Precedence, ...] | None:
    words, order = words_and_order(marks, systems, course)
    names = Names(systems, _paths(systems, course))
    pairs = needed_orders(Linearisations(marks, words, joint=joint), order, names.price)
    return None if pairs is None else tuple(dict.fromkeys(map(names.precedence, pairs)))


def _paths(systems: Sequence[TransitionSystem], course: Course) -> tuple[tuple[int, ...], ...]:
    """Return each robot's nodes."""
    paths = [[system.initial] for system in systems]
    for robot, node in course.steps:
        paths[robot].append(node)
    return tuple(map(tuple, paths))
