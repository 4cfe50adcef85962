"""How much is surely left to fly, and to where, under `team: joint`: an admissible heuristic, from each conjunct by itself.

While one robot flies, what all of them show together changes in one way: the flying robot's letter is taken out and its next
one put in. So a conjunct's state and the propositions that it sees held now are walked as a small graph: from what is held, any
part may stay, and one robot's letter is added, at no less than the shortest leg into such a place. As in
`ltlplan.search.heuristics.heuristic`, that price is shared out among the conjuncts that the letter concerns, and the conjuncts' amounts
add up to a lower bound.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import bits
from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.heuristics.spanning_tree import SpanningTreeBound
from ltlplan.search.joint.conjuncts import JointConjunct
from ltlplan.search.label_setting import distances
from ltlplan.search.reduced_graph import ReducedGraph

MAX_MOVES = 100_000
"""Moves of a conjunct's graph up to which it is walked."""


class JointHeuristic:
    """Lower bounds on the cost from each state of the conjuncts, with what is held, to acceptance.

    Args:
        parts: The conjuncts.
        masks: For each letter, its propositions as bits.
        reduced: The team's graph.
    """

    def __init__(self, parts: Sequence[JointConjunct], masks: Sequence[int], reduced: ReducedGraph) -> None:
        self._parts = parts
        walked = [part.deterministic and _moves(part, masks) <= MAX_MOVES for part in parts]
        graphs = [_Graph(part, masks) if small else None for part, small in zip(parts, walked, strict=True)]
        self._graphs, self._masks = graphs, masks
        concerned = [part for part, graph in zip(parts, graphs, strict=True) if graph is not None]
        self._prices = [
            cost / max(1, sum(1 for part in concerned if part.mask & mask))
            for mask, cost in zip(masks, reduced.entering, strict=True)
        ]
        self._rest = [None if graph is None else graph.distances(masks, self._prices) for graph in graphs]
        landmarks = [None if graph is None else graph.landmarks() for graph in graphs]
        wanted = sorted({bit for marks in landmarks if marks is not None for found in marks.values() for bit in _bits(found)})
        self._number = {bit: 1 << i for i, bit in enumerate(wanted)}
        self._goals = [{} if marks is None else self._numbered(marks) for marks in landmarks]
        self._left: dict[tuple[int, frozenset[Seen]], tuple[dict[Seen, float], dict[Seen, int]]] = {}
        shown = {letter for label in reduced.label for letter in label}
        self.tree_bound = SpanningTreeBound(reduced, [{letter for letter in shown if masks[letter] & bit} for bit in wanted])

    def __call__(self, states: Sequence[int], held: int) -> float:
        """Return a lower bound, given what all robots together show now; `UNREACHABLE` where acceptance is out of reach."""
        total = 0.0
        for part, rest, state in zip(self._parts, self._rest, states, strict=True):
            if rest is not None:
                total += rest.get((state, held & part.mask), UNREACHABLE)
        return total

    def missing(self, states: Sequence[int], held: int) -> int:
        """Return what some robot must still go to, as bits for `spanning_tree`."""
        found = 0
        for part, goals, state in zip(self._parts, self._goals, states, strict=True):
            found |= goals.get((state, held & part.mask), 0)
        return found

    def of(self, index: int, state: int, held: int) -> float:
        """Return what one conjunct adds to the bound.

        Args:
            index: Which one.
            state: Its state.
            held: What all robots together show now, as bits.
        """
        rest = self._rest[index]
        return 0.0 if rest is None else rest.get((state, held & self._parts[index].mask), UNREACHABLE)

    def knows(self, part: int) -> bool:
        """Tell whether anything is known of a conjunct, by index."""
        return self._graphs[part] is not None

    def to(self, part: int, goals: frozenset[Seen]) -> tuple[dict[Seen, float], dict[Seen, int]]:
        """Return lower bounds on the cost to come to some states of a conjunct that is known, none where there is no way, and what is missing there.

        Args:
            part: The conjunct, by index.
            goals: Its states, with what is held.
        """
        found = self._left.get((part, goals))
        if found is None:
            graph = self._graphs[part]
            assert graph is not None
            left, marks = graph.distances(self._masks, self._prices, goals), graph.landmarks(goals)
            found = self._left[part, goals] = left, self._numbered(marks)
        return found

    def _numbered(self, marks: Mapping[Seen, int]) -> dict[Seen, int]:
        return {key: sum(self._number.get(bit, 0) for bit in _bits(found)) for key, found in marks.items()}


Seen = tuple[int, int]
"""A conjunct's state and what it sees held now."""


class _Graph:
    """How one conjunct's state, with what is held, can change: backwards."""

    def __init__(self, part: JointConjunct, masks: Sequence[int]) -> None:
        self.part = part
        letters = sorted({mask & part.mask for mask in masks})
        self.back: dict[Seen, list[tuple[Seen, int]]] = {}  # before, and the letter that one robot goes to
        for held in subsets(part.mask):
            kept = tuple(subsets(held))
            for state in part.domain:
                for letter in letters:
                    for stays in kept:
                        after = part.step(state, letter | stays)
                        if after != DEAD:
                            self.back.setdefault((after, letter | stays), []).append(((state, held), letter))
        self.accepting = [(state, held) for state in part.domain if part.accepting(state) for held in subsets(part.mask)]

    def distances(
        self, masks: Sequence[int], prices: Sequence[float], goals: Collection[Seen] | None = None
    ) -> dict[Seen, float]:
        """Return the smallest sum of prices from each place to an accepting one, or a goal; none where there is no way."""
        price: dict[int, float] = {}
        for mask, cost in zip(masks, prices, strict=True):
            letter = mask & self.part.mask
            price[letter] = min(cost, price.get(letter, UNREACHABLE))
        ends = self.accepting if goals is None else sorted(goals)
        return distances(ends, lambda key: ((before, price[letter]) for before, letter in self.back.get(key, ())))

    def landmarks(self, goals: Collection[Seen] | None = None) -> dict[Seen, int]:
        """Return the propositions, as bits, that some robot must go to from each place to accept, or to a goal, whatever is done."""
        found: dict[Seen, int] = {}
        for bit in _bits(self.part.mask):
            reached = set(self.accepting if goals is None else goals)
            waiting = list(reached)
            for key in waiting:  # grows while it is walked
                for before, letter in self.back.get(key, ()):
                    if not letter & bit and before not in reached:
                        reached.add(before)
                        waiting.append(before)
            for state in self.part.domain:
                for held in subsets(self.part.mask):
                    if (state, held) not in reached:
                        found[state, held] = found.get((state, held), 0) | bit
        return found


def _moves(part: JointConjunct, masks: Sequence[int]) -> int:
    return len(part.domain) * len({mask & part.mask for mask in masks}) * 4 ** part.mask.bit_count()


def subsets(mask: int) -> Iterator[int]:
    """Yield all sets of bits within a mask."""
    at = mask
    while True:
        yield at
        if not at:
            return
        at = (at - 1) & mask


def _bits(mask: int) -> Iterator[int]:
    """Yield the single bits of a mask."""
    return (1 << at for at in bits(mask))
