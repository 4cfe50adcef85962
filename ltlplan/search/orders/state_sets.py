"""All team words of robots whose events come in a known order, followed as sets of the formula's states.

A letter that is held is read at least once and as often as one likes. Under `own` the robots' letters are read one by one in any order,
so that after each event a conjunct may be in several states; under `joint` the team's letter is the only one. At a wall that two rooms
share each of several letters may be read (see `shown_at`). A *possibility* is a state of a conjunct and who has not been read since
coming to a letter.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

from ltlplan.logic.automaton import DEAD
from ltlplan.search.counting.counting_propositions import Marks, Sums
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers, closure
from ltlplan.systems.transition_systems import TransitionSystem

_MOST_LETTERS = 4_000
"""Letters of a team, or states of the formula, that are looked at to find out whether any word satisfies it."""

Each = TypeVar("Each")
Shown = tuple[Sums, ...]
"""The marks that a robot's letter makes; at a wall that rooms share those of each letter that it may show."""

Known = tuple[int, ...]
"""For each conjunct the number of what is possible."""

_Letters = tuple[tuple[int, ...], ...]
"""For each reader (a robot, or the whole team) the letters that may be read, as bits."""

_Possible = frozenset[tuple[int, int]]
"""States of a conjunct, each with bits: bit r says that reader r has not been read since it came to its letter."""


def shown_at(marks: Marks, system: TransitionSystem, node: int) -> Shown:
    """Return what a robot may show at a node: its label, and where rooms share a wall none of them or one alone as well.

    Args:
        marks: What the formula sees.
        system: The robot's.
        node: Of the system.
    """
    label = system.labels[node]
    rooms = system.walls.get(node)
    if rooms is None:
        return (marks.of(system.robot, label),)
    left, entered = rooms
    letters = (label, label - {left, entered}, label - {entered}, label - {left})
    return tuple(dict.fromkeys(marks.of(system.robot, letter) for letter in letters))


class Reading:
    """Reading of a team's events by a formula.

    Attributes:
        marks, joint: As given.

    Args:
        marks: What the formula sees.
        joint: Whether the letter of the whole team is read, or each robot's by itself.
    """

    def __init__(self, marks: Marks, *, joint: bool) -> None:
        self.marks, self.joint = marks, joint
        self._parts = [_Possibilities(part) for part in marks.parts]

    def begin(self, team: tuple[Shown, ...]) -> Known | None:
        """Return what is possible before the first event; None where some team word has lost the task.

        Args:
            team: What each robot shows.
        """
        letters = self.letters(team)
        return all_or_none(part.begin(letters) for part in self._parts)

    def after(self, known: Known, team: tuple[Shown, ...], robot: int) -> Known | None:
        """Return what is possible when one robot has come to its next letter; None where some team word has lost the task.

        Args:
            known: What was possible before.
            team: What each robot shows now.
            robot: Who has come to another letter.
        """
        letters, reader = self.letters(team), 0 if self.joint else robot
        return all_or_none(part.after(at, letters, reader) for part, at in zip(self._parts, known, strict=True))

    def accepting(self, known: Known) -> bool:
        """Tell whether every team word that ends here satisfies the formula."""
        return all(part.accepting(at) for part, at in zip(self._parts, known, strict=True))

    @memoized
    def states(self, known: Known) -> tuple[frozenset[int], ...]:
        """Return for each conjunct the states that are possible once everybody has been read."""
        return tuple(part.states(at) for part, at in zip(self._parts, known, strict=True))

    def some_word(self, shown: Sequence[Sequence[Shown]]) -> bool:
        """Tell whether letters that robots can show satisfy the formula in some order, wherever robots are; True where there are many.

        Args:
            shown: For each robot what it shows at each node.
        """
        distinct = [list(dict.fromkeys(own)) for own in shown]
        if self.joint and math.prod(map(len, distinct)) > _MOST_LETTERS:
            return True
        teams = itertools.product(*distinct) if self.joint else ((each,) for own in distinct for each in own)
        letters = {letter for team in teams for own in self.letters(team) for letter in own}

        def onwards(states: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
            pairs = list(zip(self.marks.parts, states, strict=True))
            every = (tuple(part.step(state, letter) for part, state in pairs) for letter in letters)
            return (after for after in every if DEAD not in after)

        reached = enumerate(closure(onwards(self.marks.initial), onwards))
        return any(self.marks.accepting(states) or seen > _MOST_LETTERS for seen, states in reached)

    def is_idle(self, shown: Shown, index: int | None = None) -> bool:
        """Tell whether it makes no difference that a robot which goes on showing the same is read again.

        Args:
            shown: By the robot.
            index: Of the conjunct to which it makes none; None for all of them.
        """
        if self.joint:
            return True
        parts = self._parts if index is None else [self._parts[index]]
        return all(part.is_idle(self.marks.letter(own)) for own in shown for part in parts)

    @memoized
    def effects(self, index: int, shown: Shown) -> frozenset[tuple[int, ...]]:
        """Return what each letter that a robot may show does to the states of one conjunct, by its index, under `own`."""
        part = self._parts[index].part
        letters = {self.marks.letter(sums) & part.mask for sums in shown}
        return frozenset(tuple(part.step(state, letter) for state in part.domain) for letter in letters)

    def effect(self, shown: Shown) -> tuple[frozenset[tuple[int, ...]], ...]:
        """Return what each letter that a robot may show does to the states of each conjunct, under `own`."""
        return tuple(self.effects(index, shown) for index in range(len(self._parts)))

    @memoized
    def alike(self, index: int, one: Shown, other: Shown) -> bool:
        """Tell whether it makes no difference to one conjunct, under `own`, whether a robot comes from a letter to another or stays there.

        Args:
            index: The conjunct's.
            one: Letter of the robot.
            other: The one that it comes to.
        """
        effects = self.effects(index, one)
        place = {state: at for at, state in enumerate(self._parts[index].part.domain)}
        return effects == self.effects(index, other) and all(
            own[place[state]] == state for own in effects for state in own if state != DEAD
        )

    def matters(self, index: int, shown: Sequence[Shown]) -> bool:
        """Tell whether it can make a difference to one conjunct when a robot shows what.

        Args:
            index: The conjunct's.
            shown: By the robot, letter by letter.
        """
        letters = {sums for own in shown for sums in own}
        if self.joint:
            return len(set(map(self.marks.conjuncts[index].cut, letters))) > 1
        return not all(self._parts[index].is_idle(self.marks.letter(sums)) for sums in letters)

    @memoized
    def letters(self, team: tuple[Shown, ...]) -> _Letters:
        """Return what each reader may read of what each robot shows."""
        if not self.joint:
            return tuple(tuple(dict.fromkeys(map(self.marks.letter, own))) for own in team)
        sums = (tuple(map(sum, zip(*held, strict=True))) for held in itertools.product(*team))
        return (tuple(dict.fromkeys(map(self.marks.letter, sums))),)


def all_or_none(found: Iterable[Each | None]) -> tuple[Each, ...] | None:
    """Return what was found, each in turn; None as soon as one was not.

    Args:
        found: What was found, or None.
    """
    kept: list[Each] = []
    for each in found:
        if each is None:
            return None
        kept.append(each)
    return tuple(kept)


class _Possibilities:
    """Possible states of one conjunct, numbered."""

    def __init__(self, part: JointConjunct) -> None:
        self.part = part
        self._sets: Numbers[_Possible] = Numbers()

    def begin(self, letters: _Letters) -> int | None:
        """Return the number of what is possible at first."""
        cut = self._cut(letters)
        unread = sum(1 << reader for reader, own in enumerate(cut) if not self._all_idle(own))
        first = {
            (self.part.step(self.part.initial, letter), unread & ~(1 << reader))
            for reader, own in enumerate(cut)
            for letter in own
        }
        return None if any(state == DEAD for state, _ in first) else self._read(first, cut)

    def after(self, number: int, letters: _Letters, reader: int) -> int | None:
        """Return the number of what is possible when one reader has come to a new letter; it has been read before."""
        return self._after(number, self._cut(letters), reader)

    @memoized
    def _after(self, number: int, cut: _Letters, reader: int) -> int | None:
        bit = 0 if self._all_idle(cut[reader]) else 1 << reader
        return self._read(
            {(state, unread | bit) for state, unread in self._sets.known[number] if not unread >> reader & 1}, cut
        )

    def accepting(self, number: int) -> bool:
        """Tell whether all that is possible once everybody has been read is accepting."""
        return all(unread or self.part.accepting(state) for state, unread in self._sets.known[number])

    def states(self, number: int) -> frozenset[int]:
        """Return what is possible once everybody has been read."""
        return frozenset(state for state, unread in self._sets.known[number] if not unread)

    @memoized
    def _cut(self, letters: _Letters) -> _Letters:
        return tuple(tuple(sorted({letter & self.part.mask for letter in own})) for own in letters)

    def _all_idle(self, letters: Sequence[int]) -> bool:
        return all(map(self.is_idle, letters))

    @memoized
    def is_idle(self, letter: int) -> bool:
        """Tell whether reading a letter never changes anything, once some letter was read."""
        part, edges = self.part, self.part.automaton.edges
        later = {target for own in edges for _, target in own}
        states = (state for at, state in enumerate(part.domain) if at in later)
        return all(part.step(state, letter & part.mask) == state for state in states)

    def _read(self, possible: set[tuple[int, int]], letters: _Letters) -> int | None:
        """Return the number of what is possible after any readings of held letters; None where some lose the task."""
        readers = [(1 << reader, letter) for reader, own in enumerate(letters) if not self._all_idle(own) for letter in own]
        moves: dict[int, set[tuple[int, int]]] = {}
        found, waiting = set(possible), list(possible)
        for state, unread in waiting:  # grows while it is walked
            if state not in moves:
                moves[state] = {(self.part.step(state, letter), ~bit) for bit, letter in readers}
                if any(after == DEAD for after, _ in moves[state]):
                    return None
            reached = {(after, unread & kept) for after, kept in moves[state]} - found
            found |= reached
            waiting += reached
        return self._sets[frozenset(found)]
