"""Paths in the order of their cost, the cheapest first, over a graph that is made as it is walked."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from ltlplan.logic.budget import TooLarge

Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, slots=True)
class BestPath(Generic[Key]):
    """One path to a goal.

    Attributes:
        keys: From a start to a goal.
        cost: Sum along it.
        explored: How many steps were looked at until it was found.
    """

    keys: tuple[Key, ...]
    cost: float
    explored: int


def best_paths(
    starts: Iterable[Key],
    moves: Callable[[Key], Iterable[tuple[Key, float]]],
    ending: Callable[[Key], float | None],
    *,
    each: int,
    states: int,
) -> Iterator[BestPath[Key]]:
    """Yield paths in the order of their cost.

    Args:
        starts: Where paths begin.
        moves: Pairs (next, cost) for each key, costs not negative.
        ending: What it costs to end at a key; None where a path may not end.
        each: How often one key may be gone through; the first `each` paths are sure to be the cheapest.
        states: How many keys may be expanded.

    Raises:
        TooLarge: More keys than `states` were expanded.
    """
    pushed = 0
    heap: list[tuple[float, int, Key | None, int]] = []  # cost, tie, key (None: the path ends), index of the entry before
    entries: list[tuple[Key, int]] = []
    for key in starts:
        entries.append((key, -1))
        heap.append((0.0, pushed, key, len(entries) - 1))
        pushed += 1
    heapq.heapify(heap)
    times: Counter[Key] = Counter()
    explored = 0
    while heap:
        cost, _, key, entry = heapq.heappop(heap)
        if key is None:
            yield BestPath(_back(entries, entry), cost, explored)
            continue
        times[key] += 1
        if times[key] > each:
            continue
        explored += 1
        if explored > states:
            raise TooLarge("The search needs", explored, "states", states)
        extra = ending(key)
        if extra is not None:
            heapq.heappush(heap, (cost + extra, pushed, None, entry))
            pushed += 1
        for target, step in moves(key):
            if times[target] < each:
                entries.append((target, entry))
                heapq.heappush(heap, (cost + step, pushed, target, len(entries) - 1))
                pushed += 1


def _back(entries: list[tuple[Key, int]], at: int) -> tuple[Key, ...]:
    keys: list[Key] = []
    while at >= 0:
        key, at = entries[at]
        keys.append(key)
    return tuple(reversed(keys))
