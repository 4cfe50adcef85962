"""How much is surely left to fly to show every proposition that is still needed: a spanning tree over their places.

Whatever the robots do, their ways from where they are (the one that flies) or begin (those that have not flown) join each
needed proposition's places to one of them. So no plan is cheaper than the smallest tree that joins all of these, with the
shortest ways as its edges; the bound that Held and Karp began with for the travelling salesman (1970). It may
fall by more than a step costs, where the step leads to a place between several goals.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping

from ltlplan.search.label_setting import distances
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.team_reading import UNREACHABLE


class SpanningTreeBound:
    """Lower bounds from spanning trees.

    Args:
        graph: The team's graph.
        shown: For each goal, a single bit, the letters that show it, as numbers of the graph's labels.
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
        starts = [graph.key(robot, node) for robot, node in enumerate(graph.start)]
        rows = [[to.get(start, UNREACHABLE) for to in self._to] for start in reversed(starts[1:])]
        nearest = itertools.accumulate(rows, lambda *both: [*map(min, *both)], initial=[UNREACHABLE] * len(places))
        self._later = [*nearest][::-1]  # for each robot, from the starts of those after it

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
        return self._tree({goal: near[goal] for goal, bit in enumerate(self._bits) if missing & bit})

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
