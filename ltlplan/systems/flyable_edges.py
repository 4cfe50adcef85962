"""Edges of a mission's environment that no robot can fly for obstacles: they are rejected before anything is planned."""

from __future__ import annotations

import itertools

import numpy as np

from ltlplan.free_space.bottlenecks import what_shuts
from ltlplan.systems.region_graph import RegionGraph, RestPoint
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.unreachable import joined_names, said_of
from verify.data import BadInput, Mission


def require_flyable_edges(mission: Mission) -> None:
    """Reject edges along which no robot finds a way around obstacles and all other regions.

    Args:
        mission: With an environment and obstacles; others are let pass.

    Raises:
        BadInput: There are such edges; the message says what shuts each.
    """
    if mission.environment is None or not mission.obstacles:
        return
    layout = Layout(mission)
    graphs: dict[float, RegionGraph] = {}
    of = {robot: mission.vehicle_of(robot).radius for robot in mission.agents}
    for radius in of.values():
        graphs.setdefault(radius, RegionGraph(mission, layout=layout, radius=radius))
    faults: list[str] = []
    for a, b in mission.environment.pairs:
        ways = [(a, b)] if mission.environment.directed or a == mission.environment.start else [(a, b), (b, a)]
        ways = [
            (x, y)
            for x, y in ways
            if y != mission.environment.start and (x in layout.regions or x == mission.environment.start)
        ]
        known = all(
            name in graphs[radius].places
            for x, y in ways
            for name in (x, y)
            if name in layout.regions
            for radius in of.values()
        )
        if (
            known
            and ways
            and not any(_leads(mission, graphs[of[robot]], robot, x, y) for (x, y), robot in itertools.product(ways, of))
        ):
            smallest = min(of, key=of.__getitem__)
            faults.append(_sentence(mission, graphs[of[smallest]], smallest, *ways[0]))
    if faults:
        raise BadInput(" ".join(faults))


def _begins(mission: Mission, graph: RegionGraph, robot: str, name: str) -> tuple[RestPoint, ...]:
    """Return the rest points of a robot at a vertex: a region's middle, or where it starts."""
    if name in graph.layout.regions:
        return graph.middles(name)
    return (graph.standing(graph.layout.at(mission.agents[robot].start)),)


def _leads(mission: Mission, graph: RegionGraph, robot: str, start: str, end: str) -> bool:
    if start not in graph.layout.regions and graph.layout.at(mission.agents[robot].start).inside:
        return True  # it does not begin at the start vertex
    return any(way.end.place == end for point in _begins(mission, graph, robot, start) for way in graph.transitions(point))


def _sentence(mission: Mission, graph: RegionGraph, robot: str, start: str, end: str) -> str:
    space = graph.space
    assert space is not None
    begin = [graph.exit(point)[0].point for point in _begins(mission, graph, robot, start)]
    places = [place for _, place, _ in graph.entries(end)]
    edge = f"The edge [{start}, {end}] of the environment cannot be flown"
    shuts = [what_shuts(space, begin, place.point) for place in places]
    if all(shut is not None for shut in shuts):
        return f"{edge}: {said_of(mission, robot, end, shuts[0])}"
    through = _passed(graph, begin, places[[shut is None for shut in shuts].index(True)].point) - {start, end}
    by = (
        f": every way leads through other regions, such as {joined_names(sorted(through))}; give edges by these"
        if through
        else ""
    )
    return f"{edge} by {robot}{by}."


def _passed(graph: RegionGraph, begin: list[tuple[float, float, float]], end: tuple[float, float, float]) -> set[str]:
    """Return the regions that a shortest way through any of them enters."""
    assert graph.space is not None
    for point in begin:
        way = graph.space.way(np.array(point), np.array(end), frozenset(graph.layout.regions))
        if way is not None:
            return set().union(*graph.space.entered(way))
    return set()
