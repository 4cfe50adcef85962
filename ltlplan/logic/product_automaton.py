"""Product of the conjuncts' automata, made as it is walked: one number for all that remains to be done.

A `Task` reads letters by number (the few that robots can really show) and makes its states as they are asked for; a conjunct
whose automaton is nondeterministic is walked over sets of its states.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.conjunct_automata import AtWalls, Part, reading
from verify.data import Letter


class Task:
    """The rest of a task as one number: a state of the product of all conjuncts' automata.

    Attributes:
        parts: The conjuncts' automata.
        letters: The letters that are read, by number.
        initial: The state before anything was read.
    """

    def __init__(
        self, automata: Iterable[Automaton], letters: Sequence[Letter], walls: Mapping[int, tuple[str, str]] | None = None
    ) -> None:
        """Make the product's first state.

        Args:
            automata: One for each conjunct.
            letters: What can be read.
            walls: Letters, by number, at walls that two rooms share: the room that is left, and the one that is entered.
        """
        self.letters = tuple(letters)
        self.parts: tuple[Part, ...] = tuple(self._part(automaton, walls or {}) for automaton in automata)
        self._states: list[tuple[int, ...]] = []
        self._numbers: dict[tuple[int, ...], int] = {}
        self._rows: list[list[int] | None] = []
        self._accepting: list[bool] = []
        self._changes: dict[tuple[int, int], list[tuple[int, int]]] = {}
        self.initial = self._number(tuple(part.initial for part in self.parts))

    def _part(self, automaton: Automaton, walls: Mapping[int, tuple[str, str]]) -> Part:
        asked = {letter: rooms for letter, rooms in walls.items() if not set(rooms).isdisjoint(automaton.propositions)}
        if asked:
            return AtWalls(automaton, self.letters, asked)
        return reading(automaton, self.letters)

    def __len__(self) -> int:
        return len(self._states)

    def state(self, number: int) -> tuple[int, ...]:
        """Return the states of the conjuncts' automata that a number stands for."""
        return self._states[number]

    def is_accepting(self, number: int) -> bool:
        """Return whether everything is done."""
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
