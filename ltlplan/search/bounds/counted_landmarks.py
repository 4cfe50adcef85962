"""Landmarks of formulas that count: how many robots must at some later time make a mark, or no longer make it, whatever is done.

A state of a conjunct's automaton needs a proposition where no letters without it lead on to acceptance (Hoffmann, Porteous and
Sebastia 2004), and needs it to be false where none with it do. While a proposition `at least k make this mark` is false and needed, as
many robots as are missing to k must come to make the mark; while it is true and must become false, all but k - 1 of them must cease to.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import reduce
from operator import or_
from typing import NamedTuple

from ltlplan.logic.automaton import DEAD
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.counting.counting_propositions import NEVER, Marks, States, Sums
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.memoization import memoized

MOST_READ = 50_000
"""States times letters of a conjunct up to which its landmarks are looked for."""


class Goal(NamedTuple):
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


_Needed = tuple[Goal, int]
"""A goal, and the sum from which on its proposition is true."""


class CountedLandmarks:
    """What must still be done, by states and sums.

    Args:
        marks: What the formula sees.

    Attributes:
        goals: All that any state may need.
    """

    def __init__(self, marks: Marks) -> None:
        self._needed = [_landmarks(marks, part) for part in marks.parts]
        self.goals = tuple(sorted({goal for found in self._needed for needed in found.values() for goal, _ in needed}))

    def __call__(self, states: States, sums: Sums) -> tuple[int, ...]:
        """Return for each goal how many robots that have not reached it must.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
        """
        missing = [0] * len(self.goals)
        for number, (mark, made), least in self._asked(states):
            more = least - sums[mark] if made else sums[mark] - least + 1
            missing[number] = max(more, missing[number])
        return tuple(missing)

    @memoized
    def _asked(self, states: States) -> list[tuple[int, Goal, int]]:
        """Return what states need, each with the number of its goal."""
        needed = {one for found, state in zip(self._needed, states, strict=True) for one in found.get(state, ())}
        return [(self.goals.index(goal), goal, least) for goal, least in needed]


def _landmarks(marks: Marks, part: JointConjunct) -> dict[int, list[_Needed]]:
    """Return what each state of a conjunct needs; nothing where there are too many."""
    levels = {1 << bit: level for bit, level in enumerate(marks.levels) if part.mask >> bit & 1}
    graph = _graph(part, _letters(levels) if len(levels) <= MOST_READ.bit_length() else [])
    found: dict[int, list[_Needed]] = {state: [] for state in graph.nodes}
    for (bit, (mark, least)), made in itertools.product(levels.items(), (True, False)):
        without = graph.leading_to(graph.goals, lambda letter, bit=bit, made=made: bool(letter & bit) != made)
        for state in found.keys() - without if least < NEVER else ():
            found[state].append((Goal(mark, made), least))
    return found


def _graph(part: JointConjunct, letters: Sequence[int]) -> ConjunctGraph[int]:
    """Return a conjunct's graph under some letters; without nodes where there are too many."""
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


def _letters(levels: Mapping[int, tuple[int, int]]) -> list[int]:
    """Return the letters, as bits, that some sums make: of two counts of the same mark the larger is not true alone.

    Args:
        levels: Of each proposition, as a bit, its mark and the least sum that makes it true.
    """
    choices: dict[int, set[int]] = {}
    for mark, made in [(mark, sums) for mark, least in levels.values() for sums in (0, least) if sums < NEVER]:
        true = sum(bit for bit, (own, least) in levels.items() if own == mark and least <= made)
        choices.setdefault(mark, set()).add(true)
    return [reduce(or_, chosen, 0) for chosen in itertools.product(*map(sorted, choices.values()))]
