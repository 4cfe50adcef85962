"""Moves of a robot while tasks are allocated: the visits that it can make from where it is.

The team automaton of the 2022 paper (Def. 4.6) is walked, never built: a state of it is a robot, the automaton's
states so far, and the robot's `AgentState` in A = E x R. A robot's next step is a whole visit: it leaves where it is,
flies to the middle of a region, and may change its internal state there. Which region may be entered from where, what is read on the
way and what is permitted there is said by `ltlplan.systems.region_graph`, as for the exact search. Online teams make the same moves. A `RobotTask` is a
robot's share of the formula: the visits that it is given, in order, and what it shows by them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

from ltlplan.allocation import Itinerary
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import closure
from ltlplan.systems.region_graph import RegionGraph, RestPoint, Transition
from ltlplan.systems.region_labels import Location
from ltlplan.systems.visit_log import VisitLog
from verify.data import Letter, Mission, Visit, Word
from verify.data.language.sequence import Direction
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point

Key = tuple[Hashable, str, str]
"""Where a robot is, the region that it entered last, and its internal state."""


@dataclass(frozen=True, slots=True)
class AgentState:
    """State of a robot, in the world and in A = E x R.

    Attributes:
        position: m.
        inside: The regions that it is in.
        vertex: Vertex of the environment: the region that it entered last, or the start vertex.
        internal: Its internal state.
        place: The region in whose middle it is; None where it is anywhere else.
        side: The direction in which it flies through the hoop that it is in, where ways around obstacles depend on it.
        kind: What robots have in common to whom the mission is the same (`Mission.alike_as`).
    """

    position: Point
    inside: frozenset[str]
    vertex: str
    internal: str
    place: str | None = None
    side: Direction | None = None
    kind: str = ""

    @property
    def key(self) -> Key:
        """Key that distinguishes this state from the others that one robot can be in."""
        place: Hashable = self.place if self.side is None else (self.place, self.side)
        place = place or (self.position, self.inside)
        return ((place, self.kind) if self.kind else place, self.vertex, self.internal)

    def log(self) -> VisitLog:
        """Return a log of visits that begins where the robot is."""
        log = VisitLog([self.inside])
        if self.inside:
            log.stop(self.vertex if self.vertex in self.inside else min(self.inside))
        return log

    def seen_in(self, regions: frozenset[str]) -> AgentState:
        """Return the state of the robot where it is seen in some regions, or in none."""
        return replace(self, inside=regions, vertex=min(regions - self.inside, default=self.vertex), place=None, side=None)


@dataclass(frozen=True, slots=True)
class Move:
    """One visit as the next step.

    Attributes:
        visit: The region to whose middle it leads, and the actions made there.
        letters: Shown after that of free flight, if any, up to the last action.
        in_place: The robot stays where it is and only acts.
        departs: The letter of the free flight that comes first; None where the robot is in it already, or where the way leads from one
            region straight into the next.
        regions: The regions that the robot is in, one set after another.
        end: Where the robot is then, still inside.
        left: Its letter once it has left that place; None where it is not clear what it would be in.
        key: Of `end`.
        shown: All letters of the move, the leaving of where the robot is first.
    """

    visit: Visit
    letters: tuple[Letter, ...]
    in_place: bool
    departs: Letter | None = field(compare=False)
    regions: tuple[frozenset[str], ...] = field(compare=False)
    end: AgentState = field(compare=False)
    left: Letter | None = field(compare=False)
    key: Key = field(compare=False)
    shown: tuple[Letter, ...] = field(compare=False)


class World:
    """The moves of a mission's robots.

    Attributes:
        mission: Regions, environment, internal states.
        graph: Where robots can rest, and the ways between.
        known: By the key of a move the state at its end, and the letter once that place is left (see `Move.left`).
    """

    def __init__(self, mission: Mission) -> None:
        self.mission, self.graph = mission, RegionGraph(mission)
        self._views = {
            mission.alike_as(robot): mission.seen_by(robot) for robot in mission.agents
        }  # as each kind of robot sees it
        self._moves: dict[Hashable, tuple[Move, ...]] = {}
        self.known: dict[Key, tuple[AgentState, Letter | None]] = {}

    @memoized
    def graph_of(self, kind: str) -> RegionGraph:
        """Return where robots of one kind can rest, and the ways between.

        Args:
            kind: As an `AgentState` has it.
        """
        view = self._views.get(kind, self.mission)
        return self.graph if view is self.mission else RegionGraph(view, layout=self.graph.layout)

    @cached_property
    def overlaps(self) -> bool:
        """Return whether some regions may have a point in common."""
        return any(self.graph.layout.neighbours.values())

    @cached_property
    def shown(self) -> frozenset[Letter]:
        """The letters that robots show, wherever they fly from where they start."""
        layout = self.graph.layout
        sets = {frozenset[str](), *(frozenset(location.inside) for location in layout.middles.values())}
        if self.overlaps:
            points = [self._point(self.start(robot)) for robot in self.mission.agents]
            points += [point for region in self.graph.places for point in self.graph.middles(region)]
            for point in closure(points, lambda point: (way.end for way in self.graph.transitions(point))):
                sets.update((frozenset(point.location.inside), frozenset(self.graph.around(point) or ())))
                sets.update(*(way.letters or () for way in self.graph.transitions(point)))
        free = {frozenset(names) for view in self._views.values() for names in view.robot.states.values()}
        return frozenset(own | regions for own in free for regions in sets)

    def free_letter(self, internal: str, kind: str = "") -> Letter:
        """Return the letter of free flight in an internal state.

        Args:
            internal: The state.
            kind: Of which kind of robot.
        """
        return frozenset(self._views.get(kind, self.mission).robot.states[internal])

    def letter(self, where: AgentState) -> Letter:
        """Return the letter that a robot shows now."""
        return self.free_letter(where.internal, where.kind) | where.inside

    def start(self, robot: str) -> AgentState:
        """Return where a robot is at time 0."""
        agent = self.mission.agents[robot]
        internal = self.mission.initial_internal(robot)
        return self.at(agent.start, internal, vertex=agent.visited, kind=self.mission.alike_as(robot))

    def at(self, position: Point, internal: str, *, vertex: str | None = None, kind: str = "") -> AgentState:
        """Return the state of a robot at a point.

        Args:
            position: m.
            internal: Its internal state.
            vertex: The region that it visited last, if any; inside regions that is the innermost one.
            kind: Its kind.
        """
        point = self.graph_of(kind).standing(self.graph.layout.at(position), vertex)
        inside = frozenset(point.location.inside)
        return AgentState(position, inside, point.place if inside else point.entered, internal, kind=kind)

    def left(self, where: AgentState) -> Letter | None:
        """Return the letter of a robot that has left the regions where it hovers; None where it is not clear what it would be in."""
        around = self.graph_of(where.kind).around(self._point(where))
        return None if around is None else self.free_letter(where.internal, where.kind).union(around)

    def alike(self, where: AgentState) -> Hashable:
        """Return a key under which robots have the same moves: without overlaps and obstacles, wherever they hover."""
        place = (where.place or where.position, where.side) if self.overlaps or self.graph.space is not None else None
        return (where.vertex, where.internal, where.inside, place, where.kind)

    def moves(self, where: AgentState, *, first: bool = False) -> tuple[Move, ...]:
        """Return every visit that a robot can make next; a first move may also be to act where the robot already is."""
        key = self.alike(where)
        moves = self._moves.get(key)
        if moves is None:
            moves = self._moves[key] = tuple(self._onward(where))
        return (*self._acts(where), *moves) if first and where.inside else moves

    def retraced(self, where: AgentState, moves: tuple[Move, ...]) -> tuple[Move, ...] | None:
        """Return the moves that make the same visits from elsewhere; None where one cannot be made.

        Args:
            where: From where.
            moves: In order.
        """
        found: list[Move] = []
        for wanted in moves:
            every = self.moves(where, first=wanted.in_place)
            move = next((m for m in every if m.visit == wanted.visit and m.in_place == wanted.in_place), None)
            if move is None:
                return None
            found.append(move)
            where = move.end
        return tuple(found)

    def _point(self, where: AgentState) -> RestPoint:
        graph = self.graph_of(where.kind)
        layout = graph.layout
        if where.place is not None:
            return RestPoint(where.place, where.vertex, layout.middles[where.place], side=where.side)
        location = layout.at(where.position)
        if where.inside != frozenset(location.inside):  # seen elsewhere than it hovers, at a border
            location = Location(where.position, layout.outermost_first(where.inside), clear=False)
        place = location.inside[-1] if location.inside else graph.environment.start
        entered = graph.begun_in(location.inside) if len(location.inside) > 1 else None
        return RestPoint(place, entered or where.vertex, location, where.position)

    def _onward(self, where: AgentState) -> Iterator[Move]:
        point = self._point(where)
        for transition in self.graph_of(where.kind).transitions(point):
            end = transition.end
            for actions, reached in self._chains(end, where):
                there = AgentState(
                    end.location.point, frozenset(end.location.inside), end.entered, reached, end.place, end.side, where.kind
                )
                move = self._move(where, point, transition, actions, there)
                if move.letters:  # a way within the same regions shows nothing
                    yield move

    def _move(
        self, where: AgentState, point: RestPoint, transition: Transition, actions: tuple[Action, ...], there: AgentState
    ) -> Move:
        free, departs = self.free_letter(where.internal, where.kind), None
        path = [*(transition.letters or ()), there.inside]
        if transition.letters is None and where.inside:
            around = frozenset(self.graph_of(where.kind).around(point) or ())
            departs = free | around
            path.insert(0, around)
        letters = [free | regions for regions in path[departs is not None :] if regions != where.inside or departs is not None]
        letters += [there.inside | self.free_letter(action.target, where.kind) for action in actions]
        visit = Visit(region=there.place or "", actions=actions)
        return self._ended(visit, tuple(letters), departs, tuple(path), there)

    def _acts(self, where: AgentState) -> Iterator[Move]:
        point = self._point(where)
        apart = not self.graph.layout.neighbours[point.place]
        for actions, reached in self._chains(point, where):
            if actions:
                there = replace(where, internal=reached)
                if apart and self.graph.space is None:  # what follows is the same from wherever in the region it is
                    centre = self.graph.layout.regions[point.place].center
                    there = AgentState(centre, where.inside, point.place, reached, point.place, kind=where.kind)
                letters = tuple(where.inside | self.free_letter(action.target, where.kind) for action in actions)
                yield self._ended(Visit(region=point.place, actions=actions), letters, None, (), there, in_place=True)

    def _ended(
        self,
        visit: Visit,
        letters: tuple[Letter, ...],
        departs: Letter | None,
        regions: tuple[frozenset[str], ...],
        there: AgentState,
        *,
        in_place: bool = False,
    ) -> Move:
        key, left = there.key, self.left(there)
        self.known[key] = (there, left)
        shown = letters if departs is None else (departs, *letters)
        return Move(visit, letters, in_place, departs, regions, there, left, key, shown)

    def _chains(self, point: RestPoint, where: AgentState) -> Iterator[tuple[tuple[Action, ...], str]]:
        """Yield the sequences of actions that a point permits, none first, no internal state twice."""
        permitted, internal = tuple(self.graph_of(where.kind).actions(point)), where.internal
        queue: list[tuple[tuple[Action, ...], str, frozenset[str]]] = [((), internal, frozenset({internal}))]
        while queue:
            actions, state, seen = queue.pop(0)
            yield actions, state
            queue += [
                ((*actions, a), a.target, seen | {a.target}) for a in permitted if a.source == state and a.target not in seen
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
    def end(self) -> AgentState:
        """State of the robot after its last visit's actions, still inside."""
        return self.moves[-1].end if self.moves else self.where

    @property
    def ahead(self) -> tuple[Letter, ...]:
        """The letters after the present one."""
        letters = [letter for move in self.moves for letter in move.shown]
        if self.moves and self.leaves and self.moves[-1].left is not None:
            letters.append(self.moves[-1].left)
        return tuple(letters)

    def itinerary(self, world: World) -> Itinerary:
        """Return what the robot does, with the word that it shows; one that begins inside regions begins with visits of them."""
        log = self.where.log()
        for move in self.moves:
            for regions in move.regions:
                log.enter(regions)
            if not move.in_place:
                log.stop(move.visit.region)
            for action in move.visit.actions:
                log.act(action)
        if self.moves and self.leaves and (left := self.moves[-1].left) is not None:
            log.enter(left & self.end.inside)
        word = Word((world.letter(self.where), *self.ahead)).compressed()
        return Itinerary(log.visits, word, stops=log.stops)
