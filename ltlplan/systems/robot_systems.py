"""Transition systems of a mission's robots: A of Def. 4.3 for each of them, laid out over the mission's regions.

A robot rests in the middle of a region or at its start, and flies straight from one such point to the next; `region_labels` says
which letters it shows on the way, and ways on which that is not clear are left out. What all robots share is made once.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from ltlplan.systems.forbidden_regions import regions_to_avoid
from ltlplan.systems.objective import flown_speed, flown_weights
from ltlplan.systems.region_graph import RegionGraph, RestPoint, Transition
from ltlplan.systems.region_labels import Layout, Location
from ltlplan.systems.shared_walls import Walls
from ltlplan.systems.transition_systems import Cost, Node, TransitionSystem
from ltlplan.systems.unclear_places import unclear_middle, unclear_point
from verify.data import BadInput, Letter, Mission
from verify.data.sections import Agent
from verify.data.shapes.inequalities import Point

_HOOP_STAY = 2e-9  # ties are broken in favour of flying out of hoops and staying in plain regions
_REGION_LEAVE = 1e-9


class Systems:
    """A for every robot of a mission. What all robots share is made once.

    Args:
        mission: Whose regions and robots.
        cost: Costs of legs; where None, the lengths of ways, weighted where robots' costs or speeds differ.
        places: Regions that robots may visit; all of them where None. The others are there, but nobody points at them.
        layout: How the mission's regions lie, where that is known already.
        metre: What a metre costs each robot on ways of which `cost` says nothing, those to its end; by default `metre_costs`. Where it
            is given, costs are not those of metres alone, and say nothing of how long a robot flies.
    """

    def __init__(
        self,
        mission: Mission,
        cost: Cost | None = None,
        *,
        places: Collection[str] | None = None,
        layout: Layout | None = None,
        metre: Mapping[str, float] | None = None,
    ) -> None:
        self.mission = mission
        self.layout = layout or Layout(mission)
        self._places = places
        self._graphs: dict[tuple[str, float, frozenset[str]], RegionGraph] = {}
        self._only_metres = metre is None
        self._metre = metre_costs(mission) if metre is None else dict(metre)
        self._walls = Walls(mission)
        self.graph = self.graph_of(next(iter(mission.agents)))
        self.cost = cost
        self._regions = mission.all_regions
        self._base: dict[tuple[RegionGraph, str | float], _Builder] = {}

    def graph_of(self, robot: str) -> RegionGraph:
        """Return the points at which a robot of this kind and size can rest, and the ways between them.

        Args:
            robot: Its name.
        """
        closed = regions_to_avoid(self.mission, robot)
        radius = self.mission.vehicle_of(robot).radius if self.mission.obstacles or closed else 0.0
        key = (self.mission.alike_as(robot), radius, closed)
        if key not in self._graphs:
            seen = self.mission.seen_by(robot)
            self._graphs[key] = RegionGraph(seen, places=self._places, layout=self.layout, radius=radius, closed=closed)
        return self._graphs[key]

    def nominal_speed(self, robot: str) -> float:
        """Return how fast a robot is planned to fly, m/s.

        Args:
            robot: Its name.
        """
        return self.mission.seen_by(robot).planner.speed

    def flown_speed(self, robot: str) -> float:
        """Return how fast a robot may come to fly, m/s.

        Args:
            robot: Its name.
        """
        return flown_speed(self.mission, robot)

    def metres(self, robot: str, cost: float) -> float:
        """Return how many metres a robot flies for a cost.

        Args:
            robot: Its name.
            cost: Of ways, as this class counts them.
        """
        return cost / self._metre[robot]

    def most_costs(self) -> list[float] | None:
        """Return what each robot may cost so that all are back before a vehicle's endurance ends; None where costs do not tell."""
        allowed = self.mission.longest_flight
        if allowed is None or not self._only_metres:
            return None
        return [allowed * self.flown_speed(robot) * self._metre[robot] for robot in self.mission.agents]

    def of(self, robot: str) -> TransitionSystem:
        """Return A of one robot.

        Raises:
            BadInput: It starts, or should end, too near the border of a region; a cost is negative or no number.
        """
        agent = self.mission.agents[robot]
        graph = self.graph_of(robot)
        key = (graph, self._metre[robot] if self.cost is None else robot)
        shared = self._base.get(key)
        if shared is None:
            shared = self._base[key] = self._shared(robot)
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
            self.mission.robot_of(robot).actions,
            builder.walls,
        )

    def unclear(self, among: Collection[str] | None = None) -> tuple[str, ...]:
        """Return what is said of each region that no plan can visit: which borders are too near its middle, its own or others', and the remedy.

        Args:
            among: The regions that are looked at; None for all.
        """
        middles = self.layout.middles.items()
        return tuple(
            unclear_middle(self.layout, name)
            for name, location in middles
            if not location.clear and (among is None or name in among)
        )

    def leg(self, robot: str, start: Point | str, region: str) -> float:
        """Return the cost of one leg to a region.

        Args:
            robot: Whose leg.
            start: Where it begins: a point in m, or a region.
            region: Where it ends.

        Raises:
            BadInput: The cost that was given is negative or no number.
        """
        if self.cost is not None:
            value = float(self.cost(robot, start, region))
            if not 0 <= value < math.inf:
                raise BadInput(f"The cost of {robot}'s leg from {start} to {region} is {value}; it must be a number >= 0.")
            return value
        if start == region:  # out of the region and back
            return self._metre[robot] * 2 * self._regions[region].inner_radius
        return self._metre[robot] * min(self.graph_of(robot).lengths(start, region), default=math.inf)

    def _shared(self, robot: str) -> _Builder:
        """Return the part of A that does not depend on where a robot starts."""
        graph = self.graph_of(robot)
        builder = _Builder(graph)
        self._grow(builder, robot, [point for region in graph.places for point in graph.middles(region)])
        return builder

    def _add_start(self, builder: _Builder, robot: str, agent: Agent) -> int:
        location = self.layout.at(agent.start)
        if not location.clear:
            raise BadInput(unclear_point(self.layout, f"{robot} starts", agent.start))
        point = builder.graph.standing(location, agent.visited)
        self._grow(builder, robot, [point])
        return builder.index[self._here(point, self.mission.initial_internal(robot))]

    def _grow(self, builder: _Builder, robot: str, points: list[RestPoint]) -> None:
        """Add points, all ways on from them, and all points that these lead to."""
        waiting = [point for point in points if point not in builder.points]
        for point in waiting:
            self._add_rest_point(builder, point)
        for point in waiting:  # grows while it is walked
            for transition in builder.graph.transitions(point):
                if transition.end not in builder.points:
                    waiting.append(transition.end)
                    self._add_rest_point(builder, transition.end)
                self._add_transition(builder, robot, point, transition)

    def _add_rest_point(self, builder: _Builder, point: RestPoint) -> None:
        """Add the nodes of a robot at a point, and in the free flight after it where that is clear."""
        builder.points.add(point)
        around = builder.graph.around(point)
        flies_on = point.place in self.mission.hoops and point.position is None
        for internal in builder.internal:
            here = self._here(point, internal)
            builder.add(here, builder.label(here), _HOOP_STAY if flies_on else 0.0)
            if around is not None and not here.flying:
                gone = self._gone(builder, point, internal)
                builder.add(gone, builder.label(gone), 0.0 if flies_on else _REGION_LEAVE)
                builder.join(here, gone, 0.0)
        for action in builder.graph.actions(point):
            builder.join(self._here(point, action.source), self._here(point, action.target), 0.0)

    def _add_transition(self, builder: _Builder, robot: str, point: RestPoint, transition: Transition) -> None:
        again = transition.letters is None and transition.end.place == point.place
        cost = None if self.cost is not None or transition.length is None else self._metre[robot] * transition.length
        if cost is None:
            begins = [point.place] if point.position is None else [point.position]
            begins += [point.place] * again  # it flies out and back, no less far than to the middle
            cost = max(self.leg(robot, begin, transition.end.place) for begin in begins)
        between = transition.letters or ()
        crossings = {
            index - 1: (left, entered)
            for index, left, entered in self._walls.on(
                [frozenset(point.location.inside), *between], [frozenset(transition.end.location.inside)]
            )
        }
        for internal in builder.internal:
            previous, goal, due = self._here(point, internal), self._here(transition.end, internal), cost
            if transition.letters is None:
                previous = self._gone(builder, point, internal)
            for step, letter in enumerate(between):
                leg = (point.place, point.entered, step)
                end = transition.end
                on = Node(end.place, True, internal, letter, end.entered, point.position, leg, (point.side, end.side))
                if on not in builder.index:
                    builder.add(on, builder.label(on), None)
                    if step in crossings:
                        builder.walls[builder.index[on]] = crossings[step]
                builder.join(previous, on, due)
                previous, due = on, 0.0
            builder.join(previous, goal, due)

    def _here(self, point: RestPoint, internal: str) -> Node:
        inside = frozenset(point.location.inside)
        return Node(point.place, not inside, internal, inside, point.entered, point.position, sides=(point.side, None))

    def _gone(self, builder: _Builder, point: RestPoint, internal: str) -> Node:
        around = frozenset(builder.graph.around(point) or ())
        return Node(point.place, True, internal, around, point.entered, point.position, sides=(point.side, None))

    def _add_end(self, builder: _Builder, robot: str, end: Point) -> None:
        """Make the end point the only place to finish at; the way there is a straight line."""
        location = self.layout.at(end)
        if not location.clear:
            raise BadInput(unclear_point(self.layout, f"{robot} should end", end))
        builder.final.clear()
        for node in list(builder.nodes):
            if node.leg is not None:
                continue
            length = self._length_to_end(builder.graph, node, location)
            if not math.isfinite(length):
                continue
            if node.regions == frozenset(location.inside):
                entered: str | None = node.entered
            elif node.flying and len(location.inside) == 1 and not node.regions:
                entered = builder.graph.last_entered(node.entered, (node.regions, frozenset(location.inside)))
            else:
                entered = None
            if entered is not None:
                place = location.inside[-1] if location.inside else self.graph.environment.start
                goal = Node(place, not location.inside, node.internal, frozenset(location.inside), entered, end)
                if goal not in builder.index:
                    builder.add(goal, builder.label(goal), 0.0)
                if goal != node:
                    builder.join(node, goal, self._metre[robot] * length)
                builder.final[builder.index[goal]] = 0.0

    def _length_to_end(self, graph: RegionGraph, node: Node, end: Location) -> float:
        """Return how far it is from a node to where a robot should end, m; infinite where there is no way."""
        here = self.layout.middles[node.place] if node.position is None else self.layout.at(node.position)
        return graph.length(RestPoint(node.place, node.entered, here, node.position, node.sides[0]), end)


def metre_costs(mission: Mission) -> dict[str, float]:
    """Return what a metre costs each robot: its weight of length, and of time over its speed, the nominal one or the greatest at its pace.

    It is 1 for all where it is the same for all, and where some robot's weights name neither length nor time: then all are
    compared by metres.

    Args:
        mission: Gives weights and speeds.
    """
    found = weighted_metres(mission)
    alike = len(set(found.values())) == 1 or not all(found.values())
    return dict.fromkeys(found, 1.0) if alike else found


def weighted_metres(mission: Mission) -> dict[str, float]:
    """Return each robot's weight of length, and of time over its speed: what a metre costs it by the mission's weights.

    Args:
        mission: Gives weights and speeds.
    """
    found: dict[str, float] = {}
    for robot in mission.agents:
        weights = flown_weights(mission, robot)
        found[robot] = weights.get("length", 0.0) + weights.get("time", 0.0) / mission.seen_by(robot).planner.speed
    return found


def interchangeable(mission: Mission) -> dict[str, str]:
    """Return for each robot a key that robots have in common which can do the same from the same place, at the same costs, and end alike.

    Args:
        mission: Gives robots and their weights.
    """
    return {
        robot: f"{mission.alike_as(robot)} {mission.pace_of(robot)} {sorted(mission.weights_of(robot).items())} {agent.end}"
        for robot, agent in mission.agents.items()
    }


def unit_cost(mission: Mission) -> float:
    """Return what a search's unit is worth in the mission's own: more or less than 1 only where a metre costs all robots the same.

    Args:
        mission: Gives weights and speeds.
    """
    different = set(weighted_metres(mission).values())
    (common,) = different if len(different) == 1 else (1.0,)
    return common or 1.0


class _Builder:
    """A transition system while it is put together."""

    def __init__(self, graph: RegionGraph) -> None:
        self.graph = graph
        self.internal = {state: frozenset(names) for state, names in graph.mission.robot.states.items()}
        self.nodes: list[Node] = []
        self.index: dict[Node, int] = {}
        self.labels: list[Letter] = []
        self.edges: list[list[tuple[int, float]]] = []
        self.final: dict[int, float] = {}
        self.points: set[RestPoint] = set()
        self.walls: dict[int, tuple[str, str]] = {}

    def add(self, node: Node, label: Letter, preference: float | None) -> None:
        self.index[node] = len(self.nodes)
        if preference is not None:
            self.final[len(self.nodes)] = preference
        self.nodes.append(node)
        self.labels.append(label)
        self.edges.append([])

    def label(self, node: Node) -> Letter:
        return node.regions | self.internal[node.internal]

    def join(self, source: Node, target: Node, cost: float) -> None:
        self.edges[self.index[source]].append((self.index[target], cost))

    def copy(self) -> _Builder:
        other = _Builder(self.graph)
        other.nodes, other.index, other.labels = list(self.nodes), dict(self.index), list(self.labels)
        other.edges, other.final, other.points = [list(edges) for edges in self.edges], dict(self.final), set(self.points)
        other.walls = dict(self.walls)
        return other
