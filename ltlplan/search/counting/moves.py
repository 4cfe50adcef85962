"""Moves of a robot from one rest to the next: a flight to another region, or to one where it acts and on to another.

Robots rest at their starts, in the middles of regions and just outside regions that they have left. An action happens at some time of a visit, so a robot that acts
flies on within the same move: once it has come to rest again the action is done for sure. Where nobody waits for that it may also stay
for good.

A rest of which the formula sees nothing that was not there before may be left out: whatever the others do while somebody rests there they can
do while it still rests where it was. So on a grid of which a formula names few places only ways from one to the next are moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial

from ltlplan.search.counting.counting_propositions import Sums
from ltlplan.search.label_setting import Label, ParetoSearch
from ltlplan.search.memoization import memoized
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

MOST_ACTIONS = 2
"""Actions of a robot in one move, in one region or in two."""
_ACT = 2e-9  # of equally dear ways the one with the fewest actions is taken

_State = tuple[int, tuple[Sums, ...], bool]
"""A node, the marks on the way to it, and whether the last step acted."""


@dataclass(frozen=True, slots=True)
class Move:
    """A way from one rest to the next.

    Attributes:
        target: Node of the robot's system at which it rests then.
        shown: The marks that it makes on the way, those at the target last, without repetitions; not those that it makes before.
        cost: Of the way, and a tiny amount for each action.
        path: Nodes of the robot's system after the one it leaves.
        last: Whether the robot stays at the target for good, where it acts; nobody can wait for it there.
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
    ) -> None:
        """Look at a robot.

        Args:
            system: What it can do.
            marks_of: The marks that its letters make.
            stays: Whether it also rests just outside a region that it has left, and may stay for good where it has acted.
            skips: Whether it flies on from rests at which it makes the marks that it has made all the way.
        """
        self.system = system
        self.marks = tuple(marks_of(letter) for letter in system.labels)
        self._skips = skips
        self._stays = stays

    def rests(self, node: int) -> bool:
        """Tell whether a robot at a node can wait there for others."""
        if node == self.system.initial:
            return True
        found = self.system.nodes[node]
        return found.leg is None and (self._stays if found.flying else bool(found.regions))

    def ends(self, node: int) -> bool:
        """Tell whether the flight may end at a node."""
        return self.system.final is None or node in self.system.final

    @memoized
    def of(self, node: int) -> tuple[Move, ...]:
        """Return the moves from a node at which a robot rests."""
        return tuple(self._moves(node))

    @cached_property
    def _acts(self) -> tuple[tuple[tuple[int, float], ...], ...]:
        """For each node the edges by which the internal state changes."""
        nodes = self.system.nodes
        return tuple(
            tuple((target, cost) for target, cost in edges if nodes[target].internal != nodes[node].internal)
            for node, edges in enumerate(self.system.edges)
        )

    def _moves(self, start: int) -> Iterator[Move]:
        """Yield the cheapest way to each rest, for all marks that are made on the way.

        Labels are the ways to a node with the same marks, whose last step acted or did not; what counts is the cost, and the actions since the
        last rest.
        """
        seen = set[_State]()
        begin: Label[_State] = Label((start, (), False), (0.0, 0.0), 0.0, (0.0,))
        for label in ParetoSearch([begin], partial(self._onwards, start)):
            at, shown, acting = label.state
            cost, *path = label.rank
            stays = self._stays and bool(path) and acting and self.ends(at)
            arrived = bool(path) and self.rests(at) and not acting
            if (arrived or stays) and label.state not in seen and not self._flies_on(start, label.state):
                yield Move(at, shown, cost, tuple(map(int, path)), last=not arrived)
            seen.add(label.state)

    def _onwards(self, start: int, label: Label[_State]) -> Iterator[Label[_State]]:
        """Yield the labels after one more step: an action where the robot is, or a leg where it need not rest."""
        (at, shown, acting), (cost, acted) = label.state, label.paid
        begins, flies_on = label.before is None, self._flies_on(start, label.state)
        arrived = not begins and self.rests(at) and not acting
        steps: list[tuple[int, float, float, bool]] = []
        if arrived or acting or begins:  # here it may act, and then must fly on
            acted = 0.0 if flies_on and not acting else acted
            steps += [(t, cost + step + _ACT, acted + 1, True) for t, step in self._acts[at] if acted < MOST_ACTIONS]
        if not arrived or flies_on:
            legs = (edge for edge in self.system.edges[at] if edge[0] != start and edge not in self._acts[at])
            steps += [(target, cost + step, acted, False) for target, step in legs]
        for target, total, actions, acts in steps:
            made = self.marks[target]
            state = target, shown if made == (shown[-1] if shown else self.marks[start]) else (*shown, made), acts
            yield Label(state, (total, actions), total, (total, *label.rank[1:], target), label)

    def _flies_on(self, start: int, state: _State) -> bool:
        """Tell whether a rest is left out, as the formula sees nothing new of it."""
        return self._skips and not state[1] and (self.ends(start) or not self.ends(state[0]))
