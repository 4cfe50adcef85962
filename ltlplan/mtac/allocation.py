"""Sharing a formula among robots: where each one is, what it can do next, and what is surely left to fly.

The team automaton of the 2022 paper (Def. 4.6) is walked, never built: a state of it is a robot, the automaton's
states so far, and the robot's `Whereabouts` in A = E x R. A robot's next step is a whole visit: it leaves where it is,
enters a region, and may change its internal state there. Since the states are a set, the same walk serves before
take-off (one state) and in flight (all states that the readings so far may have led to, see `sharing.progress`).

`Outlook` is the guide of that walk: for every state a lower bound on the metres that the team still has to fly, from one
backward shortest-path search over a relaxation in which any robot that is free may be used again.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Container, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ltlplan.logic.automaton import DEAD
from verify.data import BadInput, Letter, Mission, Visit
from verify.data.mission import Action, Point

State = Hashable
"""A state of the automaton, its dead state included."""

States = frozenset[State]


class Accepting(Protocol):
    """What sharing needs of an automaton; `ltlplan.translate` returns one."""

    @property
    def initial(self) -> Hashable: ...  # noqa: D102

    @property
    def accepting(self) -> Container[Any]: ...  # noqa: D102

    def successor(self, state: Any, letter: Letter, /) -> Hashable: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Whereabouts:
    """Where a robot is, in the world and in A = E x R.

    Attributes:
        position: m.
        inside: The region that it is in, or None.
        vertex: Vertex of the environment: the region that it visited last, or the start vertex; None where there is
            no environment and it has visited nothing.
        internal: Its internal state.
    """

    position: Point
    inside: str | None
    vertex: str | None
    internal: str


@dataclass(frozen=True, slots=True)
class Move:
    """One visit as the next step.

    Attributes:
        visit: Region and actions.
        letters: Shown from entering to leaving, the leaving not included.
        internal: The internal state afterwards.
        in_place: The robot is in the region already and only acts.
    """

    visit: Visit
    letters: tuple[Letter, ...]
    internal: str
    in_place: bool = False


@dataclass(frozen=True)
class World:
    """The moves of a mission's robots.

    Attributes:
        mission: Regions, environment, internal states.
    """

    mission: Mission

    @cached_property
    def neighbours(self) -> dict[str | None, tuple[str, ...]]:
        """Regions that can be visited after each vertex; coming back to the region just left is always allowed."""
        regions = tuple(self.mission.all_regions)
        environment = self.mission.environment
        if environment is None:
            return dict.fromkeys((None, *regions), regions)
        found: dict[str | None, set[str]] = defaultdict(set)
        for source, target in environment.edges:
            found[source].add(target)
            if not environment.directed:
                found[target].add(source)
        return {
            vertex: tuple(r for r in regions if r in found[vertex] or r == vertex) for vertex in (environment.start, *regions)
        }

    @cached_property
    def _moves(self) -> dict[tuple[str | None, str], tuple[Move, ...]]:
        return {}

    def free_letter(self, internal: str) -> Letter:
        """Return the letter of free flight in an internal state."""
        return frozenset(self.mission.robot.states[internal])

    def letter(self, where: Whereabouts) -> Letter:
        """Return the letter that a robot shows now."""
        return self.free_letter(where.internal) | (frozenset() if where.inside is None else {where.inside})

    def start(self, robot: str) -> Whereabouts:
        """Return where a robot is at time 0.

        Raises:
            BadInput: It starts in two regions at once.
        """
        agent = self.mission.agents[robot]
        return self.at(agent.start, self.mission.initial_internal(robot), vertex=agent.visited, where=f"{robot} starts")

    def at(self, position: Point, internal: str, *, vertex: str | None = None, where: str = "the robot is") -> Whereabouts:
        """Return the whereabouts of a robot at a point; `vertex` is the region that it visited last, if any."""
        inside = [n for n, r in self.mission.all_regions.items() if float(r.level(np.array(position))) <= 1.0]
        if len(inside) > 1:
            raise BadInput(f"{where} in {' and '.join(inside)} at once; these regions overlap there.")
        if inside:
            return Whereabouts(position, inside[0], inside[0], internal)
        environment = self.mission.environment
        first = vertex if vertex is not None or environment is None else environment.start
        return Whereabouts(position, None, first, internal)

    def regions_at(self, positions: NDArray[np.float64]) -> list[str | None]:
        """Return the region that each point is in, or None; of several the first. Shape (n, 3)."""
        names = list(self.mission.all_regions)
        if not names:
            return [None] * len(positions)
        centres, shapes = self._shapes
        offset = positions[:, None] - centres
        inside = np.einsum("nri,rij,nrj->nr", offset, shapes, offset) <= 1.0
        return [names[int(np.argmax(row))] if row.any() else None for row in inside]

    @cached_property
    def _shapes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        regions = self.mission.all_regions.values()
        return np.array([region.center for region in regions]), np.array([region.shape for region in regions])

    def moves(self, where: Whereabouts, *, first: bool = False) -> tuple[Move, ...]:
        """Return every visit that a robot can make next; a first move may also be to act where the robot already is."""
        key = (where.vertex, where.internal)
        if key not in self._moves:
            self._moves[key] = tuple(self._all_moves(*key))
        if not first or where.inside is None:
            return self._moves[key]
        here = frozenset({where.inside})
        acts = [
            Move(
                Visit(region=where.inside, actions=actions),
                tuple(here | self.free_letter(a.target) for a in actions),
                reached,
                True,
            )
            for actions, reached in self._chains(where.inside, where.internal)
            if actions
        ]
        return (*acts, *self._moves[key])

    def after(self, move: Move) -> Whereabouts:
        """Return where a robot is once it has made its visit's last action, still inside."""
        region = move.visit.region
        return Whereabouts(self.mission.all_regions[region].center, region, region, move.internal)

    def shown(self, where: Whereabouts, move: Move) -> tuple[Letter, ...]:
        """Return the letters of a move, the leaving of the region where the robot is first."""
        if where.inside is None or move.in_place:
            return move.letters
        return (self.free_letter(where.internal), *move.letters)

    def _all_moves(self, vertex: str | None, internal: str) -> Iterator[Move]:
        for region in self.neighbours.get(vertex, ()):
            for actions, reached in self._chains(region, internal):
                letters = [frozenset({region}) | self.free_letter(internal)]
                letters += [frozenset({region}) | self.free_letter(action.target) for action in actions]
                yield Move(Visit(region=region, actions=actions), tuple(letters), reached)

    def _chains(self, region: str, internal: str) -> Iterator[tuple[tuple[Action, ...], str]]:
        """Yield the sequences of actions that a visit allows, none first, no internal state twice."""
        queue: list[tuple[tuple[Action, ...], str, frozenset[str]]] = [((), internal, frozenset({internal}))]
        while queue:
            actions, state, seen = queue.pop(0)
            yield actions, state
            queue += [
                ((*actions, a), a.target, seen | {a.target})
                for a in self.mission.robot.actions
                if a.at == region and a.source == state and a.target not in seen
            ]


@dataclass(frozen=True, slots=True)
class Part:
    """A robot's share of the formula as visits, from where it is; MTAC-E walks and hands over parts.

    Attributes:
        where: Where it begins.
        moves: Its visits, in order.
        leaves: Whether it flies out of the last region; False where the formula wants it to end inside.
    """

    where: Whereabouts
    moves: tuple[Move, ...] = ()
    leaves: bool = True

    @property
    def visits(self) -> tuple[Visit, ...]:
        """Regions and actions; a robot that begins inside a region begins with a visit of it."""
        visits = tuple(move.visit for move in self.moves)
        if self.where.inside is None or (self.moves and self.moves[0].in_place):
            return visits
        return (Visit(region=self.where.inside), *visits)

    def then(self, move: Move, leaves: bool) -> Part:
        """Return the part with one more visit."""
        return replace(self, moves=(*self.moves, move), leaves=leaves)

    def end(self, world: World) -> Whereabouts:
        """Return where the robot is after its last visit's actions, still inside."""
        return world.after(self.moves[-1]) if self.moves else self.where

    def ahead(self, world: World) -> tuple[Letter, ...]:
        """Return the letters after the present one."""
        letters: list[Letter] = []
        where = self.where
        for move in self.moves:
            letters += world.shown(where, move)
            where = world.after(move)
        if self.moves and self.leaves:
            letters.append(world.free_letter(where.internal))
        return tuple(letters)


Metric = Callable[[str, Point, str], float]
"""Lower bound on the cost of a robot's way from a point to a region: (robot, m, region)."""


class Outlook:
    """Lower bounds on what is left, for the robots that are still free to be used."""

    def __init__(
        self,
        world: World,
        automaton: Accepting,
        divides: Callable[[States], bool],
        starts: Mapping[str, Whereabouts],
        metric: Metric,
        *,
        takes_off: bool,
    ) -> None:
        """Prepare a guide.

        Args:
            world: Moves.
            automaton: Deterministic.
            divides: Whether another robot may go on from these states.
            starts: Where each robot begins.
            metric: Lower bound on the cost of one leg.
            takes_off: Whether a robot's first letter is still to be read (before take-off) or was (in flight).
        """
        self._world, self._automaton, self._divides = world, automaton, divides
        self._starts, self._metric, self._takes_off = starts, metric, takes_off
        self._regions = {name: region.center for name, region in world.mission.all_regions.items()}
        self._tables: dict[frozenset[str], dict[tuple[States, str | None, str], float]] = {}
        self._legs: dict[tuple[str | None, Point, str], float] = {}

    def read(self, states: States, letters: Collection[Letter]) -> States:
        """Return the states after letters."""
        for letter in letters:
            states = frozenset(self._automaton.successor(s, letter) for s in states)
        return states

    def is_dead(self, states: States) -> bool:
        """Tell whether some state is dead."""
        return DEAD in states

    def leg(self, robot: str, position: Point, region: str) -> float:
        """Lower bound on the cost of one robot's way from a point to a region."""
        return self._leg(robot, position, region)

    def accepts(self, states: States) -> bool:
        """Tell whether all states accept."""
        return all(state in self._automaton.accepting for state in states)

    def bound(self, states: States, where: Whereabouts, free: frozenset[str]) -> float:
        """Lower bound on the cost still to come when a robot is inside a region with its actions done."""
        return self._table(free, states, where).get((states, where.vertex, where.internal), math.inf)

    def bound_at_start(self, states: States, free: frozenset[str]) -> float:
        """Lower bound when nobody is under way and `free` are the robots that may go on."""
        best = 0.0 if self.accepts(states) else math.inf
        for robot in free:
            for _, after, where, leg in self._first(states, robot):
                best = min(best, leg + self.bound(after, where, free - {robot}))
        return best

    def _first(self, states: States, robot: str) -> Iterator[tuple[Move, States, Whereabouts, float]]:
        where = self._starts[robot]
        if self._takes_off:
            states = self.read(states, [self._world.letter(where)])
        for move in self._world.moves(where, first=True):
            after = self.read(states, self._world.shown(where, move))
            if DEAD not in after:
                yield move, after, self._world.after(move), self._leg(robot, where.position, move.visit.region)

    def _leg(self, robot: str | None, position: Point, region: str) -> float:
        key = (robot, position, region)
        if key not in self._legs:
            robots = self._starts if robot is None else (robot,)
            self._legs[key] = min(self._metric(r, position, region) for r in robots)
        return self._legs[key]

    def _table(self, free: frozenset[str], states: States, where: Whereabouts) -> dict[tuple[States, str | None, str], float]:
        """Backward shortest paths over everything that can be reached from here, any robot of `free` joining in."""
        table = self._tables.get(free)
        root = (states, where.vertex, where.internal)
        if table is not None and root in table:
            return table
        # nodes: (states, vertex, internal) inside a region, or (states,) where some free robot goes on
        into: dict[tuple, list[tuple[tuple, float]]] = defaultdict(list)
        ends: set[tuple] = set()
        seen: set[tuple] = {root}
        stack: list[tuple] = [root]
        starts = self._start_classes(free)
        while stack:
            node = stack.pop()
            for target, cost, final in self._edges(node, starts):
                if final:
                    ends.add(node)
                    continue
                into[target].append((node, cost))
                if target not in seen:
                    seen.add(target)
                    stack.append(target)
        costs: dict[tuple, float] = {}
        queue = [(0.0, i, node) for i, node in enumerate(sorted(ends, key=repr))]
        heapq.heapify(queue)
        counter = itertools.count(len(queue))
        while queue:
            cost, _, node = heapq.heappop(queue)
            if node in costs:
                continue
            costs[node] = cost
            for source, edge in into[node]:
                if source not in costs:
                    heapq.heappush(queue, (cost + edge, next(counter), source))
        table = {node: costs.get(node, math.inf) for node in seen if len(node) == 3}
        self._tables[free] = {**self._tables.get(free, {}), **table}
        return self._tables[free]

    def _start_classes(self, free: frozenset[str]) -> list[tuple[Whereabouts, dict[str, float]]]:
        """Free robots that read and move alike, with the least first leg to each region among them."""
        classes: dict[tuple, tuple[Whereabouts, dict[str, float]]] = {}
        for robot in sorted(free):
            where = self._starts[robot]
            key = (where.vertex, where.internal, where.inside)
            _, legs = classes.setdefault(key, (where, {}))
            for region in self._world.mission.all_regions:
                legs[region] = min(legs.get(region, math.inf), self._leg(robot, where.position, region))
        return list(classes.values())

    def _edges(self, node: tuple, starts: list[tuple[Whereabouts, dict[str, float]]]) -> Iterator[tuple[tuple, float, bool]]:
        """Yield (target, cost, whether this is an end) of the relaxation."""
        world = self._world
        if len(node) == 1:
            (states,) = node
            for where, legs in starts:
                begun = self.read(states, [world.letter(where)]) if self._takes_off else states
                for move in world.moves(where, first=True):
                    after = self.read(begun, world.shown(where, move))
                    if DEAD not in after:
                        yield (after, move.visit.region, move.internal), legs[move.visit.region], False
            return
        states, vertex, internal = node
        left = self.read(states, [world.free_letter(internal)])
        if self.accepts(states) or self.accepts(left):
            yield node, 0.0, True
        for rest in (states, left):
            if starts and DEAD not in rest and self._divides(rest):
                yield (rest,), 0.0, False
        where = Whereabouts(self._regions[vertex], vertex, vertex, internal)
        for move in world.moves(where):
            after = self.read(states, world.shown(where, move))
            if DEAD not in after and (after, move.visit.region, move.internal) != node:
                target = (after, move.visit.region, move.internal)
                yield target, self._leg(None, where.position, move.visit.region), False
