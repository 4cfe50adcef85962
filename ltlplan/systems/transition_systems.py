"""Transition systems of one robot, step by step: R, E and A = E x R of the 2022 paper (Defs. 4.1 to 4.3).

A node of A is a place and an internal state, and shows one letter. A place is a region that the robot is in, or free
flight after leaving one (or after the start). Free flight is a place and a letter of its own, so a plan is made over
exactly the letters that are flown: from region a to region b a robot shows {a}, {}, {b}.

A of a mission's robots is laid out in `robot_systems`; here are the values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from verify.data import BadInput, Letter, Mission
from verify.data.language.sequence import Direction
from verify.data.sections import Action
from verify.data.shapes.inequalities import Point

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
        sides: The directions in which the hoop that it is in, and the one that it is on the way to, are flown through, where ways
            around obstacles depend on them.
    """

    place: str
    flying: bool
    internal: str
    regions: frozenset[str]
    entered: str
    position: Point | None = None
    leg: tuple[str, str, int] | None = None
    sides: tuple[Direction | None, Direction | None] = (None, None)


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
        walls: For each node at a wall that two rooms share, where neither of them holds a robot for sure: the room that is left,
            and the one that is entered.
    """

    labels: tuple[Letter, ...]
    edges: tuple[tuple[tuple[int, float], ...], ...]
    initial: int = 0
    final: dict[int, float] | None = None
    nodes: tuple[Node, ...] = field(default=(), repr=False)
    robot: str = ""
    actions: tuple[Action, ...] = ()
    walls: Mapping[int, tuple[str, str]] = field(default_factory=dict[int, tuple[str, str]], repr=False)

    def __post_init__(self) -> None:
        size = len(self.labels)
        if len(self.edges) != size or not 0 <= self.initial < size:
            raise BadInput(
                f"A transition system needs one list of edges for each of its {size} labels and a start among them; "
                f"it has {len(self.edges)} lists and starts at {self.initial}."
            )

    def ending(self, node: int) -> float | None:
        """Return what it costs to end at a node, a tiny preference; None where it may not."""
        return 0.0 if self.final is None else self.final.get(node)

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
    """Environment of the robots: E of Def. 4.2.

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
    for a, b in given.pairs:
        reach[a][b] = None
        if not given.directed:
            reach[b][a] = None
    return Environment(given.start, {v: tuple(u for u in targets if u != given.start) for v, targets in reach.items()})


def robot_graph(mission: Mission) -> networkx.MultiDiGraph[str]:
    """Return R of Def. 4.1, of the mission's first agent: internal states with their propositions, actions with their regions."""
    import networkx

    graph: networkx.MultiDiGraph[str] = networkx.MultiDiGraph()
    robot = mission.robot_of(next(iter(mission.agents)))
    for state, names in robot.states.items():
        graph.add_node(state, propositions=sorted(names), initial=state == robot.initial)
    for action in robot.actions:
        graph.add_edge(action.source, action.target, at=action.at)
    return graph
