"""Automata that read one conjunct, letter by letter, by number: states, sets of them, or all that walls leave open.

An *element* says what a word does to every state (`transition_monoid` puts those of all conjuncts together).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import TypeVar

from ltlplan.logic.automaton import DEAD, Automaton
from verify.data import Letter

_State = TypeVar("_State", int, tuple[int, ...])


class Deterministic:
    """One conjunct's deterministic automaton, reading letters by number."""

    def __init__(self, automaton: Automaton, letters: Sequence[Letter]) -> None:
        self.automaton = automaton
        self.initial = automaton.initial
        self.identity = tuple(automaton.states)
        self.views, self.view = _views(automaton, letters)
        self._rows: list[list[int] | None] = [None] * len(automaton.edges)

    def row(self, state: int) -> list[int]:
        """Return the state after each letter."""
        row = self._rows[state]
        if row is None:
            holds, edges = self.automaton.diagrams.holds, self.automaton.edges[state]
            after = [next((t for guard, t in edges if holds(guard, view)), DEAD) for view in self.views]
            row = self._rows[state] = [after[view] for view in self.view]
        return row

    def accepting(self, state: int) -> bool:
        """Return whether a state is accepting."""
        return state in self.automaton.accepting

    def read(self, element: tuple[int, ...], letter: int) -> tuple[int, ...]:
        """Return the element of a word with one more letter."""
        return tuple(DEAD if state == DEAD else self.row(state)[letter] for state in element)

    def apply(self, element: tuple[int, ...], state: int) -> int:
        """Return the state that words of an element lead to."""
        return element[state]

    def compose(self, first: tuple[int, ...], second: tuple[int, ...]) -> tuple[int, ...]:
        """Return the element of a word of one element followed by one of another."""
        return tuple(DEAD if state == DEAD else second[state] for state in first)


class Subsets:
    """One conjunct's nondeterministic automaton; its states here are numbers of sets, made as they are reached."""

    def __init__(self, automaton: Automaton, letters: Sequence[Letter]) -> None:
        self.automaton = automaton
        self.views, self.view = _views(automaton, letters)
        self._masks: list[int] = []
        self._numbers: dict[int, int] = {}
        self._rows: list[list[int] | None] = []
        self._steps: list[list[int] | None] = [None] * len(automaton.edges)
        self._final = sum(1 << state for state in automaton.accepting)
        self.identity = tuple(1 << state for state in automaton.states)
        self.initial = self._number(1 << automaton.initial)

    def _step(self, state: int) -> list[int]:
        """Return where each letter leads one state of the automaton, as bits."""
        found = self._steps[state]
        if found is None:
            successors = self.automaton.successors
            masks = [sum(1 << target for target in successors(state, view)) for view in self.views]
            found = self._steps[state] = [masks[view] for view in self.view]
        return found

    def _number(self, mask: int) -> int:
        if not mask:
            return DEAD
        found = self._numbers.get(mask)
        if found is None:
            found = self._numbers[mask] = len(self._masks)
            self._masks.append(mask)
            self._rows.append(None)
        return found

    def row(self, state: int) -> list[int]:
        """Return the state after each letter."""
        row = self._rows[state]
        if row is None:
            states = [self._step(at) for at in bits(self._masks[state])]
            row = [self._number(reduce(or_, reached, 0)) for reached in zip(*states, strict=True)]
            self._rows[state] = row
        return row

    def accepting(self, state: int) -> bool:
        """Return whether a state is accepting."""
        return bool(self._masks[state] & self._final)

    def read(self, element: tuple[int, ...], letter: int) -> tuple[int, ...]:
        """Return the element of a word with one more letter."""
        return tuple(reduce(or_, (self._step(at)[letter] for at in bits(mask)), 0) for mask in element)

    def apply(self, element: tuple[int, ...], state: int) -> int:
        """Return the state that words of an element lead to."""
        return self._number(_image(self._masks[state], element))

    def compose(self, first: tuple[int, ...], second: tuple[int, ...]) -> tuple[int, ...]:
        """Return the element of a word of one element followed by one of another."""
        return tuple(_image(mask, second) for mask in first)


class AtWalls:
    """One conjunct's automaton that reads, at walls which two rooms share, all that a robot may show there.

    Planned words have one letter with both names there. A robot near the wall may be in both rooms, in one or in none, and come and
    go; as regions are closed and paths continuous, names come together or go together. States here are numbers of sets of the
    automaton's states, all of which must accept; an element is the number of
    the set of what the words do.

    Args:
        automaton: The conjunct's.
        letters: What is read.
        walls: Letters, by number, at such walls: the room that is left, and the one that is entered.
    """

    def __init__(self, automaton: Automaton, letters: Sequence[Letter], walls: Mapping[int, tuple[str, str]]) -> None:
        numbers: dict[Letter, int] = {}
        for letter in letters:
            numbers.setdefault(letter, len(numbers))
        self._walls: dict[int, dict[str, int]] = {}
        for letter, (left, entered) in walls.items():
            both = letters[letter]
            shown = {"left": both - {entered}, "entered": both - {left}, "none": both - {left, entered}, "both": both}
            self._walls[letter] = {name: numbers.setdefault(one, len(numbers)) for name, one in shown.items()}
        self._read = [numbers[letter] for letter in letters]
        self._part = reading(automaton, tuple(numbers))
        plain, self.views = self._part.view, self._part.views
        seen: dict[object, int] = {}
        at_walls = {letter: tuple(plain[one] for one in names.values()) for letter, names in self._walls.items()}
        self.view = [seen.setdefault(at_walls.get(letter, plain[own]), len(seen)) for letter, own in enumerate(self._read)]
        self._sets: list[tuple[int, ...]] = []
        self._numbers: dict[tuple[int, ...], int] = {}
        self._rows: list[list[int] | None] = []
        self._done: list[tuple[tuple[int, ...], ...]] = []
        self._elements: dict[frozenset[tuple[int, ...]], int] = {}
        self.identity = self._element([self._part.identity])
        self.initial = self._number([self._part.initial])

    def _number(self, states: Iterable[int]) -> int:
        reached = tuple(sorted(set(states)))
        if DEAD in reached:
            return DEAD
        found = self._numbers.get(reached)
        if found is None:
            found = self._numbers[reached] = len(self._sets)
            self._sets.append(reached)
            self._rows.append(None)
        return found

    def row(self, state: int) -> list[int]:
        """Return the state after each letter."""
        row = self._rows[state]
        if row is None:
            part, states = self._part, self._sets[state]
            row = [
                self._number(
                    _all_read(states, letter, own, self._walls, lambda at, one: DEAD if at == DEAD else part.row(at)[one])
                )
                for letter, own in enumerate(self._read)
            ]
            self._rows[state] = row
        return row

    def accepting(self, state: int) -> bool:
        """Return whether a state is accepting."""
        return all(map(self._part.accepting, self._sets[state]))

    def read(self, element: tuple[int, ...], letter: int) -> tuple[int, ...]:
        """Return the element of a word with one more letter."""
        return self._element(_all_read(self._own(element), letter, self._read[letter], self._walls, self._part.read))

    def apply(self, element: tuple[int, ...], state: int) -> int:
        """Return the state that words of an element lead to."""
        return self._number(self._part.apply(one, at) for one in self._own(element) for at in self._sets[state])

    def compose(self, first: tuple[int, ...], second: tuple[int, ...]) -> tuple[int, ...]:
        """Return the element of a word of one element followed by one of another."""
        return self._element(self._part.compose(a, b) for a in self._own(first) for b in self._own(second))

    def _element(self, elements: Iterable[tuple[int, ...]]) -> tuple[int, ...]:
        done = frozenset(elements)
        if done not in self._elements:
            self._elements[done] = len(self._done)
            self._done.append(tuple(sorted(done)))
        return (self._elements[done],)

    def _own(self, element: tuple[int, ...]) -> tuple[tuple[int, ...], ...]:
        return self._done[element[0]]


_FOLLOWING = {
    "left": ("both", "none"),
    "entered": ("both", "none"),
    "both": ("left", "entered", "none"),
    "none": ("left", "entered", "both"),
}
"""What may be shown at a wall after what: names come, or go, one or two at a time."""


def _all_read(
    starts: Iterable[_State],
    letter: int,
    own: int,
    walls: Mapping[int, Mapping[str, int]],
    read: Callable[[_State, int], _State],
) -> Iterator[_State]:
    """Yield what can be reached by a letter: the only one, or at a wall, all that may be shown between the one room and the other."""
    if letter not in walls:
        yield from (read(start, own) for start in starts)
        return
    seen = {(start, "left") for start in starts}
    waiting = list(seen)
    for state, shown in waiting:  # grows while it is walked
        if shown != "left":
            yield state
        for name in _FOLLOWING[shown]:
            after = (read(state, walls[letter][name]), name)
            if after not in seen:
                seen.add(after)
                waiting.append(after)


def reading(automaton: Automaton, letters: Sequence[Letter]) -> Deterministic | Subsets:
    """Return what reads a conjunct: over its states, or where it is nondeterministic, over sets of them.

    Args:
        automaton: The conjunct's.
        letters: What is read, by number.
    """
    return Deterministic(automaton, letters) if automaton.deterministic else Subsets(automaton, letters)


Part = Deterministic | Subsets | AtWalls
"""One conjunct's automaton, reading letters by number."""


def _views(automaton: Automaton, letters: Sequence[Letter]) -> tuple[list[Letter], list[int]]:
    """Return what an automaton sees of some letters: the different views, and the number of each letter's view."""
    seen = frozenset(automaton.propositions)
    numbers: dict[Letter, int] = {}
    view = [numbers.setdefault(letter & seen, len(numbers)) for letter in letters]
    return list(numbers), view


def bits(mask: int) -> Iterator[int]:
    """Yield the positions of the ones in a mask."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def _image(mask: int, steps: Sequence[int]) -> int:
    """Return the union of `steps[i]` over the ones i of a mask."""
    return reduce(or_, (steps[at] for at in bits(mask)), 0)


def reached_states(part: Part, most: int | None = None) -> tuple[int, ...]:
    """Return all states of a conjunct that letters lead to; none where there are more than a limit.

    Args:
        part: The conjunct.
        most: The limit, if any.
    """
    found = [part.initial]
    for state in found:  # grows while it is walked
        found += [after for after in dict.fromkeys(part.row(state)) if after != DEAD and after not in found]
        if most is not None and len(found) > most:
            return ()
    return tuple(found)


def is_task(part: Part, reached: Sequence[int]) -> bool:
    """Tell whether any robot can do a conjunct at any time: it is never lost, and what is done stays done.

    Args:
        part: The conjunct.
        reached: Its states.
    """
    rows = {state: part.row(state) for state in reached}
    safe = all(DEAD not in row and (not part.accepting(s) or all(map(part.accepting, row))) for s, row in rows.items())
    return safe and not part.accepting(part.initial)
