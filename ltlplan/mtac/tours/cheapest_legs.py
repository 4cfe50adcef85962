"""Cheapest ways of one robot from a place to where something is done, over the nodes that matter of the exact search's graph."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ltlplan.logic.conjunct_automata import Part
from ltlplan.search.reduced_graph import ReducedGraph

Watched = tuple[tuple[int, ...], ...]
"""Of each conjunct that every robot watches: where its word has led the initial state and the accepting ones."""

Place = tuple[int, Watched]
"""A node of a robot's graph, and what it watches."""

Key = tuple[int, Watched, int]
"""A node, what is watched there, and the state of one more conjunct."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A cheapest way on.

    Attributes:
        cost: Of the way.
        end: Where it leads.
        nodes: On the way, the first one left out.
        letters: They show.
        done: Free tasks of one letter that are done on the way.
    """

    cost: float
    end: Place
    nodes: tuple[int, ...]
    letters: tuple[int, ...]
    done: frozenset[int]


class Walk:
    """Cheapest ways of one robot from a place on (Dijkstra); iterating yields costs and places, nearest first.

    Attributes:
        costs: Of places that were yielded, and of others as known so far.
    """

    def __init__(
        self,
        graph: ReducedGraph,
        read: Callable[[Watched, int], Watched | None],
        robot: int,
        at: Place,
        more: tuple[Part, int] | None = None,
    ) -> None:
        self._graph, self._read, self.robot = graph, read, robot
        self._part = None if more is None else more[0]
        self._start: Key = (*at, -1 if more is None else more[1])
        self.costs = {self._start: 0.0}
        self._before: dict[Key, Key] = {}

    def __iter__(self) -> Iterator[tuple[float, Key]]:
        graph, label, costs, before = self._graph, self._graph.label[self.robot], self.costs, self._before
        heap: list[tuple[float, int, Key]] = [(0.0, 0, self._start)]
        closed: set[Key] = set()
        pushed = 0
        while heap:
            cost, _, key = heapq.heappop(heap)
            if key in closed:
                continue
            closed.add(key)
            yield cost, key
            node, watched, state = key
            for target, step in graph.successors(self.robot, node).edges:
                after = self._read(watched, label[target])
                if after is None:
                    continue
                there = (target, after, -1 if self._part is None else self._part.row(state)[label[target]])
                total = cost + step
                if total < costs.get(there, math.inf):
                    costs[there], before[there] = total, key
                    pushed += 1
                    heapq.heappush(heap, (total, pushed, there))

    def nodes_to(self, end: Key) -> tuple[int, ...]:
        """Return the nodes on the way to a place that was yielded, the first one left out."""
        found: list[int] = []
        while end != self._start:
            found.append(end[0])
            end = self._before[end]
        return tuple(reversed(found))
