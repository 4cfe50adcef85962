"""Landmarks: the propositions that every way to acceptance shows (Hoffmann, Porteous and Sebastia 2004), read off the automata."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TypeGuard

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.logic.product_automaton import Task
from ltlplan.search.heuristics.heuristic import MAX_TABLE
from ltlplan.search.heuristics.spanning_tree import SpanningTreeBound
from ltlplan.search.reduced_graph import ReducedGraph
from verify.data import Letter

MAX_GOALS = 40  # propositions that a conjunct's states are asked about


class Landmarks:
    """Which propositions must still be shown, whatever is done, and how far it is to show them all.

    A state of a conjunct needs a proposition where no letters without it lead on to acceptance.

    Args:
        task: What is to be done.
        graph: The team's graph.

    Attributes:
        tree_bound: Lower bounds for sets of landmarks.
    """

    def __init__(self, task: Task, graph: ReducedGraph) -> None:
        self._task = task
        shown = {letter for label in graph.label for letter in label}
        self._ways = [_Ways(part, task.letters, shown) if _is_small(part) else None for part in task.parts]
        by_part = [[] if ways is None else ways.landmarks(ways.accepting) for ways in self._ways]
        goals = sorted({name for landmarks in by_part for names in landmarks for name in names})
        bit = self._bit = {name: 1 << i for i, name in enumerate(goals)}
        self._by_part = [[sum(bit[name] for name in names) for names in landmarks] for landmarks in by_part]
        self._needed: dict[tuple[int, frozenset[int]], list[int]] = {}
        self.tree_bound = SpanningTreeBound(
            graph, [{letter for letter in shown if name in task.letters[letter]} for name in goals]
        )

    def __call__(self, state: int) -> int:
        """Return what a state of the task needs, as bits."""
        found = 0
        for at, landmarks in zip(self._task.state(state), self._by_part, strict=True):
            found |= landmarks[at] if landmarks else 0
        return found

    def needed_for(self, part: int, goals: frozenset[int]) -> list[int]:
        """Return what each state of a conjunct needs to come to some of its states, as bits.

        Args:
            part: The conjunct, by index; a small one.
            goals: States of its automaton.
        """
        key = part, goals
        found = self._needed.get(key)
        if found is None:
            ways = self._ways[part]
            assert ways is not None
            found = [sum(self._bit.get(name, 0) for name in names) for names in ways.landmarks(goals)]
            self._needed[key] = found
        return found


def _is_small(part: object) -> TypeGuard[Deterministic]:
    return isinstance(part, Deterministic) and len(part.identity) * len(part.views) <= MAX_TABLE


class _Ways:
    """How a small conjunct's states lead on without a proposition, for each that it speaks of: backwards."""

    def __init__(self, part: Deterministic, letters: Sequence[Letter], shown: Collection[int]) -> None:
        self._states = part.identity
        self.accepting = frozenset(state for state in part.identity if part.accepting(state))
        names = [name for name in part.automaton.propositions if any(name in letters[letter] for letter in shown)]
        seen = {view: part.views[view] for view in {part.view[letter] for letter in shown}}
        one = {part.view[letter]: letter for letter in shown}
        self._without: dict[str, list[list[int]]] = {}
        for name in names[:MAX_GOALS]:
            others = [one[view] for view, letter in seen.items() if name not in letter]
            back: list[list[int]] = [[] for _ in part.identity]
            for state in part.identity:
                row = part.row(state)
                for letter in others:
                    if row[letter] != DEAD:
                        back[row[letter]].append(state)
            self._without[name] = back

    def landmarks(self, goals: Collection[int]) -> list[list[str]]:
        """Return the propositions that each state needs to come to a goal."""
        found: list[list[str]] = [[] for _ in self._states]
        for name, back in self._without.items():
            reached = set(goals)
            waiting = list(reached)
            for state in waiting:  # grows while it is walked
                for before in back[state]:
                    if before not in reached:
                        reached.add(before)
                        waiting.append(before)
            for state in self._states:
                if state not in reached:
                    found[state].append(name)
        return found
