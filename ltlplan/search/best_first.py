"""Best-first search over a graph made as it is walked: A* (Hart, Nilsson and Raphael 1968), Dijkstra without a heuristic."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Generic, Literal, TypeVar

Key = TypeVar("Key", bound=Hashable)  # and ordered, where ties are broken by keys


_ROUNDING = 1e-9  # by which sums of the same costs may differ


class BestFirst(Generic[Key]):
    """A search that yields each key, the one with the least bound first.

    It is lazy: whoever iterates counts the keys, and stops when a goal has come or a budget of keys is used up. With a
    heuristic that never falls by more than a step costs, or none, every key comes once, with its least cost. With any other lower
    bound a key comes again when a cheaper path to it is found, so that the first goal is a cheapest one all the same; not so with a
    weight above 1.

    Args:
        starts: Where paths begin, at no cost.
        successors: Pairs (next key, cost of the step) for each key; costs are not negative.
        heuristic: Lower bound on the cost from a key to a goal, infinite where there is none; None for nothing known.
        weight: How much the heuristic counts; with more than 1 goals come sooner, and not the cheapest first (Pohl 1970).
        ties: Of equal bounds, the smallest key comes first, or the one that was reached first.

    Attributes:
        costs: The least cost found for each key that was reached.
        parents: The key before on that path; none for starts.
    """

    def __init__(
        self,
        starts: Iterable[Key],
        successors: Callable[[Key], Iterable[tuple[Key, float]]],
        heuristic: Callable[[Key], float] | None = None,
        *,
        weight: float = 1.0,
        ties: Literal["key", "first"] = "key",
    ) -> None:
        self.costs: dict[Key, float] = dict.fromkeys(starts, 0.0)
        self.parents: dict[Key, Key] = {}
        self._successors, self._heuristic, self._weight = successors, heuristic, weight
        self._ties = itertools.count() if ties == "first" else itertools.repeat(0)

    def __iter__(self) -> Iterator[tuple[Key, float, float]]:
        """Yield (key, cost, bound on the cost of any path through it)."""
        costs, parents, successors, heuristic = self.costs, self.parents, self._successors, self._heuristic
        weight, tie = self._weight, self._ties.__next__
        push, pop, unreachable = heapq.heappush, heapq.heappop, float("inf")
        heap = [(0.0 if heuristic is None else weight * heuristic(key), tie(), key) for key in costs]
        heapq.heapify(heap)
        closed: set[Key] = set()
        while heap:
            bound, _, key = pop(heap)
            if key in closed:
                continue
            closed.add(key)
            cost = costs[key]
            yield key, cost, bound
            for target, step in successors(key):
                total = cost + step
                known = costs.get(target, unreachable)
                if total < known and (target not in closed or (weight == 1.0 and total < known - _ROUNDING)):
                    left = 0.0 if heuristic is None else heuristic(target)
                    if left < unreachable:
                        closed.discard(target)
                        costs[target] = total
                        parents[target] = key
                        push(heap, (total + weight * left, tie(), target))

    def path(self, key: Key) -> list[Key]:
        """Return the path from a start to a key that was reached."""
        keys = [key]
        while (before := self.parents.get(keys[-1])) is not None:
            keys.append(before)
        return keys[::-1]


def distances(starts: Iterable[Key], successors: Callable[[Key], Iterable[tuple[Key, float]]]) -> dict[Key, float]:
    """Return the least cost from any of some keys to each that can be reached."""
    search = BestFirst(starts, successors, ties="first")
    for _ in search:
        pass
    return search.costs
