"""The finite words that break a formula, as a small automaton whose waiting is told apart from its progress.

What the rest of a word must do so that the formula is broken is a set of obligations (a tableau of the negated formula). To read
a letter is *free* in a state where it leaves the state as it is; otherwise it is a *move*. A word that breaks a formula needs
few moves, and between them every robot may read what is free as often as it likes, without regard to the others:
`robots_apart` rests on that. Three things make more letters free; none of them adds a word or loses one:

* A state is *covered* by another one that can do all that it can (a simulation, letter by letter; fewer obligations always
  cover more). Where a letter leads to a state that covers the present one, it may as well stay: the way on remains possible. Moves
  to what is covered by another way are left out, and states that cover each other are one.
* A run decides when it begins to *finish*: from then on the word may end after each of its letters. Before, nothing depends
  on whether it might end, and a state that swings between the two (`G F a`: the last letter shows a) is one that waits.
* No word is empty, as each robot is read, so a run whose word may end after each letter finishes from the beginning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from verify.data.language.word import Letter
from verify.logic.normal_form import Normal, normal_form, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.spot_opinion import LetterGraph, some_word_breaks
from verify.model_checking.lassos import Tableau

MAX_STATES = 400
"""Sets of obligations that may be met, over all letters of a team."""

MAX_COMPARED = 30_000
"""Pairs of states times letters up to which it is asked which state covers which; beyond, fewer obligations alone tell."""

_ENDS_WELL = ("G", "R", "W", "X")

_Successors = list[list[int]]
"""For each state, for each letter, the states that it leads to, as bits."""


class BreakingWords:
    """All words over some letters that break a formula (LTLf).

    States and letters are numbered.

    Attributes:
        letters: What is read, cut down to the formula's propositions.
        initial: States in which words may begin.
        free: For each state the letters that leave it as it is, as bits.
        moves: For each state, by letter, the states that reading it can lead to instead.
        ends: Whether a word may end in each state. No word is empty: ask only after a letter.
        easier: For each state those that cover it, itself among them.
        settled: A state from which every word is broken; None where there is none.
        before: For each state those that have a move to it.
        idle: Letters, as bits, that are free in every state.
        dead: Letters, as bits, that are free in every state and never move: reading them tells nothing.
    """

    def __init__(self, normal: Normal, letters: Iterable[Letter]) -> None:
        """Follow all obligations that words over `letters` can lead to.

        Args:
            normal: The formula that is to be broken.
            letters: All that can be read, cut down to its propositions.

        Raises:
            OutOfBudget: There are more than `MAX_STATES` sets of obligations, or too many ways to meet them.
        """
        self.normal = normal
        self.letters = tuple(letters)
        sets, after = _followed(normal, self.letters)
        kinds = normal_form(to_formula(normal), negated=True).kinds
        ends_well = [all(kind in _ENDS_WELL for i, kind in enumerate(kinds) if here >> i & 1) for here in sets]
        # state 2 s waits, and 2 s + 1 finishes, with the obligations of s
        successors: _Successors = []
        for here in range(len(sets)):
            for finishing in (False, True):
                row: list[int] = []
                for targets in after[here]:
                    row.append(sum((0 if finishing else 1 << 2 * s) | (1 << 2 * s + 1 if ends_well[s] else 0) for s in targets))
                successors.append(row if ends_well[here] or not finishing else [0] * len(self.letters))
        ends = [bool(state % 2) and ends_well[state // 2] for state in range(len(successors))]
        covering = _covering(successors, ends, sets)
        begin = _best([0, *([1] if ends[1] else [])], covering)
        self._number(begin, successors, ends, covering)
        self.settled = next((s for s, free in enumerate(self.free) if self.ends[s] and free == self._every), None)

    def _number(self, begin: list[int], successors: _Successors, ends: list[bool], covering: list[int]) -> None:
        """Number the states that are met, and sort out what is free and what moves."""
        self._every = (1 << len(self.letters)) - 1
        order = list(begin)
        index = {state: i for i, state in enumerate(order)}
        self.initial = tuple(range(len(begin)))
        self.free: list[int] = []
        self.moves: list[dict[int, tuple[int, ...]]] = []
        for here in order:
            free = 0
            moves: dict[int, tuple[int, ...]] = {}
            for number, targets in enumerate(successors[here]):
                ways = list(bits(targets))
                if targets & covering[here]:
                    free |= 1 << number
                    ways = [way for way in ways if not covering[way] >> here & 1]
                ways = _best(ways, covering)
                for way in ways:
                    if way not in index:
                        index[way] = len(order)
                        order.append(way)
                if ways:
                    moves[number] = tuple(index[way] for way in ways)
            self.free.append(free)
            self.moves.append(moves)
        self.ends = [ends[state] for state in order]
        self.easier = [[i for i, other in enumerate(order) if covering[state] >> other & 1] for state in order]
        self.before: list[list[int]] = [[] for _ in order]
        self.idle = self.dead = self._every
        for source, (free, moves) in enumerate(zip(self.free, self.moves, strict=True)):
            self.idle &= free
            self.dead &= free & ~sum(1 << number for number in moves)
            for target in {target for targets in moves.values() for target in targets}:
                self.before[target].append(source)

    def __len__(self) -> int:
        return len(self.free)

    def spot_agrees(self) -> bool:
        """Return whether Spot finds these words to be exactly the ones over the letters that break the formula.

        Raises:
            OutOfBudget: Spot is not asked about so large a formula, or the words are too many to be written down.
            MissingEngine: Spot is not installed.
        """
        edges: list[tuple[int, Letter, int]] = []
        order = [frozenset(self.initial)]
        index = {order[0]: 1}
        for source, states in enumerate(order, start=1):
            for number, letter in enumerate(self.letters):
                after = frozenset(self._after(states, number))
                if after not in index:
                    if len(order) >= MAX_STATES:
                        raise OutOfBudget(f"more than {MAX_STATES} sets of states to be compared with Spot's")
                    order.append(after)
                    index[after] = len(order)
                edges.append((source, letter, index[after]))
        edges += [(0, letter, target) for source, letter, target in edges if source == 1]
        breaking = frozenset(i for i, states in enumerate(order, start=1) if any(self.ends[s] for s in states))
        others = frozenset(range(1, len(order) + 1)) - breaking
        negated = normal_form(to_formula(self.normal), negated=True)
        every = len(order) + 1, tuple(edges)
        return not (
            some_word_breaks(LetterGraph(*every, others), self.normal)
            or some_word_breaks(LetterGraph(*every, breaking), negated)
        )

    def _after(self, states: Iterable[int], number: int) -> set[int]:
        found: set[int] = set()
        for state in states:
            if self.free[state] >> number & 1:
                found.add(state)
            found.update(self.moves[state].get(number, ()))
        return found


def _followed(normal: Normal, letters: tuple[Letter, ...]) -> tuple[list[int], list[list[list[int]]]]:
    """Return all sets of obligations, and for each of them, for each letter, the smallest ones that can follow."""
    tableau = Tableau(normal_form(to_formula(normal), negated=True))
    order = [tableau.initial]
    index = {tableau.initial: 0}
    found: list[list[list[int]]] = []
    for here in order:
        row: list[list[int]] = []
        for letter in letters:
            after = _smallest(obligations for obligations, _ in tableau.read(here, letter))
            for there in after:
                if there not in index:
                    if len(order) >= MAX_STATES:
                        raise OutOfBudget(f"more than {MAX_STATES} ways in which a word can be on the way to break it")
                    index[there] = len(order)
                    order.append(there)
            row.append([index[there] for there in after])
        found.append(row)
    return order, found


def _smallest(sets: Iterable[int]) -> list[int]:
    """Drop obligations that ask for all that others ask for, and more."""
    kept: list[int] = []
    for one in sorted(set(sets), key=lambda bits: (bits.bit_count(), bits)):
        if not any(other & one == other for other in kept):
            kept.append(one)
    return kept


def _covering(successors: _Successors, ends: list[bool], sets: list[int]) -> list[int]:
    """Return for each state those that cover it, as bits."""
    count = len(successors)
    columns = list(dict.fromkeys(zip(*successors, strict=True)))  # letters that lead to the same everywhere are one
    if count * count * len(columns) > MAX_COMPARED:
        return [
            sum(
                1 << 2 * other + state % 2
                for other, smaller in enumerate(sets)
                if smaller & sets[state // 2] == smaller and ends[2 * other + state % 2] == ends[state]
            )
            | 1 << state
            for state in range(count)
        ]
    rows = list(zip(*columns, strict=True)) if columns else [() for _ in range(count)]
    covering = [sum(1 << other for other in range(count) if ends[other] or not ends[state]) for state in range(count)]
    changed = True
    while changed:
        changed = False
        for state, row in enumerate(rows):
            for other in bits(covering[state]):
                if any(not theirs & covering[way] for mine, theirs in zip(row, rows[other], strict=True) for way in bits(mine)):
                    covering[state] &= ~(1 << other)
                    changed = True
    return covering


def _best(states: list[int], covering: list[int]) -> list[int]:
    """Keep states that no other one covers, and one of those that cover each other."""
    kept: list[int] = []
    for state in states:
        if any(covering[state] >> other & 1 for other in kept):
            continue
        kept = [other for other in kept if not covering[other] >> state & 1]
        kept.append(state)
    return kept


def bits(mask: int) -> Iterator[int]:
    """Yield the places of a number's bits, the lowest first."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low
