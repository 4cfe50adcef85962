"""All team words of several robots, as one graph that is explored on demand.

Graphs over the robots' own behaviours. An edge either reads a letter or is silent (something changes and nobody
looks). `OwnGraph` reads one robot's letter at a time; a robot must be read at least once before its letter changes.
`JointGraph` reads the union of all letters at every change. A path is a team word from an initial to a final state.

With times, robots may be at nodes together only where the spans of those nodes overlap, and change together only at an
instant at which all can still be where they were. That is enough: spans only move forward, so the latest of the starts is
an instant that never goes back.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import Together
from verify.model_checking.robot_letters import RobotBehaviour

MAX_TOGETHER = 12
"""Robots whose letters can change at one instant under the joint reading."""


@dataclass(frozen=True, slots=True)
class Observation:
    """One reading: a robot's index (None for the union of all) and the node of every robot at that time."""

    robot: int | None
    letter: Letter
    nodes: tuple[int, ...]


Step = tuple[Observation | None, Hashable]


class TeamGraph(Protocol):
    """Graph that the searches need: initial nodes, successors, and nodes where a team word may end."""

    def initial(self) -> Iterable[Step]:
        """Yield the first states, each with the reading that leads there (or None)."""
        ...

    def steps(self, state: Any) -> Iterable[Step]:  # of any type: each graph has states of its own
        """Yield what can come next."""
        ...

    def is_final(self, state: Any) -> bool:  # of any type: each graph has states of its own
        """Return whether the team word may end here."""
        ...

    def stronger(self, state: Any) -> tuple[Hashable, int]:  # of any type: each graph has states of its own
        """Return (key, bits): of two states with equal keys the one with more bits can do all that the other can."""
        ...


@dataclass(frozen=True, slots=True)
class Ranks:
    """The spans of all nodes, with numbers in the order of their ends instead of times.

    Attributes:
        spans: For each robot, for each of its nodes, the first and the last rank.
        last: The greatest rank.
    """

    spans: list[list[tuple[int, int]]]
    last: int

    @classmethod
    def of(cls, robots: Sequence[RobotBehaviour], clock_error: Fraction) -> Ranks:
        """Rank the ends of spans that are widened by what clocks may be off, in s."""
        ends = sorted({t for r in robots for low, high in r.spans for t in (low - clock_error, high + clock_error)})
        rank = {t: i for i, t in enumerate(ends)}
        spans = [[(rank[low - clock_error], rank[high + clock_error]) for low, high in robot.spans] for robot in robots]
        return cls(spans, len(ends) - 1)

    @classmethod
    def timeless(cls, robots: Sequence[RobotBehaviour]) -> Ranks:
        """Let each node be held at any time."""
        return cls([[(0, 0)] * len(robot) for robot in robots], 0)


class _Clock:
    """Relation of nodes that different robots can hold at the same time."""

    def __init__(self, robots: Sequence[RobotBehaviour], *, timed: bool, clock_error: Fraction) -> None:
        ranks = Ranks.of(robots, clock_error)
        self.timed = timed and len(robots) > 1
        self.low = [[low for low, _ in spans] for spans in ranks.spans]
        self.high = [[high for _, high in spans] for spans in ranks.spans]

    def signature(self, robots: Sequence[RobotBehaviour]) -> Hashable:
        """Return all that the team words depend on: equal signatures, equal words."""
        shape = tuple((r.letters, r.following, r.initial, r.final) for r in robots)
        return shape, (tuple(map(tuple, self.low)), tuple(map(tuple, self.high))) if self.timed else None

    def allows(self, nodes: tuple[int, ...], robot: int, target: int) -> bool:
        """Return whether one robot can be at `target` while the others stay where they are."""
        if not self.timed:
            return True
        low, high = self.low[robot][target], self.high[robot][target]
        return all(
            other == robot or (self.low[other][node] <= high and low <= self.high[other][node])
            for other, node in enumerate(nodes)
        )

    def in_time(self, nodes: tuple[int, ...], robot: int, target: int) -> bool:
        """Return whether one robot can come to `target` while nobody has to be gone: at an instant at which all may change."""
        if not self.timed:
            return True
        return self.low[robot][target] <= min(high[n] for high, n in zip(self.high, nodes, strict=True))

    def together(self, options: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Leave out nodes that overlap with no choice of some other robot's: no state has them."""
        if not self.timed:
            return options
        first = [min(self.low[r][n] for n in choices) for r, choices in enumerate(options)]
        last = [max(self.high[r][n] for n in choices) for r, choices in enumerate(options)]
        latest, earliest = max(first), min(last)
        return [
            tuple(n for n in choices if self.low[r][n] <= earliest and latest <= self.high[r][n])
            for r, choices in enumerate(options)
        ]

    def allows_all(self, nodes: tuple[int, ...]) -> bool:
        """Return whether all robots can be where they are at one time."""
        if not self.timed:
            return True
        return max(low[n] for low, n in zip(self.low, nodes, strict=True)) <= min(
            high[n] for high, n in zip(self.high, nodes, strict=True)
        )


class _TeamGraph:
    """Common base of both readings of a team.

    Args:
        robots: The robots.
        timed: Whether the spans bind; otherwise only each robot's own order does.
        clock_error: How far each robot's clock may be off, in s.
        permitted: If given, states (tuples of nodes) for which it is false are left out: waits between robots.
    """

    def __init__(
        self,
        robots: Sequence[RobotBehaviour],
        *,
        timed: bool,
        clock_error: Fraction = Fraction(0),
        permitted: Callable[[tuple[int, ...]], bool] | None = None,
    ) -> None:
        self.robots = tuple(robots)
        self.clock = _Clock(self.robots, timed=timed, clock_error=clock_error)
        self.permitted = permitted


class OwnGraph(_TeamGraph):
    """Team words whose positions are one robot's letter at one time.

    A state is (node of every robot, bits): bit r says that robot r's present letter has been read.
    """

    @cached_property
    def all_read(self) -> int:
        """The bits of a state in which every robot's letter has been read."""
        return (1 << len(self.robots)) - 1

    def signature(self) -> Hashable:
        """Return all that the team words depend on; None where something else limits them."""
        return None if self.permitted is not None else ("own", self.clock.signature(self.robots))

    def initial(self) -> Iterator[Step]:
        """Yield every way to begin."""
        for nodes in itertools.product(*(robot.initial for robot in self.robots)):
            if self.clock.allows_all(nodes):
                yield None, (nodes, 0)

    def steps(self, state: tuple[tuple[int, ...], int]) -> Iterator[Step]:
        """Read any robot, or let one robot move on."""
        nodes, bits = state
        for r, robot in enumerate(self.robots):
            node, bit = nodes[r], 1 << r
            letter = robot.letters[node]
            yield Observation(r, letter, nodes), (nodes, bits | bit)
            for target in robot.following[node]:
                changed = robot.letters[target] != letter
                if changed and not bits & bit:
                    continue
                if self.clock.allows(nodes, r, target):
                    moved = (*nodes[:r], target, *nodes[r + 1 :])
                    if self.permitted is None or self.permitted(moved):
                        yield None, (moved, bits & ~bit if changed else bits)

    def is_final(self, state: tuple[tuple[int, ...], int]) -> bool:
        """Return whether all robots have arrived and been read."""
        nodes, bits = state
        return bits == self.all_read and all(n in robot.final for n, robot in zip(nodes, self.robots, strict=True))

    def stronger(self, state: tuple[tuple[int, ...], int]) -> tuple[Hashable, int]:
        """Return the positions, and the robots that have been read, which alone may move on."""
        return state


class JointGraph(_TeamGraph):
    """Team words whose positions are the union of what all robots hold; changes at one instant in any combination.

    Args:
        robots: The robots; where there is `together`, with marked letters.
        timed: Whether the spans bind; otherwise only each robot's own order does.
        clock_error: How far each robot's clock may be off, in s.
        permitted: If given, states for which it is false are left out.
        together: If given, puts letters together instead of their union.
    """

    def __init__(
        self,
        robots: Sequence[RobotBehaviour],
        *,
        timed: bool,
        clock_error: Fraction = Fraction(0),
        permitted: Callable[[tuple[int, ...]], bool] | None = None,
        together: Together | None = None,
    ) -> None:
        super().__init__(robots, timed=timed, clock_error=clock_error, permitted=permitted)
        self.together = together

    def _observation(self, nodes: tuple[int, ...]) -> Observation:
        letters = (robot.letters[n] for n, robot in zip(nodes, self.robots, strict=True))
        if self.together is not None:
            return Observation(None, self.together((letter, 1) for letter in letters), nodes)
        return Observation(None, frozenset().union(*letters), nodes)

    def signature(self) -> Hashable:
        """Return all that the team words depend on; None where something else limits them."""
        return None if self.permitted is not None else ("joint", self.clock.signature(self.robots), self.together)

    def initial(self) -> Iterator[Step]:
        """Yield every way to begin."""
        for nodes in itertools.product(*(robot.initial for robot in self.robots)):
            if self.clock.allows_all(nodes):
                yield self._observation(nodes), nodes

    def steps(self, state: tuple[int, ...]) -> Iterator[Step]:
        """Read again, let one robot move on in silence, or change the letters of some robots together.

        Raises:
            OutOfBudget: More robots than `MAX_TOGETHER` can change their letters at one instant.
        """
        here = self._observation(state)
        yield here, state
        options: list[tuple[int, ...]] = []
        for r, robot in enumerate(self.robots):
            changing: list[int] = []
            for target in robot.following[state[r]]:
                if robot.letters[target] != robot.letters[state[r]]:
                    if self.clock.in_time(state, r, target):
                        changing.append(target)
                elif self.clock.allows(state, r, target):
                    moved = (*state[:r], target, *state[r + 1 :])
                    if self.permitted is None or self.permitted(moved):
                        yield None, moved
            options.append((state[r], *changing))
        options = self.clock.together(options)
        if sum(len(choices) > 1 for choices in options) > MAX_TOGETHER:
            raise OutOfBudget(f"more than {MAX_TOGETHER} robots can change their letters at one instant")
        for nodes in itertools.product(*options):
            if nodes != state and self.clock.allows_all(nodes) and (self.permitted is None or self.permitted(nodes)):
                yield self._observation(nodes), nodes

    def is_final(self, state: tuple[int, ...]) -> bool:
        """Return whether all robots have arrived."""
        return all(n in robot.final for n, robot in zip(state, self.robots, strict=True))

    def stronger(self, state: tuple[int, ...]) -> tuple[Hashable, int]:
        """Return no bits, as no state can do more than another."""
        return state, 0


class WithOthers:
    """Team words of some robots, among whose readings others' letters come at any time, any number of times.

    Every team word of all robots is one of these, so what holds of these holds of the team; the others' order, times
    and number of readings are forgotten, and with them nearly all of the states.
    """

    def __init__(self, graph: TeamGraph | None, letters: Iterable[Letter]) -> None:
        self.graph = graph
        self.letters = sorted(set(letters), key=sorted)

    def initial(self) -> Iterable[Step]:
        """Yield every way to begin."""
        return [(None, False)] if self.graph is None else self.graph.initial()

    def steps(self, state: Any) -> Iterator[Step]:  # of any type: each graph has states of its own
        """Read any of the others' letters, or go on as the robots that are followed do."""
        for letter in self.letters:
            yield Observation(None, letter, ()), True if self.graph is None else state
        if self.graph is not None:
            yield from self.graph.steps(state)

    def is_final(self, state: Any) -> bool:  # of any type: each graph has states of its own
        """Return whether the team word may end here; it has at least one reading."""
        return state if self.graph is None else self.graph.is_final(state)

    def stronger(self, state: Any) -> tuple[Hashable, int]:  # of any type: each graph has states of its own
        """Compare as the robots that are followed do."""
        return (state, 0) if self.graph is None else self.graph.stronger(state)
