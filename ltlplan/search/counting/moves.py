"""What a robot can do from one rest to the next: fly to another region, or to one where it acts and on to another.

Robots rest at their starts and in the middles of regions. An action happens at some time of a visit, so a robot that acts
flies on within the same move: once it has come to rest again the action is done for sure. Where nobody waits for that it may also stay
for good.

A rest of which the formula sees nothing that was not there before may be left out: whatever the others do while somebody rests there they can
do while it still rests where it was. So on a grid of which a formula names few places only ways from one to the next are moves.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

from ltlplan.search.counting.counting_propositions import Sums
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

MOST_ACTIONS = 2
"""Actions of a robot in one move, in one region or in two."""
_ACT = 2e-9  # of equally dear ways the one with the fewest actions is taken


@dataclass(frozen=True, slots=True)
class Move:
    """A way from one rest to the next.

    Attributes:
        target: Node of the robot's system at which it rests then.
        shown: The marks that it makes on the way, those at the target last, without repetitions; not those that it makes before.
        cost: Of the way, and a tiny amount for each action.
        path: Nodes of the robot's system after the one it leaves.
        last: Whether the robot stays at the target for good: just outside a region, or where it acts; nobody can wait for it there.
    """

    target: int
    shown: tuple[Sums, ...]
    cost: float
    path: tuple[int, ...]
    last: bool = False


class RobotMoves:
    """One robot's moves, by the node at which it rests; made as they are asked for."""

    def __init__(
        self,
        system: TransitionSystem,
        marks_of: Callable[[Letter], Sums],
        *,
        stays: bool,
        skips: bool,
        hovers: bool = False,
    ) -> None:
        """Look at a robot.

        Args:
            system: What it can do.
            marks_of: The marks that its letters make.
            stays: Whether it may also stay, for good, just outside a region that it has left or where it has acted.
            skips: Whether it flies on from rests at which it makes the marks that it has made all the way.
            hovers: Whether it also rests just outside a region that it has left, while others fly.
        """
        self.system = system
        self.marks = tuple(marks_of(letter) for letter in system.labels)
        self._skips = skips
        self._stays, self._hovers = stays, hovers
        self._known: dict[int, tuple[Move, ...]] = {}

    def rests(self, node: int) -> bool:
        """Tell whether a robot at a node can wait there for others."""
        if node == self.system.initial:
            return True
        found = self.system.nodes[node]
        return (not found.flying and found.leg is None and bool(found.regions)) or (self._hovers and self._gone(node))

    def ends(self, node: int) -> bool:
        """Tell whether the flight may end at a node."""
        return self.system.final is None or node in self.system.final

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
        """Yield the cheapest way to each rest, for all marks that are made on the way."""
        system = self.system
        # cost, nodes on the way, marks, actions since the last rest, whether the last step acted
        heap: list[tuple[float, tuple[int, ...], tuple[Sums, ...], int, bool]] = [(0.0, (), (), 0, False)]
        seen: dict[tuple[int, tuple[Sums, ...], bool], int] = {}  # with as many actions, the least so far
        while heap:
            cost, path, shown, acted, acting = heapq.heappop(heap)
            at = path[-1] if path else start
            known = seen.get((at, shown, acting), MOST_ACTIONS + 1)
            if known <= acted:
                continue
            seen[at, shown, acting] = acted
            arrived = bool(path) and self.rests(at) and not acting
            flies_on = self._skips and not shown and (self.ends(start) or not self.ends(at))
            stays = self._stays and bool(path) and (acting or self._gone(at)) and self.ends(at)
            if not flies_on and (arrived or stays) and known > MOST_ACTIONS:
                yield Move(at, shown, cost, path, last=stays)
            if arrived or acting or not path:  # here it may act, and then must fly on
                acted = 0 if flies_on and not acting else acted
                for target, step in self._acts[at] if acted < MOST_ACTIONS else ():
                    heapq.heappush(
                        heap, (cost + step + _ACT, (*path, target), self._longer(start, shown, target), acted + 1, True)
                    )
            if arrived and not flies_on:
                continue
            for target, step in system.edges[at]:
                if target != start and (target, step) not in self._acts[at]:
                    heapq.heappush(heap, (cost + step, (*path, target), self._longer(start, shown, target), acted, False))

    def _gone(self, node: int) -> bool:
        found = self.system.nodes[node]
        return found.flying and found.leg is None and node != self.system.initial

    def _longer(self, start: int, shown: tuple[Sums, ...], target: int) -> tuple[Sums, ...]:
        made = shown[-1] if shown else self.marks[start]
        return shown if self.marks[target] == made else (*shown, self.marks[target])
