"""Transition system of a team, one robot flying at a time: the product of its robots' systems, made as it is walked.

A node is the node of every robot and who moved last. A robot sets out when all others rest, in a region or where they start; so a
path of the product is a flight of the team, one robot after another, whose every letter is read. What robots may do at
the same time is decided afterwards (`team_stages`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

Nodes = tuple[int, ...]
NOBODY = -1
"""Who moved last where nobody has moved yet."""
SEAM = -2
"""Instead of a robot: a cycle ends, in which each is read at least once, and the next begins."""


TeamLetter = tuple[tuple[Letter, ...], int]
"""What all robots show, and who moved last."""


class TeamSystem:
    """The product of a team's systems.

    Attributes:
        systems: One for each robot.
        initial: The node of every robot at the start.

    Args:
        systems: One for each robot.
        together: Whether several robots may be on their way at the same time, each of them making a step at a time.
    """

    def __init__(self, systems: Sequence[TransitionSystem], *, together: bool = False) -> None:
        self.systems, self._together = tuple(systems), together
        self.initial: Nodes = tuple(system.initial for system in self.systems)
        self.rests = [resting(own, alone=len(systems) == 1) for own in self.systems]

    def letter(self, nodes: Nodes, mover: int) -> TeamLetter:
        """Return the letter of all robots.

        Args:
            nodes: The node of every robot.
            mover: Who moved last.
        """
        return tuple(own.labels[node] for own, node in zip(self.systems, nodes, strict=True)), mover

    def moves(self, nodes: Nodes) -> Iterator[tuple[int, float, Nodes]]:
        """Yield who can move where all robots are, what it pays, and where all are then.

        Args:
            nodes: The node of every robot.
        """
        flying = [robot for robot, node in enumerate(nodes) if not self.rests[robot][node]]
        for robot in flying if flying and not self._together else range(len(nodes)):
            for target, cost in self.systems[robot].edges[nodes[robot]]:
                yield robot, cost, (*nodes[:robot], target, *nodes[robot + 1 :])


def resting(system: TransitionSystem, *, alone: bool = False) -> list[bool]:
    """Tell of each node whether a robot can wait there; anywhere, where nodes mean nothing.

    Args:
        system: The robot's.
        alone: Whether nobody waits for it: then it may also stay in free flight.
    """
    if alone:
        return [system.ending(node) is not None for node in range(len(system.labels))]
    if not system.nodes:
        return [True] * len(system.labels)
    return [not node.flying or index == system.initial for index, node in enumerate(system.nodes)]
