"""How far a team is, as one number: the states of a search that follows its robots one after another.

`TeamStates` is for formulas that robots keep each by itself; those of `team: joint` are in `joint.joint_states`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import Element, OrderCheck, TransitionMonoid
from ltlplan.search.heuristics.heuristic import UNREACHABLE, TaskHeuristic
from ltlplan.search.heuristics.landmarks import Landmarks
from ltlplan.search.heuristics.order_bounds import OrderBounds
from ltlplan.search.reduced_graph import ReducedGraph


class SearchStates(Protocol):
    """The states of a search that follows a team's robots one after another: how far the team is, as one number.

    Attributes:
        initial: Before anything was read.
    """

    initial: int

    def rest(self, number: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost that is left with a robot at a node, which falls by no more than a step costs.

        Args:
            number: The state.
            robot: The robot that flies; those after it are still to fly.
            node: Where it is.
        """
        ...

    def after(self, number: int, letter: int) -> int:
        """Return the state after a letter of the robot that flies; `DEAD` where the task is lost."""
        ...

    def handed_over(self, number: int) -> int:
        """Return the state between a robot's word and the next one's; `DEAD` where some order of the robots is lost."""
        ...

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        ...

    def holds_in_every_order(self, number: int) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        ...


class TeamStates:
    """How far a team is, as one number: the state of the task and, for the tracked conjuncts, the elements of the words.

    Args:
        graph: The team's graph.
        task: What is to be done.
        tracked: The conjuncts, by index, for which the words must also keep the task in every order.
    """

    def __init__(self, graph: ReducedGraph, task: Task, tracked: Sequence[int] = ()) -> None:
        self.task = task
        self._heuristic = TaskHeuristic(task, graph.entering)
        self._landmarks = Landmarks(task, graph)
        self._orders = {
            place: OrderBounds(part, index, self._heuristic, self._landmarks)
            for place, index in enumerate(tracked)
            if isinstance(part := task.parts[index], Deterministic) and self._heuristic.knows(index)
        }
        self._monoid, self._check = TransitionMonoid(task, tracked), OrderCheck(task, tracked)
        self._states: list[int] = []
        self._own: list[Element] = []
        self._done: list[tuple[Element, ...]] = []
        self._numbers: dict[tuple[int, Element, tuple[Element, ...]], int] = {}
        self._after: list[dict[int, int]] = []
        self._switched: dict[int, int] = {}
        self._rest: list[float] = []
        self._missing: list[int] = []
        self.initial = self._number(task.initial, self._monoid.identity, ())

    def after(self, number: int, letter: int) -> int:
        """Return the state after a letter; `DEAD` where the task is lost, for this order of the robots or for another."""
        found = self._after[number].get(letter)
        if found is None:
            found = DEAD
            state = self.task.row(self._states[number])[letter]
            if state != DEAD and self._heuristic(state) < UNREACHABLE:
                element = self._monoid.read(self._own[number], letter)
                if not self._monoid.is_dead(element):
                    found = self._alive(self._number(state, element, self._done[number]))
            self._after[number][letter] = found
        return found

    def handed_over(self, number: int) -> int:
        """Return the state between a robot's word and the next one's; `DEAD` where some order of the robots is lost."""
        found = self._switched.get(number)
        if found is None:
            found, element, done = DEAD, self._own[number], self._done[number]
            if element != self._monoid.identity:
                done = tuple(sorted((*done, element)))
            if self._check.failing_order(done, finished=False) is None:
                found = self._alive(self._number(self._states[number], self._monoid.identity, done))
            self._switched[number] = found
        return found

    def rest(self, number: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost that is left with a robot at a node.

        Args:
            number: The state.
            robot: The robot that flies; those after it are still to fly.
            node: Where it is.
        """
        return max(self._rest[number], self._landmarks.tree_bound(self._missing[number], robot, node))

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return self.task.is_accepting(self._states[number])

    def holds_in_every_order(self, number: int) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        return self._check.failing_order([*self._done[number], self._own[number]]) is None

    def _alive(self, number: int) -> int:
        """Return a state's number; `DEAD` where some order of the robots is lost whatever is still to be read."""
        return number if self._rest[number] < UNREACHABLE else DEAD

    def _number(self, state: int, own: Element, done: tuple[Element, ...]) -> int:
        key = (state, own, done)
        found = self._numbers.get(key)
        if found is None:
            found = self._numbers[key] = len(self._states)
            self._states.append(state)
            self._own.append(own)
            self._done.append(done)
            self._after.append({})
            rest, missing = self._heuristic(state), self._landmarks(state)
            for place, bound in self._orders.items():
                left, needed = bound(own[place], [each[place] for each in done])
                rest, missing = rest + left - bound.plain(self.task.state(state)), missing | needed
            self._rest.append(rest)
            self._missing.append(missing)
        return found
