"""A mission's formula as robots read it: by the letters that they can show, with what MTAC-E asks of its states.

Where a task may be divided, whether words hold in every order, and which letters may be read at any time.
"""

from __future__ import annotations

import itertools
from collections.abc import Container, Hashable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.decomposition import decomposes_from
from ltlplan.logic.translation import translate
from ltlplan.mtac.agent_moves import World
from ltlplan.search.counting.counting_propositions import true_atoms
from ltlplan.search.every_order import hold_in_every_order
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import closure
from verify.data import Letter
from verify.data.language.counting import atoms

State = Hashable
"""A state of the automaton, its dead state included."""

States = frozenset[State]

MAX_COMMUTING = 10_000
"""States times letters up to which it is found out which letters commute."""


class Accepting(Protocol):
    """Interface of an automaton that sharing needs; `ltlplan.translate` returns one."""

    @property
    def initial(self) -> Hashable: ...  # noqa: D102

    @property
    def accepting(self) -> Container[Any]: ...  # noqa: D102  # of any type: each automaton has states of its own

    def successor(self, state: Any, letter: Letter, /) -> Hashable: ...  # noqa: D102  # of any type: likewise


class Reader:
    """A mission's formula as an automaton that reads letters by name and remembers what it has read.

    Attributes:
        initial: The state before anything was read.
        shown: The letters that one robot can show.
    """

    def __init__(self, world: World) -> None:
        mission = world.mission
        self._formula, self._joint = mission.formula, mission.spec.team == "joint"
        self._automaton = translate(mission.formula, trace="finite")
        self._atoms = atoms(mission.formula)
        self.initial: State = self._automaton.initial
        self.shown = tuple(sorted(world.shown, key=sorted))

    @property
    def accepting(self) -> Reader:
        """Container that answers `state in reader.accepting`."""
        return self

    def __contains__(self, state: Any) -> bool:  # of any type: each automaton has states of its own
        return state != DEAD and self._automaton.is_accepting(state)

    @memoized
    def successor(self, state: Any, letter: Letter) -> Any:  # of any type: each automaton has states of its own
        """Return the state after a letter, or `DEAD`."""
        return DEAD if state == DEAD else self._automaton.successor(state, letter)

    def read(self, states: States, letters: Iterable[Letter]) -> States:
        """Return the states after letters."""
        for letter in letters:
            states = frozenset(self.successor(state, letter) for state in states)
        return states

    def team_letter(self, held: Mapping[str, Letter]) -> Letter:
        """Return what a team shows whose robots hold some letters: their union, and what holds of single robots and of numbers.

        Args:
            held: Each robot's letter.
        """
        return union_of(held) | (self._true(tuple(held.items())) if self._atoms else frozenset())

    @memoized
    def _true(self, held: tuple[tuple[str, Letter], ...]) -> Letter:
        """Return what holds of single robots, and of how many they are."""
        return true_atoms(self._atoms, held)

    def in_decomposition_set(self, states: States, *, begun: States | None = None) -> bool:
        """Tell whether the rest may be handed to another robot: whether the states are in the decomposition set.

        The set is that of the letters that these robots can show, and of the state that the team is in now: in flight, what is
        done is done, and only the order of what is left counts. Under `team: joint` a robot's word alone says nothing, and
        the finished plan is the only test.

        Args:
            states: Where the rest would be handed over.
            begun: Where the team is now; None before take-off.
        """
        if self._joint:
            return DEAD not in states
        return self._decomposes(frozenset({self.initial}) if begun is None else begun, states)

    @memoized
    def _decomposes(self, begun: States, states: States) -> bool:
        return DEAD not in states and decomposes_from(self._automaton, begun, states, self.shown)

    @memoized
    def commutes(self, letter: Letter) -> bool:
        """Tell whether it does not matter when a letter is read among others: always the same state, and once is enough.

        False where the automaton is too large to say so quickly.
        """
        states = self._reachable
        return (
            bool(states)
            and all(
                self.successor(self.successor(state, letter), other) == self.successor(self.successor(state, other), letter)
                for state in states
                for other in self.shown
            )
            and all(self.successor(self.successor(s, letter), letter) == self.successor(s, letter) for s in states)
        )

    @cached_property
    def _reachable(self) -> tuple[State, ...]:
        """All states that the robots' letters lead to; none where there are too many to look at all pairs of letters."""
        most = MAX_COMMUTING // len(self.shown)
        found = closure([self.initial], lambda state: (self.successor(state, letter) for letter in self.shown))
        seen = tuple(itertools.islice(found, most + 1))
        return seen if len(seen) <= most else ()

    def holds_in_every_order(self, words: Mapping[str, Sequence[Letter]]) -> bool:
        """Tell whether the words have the sequential property (Def. 4.5)."""
        return hold_in_every_order(conjunct_automata(self._formula, "finite"), [*words.values()], joint=self._joint)


def union_of(held: Mapping[str, Letter]) -> Letter:
    """Return the union of what robots hold: what a team shows where nothing asks for numbers or single robots.

    Args:
        held: Each robot's letter.
    """
    return frozenset[str]().union(*held.values())
