"""What a team can do, one robot flying at a time: the product of its robots' systems, made as it is walked.

A node is the node of every robot and who moved last. A robot sets out when all others rest, in a region or where they start; so a
path of the product is a flight of the team, one robot after another, whose every letter is read. What robots may do at
the same time is decided afterwards (`team_stages`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import overload

from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

Nodes = tuple[int, ...]
NOBODY = -1
"""Who moved last where nobody has moved yet."""
SEAM = -2
"""Instead of a robot: a lap ends, in which each is read at least once, and the next begins."""


class TeamLetters:
    """Letters of all robots at one time, with who moved last, as one letter of a product."""

    def __init__(self) -> None:
        """Begin without letters."""
        self._meant: dict[Letter, tuple[tuple[Letter, ...], int]] = {}

    def written(self, letters: Sequence[Letter], mover: int) -> Letter:
        """Return one letter for what all robots show.

        Args:
            letters: Each robot's.
            mover: Who moved last.
        """
        found = frozenset({f"{robot}.{name}" for robot, letter in enumerate(letters) for name in letter} | {f"{mover}"})
        self._meant.setdefault(found, (tuple(letters), mover))
        return found

    def read(self, letter: Letter) -> tuple[tuple[Letter, ...], int]:
        """Return each robot's letter and who moved last.

        Args:
            letter: One that was written.
        """
        return self._meant[letter]


class TeamSystem:
    """The product of a team's systems.

    Attributes:
        systems: One for each robot.
        letters: What its labels mean.
        labels, edges, initial, final: As of one robot's system; grown as it is walked.

    Args:
        systems: One for each robot.
        together: Whether several robots may be on their way at the same time, each of them making a step at a time.
        weights: What a robot's costs count; 1 where None.
        movers: Whether it is told apart who moved last, which only readings one robot at a time ask for.
    """

    def __init__(
        self,
        systems: Sequence[TransitionSystem],
        *,
        together: bool = False,
        weights: Sequence[float] | None = None,
        movers: bool = True,
    ) -> None:
        self.systems = tuple(systems)
        self.letters = TeamLetters()
        self._movers, self._together, self._weights = movers, together, tuple(weights or (1.0,) * len(self.systems))
        self._rests = [_resting(own) for own in self.systems]
        self._numbers: dict[tuple[Nodes, int], int] = {}
        self.places: list[tuple[Nodes, int]] = []
        self.labels: list[Letter] = []
        self.final: dict[int, float] = {}
        self.initial = self._number(tuple(system.initial for system in self.systems), NOBODY)
        self.edges: Sequence[Sequence[tuple[int, float]]] = _Edges(self)

    def nodes(self, place: int) -> Nodes:
        """Return the node of every robot at a place of the product."""
        return self.places[place][0]

    def rests(self, robot: int, node: int) -> bool:
        """Tell whether a robot at this node can wait for others."""
        return self._rests[robot][node]

    def all_rest(self, nodes: Nodes) -> bool:
        """Tell whether all robots can wait where they are."""
        return all(self._rests[robot][node] for robot, node in enumerate(nodes))

    def moves(self, nodes: Nodes) -> Iterator[tuple[int, float, Nodes]]:
        """Yield who can move where all robots are, what it pays, and where all are then.

        Args:
            nodes: The node of every robot.
        """
        flying = [robot for robot, node in enumerate(nodes) if not self._rests[robot][node]]
        for robot in flying if flying and not self._together else range(len(nodes)):
            for target, cost in self.systems[robot].edges[nodes[robot]]:
                yield robot, cost * self._weights[robot], (*nodes[:robot], target, *nodes[robot + 1 :])

    def steps(self, place: int) -> tuple[tuple[int, float], ...]:
        """Return what can follow, with costs."""
        return tuple((self._number(after, robot), cost) for robot, cost, after in self.moves(self.places[place][0]))

    def _number(self, nodes: Nodes, mover: int) -> int:
        mover = mover if self._movers else NOBODY
        found = self._numbers.get((nodes, mover))
        if found is None:
            found = self._numbers[nodes, mover] = len(self.places)
            self.places.append((nodes, mover))
            self.labels.append(self.letters.written([s.labels[n] for s, n in zip(self.systems, nodes, strict=True)], mover))
            if self._together or self.all_rest(nodes):
                self.final[found] = 0.0
        return found


def _resting(system: TransitionSystem) -> list[bool]:
    """Tell of each node whether a robot can wait there; anywhere, where nodes mean nothing."""
    if not system.nodes:
        return [True] * len(system.labels)
    return [not node.flying or index == system.initial for index, node in enumerate(system.nodes)]


class _Edges(Sequence[Sequence[tuple[int, float]]]):
    """The edges of a product, made when they are asked for."""

    def __init__(self, system: TeamSystem) -> None:
        self._system = system
        self._known: dict[int, tuple[tuple[int, float], ...]] = {}

    def __len__(self) -> int:
        return len(self._system.places)

    @overload
    def __getitem__(self, index: int) -> Sequence[tuple[int, float]]: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sequence[tuple[int, float]]]: ...
    def __getitem__(self, index: int | slice) -> Sequence[tuple[int, float]] | Sequence[Sequence[tuple[int, float]]]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        found = self._known.get(index)
        if found is None:
            found = self._known[index] = self._system.steps(index)
        return found
