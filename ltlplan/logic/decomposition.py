"""The decomposition set: states in which the rest of a mission may be handed to another robot (2022 paper, Def. 4.5).

A state q belongs to it when both orders of the two tasks keep the formula, whichever words perform them: every word of
L(q -> accept) followed by one of L(start -> q) is accepted. That is an inclusion of languages, decided here exactly by
reachability in pairs of states; the test by essential sequences found in the literature accepts states that it must not.

Membership concerns every pair of words. A plan has one word a robot, so a switch outside the set may still be sound, and
three words may fail where each pair passes; `ltlplan.search` decides on the very words.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.conjunction import Conjunction
from verify.data import BadInput, Letter

State = Any  # of whichever automaton was given: an `Automaton` counts its states, a `Conjunction` has tuples


def decomposition_set(automaton: Automaton | Conjunction, alphabet: Iterable[Iterable[str]] | None = None) -> frozenset[State]:
    """Return the states in which a mission decomposes.

    Args:
        automaton: Deterministic, on finite words.
        alphabet: The letters that robots can really show; None for all. Fewer letters can only enlarge the set.

    Raises:
        BadInput: The automaton is nondeterministic or reads infinite words.
        TooLarge: The automaton has more states than its budget allows.
    """
    reach = _Reach(automaton, alphabet)
    return frozenset(state for state in automaton.states if reach.decomposes(state))


def decomposes(automaton: Automaton | Conjunction, state: State, alphabet: Iterable[Iterable[str]] | None = None) -> bool:
    """Return whether one state belongs to the decomposition set, looking only at what can be reached from it.

    For a conjunction, membership conjunct by conjunct is tried first; it suffices, and is much cheaper.

    Args:
        automaton: Deterministic, on finite words.
        state: One of its states.
        alphabet: The letters that robots can really show; None for all.

    Raises:
        BadInput: The automaton is nondeterministic or reads infinite words.
    """
    if isinstance(automaton, Conjunction) and all(isinstance(at, int) for at in state):
        letters = None if alphabet is None else [frozenset(letter) for letter in alphabet]
        if all(decomposes(part, at, letters) for part, at in zip(automaton.parts, state, strict=True)):
            return True
        alphabet = letters
    return _Reach(automaton, alphabet).decomposes(state)


def decomposes_from(
    automaton: Automaton | Conjunction,
    begun: frozenset[State],
    states: frozenset[State],
    alphabet: Iterable[Iterable[str]] | None = None,
) -> bool:
    """Return whether what is left of a mission decomposes, for a team that has come some way already.

    That is Def. 4.5 with the present in the place of the start: every word that leads on from `states` to acceptance,
    followed by one that leads from `begun` to `states`, is accepted from `begun`. Where several states may have been
    reached, words are accepted from all of them.

    Args:
        automaton: Deterministic, on finite words.
        begun: The states that the team may be in now.
        states: Those in which the rest would be handed over.
        alphabet: The letters that robots can really show; None for all.
    """
    letters = automaton.letters if alphabet is None else tuple(dict.fromkeys(frozenset(letter) for letter in alphabet))
    if isinstance(automaton, Conjunction) and len(begun) == len(states) == 1:
        (first,), (state,) = begun, states
        if DEAD not in (first, state) and all(isinstance(at, int) for at in (*first, *state)):
            by_part = zip(automaton.parts, first, state, strict=True)
            # each conjunct by itself suffices, and is much cheaper
            if all(decomposes_from(part, frozenset({a}), frozenset({b}), letters) for part, a, b in by_part):
                return True
    return _Reach(_Together(automaton, begun), letters).decomposes(DEAD if DEAD in states else states)


class _Together:
    """An automaton begun in several states at once; it accepts what is accepted from all of them."""

    trace, deterministic = "finite", True

    def __init__(self, automaton: Automaton | Conjunction, begun: frozenset[State]) -> None:
        if automaton.trace != "finite" or not automaton.deterministic:
            raise BadInput("The decomposition set is that of a deterministic automaton on finite words.")
        self._automaton, self.letters, self.initial = automaton, automaton.letters, begun

    def successor(self, states: frozenset[State], letter: Letter) -> State:
        """Return the states after a letter; dead as soon as one is."""
        after = frozenset(self._automaton.successor(state, letter) for state in states)
        return DEAD if DEAD in after else after

    def is_accepting(self, states: State) -> bool:
        """Return whether every state accepts."""
        return states != DEAD and all(self._automaton.is_accepting(state) for state in states)


class _Reach:
    """Reachability in pairs of states of one automaton over one alphabet."""

    def __init__(self, automaton: Automaton | Conjunction | _Together, alphabet: Iterable[Iterable[str]] | None) -> None:
        if automaton.trace != "finite" or not automaton.deterministic:
            raise BadInput("The decomposition set is that of a deterministic automaton on finite words.")
        self.automaton = automaton
        self.letters: Sequence[Letter] = (
            automaton.letters if alphabet is None else tuple(dict.fromkeys(frozenset(letter) for letter in alphabet))
        )
        self._rows: dict[State, tuple[State, ...]] = {}

    def row(self, state: State) -> tuple[State, ...]:
        """Return the states after each letter."""
        found = self._rows.get(state)
        if found is None:
            found = self._rows[state] = tuple(self.automaton.successor(state, letter) for letter in self.letters)
        return found

    def decomposes(self, state: State) -> bool:
        """Return whether L(state -> accept) followed by L(start -> state) is accepted, word by word."""
        if state == DEAD:
            return False
        # where the start can be once some word has led from `state` to acceptance ...
        halfway = {there for here, there in self._pairs({(state, self.automaton.initial)}) if self.automaton.is_accepting(here)}
        # ... and no word from there that leads the start to `state` may end outside the accepting states
        return all(
            self.automaton.is_accepting(there)
            for here, there in self._pairs({(self.automaton.initial, there) for there in halfway})
            if here == state
        )

    def _pairs(self, start: Collection[tuple[State, State]]) -> set[tuple[State, State]]:
        """Return the pairs that equal words lead to, without those whose first state is dead."""
        seen = set(start)
        waiting = list(start)
        for here, there in waiting:  # grows while it is walked
            there_row = None if there == DEAD else self.row(there)
            for index, after in enumerate(self.row(here)):
                if after != DEAD:
                    pair = (after, DEAD if there_row is None else there_row[index])
                    if pair not in seen:
                        seen.add(pair)
                        waiting.append(pair)
        return seen
