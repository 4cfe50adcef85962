"""The one search of planning: label setting over a graph that is made as it is walked.

`BestFirst` keeps one label for each state, with its least cost: A* (Hart, Nilsson and Raphael 1968), Dijkstra without a heuristic.
`ParetoSearch` keeps all labels of a state that no other one dominates, where several costs count by themselves (Martins 1984), as for the
robot with the highest cost. Both are lazy: they yield states in order, and whoever iterates counts and stops.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, Literal, Self, TypeVar

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
        successors: Next key and cost of the step for each key, and whatever else its user wants to know; costs are not negative.
        heuristic: Lower bound on the cost from a key to a goal, infinite where there is none; None for nothing known.
        weight: How much the heuristic counts; with more than 1 goals come sooner, and not the cheapest first (Pohl 1970).
        ties: Of equal bounds, the smallest key comes first, or the one that was reached first. `farthest`: bounds are equal up to rounding, and
            the key with the highest cost comes first; it comes again when a path to it is cheaper at all.

    Attributes:
        costs: The least cost found for each key that was reached.
        parents: The key before on that path; none for starts.
    """

    def __init__(
        self,
        starts: Iterable[Key],
        successors: Callable[[Key], Iterable[tuple[Key, float] | tuple[Key, float, object]]],
        heuristic: Callable[[Key], float] | None = None,
        *,
        weight: float = 1.0,
        ties: Literal["key", "first", "farthest"] = "key",
    ) -> None:
        self.costs: dict[Key, float] = dict.fromkeys(starts, 0.0)
        self.parents: dict[Key, Key] = {}
        self._successors, self._heuristic, self._weight = successors, heuristic, weight
        self._ties = itertools.count() if ties == "first" else itertools.repeat(0)
        self._farthest = ties == "farthest"

    def __iter__(self) -> Iterator[tuple[Key, float, float]]:
        """Yield (key, cost, bound on the cost of any path through it)."""
        costs, parents, successors, heuristic = self.costs, self.parents, self._successors, self._heuristic
        weight, tie = self._weight, self._ties.__next__
        push, pop, unreachable = heapq.heappush, heapq.heappop, float("inf")
        farthest, slack = self._farthest, 0.0 if self._farthest else _ROUNDING
        heap: list[tuple[float, float, Key]] = [
            (0.0 if heuristic is None else weight * heuristic(key), tie(), key) for key in costs
        ]
        heapq.heapify(heap)
        closed: set[Key] = set()
        while heap:
            bound, _, key = pop(heap)
            if key in closed:
                continue
            closed.add(key)
            cost = costs[key]
            yield key, cost, bound
            for onwards in successors(key):
                target, total = onwards[0], cost + onwards[1]
                known = costs.get(target, unreachable)
                if total < known and (target not in closed or (weight == 1.0 and total < known - slack)):
                    left = 0.0 if heuristic is None else heuristic(target)
                    if left < unreachable:
                        closed.discard(target)
                        costs[target] = total
                        parents[target] = key
                        bound = total + weight * left
                        if farthest:
                            push(heap, (math.floor(bound / _ROUNDING) * _ROUNDING, -total, target))
                        else:
                            push(heap, (bound, tie(), target))

    def walked(self) -> Self:
        """Return the search when it has come to its end."""
        for _ in self:
            pass
        return self

    def path(self, key: Key) -> list[Key]:
        """Return the path from a start to a key that was reached."""
        keys = [key]
        while (before := self.parents.get(keys[-1])) is not None:
            keys.append(before)
        return keys[::-1]


def distances(starts: Iterable[Key], successors: Callable[[Key], Iterable[tuple[Key, float]]]) -> dict[Key, float]:
    """Return the least cost from any of some keys to each that can be reached."""
    return BestFirst(starts, successors, ties="first").walked().costs


Costs = tuple[float, ...]


@dataclass(slots=True, eq=False)
class Label(Generic[Key]):
    """A path to a state, of which there can be several.

    Attributes:
        state: Where the path has come to.
        paid: The costs that count, each by itself: a path dominates another one to the same state where none of its costs is higher.
        total: The sum of all costs, whoever pays.
        rank: What labels are taken by, the least first; of equal ranks, the one that was reached first.
        before: The path without its last step; None at a start.
        step: What its last step was, as the search's user wants to know it.
    """

    state: Key
    paid: Costs
    total: float
    rank: tuple[float, ...]
    before: Label[Key] | None = None
    step: object = None

    def path(self) -> list[Label[Key]]:
        """Return the labels from a start to this one."""
        labels: list[Label[Key]] = []
        label: Label[Key] | None = self
        while label is not None:
            labels.append(label)
            label = label.before
        return labels[::-1]


class ParetoSearch(Generic[Key]):
    """A search that yields every label that no label to the same state dominates, the one with the least rank first.

    The first complete label is the best one if no rank is higher than that of any complete label that follows from it.

    Args:
        starts: Labels with which paths begin.
        successors: The labels that follow one that is yielded; those that cannot become good enough are left out.
        rounding: By how much a cost may be higher and still count as no higher: sums of the same costs differ by their order.

    Attributes:
        reached: Labels that were reached and not dominated then.
    """

    def __init__(
        self, starts: Iterable[Label[Key]], successors: Callable[[Label[Key]], Iterable[Label[Key]]], *, rounding: float = 0.0
    ) -> None:
        self._successors, self._rounding = successors, rounding
        self._fronts: dict[Key, list[Costs]] = {}
        self._heap: list[tuple[float, ...]] = []  # of numbers alone, which the garbage collector does not follow
        self._labels: dict[float, Label[Key]] = {}
        self.reached = 0
        self._push(starts)

    def __iter__(self) -> Iterator[Label[Key]]:
        """Yield the labels."""
        heap, fronts = self._heap, self._fronts
        while heap:
            label = self._labels.pop(heapq.heappop(heap)[-1])
            if not self._is_dominated(label.state, label.paid):
                fronts.setdefault(label.state, []).append(label.paid)
                yield label
                self._push(self._successors(label))

    def _push(self, labels: Iterable[Label[Key]]) -> None:
        for label in labels:
            if not self._is_dominated(label.state, label.paid):
                self.reached += 1
                self._labels[self.reached] = label
                heapq.heappush(self._heap, (*label.rank, self.reached))

    def _is_dominated(self, state: Key, paid: Costs) -> bool:
        rounding = self._rounding
        for known in self._fronts.get(state, ()):
            for least, cost in zip(known, paid, strict=True):
                if least > cost + rounding:
                    break
            else:
                return True
        return False
