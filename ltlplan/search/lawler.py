"""Lawler's partition: the solutions of a space, the cheapest first, each found by excluding those before it.

    E. L. Lawler, "A procedure for computing the K best solutions to discrete optimization problems", Management Science 18, 1972

A space is a frozen value that says what its solutions must do without. A solution that is yielded and not good enough parts the rest of its
space into smaller ones, in each of which one thing more is forbidden. Equal spaces are searched once. The partition is lazy: nothing is
searched before the next solution is asked for.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

Space = TypeVar("Space", bound=Hashable)
Solution = TypeVar("Solution")


class Member(NamedTuple, Generic[Space, Solution]):
    """A solution, where it was found.

    Attributes:
        cost: What it costs; any value that has an order.
        found: How many solutions were found before it, which breaks ties.
        space: The space that it is cheapest in.
        solution: The solution.
    """

    cost: Any
    found: int
    space: Space
    solution: Solution


@dataclass
class Partition(Generic[Space, Solution]):
    """Solutions of some spaces and their parts, the cheapest first.

    Attributes:
        spaces: Where to begin.
        solve: Finds the solutions of a space, with their costs: its cheapest one, or several candidates for that; none where it is empty.
        part: Parts what is left of a space without a solution. It is called when the next solution is asked for.
        searches: How many spaces may be searched; once they are used up, solutions of other spaces may be missing and no order is promised.
        searched: Those that were.
    """

    spaces: Iterable[Space]
    solve: Callable[[Space], Iterable[tuple[Any, Solution]]]
    part: Callable[[Space, Solution], Iterable[Space]] = lambda _space, _solution: ()
    searches: float = float("inf")
    searched: set[Space] = field(default_factory=set[Space], init=False)

    def __iter__(self) -> Iterator[Member[Space, Solution]]:
        """Yield the solutions, each with its space."""
        heap: list[Member[Space, Solution]] = []
        spaces, found = self.spaces, 0
        while True:
            for space in spaces:
                if space in self.searched or len(self.searched) >= self.searches:
                    continue
                self.searched.add(space)
                for cost, solution in self.solve(space):
                    heapq.heappush(heap, Member(cost, found, space, solution))
                    found += 1
            if not heap:
                return
            cheapest = heapq.heappop(heap)
            yield cheapest
            spaces = self.part(cheapest.space, cheapest.solution)
