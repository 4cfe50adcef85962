"""Landmarks of formulas that count: how many robots must at some later time make a mark, or no longer make it, whatever is done.

A state of a conjunct's automaton needs a proposition where no letters without it lead on to acceptance (Hoffmann, Porteous and
Sebastia 2004), and needs it to be false where none with it do. While a proposition `at least k make this mark` is false and needed, as
many robots as are missing to k must come to make the mark; while it is true and must become false, all but k - 1 of them must cease to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ltlplan.logic.automaton import DEAD
from ltlplan.search.counting.counting_propositions import NEVER, Marks, States, Sums
from ltlplan.search.joint.conjuncts import JointConjunct

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
        self._by_states: dict[States, tuple[tuple[int, _Needed], ...]] = {}

    def __call__(self, states: States, sums: Sums) -> tuple[int, ...]:
        """Return for each goal how many robots that have not reached it must.

        Args:
            states: The conjuncts' states.
            sums: How many robots make each mark.
        """
        asked = self._by_states.get(states)
        if asked is None:
            needed = {n for found, state in zip(self._needed, states, strict=True) for n in found.get(state, ())}
            asked = self._by_states[states] = tuple((self._number[n.goal], n) for n in needed)
        missing = [0] * len(self.goals)
        for number, needed in asked:
            more = needed.missing(sums)
            if more > missing[number]:
                missing[number] = more
        return tuple(missing)


def never_made(marks: Marks) -> frozenset[int]:
    """Return the marks, by number, that no robot may ever make: the first one that does loses the task.

    Args:
        marks: What the formula sees.
    """
    found: set[int] = set()
    for part in marks.parts:
        levels = _levels(marks, part)
        letters, after = _walked(part, levels)
        for bit, (mark, least) in levels.items():
            lost = (targets[i] == DEAD for targets in after.values() for i, letter in enumerate(letters) if letter & bit)
            if least == 1 and after and all(lost):
                found.add(mark)
    return frozenset(found)


_Levels = dict[int, tuple[int, int]]
"""Of each proposition of a conjunct, as a bit, its mark and the least sum that makes it true."""


def _levels(marks: Marks, part: JointConjunct) -> _Levels:
    return {1 << bit: level for bit, level in enumerate(marks.levels) if part.mask >> bit & 1}


def _walked(part: JointConjunct, levels: _Levels) -> tuple[list[int], dict[int, list[int]]]:
    """Return all letters, and where they lead from each state of a conjunct; no states where there are too many."""
    letters = list(_letters(levels)) if len(levels) <= MOST_READ.bit_length() else []
    after: dict[int, list[int]] = {}
    waiting = [part.initial]
    for state in waiting:  # grows while it is walked
        if len(after) * len(letters) >= MOST_READ or not letters:
            return letters, {}
        if state not in after:
            after[state] = [part.step(state, letter) for letter in letters]
            waiting += [target for target in after[state] if target != DEAD and target not in after]
    return letters, after


def _landmarks(marks: Marks, part: JointConjunct) -> dict[int, tuple[_Needed, ...]]:
    """Return what each state of a conjunct needs; nothing where there are too many."""
    levels = _levels(marks, part)
    letters, after = _walked(part, levels)
    found: dict[int, tuple[_Needed, ...]] = dict.fromkeys(after, ())
    for bit, (mark, least) in levels.items():
        for made in (True, False):
            need = _Needed(Goal(mark, made), least)
            without = _accepting_without(part, after, [bool(letter & bit) != made for letter in letters])
            for state in after:
                if not without(state) and least < NEVER:
                    found[state] = (*found[state], need)
    return found


def _accepting_without(part: JointConjunct, after: dict[int, list[int]], allowed: list[bool]) -> Callable[[int], bool]:
    """Return whether letters that are allowed lead from a state to acceptance."""
    back: dict[int, list[int]] = {}
    for state, targets in after.items():
        for target, may in zip(targets, allowed, strict=True):
            if may and target != DEAD:
                back.setdefault(target, []).append(state)
    reached = {state for state in after if part.accepting(state)}
    waiting = list(reached)
    for state in waiting:  # grows while it is walked
        more = [before for before in back.get(state, ()) if before not in reached]
        reached.update(more)
        waiting += more
    return reached.__contains__


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
