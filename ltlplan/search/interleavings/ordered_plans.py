"""Plans that hold under precedences between events, where none holds in every order of the robots.

First a cheapest course of events is looked for all of whose team words satisfy the formula; where there is none, no words and no
precedences do. Then few of the precedences of that course are kept, so that robots wait for each other only where they must.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.search.counts.marks import Marks
from ltlplan.search.interleavings.abstraction import alike_merged
from ltlplan.search.interleavings.courses import Course, cheapest_course, is_event
from ltlplan.search.interleavings.event_names import Names
from ltlplan.search.interleavings.linearisations import Event, Linearisations
from ltlplan.search.interleavings.needed_orders import needed_orders
from ltlplan.search.interleavings.readings import Reading, Shown, shown_at
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible
from verify.data.language.counting import Atom
from verify.data.plan import Precedence

MOST_STATES = 30_000
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
    shown = [[shown_at(marks, system, node) for node in range(len(system.labels))] for system in systems]
    if not _may_be_possible(systems, shown, reading, most):
        return None
    course = cheapest_course(systems, shown, reading, most)
    if course is None:
        return None
    paths, order = _paths(systems, course)
    found = _precedences(marks, systems, paths, order, joint=joint)
    if found is None:
        raise Infeasible(
            "Words satisfy the formula where one robot's event follows another's, but these events are between two actions of one "
            "visit, which no wait can part."
        )
    return OrderedPlan(paths, found, course.cost, course.reached)


def _may_be_possible(
    systems: Sequence[TransitionSystem], shown: Sequence[Sequence[Shown]], reading: Reading, most: int
) -> bool:
    """Tell whether smaller systems that can do more can do it; True where that takes too long to find out."""
    merged = [alike_merged(system, own, reading.is_idle) for system, own in zip(systems, shown, strict=True)]
    try:
        return cheapest_course([system for system, _ in merged], [own for _, own in merged], reading, most) is not None
    except TooLarge:
        return True


def _precedences(
    marks: Marks,
    systems: Sequence[TransitionSystem],
    paths: Sequence[Sequence[int]],
    order: Sequence[Event],
    *,
    joint: bool,
) -> tuple[Precedence, ...] | None:
    words = [
        [shown_at(marks, system, node) for i, node in enumerate(path) if _is_new(system, path, i)]
        for system, path in zip(systems, paths, strict=True)
    ]
    names = Names(systems, paths)
    pairs = needed_orders(Linearisations(marks, words, joint=joint), order, names.price)
    return None if pairs is None else tuple(dict.fromkeys(map(names.precedence, pairs)))


def _paths(systems: Sequence[TransitionSystem], course: Course) -> tuple[tuple[tuple[int, ...], ...], list[Event]]:
    """Return each robot's nodes, and the events in their order."""
    paths = [[system.initial] for system in systems]
    letters = [0] * len(systems)
    order: list[Event] = []
    for robot, node in course.steps:
        paths[robot].append(node)
        if _is_new(systems[robot], paths[robot], len(paths[robot]) - 1):
            letters[robot] += 1
            order.append((robot, letters[robot]))
    return tuple(map(tuple, paths)), order


def _is_new(system: TransitionSystem, path: Sequence[int], index: int) -> bool:
    return index == 0 or is_event(system, path[index - 1], path[index])
