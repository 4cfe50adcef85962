"""How much is surely left to fly to show every proposition that is still needed: a spanning tree over their places.

Whatever the robots do, their ways from where they are (the one that flies) or begin (those that have not flown) join each
needed proposition's places to one of them. So no plan is cheaper than the smallest tree that joins all of these, with the
shortest ways as its edges; the bound that Held and Karp began with for the travelling salesman (1970). It may
fall by more than a step costs, where the step leads to a place between several goals.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.label_setting import distances
from ltlplan.search.reduced_graph import ReducedGraph


class SpanningTreeBound:
    """Lower bounds from spanning trees.

    Args:
        graph: The team's graph.
        shown: For each goal, the letters that show it, as numbers of the graph's labels.
    """

    def __init__(self, graph: ReducedGraph, shown: Sequence[Collection[int]]) -> None:
        self._graph = graph
        nodes = graph.reached()
        back: dict[tuple[int, int], list[tuple[tuple[int, int], float]]] = {}
        for robot, node in nodes:
            for target, cost in graph.successors(max(robot, 0), node).edges:
                back.setdefault(graph.key(robot, target), []).append(((robot, node), cost))
        letters = {key: graph.label[max(key[0], 0)][key[1]] for key in nodes}
        self._to = [distances([key for key in nodes if letters[key] in own], lambda key: back.get(key, ())) for own in shown]
        count = len(shown)
        between = [[UNREACHABLE] * count for _ in range(count)]
        for goal, to in enumerate(self._to):
            for key, cost in to.items():
                for other, own in enumerate(shown):
                    if letters[key] in own and cost < between[goal][other]:
                        between[goal][other] = between[other][goal] = cost
        self._between = between
        self._later = [[UNREACHABLE] * count]  # from the starts of the robots after each one, the last one first
        for robot in range(len(graph.start) - 1, 0, -1):
            start = graph.key(robot, graph.start[robot])
            pairs = zip(self._later[-1], self._to, strict=True)
            self._later.append([min(cost, to.get(start, UNREACHABLE)) for cost, to in pairs])
        self._later.reverse()
        self._known: dict[tuple[int, int, int], float] = {}

    def __call__(self, missing: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost to show what is missing; infinite where it is out of reach.

        Args:
            missing: Goals, as bits.
            robot: The robot that flies; those after it are still to fly.
            node: Where it is.
        """
        if not missing:
            return 0.0
        key = (missing, robot, node)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._tree(missing, robot, self._graph.key(robot, node))
        return found

    def _tree(self, missing: int, robot: int, here: tuple[int, int]) -> float:
        """Return the length of the smallest tree (Prim's algorithm)."""
        later = self._later[robot]
        far = {
            goal: min(later[goal], to.get(here, UNREACHABLE)) for goal, to in enumerate(self._to) if missing >> goal & 1
        }  # from each goal to the tree so far
        total = 0.0
        while far:
            goal = min(far, key=far.__getitem__)
            total += far.pop(goal)
            row = self._between[goal]
            for other, cost in far.items():
                if row[other] < cost:
                    far[other] = row[other]
        return total
