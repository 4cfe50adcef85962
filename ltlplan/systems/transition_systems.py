"""What one robot can do, step by step: the transition systems R, E and A = E x R of the 2022 paper (Defs. 4.1 to 4.3).

A node of A is a place and an internal state, and shows one letter. A place is a region that the robot is in, or free
flight after leaving one (or after the start). Free flight is a place and a letter of its own, so a plan is made over
exactly the letters that are flown: from region a to region b a robot shows {a}, {}, {b}.

How words, visits and nodes belong together:

* A robot that starts inside a region begins with a visit of it; that visit is listed first, idle robots included.
* Flying to a region adds free flight and then the region; an action adds the region with the new internal propositions.
* At its end a robot stays in a plain region that it visited last, and has flown out of a hoop; where the formula needs
  the other choice, the last letter of the word says so.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ltlplan.systems.region_labels import Layout, Location
from verify.data import BadInput, Letter, Mission, Visit, Word
from verify.data.mission import Action, Agent, Point
from verify.data.word import stutter_free

if TYPE_CHECKING:
    import networkx

Cost = Callable[[str, "Point | str", str], float]
"""(robot, from a position or region, to a region) -> cost of that leg."""


@dataclass(frozen=True, slots=True)
class Node:
    """A state of A.

    Attributes:
        place: The region that the robot is in the middle of, has just left or is on the way to; the environment's start
            vertex before any.
        flying: Whether it is on its way rather than in the middle of its place.
        internal: Its internal state.
        regions: The regions that it is in.
        entered: The region that it entered last, or the start vertex: where its next edge of the environment begins.
        position: Where it stands if that is not the middle of its place (its start or its end), m.
        leg: Where it comes from and how many letters ago, on a way past several borders.
    """

    place: str
    flying: bool
    internal: str
    regions: frozenset[str]
    entered: str
    position: Point | None = None
    leg: tuple[str, str, int] | None = None


@dataclass(frozen=True, eq=False)
class TransitionSystem:
    """A labelled graph with costs: one robot's possible behaviour.

    Attributes:
        labels: The letter that each node shows.
        edges: For each node, pairs (target, cost); costs are not negative.
        initial: Where it begins.
        final: Nodes where it may end, each with a tiny preference that breaks ties; None: anywhere.
        nodes: What the nodes mean, where they come from a mission; otherwise empty.
        robot: Whose behaviour it is.
        actions: The actions that change internal states, where they come from a mission.
    """

    labels: tuple[Letter, ...]
    edges: tuple[tuple[tuple[int, float], ...], ...]
    initial: int = 0
    final: dict[int, float] | None = None
    nodes: tuple[Node, ...] = field(default=(), repr=False)
    robot: str = ""
    actions: tuple[Action, ...] = ()

    def __post_init__(self) -> None:
        size = len(self.labels)
        if len(self.edges) != size or not 0 <= self.initial < size:
            raise BadInput(
                f"A transition system needs one list of edges for each of its {size} labels and a start among them; "
                f"it has {len(self.edges)} lists and starts at {self.initial}."
            )

    def to_networkx(self) -> networkx.DiGraph[int]:
        """Return the graph; nodes carry `label` (sorted names), `initial` and, for a mission, `place`, `flying`, `internal`."""
        import networkx

        graph: networkx.DiGraph[int] = networkx.DiGraph(robot=self.robot)
        for index, label in enumerate(self.labels):
            graph.add_node(index, label=sorted(label), initial=index == self.initial)
            if self.nodes:
                node = self.nodes[index]
                graph.nodes[index].update(place=node.place, flying=node.flying, internal=node.internal)
        for source, edges in enumerate(self.edges):
            for target, cost in edges:
                if not graph.has_edge(source, target) or graph.edges[source, target]["cost"] > cost:
                    graph.add_edge(source, target, cost=cost)
        return graph


@dataclass(frozen=True, slots=True)
class Environment:
    """Where robots can go: E of Def. 4.2.

    Attributes:
        start: The vertex of a robot that begins in free flight.
        successors: For each vertex, the regions that can be visited next; coming back to the region just left is allowed.
    """

    start: str
    successors: dict[str, tuple[str, ...]]

    def to_networkx(self) -> networkx.DiGraph[str]:
        """Return the graph, without the returns to the region just left."""
        import networkx

        graph: networkx.DiGraph[str] = networkx.DiGraph()
        graph.add_nodes_from(self.successors)
        graph.add_edges_from((a, b) for a, targets in self.successors.items() for b in targets if a != b)
        return graph


def environment_of(mission: Mission) -> Environment:
    """Return E: the mission's edges, or all of them where it gives none."""
    regions = tuple(mission.all_regions)
    given = mission.environment
    if given is None:
        start = next(name for name in ("start", *(f"start{i}" for i in range(len(regions) + 1))) if name not in regions)
        return Environment(start, {start: regions, **dict.fromkeys(regions, regions)})
    reach: dict[str, dict[str, None]] = {given.start: {}, **{region: {region: None} for region in regions}}
    for a, b in given.edges:
        reach[a][b] = None
        if not given.directed:
            reach[b][a] = None
    return Environment(given.start, {v: tuple(u for u in targets if u != given.start) for v, targets in reach.items()})


def robot_graph(mission: Mission) -> networkx.MultiDiGraph[str]:
    """Return R of Def. 4.1: internal states with their propositions, actions with the region that permits them."""
    import networkx

    graph: networkx.MultiDiGraph[str] = networkx.MultiDiGraph()
    for state, names in mission.robot.states.items():
        graph.add_node(state, propositions=sorted(names), initial=state == mission.robot.initial)
    for action in mission.robot.actions:
        graph.add_edge(action.source, action.target, at=action.at)
    return graph


class Systems:
    """A for every robot of a mission. What all robots share is made once.

    Args:
        mission: Whose regions and robots.
        cost: Costs of legs; straight lines where None.
        places: Regions that robots may visit; all of them where None. The others are there, but nobody points at them.
        layout: How the mission's regions lie, where that is known already.
    """

    def __init__(
        self,
        mission: Mission,
        cost: Cost | None = None,
        *,
        places: Collection[str] | None = None,
        layout: Layout | None = None,
    ) -> None:
        self.mission = mission
        self.environment = environment_of(mission)
        self.layout = layout or Layout(mission)
        self.cost = cost
        self._regions = mission.all_regions
        self._internal = {state: frozenset(names) for state, names in mission.robot.states.items()}
        self._places = {
            name: location
            for name, location in self.layout.middles.items()
            if location.clear and (places is None or name in places)
        }
        self._around = {region: self.layout.around(region) for region in self._regions}
        self._holding: dict[str, list[str]] = {region: [] for region in self._regions}
        """For each region, the places whose middle lies in it."""
        for name, location in self._places.items():
            for region in location.inside:
                self._holding[region].append(name)
        self._order = {name: index for index, name in enumerate(self._places)}
        sets = {id(regions): frozenset(regions) for regions in self.environment.successors.values()}
        self._next = {vertex: sets[id(regions)] for vertex, regions in self.environment.successors.items()}
        self._base: dict[str, _Builder] = {}

    def of(self, robot: str) -> TransitionSystem:
        """Return A of one robot.

        Raises:
            BadInput: It starts, or should end, too near the border of a region; a cost is negative or no number.
        """
        agent = self.mission.agents[robot]
        shared = self._base.get("" if self.cost is None else robot)
        if shared is None:
            shared = self._base["" if self.cost is None else robot] = self._shared(robot)
        builder = shared.copy()
        initial = self._add_start(builder, robot, agent)
        if agent.end is not None:
            self._add_end(builder, robot, agent.end)
        return TransitionSystem(
            tuple(builder.labels),
            tuple(map(tuple, builder.edges)),
            initial,
            dict(builder.final),
            tuple(builder.nodes),
            robot,
            self.mission.robot.actions,
        )

    def unclear(self) -> tuple[str, ...]:
        """Return a sentence for each region that no plan can visit, because its middle lies on the border of another."""
        return tuple(
            f"The middle of '{name}' lies within the margin {self.layout.slack:g} m of another region's border, so it cannot "
            "be visited for sure."
            for name, location in self.layout.middles.items()
            if not location.clear
        )

    def leg(self, robot: str, start: Point | str, region: str) -> float:
        """Return the cost of one leg to a region."""
        if self.cost is not None:
            value = float(self.cost(robot, start, region))
            if not 0 <= value < math.inf:
                raise BadInput(f"The cost of {robot}'s leg from {start} to {region} is {value}; it must be a number >= 0.")
            return value
        if start == region:  # out of the region and back
            return 2 * self._regions[region].inner_radius
        origin = self._regions[start].center if isinstance(start, str) else start
        return math.dist(origin, self._regions[region].center)

    def _shared(self, robot: str) -> _Builder:
        """Return the part of A that does not depend on where a robot starts."""
        builder = _Builder()
        points = [_RestPoint(region, region, location) for region, location in self._places.items()]
        self._grow(builder, robot, points)
        return builder

    def _add_start(self, builder: _Builder, robot: str, agent: Agent) -> int:
        start, location = agent.start, self.layout.at(agent.start)
        if not location.clear:
            raise BadInput(f"{robot} starts within the margin {self.layout.slack:g} m of a region's border.")
        place = location.inside[-1] if location.inside else self.environment.start
        entered = place if location.inside else agent.visited or place
        self._grow(builder, robot, [_RestPoint(place, entered, location, start)])
        at = Node(place, not location.inside, self.mission.initial_internal(robot), frozenset(location.inside), entered, start)
        return builder.index[at]

    def _grow(self, builder: _Builder, robot: str, points: list[_RestPoint]) -> None:
        """Add points, all ways on from them, and all points that these lead to."""
        waiting = [point for point in points if point not in builder.points]
        for point in waiting:
            self._add_rest_point(builder, point)
        for point in waiting:  # grows while it is walked
            for transition in self._transitions(point):
                if transition.end not in builder.points:
                    waiting.append(transition.end)
                    self._add_rest_point(builder, transition.end)
                self._add_transition(builder, robot, point, transition)

    def _add_rest_point(self, builder: _Builder, point: _RestPoint) -> None:
        """Add the nodes of a robot at a point, and in the free flight after it where that is clear."""
        builder.points.add(point)
        around = self._around_rest_point(point)
        flies_on = point.place in self.mission.hoops and point.position is None
        for internal in self._internal:
            here = self._here(point, internal)
            builder.add(here, self._label(here), _HOOP_STAY if flies_on else 0.0)
            if around is not None and not here.flying:
                gone = self._gone(point, internal)
                builder.add(gone, self._label(gone), 0.0 if flies_on else _REGION_LEAVE)
                builder.join(here, gone, 0.0)
        for action in self.mission.robot.actions:
            if action.at in point.location.inside:
                builder.join(self._here(point, action.source), self._here(point, action.target), 0.0)

    def _add_transition(self, builder: _Builder, robot: str, point: _RestPoint, transition: _Transition) -> None:
        again = transition.end.place == point.place
        cost = self.leg(robot, point.place if point.position is None or again else point.position, transition.end.place)
        for internal in self._internal:
            previous, goal, due = self._here(point, internal), self._here(transition.end, internal), cost
            if transition.letters is None:
                previous = self._gone(point, internal)
            for step, letter in enumerate(transition.letters or ()):
                leg = (point.place, point.entered, step)
                on = Node(transition.end.place, True, internal, letter, transition.end.entered, point.position, leg)
                if on not in builder.index:
                    builder.add(on, self._label(on), None)
                builder.join(previous, on, due)
                previous, due = on, 0.0
            builder.join(previous, goal, due)

    def _transitions(self, point: _RestPoint) -> Iterator[_Transition]:
        """Yield every way on from a point."""
        around = self._around_rest_point(point)
        for target in self._targets(point):
            location = self._places[target]
            outside = tuple(name for name in location.inside if name != target)
            start, letters = frozenset(point.location.inside), None
            if around is not None and around == outside and (self._around[target] is not None or not outside):
                start = frozenset(around)
                path: tuple[Letter, ...] = (start, frozenset(location.inside))
            elif target == point.place:
                continue
            else:
                found = self.layout.way(point.location, location)
                if found is None:
                    continue
                path, letters = found, found[1:-1]
            entered = self._last_entered(point.entered, path)
            if entered is not None:
                yield _Transition(_RestPoint(target, entered, location), letters)

    def _targets(self, point: _RestPoint) -> list[str]:
        """Return the places to which there may be a way: an edge leads into them, or nothing new is entered on the way."""
        reached = {place for region in self._next[point.entered] for place in self._holding[region]}
        reached.update(place for region in point.location.inside for place in self._holding[region])
        return sorted(reached, key=self._order.__getitem__)

    def _last_entered(self, entered: str, path: Sequence[Letter]) -> str | None:
        """Return the region entered last on a path, or None where an edge for it is missing."""
        for before, after in itertools.pairwise(path):
            for region in after - before:  # one at most: borders are passed one by one
                if region not in self._next[entered]:
                    return None
                entered = region
        return entered

    def _around_rest_point(self, point: _RestPoint) -> tuple[str, ...] | None:
        if not point.location.inside:
            return ()
        return self._around[point.place] if len(point.location.inside) == len(self.layout.middles[point.place].inside) else None

    def _here(self, point: _RestPoint, internal: str) -> Node:
        return Node(
            point.place, not point.location.inside, internal, frozenset(point.location.inside), point.entered, point.position
        )

    def _gone(self, point: _RestPoint, internal: str) -> Node:
        return Node(point.place, True, internal, frozenset(self._around_rest_point(point) or ()), point.entered, point.position)

    def _label(self, node: Node) -> Letter:
        return node.regions | self._internal[node.internal]

    def _add_end(self, builder: _Builder, robot: str, end: Point) -> None:
        """Make the end point the only place to finish at; the way there is a straight line."""
        location = self.layout.at(end)
        if not location.clear:
            raise BadInput(f"{robot} should end within the margin {self.layout.slack:g} m of a region's border.")
        builder.final.clear()
        for node in list(builder.nodes):
            if node.leg is not None:
                continue
            origin = node.position if node.position is not None else self._regions[node.place].center
            if node.regions == frozenset(location.inside):
                entered: str | None = node.entered
            elif node.flying and len(location.inside) == 1 and not node.regions:
                entered = self._last_entered(node.entered, (node.regions, frozenset(location.inside)))
            else:
                entered = None
            if entered is not None:
                place = location.inside[-1] if location.inside else self.environment.start
                goal = Node(place, not location.inside, node.internal, frozenset(location.inside), entered, end)
                if goal not in builder.index:
                    builder.add(goal, self._label(goal), 0.0)
                if goal != node:
                    builder.join(node, goal, math.dist(origin, end))
                builder.final[builder.index[goal]] = 0.0


@dataclass(frozen=True, slots=True)
class _RestPoint:
    """Where a robot can be at rest: the middle of a region, or its start.

    Attributes:
        place: The region, or the environment's start vertex.
        entered: The region entered last.
        location: The point and the regions around it.
        position: The point, for a start.
    """

    place: str
    entered: str
    location: Location
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class _Transition:
    """The way to the next point; `letters` are the regions in between, or None for the free flight after the last point."""

    end: _RestPoint
    letters: tuple[Letter, ...] | None


def word_of(
    mission: Mission, agent: str, visits: Sequence[Visit], cycle_visit: int | None = None, *, stays: bool | None = None
) -> Word:
    """Return the word that a robot shows when it makes these visits, free flight included.

    Args:
        mission: Whose regions, start and internal states.
        agent: The robot's name.
        visits: In flight order. A robot that starts inside a region has that visit first.
        cycle_visit: Index of the first visit of the cycle, for a lasso; the number of visits where the cycle is a hover.
        stays: Whether the robot ends inside the region that it visited last; by default in a plain region, but not in a hoop.
            For a lasso: whether a hover is in that region.

    Raises:
        BadInput: An unknown region, one whose middle lies in another, an action that its region or the internal state does not
            permit, a robot that starts inside a region without visiting it.
    """
    regions = mission.all_regions
    start = np.array(mission.agents[agent].start)
    inside = frozenset(name for name, region in regions.items() if float(region.level(start)) <= 1.0)
    state = mission.initial_internal(agent)
    letters: list[Letter] = []
    entry: list[int] = []  # index of each visit's first letter
    for index, visit in enumerate(visits):
        if visit.region not in regions:
            raise BadInput(f"{agent}, visit {index}: '{visit.region}' is not a region of the mission.")
        shared = sorted(
            n for n, r in regions.items() if n != visit.region and float(r.level(np.array(regions[visit.region].center))) <= 1
        )
        if shared:
            raise BadInput(
                f"{agent}, visit {index}: the middle of '{visit.region}' also lies in {', '.join(shared)}, so the visits alone do "
                "not give the word; use the word of the planner's itinerary."
            )
        if index or not inside:
            letters.append(frozenset(mission.robot.states[state]))
        elif visit.region not in inside:
            raise BadInput(f"{agent} starts inside {', '.join(sorted(inside))}; its first visit must be that region.")
        entry.append(len(letters))
        letters.append(frozenset({visit.region, *mission.robot.states[state]}))
        for action in visit.actions:
            if action.at != visit.region or action.source != state or action not in mission.robot.actions:
                raise BadInput(
                    f"{agent}, visit {index}: the action {action.source} -> {action.target} at {action.at} is not possible "
                    f"in {visit.region} with internal state {state}."
                )
            state = action.target
            letters.append(frozenset({visit.region, *mission.robot.states[state]}))
    free = frozenset(mission.robot.states[state])
    if not visits:
        if inside:
            raise BadInput(f"{agent} starts inside {', '.join(sorted(inside))}; its first visit must be that region.")
        letters.append(free)
    if stays is None:
        stays = bool(visits) and visits[-1].region not in mission.hoops
    if cycle_visit is None or cycle_visit == len(visits):
        if visits and not stays:
            letters.append(free)
        return Word(stutter_free(letters)) if cycle_visit is None else Word(stutter_free(letters)[:-1], (letters[-1],))
    letters.append(free)  # on the way back to the cycle's first visit
    cut = entry[cycle_visit]
    return Word(stutter_free(letters[:cut]), stutter_free(letters[cut:]))


_HOOP_STAY = 2e-9  # ties are broken in favour of flying out of hoops and staying in plain regions
_REGION_LEAVE = 1e-9


class _Builder:
    """A transition system while it is put together."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.index: dict[Node, int] = {}
        self.labels: list[Letter] = []
        self.edges: list[list[tuple[int, float]]] = []
        self.final: dict[int, float] = {}
        self.points: set[_RestPoint] = set()

    def add(self, node: Node, label: Letter, preference: float | None) -> None:
        self.index[node] = len(self.nodes)
        if preference is not None:
            self.final[len(self.nodes)] = preference
        self.nodes.append(node)
        self.labels.append(label)
        self.edges.append([])

    def join(self, source: Node, target: Node, cost: float) -> None:
        self.edges[self.index[source]].append((self.index[target], cost))

    def copy(self) -> _Builder:
        other = _Builder()
        other.nodes, other.index, other.labels = list(self.nodes), dict(self.index), list(self.labels)
        other.edges, other.final, other.points = [list(edges) for edges in self.edges], dict(self.final), set(self.points)
        return other
