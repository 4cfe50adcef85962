"""Lower bounds on the cost that is left, from each conjunct by itself: what its landmarks take, and shares of the steps that it needs.

A step to a letter costs at least what the cheapest step to it costs. That is shared out among the conjuncts that the letter may bring
nearer to their goals, so that the amounts which the conjuncts need may be added up (cost partitioning; Katz and Domshlak 2010).
The sum is never more than the true rest. Where a conjunct has no way to a goal, the whole task is lost.

What is left to fly to show every proposition that is still needed is bounded by a spanning tree over their places. Whatever the robots do, their ways from where they are (the one that flies) or begin (those that have not flown) join each
needed proposition's places to one of them. So no plan is cheaper than the smallest tree that joins all of these, with the
shortest ways as its edges; the bound that Held and Karp began with for the travelling salesman (1970). Of one robot with many goals the tree has
tolls, so that it hardly branches (`set_orders`). It may
fall by more than a step costs, where the step leads to a place between several goals.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import reduce
from operator import or_
from typing import Generic

import numpy as np

from ltlplan.search.bounds.conjunct_graph import ConjunctGraph, Node, single_bits
from ltlplan.search.bounds.set_orders import LeastTrees
from ltlplan.search.label_setting import distances
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import TIE, ReducedGraph
from ltlplan.search.team_reading import UNREACHABLE

MANY_GOALS = 10
"""Goals from which on the way of a single robot through them is bounded by trees with tolls, which take longer to find."""

To = tuple[Mapping[Node, float], Mapping[Node, int]]
"""What each node still costs at least, none where there is no way; and what must still be shown from there, as bits."""


class SpanningTreeBound:
    """Lower bounds from spanning trees.

    Args:
        graph: The team's graph.
        shown: For each goal, a single bit, the letters that show it, as numbers of the graph's labels.

    Attributes:
        one_way: Whether one robot flies through many goals, so that trees have tolls.
    """

    def __init__(self, graph: ReducedGraph, shown: Mapping[int, Collection[int]]) -> None:
        self._graph, self._bits = graph, tuple(shown)
        nodes = graph.reached()
        back: dict[tuple[int, int], list[tuple[tuple[int, int], float]]] = {}
        for robot, node in nodes:
            for target, cost in graph.successors(max(robot, 0), node).edges:
                back.setdefault(graph.key(robot, target), []).append(((robot, node), cost))
        places = [[key for key in nodes if graph.label[max(key[0], 0)][key[1]] in own] for own in shown.values()]
        self._to = [distances(keys, lambda key: back.get(key, ())) for keys in places]
        ways = [[min((to.get(key, UNREACHABLE) for key in keys), default=UNREACHABLE) for keys in places] for to in self._to]
        self._between = [
            [min(pair) for pair in zip(*both, strict=True)] for both in zip(ways, zip(*ways, strict=True), strict=True)
        ]
        # what can be shown where two others are joins these for nothing, so that trees without it are larger
        self._anywhere = sum(
            bit for bit, row in zip(self._bits, self._between, strict=True) if sum(far <= TIE for far in row) > 2
        )
        starts = [graph.key(robot, node) for robot, node in enumerate(graph.start)]
        rows = [[to.get(start, UNREACHABLE) for to in self._to] for start in reversed(starts[1:])]
        nearest = itertools.accumulate(rows, lambda *both: [*map(min, *both)], initial=[UNREACHABLE] * len(places))
        self._later = [*nearest][::-1]  # for each robot, from the starts of those after it
        alone = len(starts) == 1 and len(places) >= MANY_GOALS and all(map(math.isfinite, itertools.chain(*self._between)))
        # one way ends at some goal, wherever that is
        self._way = LeastTrees(np.array(self._between), np.zeros(len(places))).remaining if alone else None
        self.one_way = alone

    def __call__(self, missing: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost to show what is missing; infinite where it is out of reach.

        Args:
            missing: Goals, as bits.
            robot: The robot that flies; those after it are still to fly.
            node: Where it is.
        """
        return self._cost(missing, robot, node) if missing else 0.0

    @memoized
    def _cost(self, missing: int, robot: int, node: int) -> float:
        near = self._distances(robot, self._graph.key(robot, node))
        if self._way is not None:
            left = self._way(sum(1 << goal for goal, bit in enumerate(self._bits) if missing & bit))
            return float((left + near).min())
        everything = self._tree({goal: near[goal] for goal, bit in enumerate(self._bits) if missing & bit})
        if not missing & self._anywhere:
            return everything
        return max(everything, self._cost(missing & ~self._anywhere, robot, node))

    @memoized
    def _distances(self, robot: int, here: tuple[int, int]) -> list[float]:
        """Return how far each goal is from the robot that flies, or from the start of one that is still to fly."""
        return [min(later, to.get(here, UNREACHABLE)) for later, to in zip(self._later[robot], self._to, strict=True)]

    def _tree(self, far: dict[int, float]) -> float:
        """Return the length of the smallest tree (Prim's algorithm), given how far each goal is from where it begins."""
        total = 0.0
        goal = min(far, key=far.__getitem__, default=-1)
        while far:
            total += far.pop(goal)
            row, least = self._between[goal], UNREACHABLE
            for other, cost in far.items():
                if row[other] < cost:
                    far[other] = cost = row[other]
                if cost < least:
                    goal, least = other, cost
            if far and least == UNREACHABLE:
                return UNREACHABLE
        return total


class ConjunctBounds(Generic[Node]):
    """Lower bounds on the cost until all conjuncts are satisfied.

    Args:
        graphs: One for each conjunct; None where it is too large to be looked at.
        masks: The propositions of each letter, as bits.
        reduced: The team's graph.

    Attributes:
        tree: Lower bounds on the cost to show what must still be shown.
        rest: Of each conjunct what is left from each node; None where nothing is known of it.
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
        self.rest = [None if graph is None else self.to(index, graph.goals) for index, graph in enumerate(graphs)]
        self._shown = reduce(or_, (needed for rest in self.rest if rest is not None for needed in rest[1].values()), 0)
        self.tree = SpanningTreeBound(
            reduced, {bit: {letter for letter in letters if masks[letter] & bit} for bit in single_bits(self._shown)}
        )

    def __call__(self, nodes: Iterable[Node]) -> tuple[float, int]:
        """Return a lower bound, `UNREACHABLE` where the task is lost, and what must still be shown, as bits.

        Args:
            nodes: Where each conjunct is.
        """
        total, missing = 0.0, 0
        for node, rest in zip(nodes, self.rest, strict=True):
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
        rest = self.rest[index]
        return 0.0 if rest is None else rest[0].get(node, UNREACHABLE)

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
