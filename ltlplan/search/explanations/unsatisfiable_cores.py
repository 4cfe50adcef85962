"""Unsatisfiable cores: a smallest set of requirements that cannot hold together, and what stands in their way, in words.

Nothing is guessed. Every sentence here is the outcome of a search that found nothing, in the mission's world or in one
that differs from it in just the thing that the sentence names: one region taken away, all edges added, free flight
not shown, an internal state given from the start.

What would make the impossible possible is looked for too: an edge more, or a region or edge that is open to all.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial

from ltlplan.logic.conjunction import conjuncts
from ltlplan.search.explanations.inquiry import Feasible, Inquiry, Worlds, eventually
from ltlplan.search.explanations.reasons import reasons_against
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import environment_of
from ltlplan.systems.unreachable import joined_names, why_unreachable
from verify.data import Formula, Mission, Unsatisfiable, Word
from verify.data.sections import Edge, Environment

MAX_SUBSETS = 300
_EDGES = 20  # that are tried in pairs


class NoPlan(Unsatisfiable):
    """No words that these robots can fly satisfy the formula.

    Attributes:
        core: Requirements that cannot hold together, as text; no proper part of them is impossible by itself.
        reasons: What stands in their way, one sentence each.
        edges: Edges of the environment that would make the core possible, where some would.
        left_out: Parts of the formula without which the rest can be planned; empty where none were found.
    """

    def __init__(
        self,
        core: Sequence[str],
        reasons: Sequence[str],
        edges: Sequence[tuple[str, str]] = (),
        left_out: Sequence[str] = (),
        *,
        least: bool = False,
    ) -> None:
        self.core = tuple(core)
        self.reasons = tuple(reasons)
        self.edges = tuple(edges)
        self.left_out = tuple(left_out)
        quoted = [f"`{part}`" for part in core]
        what = f"{quoted[0]} cannot hold" if len(quoted) == 1 else f"{joined_names(quoted)} cannot hold together"
        which, parts = "The cheapest relaxation" if least else "A relaxation", [f"`{part}`" for part in left_out]
        offer = [f"{which} leaves out {joined_names(parts)} (weight {len(parts)}): the rest can be planned."] if parts else []
        super().__init__(" ".join(["No plan satisfies the formula.", f"{what}.", *self.reasons, *offer]))


def explain(mission: Mission, systems: Systems, worlds: Worlds, possible: Feasible) -> NoPlan:
    """Return the error that says why a mission has no plan.

    Args:
        mission: Whose formula cannot be met.
        systems: What its robots can do.
        worlds: One system for each robot.
        possible: Whether some requirements can be met in some worlds; it may raise where it cannot tell.
    """
    inquiry = Inquiry(mission, systems, worlds, possible)
    core = _core(inquiry)
    robots = [world.robot for world in worlds]
    in_worlds = partial(inquiry.feasible, core)
    opened = opened_to_all(mission, in_worlds, robots)
    edges = [] if opened else missing_edges(mission, in_worlds, robots)
    reasons = [
        *reasons_against(inquiry, core),
        *_shut(inquiry, core),
        *edge_sentence(mission, edges),
        *opened,
        *systems.unclear(mission.formula.names() if mission.environment is None else None),  # edges may lead through any
    ]
    return NoPlan([inquiry.shown(part) for part in core], list(dict.fromkeys(reasons)), edges)


def refused_in_some_order(mission: Mission, order: Sequence[tuple[str, Word]]) -> NoPlan:
    """Return the error for a formula that robots can meet in one order of flying, but by no plan in every order.

    Args:
        mission: Whose formula it is.
        order: The order, with words, that breaks the cheapest plan.
    """
    shown = ", then ".join(f"{robot} {word}" for robot, word in order)
    reason = (
        "Plans exist that hold in one order of the robots, but none that holds in every order, and none under precedences. "
        f"The cheapest one fails, for instance, when they are read one after another as {shown}."
    )
    return NoPlan([mission.spec.formula or "true"], [reason])


def _core(inquiry: Inquiry) -> list[Formula]:
    """Return a smallest impossible set of requirements; where there are too many sets to try, one that cannot be made smaller."""
    parts = list(dict.fromkeys(conjuncts(inquiry.mission.formula)))
    core = without_needless(parts, lambda some: inquiry.feasible(some, inquiry.worlds))
    smaller = itertools.chain.from_iterable(itertools.combinations(parts, size) for size in range(1, len(core)))
    tried = itertools.islice(smaller, MAX_SUBSETS)
    return next((list(some) for some in tried if not inquiry.feasible(some, inquiry.worlds)), core)


def without_needless(parts: Sequence[Formula], possible: Callable[[list[Formula]], bool]) -> list[Formula]:
    """Return impossible requirements without those, in turn, without which the others are impossible as well.

    Args:
        parts: Different requirements.
        possible: Tells whether some requirements can hold together.
    """
    core = list(parts)
    for part in parts:
        rest = [other for other in core if other != part]
        core = rest if rest and not possible(rest) else core
    return core


def _shut(inquiry: Inquiry, core: list[Formula]) -> list[str]:
    """Say what shuts the ways to regions that no robot can reach for obstacles."""
    mission = inquiry.mission
    if not mission.obstacles:
        return []
    names = {name for part in core for name in inquiry.names(part)}
    acted = {action.at for robot in inquiry.robots for action in robot.actions if names & set(robot.states[action.target])}
    named = (names | acted) & mission.all_regions.keys()
    lost = [name for name in sorted(named) if not inquiry.feasible([eventually(name)], inquiry.worlds)]
    smallest = min(mission.agents, key=lambda robot: mission.vehicle_of(robot).radius)
    graph = inquiry.systems.graph_of(smallest)
    found = (why_unreachable(mission, graph, smallest, name) for name in lost)
    return [sentence for sentence in found if sentence is not None]


def edge_sentence(mission: Mission, edges: Sequence[tuple[str, str]]) -> list[str]:
    """Say with which edges a core could hold; nothing where there are none.

    Args:
        mission: Whose environment they are missing in.
        edges: As `missing_edges` returns them.
    """
    if not edges:
        return []
    arrow = " -> " if mission.environment is not None and mission.environment.directed else " - "
    return [f"With the edge{'s' * (len(edges) > 1)} {joined_names([a + arrow + b for a, b in edges])} added it could hold."]


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
    some = [*itertools.combinations(wanted, 1), *(itertools.combinations(wanted, 2) if len(wanted) <= _EDGES else ())]
    return next((list(edges) for edges in some if possible(_with_edges(mission, given, edges, robots))), [])


def opened_to_all(mission: Mission, possible: Callable[[Worlds], bool], robots: Sequence[str]) -> list[str]:
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
    alone = itertools.chain(
        (one[1] for one in closed if would_be([one], ())),
        (f"the edge {edge.between[0]} - {edge.between[1]}" for edge in edges if would_be((), [edge])),
    )
    return [f"If {next(alone, 'all regions and edges')} were open to every robot it could hold."]


def _with_edges(mission: Mission, given: Environment, edges: Sequence[tuple[str, str]], robots: Sequence[str]) -> Worlds:
    environment = given.model_copy(update={"edges": (*given.edges, *edges)})
    changed = Systems(mission.model_copy(update={"environment": environment}))
    return [changed.of(robot) for robot in robots]
