"""What remains to be done, as one number: the product of the conjuncts' automata, made as it is walked.

A `Task` reads letters by number (the few that robots can really show) and makes its states as they are asked for; a conjunct
whose automaton is nondeterministic is walked over sets of its states.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import reduce
from operator import or_

from ltlplan.logic.automaton import DEAD, Automaton
from verify.data import Letter


class Task:
    """What remains to be done, as one number: a state of the product of all conjuncts' automata.

    Attributes:
        parts: The conjuncts' automata.
        letters: The letters that are read, by number.
        initial: The state before anything was read.
    """

    def __init__(self, automata: Iterable[Automaton], letters: Sequence[Letter]) -> None:
        self.letters = tuple(letters)
        self.parts: tuple[Deterministic | Subsets, ...] = tuple(
            Deterministic(a, self.letters) if a.deterministic else Subsets(a, self.letters) for a in automata
        )
        self._states: list[tuple[int, ...]] = []
        self._numbers: dict[tuple[int, ...], int] = {}
        self._rows: list[list[int] | None] = []
        self._accepting: list[bool] = []
        self._changes: dict[tuple[int, int], list[tuple[int, int]]] = {}
        self.initial = self._number(tuple(part.initial for part in self.parts))

    def __len__(self) -> int:
        return len(self._states)

    def state(self, number: int) -> tuple[int, ...]:
        """Return the states of the conjuncts' automata that a number stands for."""
        return self._states[number]

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done."""
        return self._accepting[number]

    def row(self, number: int) -> list[int]:
        """Return the state after each letter; `DEAD` where some conjunct can no longer hold."""
        row = self._rows[number]
        if row is None:
            state = self._states[number]
            after: dict[int, list[int]] = {}  # letters that change anything, with the state that they lead to
            row = [number] * len(self.letters)
            for index, at in enumerate(state):
                for letter, target in self._part_changes(index, at):
                    if target == DEAD:
                        row[letter] = DEAD
                    elif row[letter] != DEAD:
                        if letter not in after:
                            after[letter] = list(state)
                        after[letter][index] = target
            for letter, target_state in after.items():
                if row[letter] != DEAD:
                    row[letter] = self._number(tuple(target_state))
            self._rows[number] = row
        return row

    def _part_changes(self, index: int, at: int) -> list[tuple[int, int]]:
        found = self._changes.get((index, at))
        if found is None:
            row = self.parts[index].row(at)
            found = self._changes[index, at] = [(letter, target) for letter, target in enumerate(row) if target != at]
        return found

    def _number(self, state: tuple[int, ...]) -> int:
        found = self._numbers.get(state)
        if found is None:
            found = self._numbers[state] = len(self._states)
            self._states.append(state)
            self._rows.append(None)
            self._accepting.append(all(part.accepting(at) for part, at in zip(self.parts, state, strict=True)))
        return found

    def run(self, letters: Iterable[int], start: int | None = None) -> int:
        """Return the state after some letters, or `DEAD`."""
        at = self.initial if start is None else start
        for letter in letters:
            at = self.row(at)[letter]
            if at == DEAD:
                return DEAD
        return at


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
        """Tell whether a state is accepting."""
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
        """Tell whether a state is accepting."""
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
