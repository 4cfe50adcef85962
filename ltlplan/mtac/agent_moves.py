"""What a robot can do next while a formula is shared: where it is, the visits that it can make, the tasks that it is given.

The team automaton of the 2022 paper (Def. 4.6) is walked, never built: a state of it is a robot, the automaton's
states so far, and the robot's `AgentState` in A = E x R. A robot's next step is a whole visit: it leaves where it is,
enters a region, and may change its internal state there. Since the states are a set, the same walk serves before
take-off (one state) and in flight (all states that the readings so far may have led to, see `sharing.belief`).
"""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ltlplan.systems.transition_systems import Environment, environment_of
from verify.data import BadInput, Letter, Mission, Visit
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point

State = Hashable
"""A state of the automaton, its dead state included."""

States = frozenset[State]


class Accepting(Protocol):
    """What sharing needs of an automaton; `ltlplan.translate` returns one."""

    @property
    def initial(self) -> Hashable: ...  # noqa: D102

    @property
    def accepting(self) -> Container[Any]: ...  # noqa: D102  # of any type: each automaton has states of its own

    def successor(self, state: Any, letter: Letter, /) -> Hashable: ...  # noqa: D102  # of any type: likewise


@dataclass(frozen=True, slots=True)
class AgentState:
    """Where a robot is, in the world and in A = E x R.

    Attributes:
        position: m.
        inside: The regions that it is in.
        vertex: Vertex of the environment: the region that it visited last, or the start vertex.
        internal: Its internal state.
    """

    position: Point
    inside: frozenset[str]
    vertex: str
    internal: str

    def seen_in(self, regions: frozenset[str]) -> AgentState:
        """Return the state of the robot where it is seen in some regions, or in none."""
        entered = regions - self.inside
        return replace(self, inside=regions, vertex=min(entered, default=self.vertex))


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
    def environment(self) -> Environment:
        """Which regions can be visited after each vertex; coming back to the region just left is always allowed."""
        return environment_of(self.mission)

    @cached_property
    def neighbours(self) -> dict[str, tuple[str, ...]]:
        """The environment's successors, in the order in which the mission lists regions."""
        place = {region: index for index, region in enumerate(self.mission.all_regions)}
        every = self.environment.successors
        ordered = {id(nexts): tuple(sorted(nexts, key=place.__getitem__)) for nexts in every.values()}  # often one for all
        return {vertex: ordered[id(nexts)] for vertex, nexts in every.items()}

    @cached_property
    def _moves(self) -> dict[tuple[str, str], tuple[Move, ...]]:
        return {}

    def free_letter(self, internal: str) -> Letter:
        """Return the letter of free flight in an internal state."""
        return frozenset(self.mission.robot.states[internal])

    def letter(self, where: AgentState) -> Letter:
        """Return the letter that a robot shows now."""
        return self.free_letter(where.internal) | where.inside

    def start(self, robot: str) -> AgentState:
        """Return where a robot is at time 0.

        Raises:
            BadInput: It starts in two regions at once.
        """
        agent = self.mission.agents[robot]
        return self.at(agent.start, self.mission.initial_internal(robot), vertex=agent.visited, where=f"{robot} starts")

    def at(self, position: Point, internal: str, *, vertex: str | None = None, where: str = "the robot is") -> AgentState:
        """Return the state of a robot at a point.

        Args:
            position: m.
            internal: Its internal state.
            vertex: The region that it visited last, if any.
            where: Begins the sentence of a refusal.

        Raises:
            BadInput: The point lies in two regions at once.
        """
        inside = self._holding(position)
        if len(inside) > 1:
            raise BadInput(f"{where} in {' and '.join(inside)} at once; these regions overlap there.")
        if inside:
            return AgentState(position, frozenset(inside), inside[0], internal)
        return AgentState(position, frozenset(), self.environment.start if vertex is None else vertex, internal)

    def start_in_overlap(self) -> str | None:
        """Return a sentence about the first robot that starts in several regions at once, where moves are not known; or None."""
        for robot, agent in self.mission.agents.items():
            inside = self._holding(agent.start)
            if len(inside) > 1:
                return f"{robot} starts in {' and '.join(inside)} at once"
        return None

    def _holding(self, position: Point) -> list[str]:
        """Return the regions that hold a point, in the mission's order."""
        return [n for n, r in self.mission.all_regions.items() if float(r.level(np.array(position))) <= 1.0]

    def regions_at(self, positions: NDArray[np.float64]) -> list[frozenset[str]]:
        """Return the regions that each point is in. Shape (n, 3)."""
        names = list(self.mission.all_regions)
        if not names:
            return [frozenset()] * len(positions)
        centres, shapes = self._shapes
        offset = positions[:, None] - centres
        inside = np.einsum("nri,rij,nrj->nr", offset, shapes, offset) <= 1.0
        return [frozenset(names[k] for k in np.flatnonzero(row)) for row in inside]

    @cached_property
    def _shapes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        regions = self.mission.all_regions.values()
        return np.array([region.center for region in regions]), np.array([region.shape for region in regions])

    def moves(self, where: AgentState, *, first: bool = False) -> tuple[Move, ...]:
        """Return every visit that a robot can make next; a first move may also be to act where the robot already is."""
        key = (where.vertex, where.internal)
        if key not in self._moves:
            self._moves[key] = tuple(self._all_moves(*key))
        if not first or not where.inside:
            return self._moves[key]
        acts = [
            Move(
                Visit(region=region, actions=actions),
                tuple(where.inside | self.free_letter(a.target) for a in actions),
                reached,
                True,
            )
            for region in sorted(where.inside)
            for actions, reached in self._chains(region, where.internal)
            if actions
        ]
        return (*acts, *self._moves[key])

    def after(self, move: Move) -> AgentState:
        """Return where a robot is once it has made its visit's last action, still inside."""
        region = move.visit.region
        return AgentState(self.mission.all_regions[region].center, frozenset({region}), region, move.internal)

    def shown(self, where: AgentState, move: Move) -> tuple[Letter, ...]:
        """Return the letters of a move, the leaving of the region where the robot is first."""
        if not where.inside or move.in_place:
            return move.letters
        return (self.free_letter(where.internal), *move.letters)

    def _all_moves(self, vertex: str, internal: str) -> Iterator[Move]:
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
class RobotTask:
    """A robot's share of the formula as visits, from where it is; MTAC-E walks and hands over tasks.

    Attributes:
        where: Where it begins.
        moves: Its visits, in order.
        leaves: Whether it flies out of the last region; False where the formula wants it to end inside.
    """

    where: AgentState
    moves: tuple[Move, ...] = ()
    leaves: bool = True

    @property
    def visits(self) -> tuple[Visit, ...]:
        """Regions and actions; a robot that begins inside a region begins with a visit of it."""
        visits = tuple(move.visit for move in self.moves)
        if not self.where.inside or (self.moves and self.moves[0].in_place):
            return visits
        return (*(Visit(region=region) for region in sorted(self.where.inside)), *visits)

    def then(self, move: Move, leaves: bool) -> RobotTask:
        """Return the task with one more visit."""
        return replace(self, moves=(*self.moves, move), leaves=leaves)

    def end(self, world: World) -> AgentState:
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
