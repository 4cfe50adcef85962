"""Landmarks of formulas that count: how many robots must at some later time make a mark, or no longer make it, whatever is done.

A state of a conjunct's automaton needs a proposition where no letters without it lead on to acceptance (Hoffmann, Porteous and
Sebastia 2004), and needs it to be false where none with it do. While a proposition `at least k make this mark` is false and needed, as
many robots as are missing to k must come to make the mark; while it is true and must become false, all but k - 1 of them must cease to.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from ltlplan.logic.automaton import DEAD
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.counting.counting_propositions import NEVER, Marks, States, Sums
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.memoization import memoized

MOST_READ = 50_000
"""States times letters of a conjunct up to which its landmarks are looked for."""


@dataclass(frozen=True, slots=True, order=True)
class Goal:
    """What some robots must do: make a mark on their way, or show a letter that does not make it.

    Attributes:
        mark: Its number.
        made: Whether it is to be made.
    """

    mark: int
    made: bool

    def shown(self, marks: Sums) -> bool:
        """Tell whether a letter of one robot, by its marks, does it."""
        return bool(marks[self.mark]) == self.made


@dataclass(frozen=True, slots=True)
class _Needed:
    """A proposition that must become true, or false, and by how many robots it is."""

    goal: Goal
    least: int

    def missing(self, sums: Sums) -> int:
        """Return how many robots, of those that have not done so, must reach the goal; 0 where the proposition is as needed now."""
        now = sums[self.goal.mark]
        return max(0, self.least - now if self.goal.made else now - self.least + 1)


class CountedLandmarks:
    """What must still be done, by states and sums.

    Args:
        marks: What the formula sees.

    Attributes:
        goals: All that any state may need.
    """

    def __init__(self, marks: Marks) -> None:
        self._needed = [_landmarks(marks, part) for part in marks.parts]
        self.goals = tuple(sorted({n.goal for found in self._needed for needed in found.values() for n in needed}))
        self._number = {goal: index for index, goal in enumerate(self.goals)}

    def __call__(self, states: States, sums: Sums) -> tuple[int, ...]:
        """Return for each goal how many robots that have not reached it must.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
        """
        missing = [0] * len(self.goals)
        for number, needed in self._asked(states):
            more = needed.missing(sums)
            if more > missing[number]:
                missing[number] = more
        return tuple(missing)

    @memoized
    def _asked(self, states: States) -> tuple[tuple[int, _Needed], ...]:
        """Return what states need, each with the number of its goal."""
        needed = {n for found, state in zip(self._needed, states, strict=True) for n in found.get(state, ())}
        return tuple((self._number[n.goal], n) for n in needed)


def never_made(marks: Marks) -> frozenset[int]:
    """Return the marks, by number, that no robot may ever make: the first one that does loses the task.

    Args:
        marks: What the formula sees.
    """
    found: set[int] = set()
    for part in marks.parts:
        levels = _levels(marks, part)
        graph = _graph(part, levels)
        shown = {letter for edges in graph.back.values() for _, letter in edges}
        found |= {
            mark for bit, (mark, least) in levels.items() if least == 1 and graph.nodes and not any(bit & s for s in shown)
        }
    return frozenset(found)


_Levels = dict[int, tuple[int, int]]
"""Of each proposition of a conjunct, as a bit, its mark and the least sum that makes it true."""


def _levels(marks: Marks, part: JointConjunct) -> _Levels:
    return {1 << bit: level for bit, level in enumerate(marks.levels) if part.mask >> bit & 1}


def _graph(part: JointConjunct, levels: _Levels) -> ConjunctGraph[int]:
    """Return a conjunct's graph under all letters that some sums make; without nodes where there are too many."""
    letters = list(_letters(levels)) if len(levels) <= MOST_READ.bit_length() else []
    nodes, back = [part.initial], dict[int, list[tuple[int, int]]]()
    for read, state in enumerate(nodes):  # grows while it is walked
        if read * len(letters) >= MOST_READ or not letters:
            return ConjunctGraph((), {}, frozenset(), part.mask, ())
        for letter in letters:
            after = part.step(state, letter)
            if after != DEAD:
                if after not in back and after != part.initial:
                    nodes.append(after)
                back.setdefault(after, []).append((state, letter))
    return ConjunctGraph(nodes, back, frozenset(filter(part.accepting, nodes)), part.mask, ())


def _landmarks(marks: Marks, part: JointConjunct) -> dict[int, tuple[_Needed, ...]]:
    """Return what each state of a conjunct needs; nothing where there are too many."""
    levels = _levels(marks, part)
    graph = _graph(part, levels)
    found: dict[int, tuple[_Needed, ...]] = dict.fromkeys(graph.nodes, ())
    for (bit, (mark, least)), made in itertools.product(levels.items(), (True, False)):
        without = graph.leading_to(graph.goals, lambda letter, bit=bit, made=made: bool(letter & bit) != made)
        for state in graph.nodes if least < NEVER else ():
            if state not in without:
                found[state] = (*found[state], _Needed(Goal(mark, made), least))
    return found


def _letters(levels: _Levels) -> Iterator[int]:
    """Yield the letters, as bits, that some sums make: of two counts of the same mark the larger is not true alone."""
    by_mark: dict[int, list[tuple[int, int]]] = {}
    for bit, (mark, least) in levels.items():
        by_mark.setdefault(mark, []).append((least, bit))
    letters = [0]
    for counts in by_mark.values():
        begun, choices = 0, [0] if all(least > 0 for least, _ in counts) else list[int]()
        for least in sorted({least for least, _ in counts if least < NEVER}):
            begun |= sum(bit for other, bit in counts if other == least)
            choices.append(begun)
        if any(least <= 0 for least, _ in counts):
            choices = [choice for choice in choices if choice]
        letters = [letter | choice for letter in letters for choice in choices]
    yield from letters
