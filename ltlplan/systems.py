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
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from verify.data import BadInput, Letter, Mission, Visit, Word
from verify.data.mission import Action, Point, Region

if TYPE_CHECKING:
    import networkx

Cost = Callable[[str, "Point | str", str], float]
"""(robot, from a position or region, to a region) -> cost of that leg."""


@dataclass(frozen=True, slots=True)
class Node:
    """A state of A.

    Attributes:
        place: The region that the robot is in or has just left; the environment's start vertex before any.
        flying: Whether it is in free flight rather than in the region.
        internal: Its internal state.
        position: Where it stands if that is not the region's centre (its start or its end), m.
    """

    place: str
    flying: bool
    internal: str
    position: Point | None = None


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
        start = "start" if "start" not in regions else "start_"
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

    Raises:
        BadInput: Regions overlap in a way that no plan can be made over.
    """

    def __init__(self, mission: Mission, cost: Cost | None = None) -> None:
        self.mission = mission
        self.environment = environment_of(mission)
        self.cost = cost
        self._regions = mission.all_regions
        self._internal = {state: frozenset(names) for state, names in mission.robot.states.items()}
        self._centres = {name: np.array(region.center) for name, region in self._regions.items()}
        _refuse_overlaps(mission)
        self._base: dict[str, _Builder] = {}

    def of(self, robot: str) -> TransitionSystem:
        """Return A of one robot."""
        agent = self.mission.agents[robot]
        shared = self._base.get("" if self.cost is None else robot)
        if shared is None:
            shared = self._shared(robot)
            self._base["" if self.cost is None else robot] = shared
        builder = shared.copy()
        initial = self._add_start(builder, robot, agent.start)
        if agent.end is not None:
            self._add_end(builder, agent.end)
        return TransitionSystem(
            tuple(builder.labels),
            tuple(map(tuple, builder.edges)),
            initial,
            dict(builder.final),
            tuple(builder.nodes),
            robot,
            self.mission.robot.actions,
        )

    def leg(self, robot: str, start: Point | str, region: str) -> float:
        """Return the cost of one leg to a region."""
        if self.cost is not None:
            value = float(self.cost(robot, start, region))
            if not value >= 0:
                raise BadInput(f"The cost of {robot}'s leg from {start} to {region} is {value}; costs must not be negative.")
            return value
        if start == region:  # out of the region and back
            return 2 * min(self._regions[region].radii)
        origin = self._centres[start] if isinstance(start, str) else np.array(start)
        return float(math.dist(origin, self._centres[region]))

    def _shared(self, robot: str) -> _Builder:
        builder = _Builder()
        for region in self._regions:
            hoop = region in self.mission.hoops
            for internal, names in self._internal.items():
                builder.add(Node(region, False, internal), frozenset({region}) | names, _HOOP_STAY if hoop else 0.0)
                builder.add(Node(region, True, internal), names, 0.0 if hoop else _REGION_LEAVE)
        for region, targets in self.environment.successors.items():
            if region in self._regions:
                for target in targets:
                    cost = self.leg(robot, region, target)
                    for internal in self._internal:
                        builder.join(Node(region, True, internal), Node(target, False, internal), cost)
                for internal in self._internal:
                    builder.join(Node(region, False, internal), Node(region, True, internal), 0.0)
        for action in self.mission.robot.actions:
            builder.join(Node(action.at, False, action.source), Node(action.at, False, action.target), 0.0)
        return builder

    def _add_start(self, builder: _Builder, robot: str, start: Point) -> int:
        inside = [name for name, region in self._regions.items() if float(region.level(np.array(start))) <= 1.0]
        initial = self.mission.robot.initial
        if not inside:
            node = Node(self.environment.start, True, initial, start)
            builder.add(node, self._internal[initial], 0.0)
            for target in self.environment.successors[self.environment.start]:
                builder.join(node, Node(target, False, initial), self.leg(robot, start, target))
            return builder.index[node]
        region = inside[0]
        reachable = [initial]
        for state in reachable:  # grows while it is walked
            found = [a.target for a in self.mission.robot.actions if a.at == region and a.source == state]
            reachable += [target for target in found if target not in reachable]
        for state in reachable:
            builder.add(Node(region, False, state, start), frozenset({region}) | self._internal[state], 0.0)
            builder.add(Node(region, True, state, start), self._internal[state], _REGION_LEAVE)
            builder.join(Node(region, False, state, start), Node(region, True, state, start), 0.0)
            for target in self.environment.successors[region]:
                cost = self.leg(robot, region if target == region else start, target)
                builder.join(Node(region, True, state, start), Node(target, False, state), cost)
        for action in self.mission.robot.actions:
            if action.at == region and action.source in reachable:
                builder.join(Node(region, False, action.source, start), Node(region, False, action.target, start), 0.0)
        return builder.index[Node(region, False, initial, start)]

    def _add_end(self, builder: _Builder, end: Point) -> None:
        """Make the end point the only place to finish at; its leg is a straight line."""
        inside = [name for name, region in self._regions.items() if float(region.level(np.array(end))) <= 1.0]
        existing = list(builder.nodes)
        builder.final.clear()
        for node in existing:
            origin = node.position if node.position is not None else self._regions[node.place].center
            cost = math.dist(origin, end)
            if inside:
                if node.place == inside[0] and not node.flying:
                    cost = math.dist(origin, end)
                elif not node.flying or inside[0] not in self.environment.successors[node.place]:
                    continue
                goal = Node(inside[0], False, node.internal, end)
                label = frozenset({inside[0]}) | self._internal[node.internal]
            elif node.flying:
                goal = Node(self.environment.start, True, node.internal, end)
                label = self._internal[node.internal]
            else:
                continue
            if goal not in builder.index:
                builder.add(goal, label, 0.0)
            builder.join(node, goal, cost)


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
        BadInput: An unknown region, an action that its region or the internal state does not permit, a robot that starts
            inside a region without visiting it.
    """
    regions = mission.all_regions
    start = np.array(mission.agents[agent].start)
    inside = frozenset(name for name, region in regions.items() if float(region.level(start)) <= 1.0)
    state = mission.robot.initial
    letters: list[Letter] = []
    entry: list[int] = []  # index of each visit's first letter
    for index, visit in enumerate(visits):
        if visit.region not in regions:
            raise BadInput(f"{agent}, visit {index}: '{visit.region}' is not a region of the mission.")
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
        return Word(tuple(_merged(letters))) if cycle_visit is None else Word(tuple(_merged(letters)[:-1]), (letters[-1],))
    letters.append(free)  # on the way back to the cycle's first visit
    cut = entry[cycle_visit]
    return Word(tuple(_merged(letters[:cut])), tuple(_merged(letters[cut:])))


def _merged(letters: Iterable[Letter]) -> list[Letter]:
    """Return letters without immediate repetitions."""
    result: list[Letter] = []
    for letter in letters:
        if not result or result[-1] != letter:
            result.append(letter)
    return result


_HOOP_STAY = 2e-9  # ties are broken in favour of flying out of hoops and staying in plain regions
_REGION_LEAVE = 1e-9


class _Builder:
    """A transition system while it is put together."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.index: dict[Node, int] = {}
        self.labels: list[Letter] = []
        self.edges: list[list[tuple[int, float]] | tuple[tuple[int, float], ...]] = []
        self.final: dict[int, float] = {}

    def add(self, node: Node, label: Letter, preference: float) -> None:
        self.index[node] = len(self.nodes)
        self.final[len(self.nodes)] = preference
        self.nodes.append(node)
        self.labels.append(label)
        self.edges.append([])

    def join(self, source: Node, target: Node, cost: float) -> None:
        at = self.index[source]
        self.edges[at] = [*self.edges[at], (self.index[target], cost)]

    def copy(self) -> _Builder:
        other = _Builder()
        other.nodes, other.index, other.labels = list(self.nodes), dict(self.index), list(self.labels)
        other.edges, other.final = list(self.edges), dict(self.final)
        return other


def _refuse_overlaps(mission: Mission) -> None:
    """Refuse regions that may have a common point, until plans can be made over them."""
    regions = mission.all_regions
    pairs = [
        f"'{a}' and '{b}'" for (a, one), (b, other) in itertools.combinations(regions.items(), 2) if not _apart(one, other)
    ]
    if pairs:
        raise BadInput(f"These regions overlap, and no plan can be made over their letters: {', '.join(pairs)}.")


def _apart(one: Region, other: Region) -> bool:
    """Tell whether two ellipsoids have no common point for sure (floats, with room to spare)."""
    between = np.array(other.center) - np.array(one.center)
    if float(np.linalg.norm(between)) > (max(one.radii) + max(other.radii)) * (1 + 1e-9):
        return True
    first, second = np.linalg.inv(one.shape), np.linalg.inv(other.shape)
    # apart if and only if, for some share s, between' (first / (1 - s) + second / s)^-1 between > 1
    shares = np.linspace(0.0, 1.0, 201)[1:-1, None, None]
    sums = first / (1 - shares) + second / shares
    levels = np.einsum("i,kij,j->k", between, np.linalg.inv(sums), between)
    return bool(np.max(levels) > 1 + 1e-9)
