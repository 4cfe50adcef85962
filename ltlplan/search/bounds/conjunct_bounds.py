"""Lower bounds on the cost that is left, from each conjunct by itself: what its landmarks take, and shares of the steps that it needs.

A step to a letter costs at least what the cheapest step to it costs. That is shared out among the conjuncts that the letter may bring
nearer to their goals, so that the amounts which the conjuncts need may be added up (cost partitioning; Katz and Domshlak 2010).
The sum is never more than the true rest. Where a conjunct has no way to a goal, the whole task is lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Generic

from ltlplan.search.bounds.conjunct_graph import ConjunctGraph, Node, single_bits
from ltlplan.search.bounds.spanning_tree import SpanningTreeBound
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.team_reading import UNREACHABLE

To = tuple[Mapping[Node, float], Mapping[Node, int]]
"""What each node still costs at least, none where there is no way; and what must still be shown from there, as bits."""


class ConjunctBounds(Generic[Node]):
    """Lower bounds on the cost until all conjuncts are satisfied.

    Args:
        graphs: One for each conjunct; None where it is too large to be looked at.
        masks: The propositions of each letter, as bits.
        reduced: The team's graph.

    Attributes:
        tree: Lower bounds on the cost to show what must still be shown.
    """

    def __init__(self, graphs: Sequence[ConjunctGraph[Node] | None], masks: Sequence[int], reduced: ReducedGraph) -> None:
        self._graphs = graphs
        known = [graph for graph in graphs if graph is not None]
        shares = [
            cost / max(1, sum(1 for graph in known if mask & graph.mask in graph.priced))
            for mask, cost in zip(masks, reduced.entering, strict=True)
        ]
        self._prices = [{} if graph is None else _least_prices(graph, masks, shares) for graph in graphs]
        letters = {letter for label in reduced.label for letter in label}
        self._shown = reduce(or_, (masks[letter] for letter in letters), 0)
        self._rest = [None if graph is None else self.to(index, graph.goals) for index, graph in enumerate(graphs)]
        self._shown = reduce(or_, (needed for rest in self._rest if rest is not None for needed in rest[1].values()), 0)
        self.tree = SpanningTreeBound(
            reduced, {bit: {letter for letter in letters if masks[letter] & bit} for bit in single_bits(self._shown)}
        )

    def __call__(self, nodes: Iterable[Node]) -> tuple[float, int]:
        """Return a lower bound, `UNREACHABLE` where the task is lost, and what must still be shown, as bits.

        Args:
            nodes: Where each conjunct is.
        """
        total, missing = 0.0, 0
        for node, rest in zip(nodes, self._rest, strict=True):
            if rest is not None:
                total += rest[0].get(node, UNREACHABLE)
                missing |= rest[1].get(node, 0)
        return total, missing

    def of(self, index: int, node: Node) -> float:
        """Return what one conjunct adds to the bound.

        Args:
            index: Which one.
            node: Where it is.
        """
        rest = self._rest[index]
        return 0.0 if rest is None else rest[0].get(node, UNREACHABLE)

    def knows(self, index: int) -> bool:
        """Tell whether anything is known of a conjunct, by index."""
        return self._rest[index] is not None

    @memoized
    def to(self, index: int, goals: frozenset[Node]) -> To[Node]:
        """Return what is left from each node of a conjunct that is known to one of some nodes.

        Args:
            index: The conjunct's.
            goals: The nodes.
        """
        graph = self._graphs[index]
        assert graph is not None
        return graph.costs(self._prices[index], goals), graph.landmarks(goals, self._shown)


def _least_prices(graph: ConjunctGraph[Node], masks: Sequence[int], shares: Sequence[float]) -> dict[int, float]:
    """Return the least price of each letter as a conjunct sees it."""
    price: dict[int, float] = {}
    for mask, share in zip(masks, shares, strict=True):
        seen = mask & graph.mask
        price[seen] = min(price.get(seen, UNREACHABLE), share if seen in graph.priced else 0.0)
    return price
