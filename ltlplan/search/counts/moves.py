"""What a robot can do from one rest to the next: fly to another region, or to one where it acts and on to another.

Robots rest at their starts and in the middles of regions. An action happens at some time of a visit, so a robot that acts
flies on within the same move: once it has come to rest again the action is done for sure.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

MOST_ACTIONS = 2
"""Regions in which a robot acts in one move."""


@dataclass(frozen=True, slots=True)
class Move:
    """A way from one rest to the next.

    Attributes:
        target: Node of the robot's system at which it rests then.
        letters: What it shows on the way, the letter at the target last, without repetitions; not the one that it holds before.
        cost: Of the way.
        path: Nodes of the robot's system after the one it leaves.
    """

    target: int
    letters: tuple[Letter, ...]
    cost: float
    path: tuple[int, ...]


class RobotMoves:
    """One robot's moves, by the node at which it rests; made as they are asked for."""

    def __init__(self, system: TransitionSystem, *, hovers_outside: bool) -> None:
        """Look at a robot.

        Args:
            system: What it can do.
            hovers_outside: Whether it may also come to rest, for good, just outside a region that it has left.
        """
        self.system = system
        self._outside = hovers_outside
        self._known: dict[int, tuple[Move, ...]] = {}

    def rests(self, node: int) -> bool:
        """Tell whether a robot at a node can wait there for others."""
        if node == self.system.initial:
            return True
        found = self.system.nodes[node]
        return not found.flying and found.leg is None and bool(found.regions)

    def ends(self, node: int) -> bool:
        """Tell whether the flight may end at a node."""
        return self.system.final is None or node in self.system.final

    def last(self, node: int) -> bool:
        """Tell whether a robot that has come to a node stays there to the end: it cannot wait there for others."""
        return not self.rests(node)

    def of(self, node: int) -> tuple[Move, ...]:
        """Return the moves from a node at which a robot rests."""
        found = self._known.get(node)
        if found is None:
            found = self._known[node] = tuple(self._moves(node))
        return found

    @cached_property
    def _acts(self) -> tuple[tuple[tuple[int, float], ...], ...]:
        """For each node the edges by which the internal state changes."""
        nodes = self.system.nodes
        return tuple(
            tuple((target, cost) for target, cost in edges if nodes[target].internal != nodes[node].internal)
            for node, edges in enumerate(self.system.edges)
        )

    def _moves(self, start: int) -> Iterator[Move]:
        """Yield the cheapest way to each rest, for each word on the way."""
        system = self.system
        # cost, nodes on the way, letters, actions so far, whether the last step acted
        heap: list[tuple[float, tuple[int, ...], tuple[Letter, ...], int, bool]] = [(0.0, (), (), 0, False)]
        seen: set[tuple[int, tuple[Letter, ...]]] = set()
        while heap:
            cost, path, letters, acted, acting = heapq.heappop(heap)
            at = path[-1] if path else start
            if (at, letters) in seen:
                continue
            seen.add((at, letters))
            arrived = bool(path) and self.rests(at)
            if (arrived and not acting) or (path and not acting and self._outside and self._gone(at)):
                yield Move(at, letters, cost, path)
            if (arrived and not acting) or (not path):  # here it may act, and then must fly on
                for target, step in self._acts[at] if acted < MOST_ACTIONS else ():
                    heapq.heappush(heap, (cost + step, (*path, target), self._longer(start, letters, target), acted + 1, True))
            if arrived and not acting:
                continue
            for target, step in system.edges[at]:
                if target != start and (target, step) not in self._acts[at]:
                    heapq.heappush(heap, (cost + step, (*path, target), self._longer(start, letters, target), acted, False))

    def _gone(self, node: int) -> bool:
        found = self.system.nodes[node]
        return found.flying and found.leg is None and self.ends(node) and node != self.system.initial

    def _longer(self, start: int, letters: tuple[Letter, ...], target: int) -> tuple[Letter, ...]:
        held = letters[-1] if letters else self.system.labels[start]
        shown = self.system.labels[target]
        return letters if shown == held else (*letters, shown)
