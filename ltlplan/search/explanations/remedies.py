"""What would make the impossible possible: an edge more, or a region or edge that is open to all."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem, environment_of
from verify.data import Mission
from verify.data.sections import Edge, Environment

Worlds = Sequence[TransitionSystem]


def missing_edges(mission: Mission, possible: Callable[[Worlds], bool], robots: Sequence[str]) -> list[tuple[str, str]]:
    """Return edges of the environment that would make the core possible, one or two; none where edges do not matter.

    Args:
        mission: Whose environment they are missing in.
        possible: Whether what is asked can be met in some worlds.
        robots: Of which robot each world is.
    """
    given = mission.environment
    if given is None:
        return []
    regions = tuple(mission.all_regions)
    successors = environment_of(mission).successors
    wanted = [
        (a, b)
        for a in (given.start, *regions)
        for b in regions
        if a != b and b not in successors[a] and (given.directed or a == given.start or a < b)
    ]
    if len(wanted) > 200 or not possible(_with_edges(mission, given, wanted, robots)):
        return []
    for size in (1, 2):
        if size == 2 and len(wanted) > 20:
            break
        for edges in itertools.combinations(wanted, size):
            if possible(_with_edges(mission, given, edges, robots)):
                return list(edges)
    return []


def opened(mission: Mission, possible: Callable[[Worlds], bool], robots: Sequence[str]) -> list[str]:
    """Say what, opened to all kinds of robots, would make the core possible: one region or edge, or all of them.

    Args:
        mission: What is closed in it.
        possible: Whether what is asked can be met in some worlds.
        robots: Of which robot each world is.
    """
    given = mission.environment
    tables = {"hoops": mission.hoops, "regions": mission.regions}
    closed = [(table, name) for table, those in tables.items() for name, region in those.items() if region.only]
    edges = [edge for edge in (() if given is None else given.edges) if isinstance(edge, Edge)]

    def would_be(names: Sequence[tuple[str, str]], opened: Sequence[Edge]) -> bool:
        update: dict[str, object] = {
            table: {n: r.model_copy(update={"only": None}) if (table, n) in names else r for n, r in those.items()}
            for table, those in tables.items()
        }
        if given is not None:
            kept = tuple(e.between if isinstance(e, Edge) and e in opened else e for e in given.edges)
            update["environment"] = given.model_copy(update={"edges": kept})
        changed = Systems(mission.model_copy(update=update))
        return possible([changed.of(robot) for robot in robots])

    if not closed + edges or not would_be(closed, edges):
        return []
    for one in closed:
        if would_be([one], ()):
            return [f"If {one[1]} were open to every robot it could hold."]
    for edge in edges:
        if would_be((), [edge]):
            return [f"If the edge {edge.between[0]} - {edge.between[1]} were open to every robot it could hold."]
    return ["If all regions and edges were open to every robot it could hold."]


def _with_edges(mission: Mission, given: Environment, edges: Sequence[tuple[str, str]], robots: Sequence[str]) -> Worlds:
    environment = given.model_copy(update={"edges": (*given.edges, *edges)})
    changed = Systems(mission.model_copy(update={"environment": environment}))
    return [changed.of(robot) for robot in robots]
