"""How much is surely left to fly where a conjunct must hold in every order of flying: as much as the order that asks for most.

The search follows robots in one order. In others, those that have flown come before what is still to be flown, or after it: what each
of them holds meanwhile is known but for where robots come to rest that are still to fly, and there anything that may be held counts as
held. As in `ltlplan.search.heuristics.order_bounds`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from functools import reduce
from operator import or_

from ltlplan.logic.automaton import DEAD
from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.joint.conjuncts import WordEffects
from ltlplan.search.joint.heuristic import JointHeuristic, Seen, subsets

_ALL_ORDERS = 3  # words up to which all their orders are looked at; of more the sorted one and its reverse


class JointOrderBounds:
    """Lower bounds for one conjunct that every order of flying has to keep; it has to be one for which reading a letter twice changes nothing.

    Args:
        words: What words do to the conjunct.
        index: Its index among all.
        heuristic: Bounds on what its states cost; it has to know the conjunct.
    """

    def __init__(self, words: WordEffects, index: int, heuristic: JointHeuristic) -> None:
        self._words, self._index, self._heuristic = words, index, heuristic
        self._goals: dict[tuple[tuple[int, ...], int], frozenset[Seen]] = {}
        self._known: dict[tuple[int, tuple[int, ...], int], tuple[float, int]] = {}

    def __call__(self, own: int, done: tuple[int, ...], waiting: int) -> tuple[float, int]:
        """Return a lower bound on the cost that is left, and what some robot must still go to, as bits.

        Args:
            own: What the word of the robot that flies has done so far.
            done: What the words of robots that flew before it do, sorted.
            waiting: What is held by those still to fly.
        """
        waiting &= self._words.part.mask
        key = own, done, waiting
        found = self._known.get(key)
        if found is None:
            words, cost, missing = self._words, 0.0, 0
            still = reduce(or_, (words.last[word] for word in done if not words.moved[word]), waiting)
            for before, after in _parted(tuple(word for word in done if words.moved[word])):
                left, needed = self._left(own, before, after, still)
                cost, missing = max(cost, left), missing | needed
            found = self._known[key] = cost, missing
        return found

    def _left(self, own: int, before: Sequence[int], after: Sequence[int], still: int) -> tuple[float, int]:
        """Return what is left between the robot's word with some before it, and others that are flown afterwards."""
        words, flown = self._words, (*before, own)
        later = self._union(words.first, after, still)
        state = words.part.step(words.part.initial, self._union(words.first, flown, later))
        for place, word in enumerate(flown):
            context = self._union(words.last, flown[:place], self._union(words.first, flown[place + 1 :], later))
            state = words.apply(word, state, context)
        if state == DEAD:
            return UNREACHABLE, 0
        held = self._union(words.last, flown, later)
        goals = self._before(after, self._union(words.last, before, 0))
        seen = state, held & words.part.mask
        left, missing = self._heuristic.to(self._index, goals)
        return left.get(seen, UNREACHABLE), missing.get(seen, 0)

    def _before(self, after: Sequence[int], lasts: int) -> frozenset[Seen]:
        """Return from where, states with what is held then, some words lead to acceptance for something that others may hold.

        Args:
            after: The words, in their order.
            lasts: What those hold that flew before all that is left.
        """
        key = tuple(after), lasts
        found = self._goals.get(key)
        if found is None:
            part = self._words.part
            found = frozenset(
                (state, held)
                for held in subsets(part.mask)
                for state in part.domain
                if any(map(part.accepting, self._reached(state, held, after, lasts)))
            )
            self._goals[key] = found
        return found

    def _reached(self, state: int, held: int, after: Sequence[int], lasts: int) -> set[int]:
        """Return all states that some words may lead to."""
        words, reached = self._words, {state}
        for place, word in enumerate(after):
            sure = self._union(words.last, after[:place], self._union(words.first, after[place + 1 :], lasts))
            may = self._union(words.last, after[:place], held)
            contexts = [context for context in words.contexts if not (sure & ~context or context & ~may)]
            reached = {words.apply(word, at, context) for at in reached for context in contexts} - {DEAD}
        return reached

    @staticmethod
    def _union(held: Sequence[int], words: Sequence[int], others: int) -> int:
        return reduce(or_, (held[word] for word in words), others)


def _parted(effects: tuple[int, ...]) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Yield the ways in which words come before and after what is still to be flown."""
    few = len(effects) <= _ALL_ORDERS
    orders = sorted(set(itertools.permutations(effects))) if few else [effects, effects[::-1]]
    return ((order[:cut], order[cut:]) for order in orders for cut in range(len(effects) + 1))
