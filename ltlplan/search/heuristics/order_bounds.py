"""How much is surely left to fly where words must hold in every order of the robots: as much as the order that asks for most.

A search follows robots one after another, and what is cheap in that order may break a conjunct in another one. What the other orders
still ask for is known long before all robots have flown: those that did may come before what is still to be read, or after it. So this has
to lead on from where some of them take the conjunct to where the rest of them, read afterwards, takes it to acceptance.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import reduce

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.search.heuristics.heuristic import UNREACHABLE, TaskHeuristic
from ltlplan.search.heuristics.landmarks import Landmarks

Effect = tuple[int, ...]
"""What a word does to a conjunct: the state that each state is taken to."""

_ALL_ORDERS = 3  # words up to which all their orders are looked at; of more the sorted one and its reverse


class OrderBounds:
    """Lower bounds for one conjunct that every order of the robots has to keep.

    Args:
        part: The conjunct.
        index: Its index in the task.
        heuristic: Bounds on what its states cost; it has to know the conjunct.
        landmarks: What its states need.
    """

    def __init__(self, part: Deterministic, index: int, heuristic: TaskHeuristic, landmarks: Landmarks) -> None:
        self._part, self._index = part, index
        self._heuristic, self._landmarks = heuristic, landmarks
        self._accepting = frozenset(state for state in part.identity if part.accepting(state))
        self._plain = heuristic.distances_to(index, self._accepting) or []
        self._known: dict[tuple[Effect, tuple[Effect, ...]], tuple[float, int]] = {}

    def plain(self, states: Sequence[int]) -> float:
        """Return the bound where only the order counts in which the robots are followed.

        Args:
            states: Of all conjuncts.
        """
        return self._plain[states[self._index]]

    def __call__(self, own: Effect, done: Sequence[Effect]) -> tuple[float, int]:
        """Return a lower bound on the cost that is left, and what must still be shown, as bits.

        Args:
            own: What the word of the robot that flies has done so far.
            done: What the words of robots that flew before it do.
        """
        others = tuple(sorted(effect for effect in done if effect != self._part.identity))
        found = self._known.get((own, others))
        if found is None:
            cost, missing = 0.0, 0
            for before, after in _parted(others):
                left, needed = self._left((*before, own), after)
                cost, missing = max(cost, left), missing | needed
            found = self._known[own, others] = cost, missing
        return found

    def _left(self, before: Sequence[Effect], after: Sequence[Effect]) -> tuple[float, int]:
        """Return what is left between some words and others that are read afterwards."""
        part = self._part
        state = part.initial
        for effect in before:
            state = DEAD if state == DEAD else effect[state]
        if state == DEAD:
            return UNREACHABLE, 0
        then = reduce(part.compose, after, part.identity)
        goals = frozenset(state for state in part.identity if then[state] in self._accepting)
        cost = self._heuristic.distances_to(self._index, goals)
        assert cost is not None  # the conjunct is a small one
        return cost[state], self._landmarks.needed_for(self._index, goals)[state]


def _parted(effects: tuple[Effect, ...]) -> Iterator[tuple[tuple[Effect, ...], tuple[Effect, ...]]]:
    """Yield the ways in which words come before and after what is still to be read."""
    few = len(effects) <= _ALL_ORDERS
    orders = sorted(set(itertools.permutations(effects))) if few else [effects, effects[::-1]]
    return ((order[:cut], order[cut:]) for order in orders for cut in range(len(effects) + 1))
