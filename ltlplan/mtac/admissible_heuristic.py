"""Admissible heuristic of the beam search: for every state of the team automaton a lower bound on the cost that is left.

It comes from one backward shortest-path search over a relaxation in which any robot that is free may be used again. It guides the
beam search of MTAC-E, and it never rules out what is best.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ltlplan.logic.automaton import DEAD
from ltlplan.mtac.agent_moves import AgentState, World
from ltlplan.mtac.decomposable_task import Reader, States
from ltlplan.search.label_setting import distances
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import closure
from verify.data.shapes.inequalities import Point

Metric = Callable[[str, Point, str], float]
"""Lower bound on the cost of a robot's way from a point to a region: (robot, m, region)."""


@dataclass(frozen=True, slots=True)
class TeamModel:
    """A team that tasks are shared in: what the search for tasks and its heuristic know.

    Attributes:
        world: Moves.
        reader: The formula's automaton.
        starts: Where each robot begins.
        metric: Lower bound on the cost of one leg.
    """

    world: World
    reader: Reader
    starts: Mapping[str, AgentState]
    metric: Metric


_Node = tuple[Any, ...]  # no union: the length tells which one it is
"""(states, `AgentState.key`) inside a region, or (states,) where some free robot goes on."""


class AdmissibleHeuristic:
    """Lower bounds on what is left, for the robots that are still free to be used."""

    def __init__(self, team: TeamModel) -> None:
        """Prepare a heuristic; bounds are computed when they are asked for."""
        self._world, self._reader, self._starts, self._metric = team.world, team.reader, team.starts, team.metric
        self._tables: dict[frozenset[str], dict[_Node, float]] = {}

    def accepts(self, states: States) -> bool:
        """Tell whether all states accept."""
        return all(state in self._reader.accepting for state in states)

    def bound(self, states: States, where: AgentState, free: frozenset[str]) -> float:
        """Return a lower bound on the cost still to come when a robot is inside a region with its actions done.

        Args:
            states: The automaton's states now.
            where: Where the robot is.
            free: Robots that have not begun.
        """
        return self._table(free, states, where).get((states, where.key), math.inf)

    @memoized
    def leg(self, robot: str | None, position: Point, region: str, kind: str = "") -> float:
        """Return a lower bound on the cost of the way from a point to a region.

        Args:
            robot: Whose costs count; None for the least of any robot of a kind.
            position: m.
            region: Where it flies to.
            kind: As an `AgentState` has it.
        """
        robots = [r for r, where in self._starts.items() if where.kind == kind] if robot is None else [robot]
        return min(self._metric(r, position, region) for r in robots or self._starts)

    def _table(self, free: frozenset[str], states: States, where: AgentState) -> dict[_Node, float]:
        """Backward shortest paths over everything that can be reached from here, any robot of `free` joining in."""
        table = self._tables.get(free)
        root: _Node = (states, where.key)
        if table is not None and root in table:
            return table
        into: dict[_Node, list[tuple[_Node, float]]] = defaultdict(list)
        ends: set[_Node] = set()
        starts = self._start_classes(free)

        def onwards(node: _Node) -> Iterator[_Node]:
            for target, cost, final in self._edges(node, starts):
                if final:
                    ends.add(node)
                else:
                    into[target].append((node, cost))
                    yield target

        seen = list(closure([root], onwards))
        costs = distances(ends, lambda node: into[node])
        table = {node: costs.get(node, math.inf) for node in seen if len(node) > 1}
        self._tables[free] = {**self._tables.get(free, {}), **table}
        return self._tables[free]

    def _start_classes(self, free: frozenset[str]) -> list[tuple[AgentState, dict[str, float]]]:
        """Free robots that read and move alike, with the least first leg to each region among them."""
        classes: dict[Hashable, tuple[AgentState, dict[str, float]]] = {}
        for robot in sorted(free):
            where = self._starts[robot]
            _, legs = classes.setdefault(self._world.alike(where), (where, {}))
            for region in self._world.mission.all_regions:
                legs[region] = min(legs.get(region, math.inf), self.leg(robot, where.position, region))
        return list(classes.values())

    def _edges(self, node: _Node, starts: list[tuple[AgentState, dict[str, float]]]) -> Iterator[tuple[_Node, float, bool]]:
        """Yield (target, cost, whether this is an end) of the relaxation."""
        world = self._world
        if len(node) == 1:
            (states,) = node
            for where, legs in starts:
                begun = self._reader.read(states, [world.letter(where)])
                for move in world.moves(where, first=True):
                    after = self._reader.read(begun, move.shown)
                    if DEAD not in after:
                        acts_where_it_hovers = move.in_place and move.end.place is None
                        yield (after, move.key), 0.0 if acts_where_it_hovers else legs[move.visit.region], False
            return
        states, key = node
        where, leaving = world.known[key]
        over = (states,) if leaving is None else (states, self._reader.read(states, [leaving]))
        if self.accepts(over[0]) or self.accepts(over[-1]):
            yield node, 0.0, True
        for rest in over:
            if starts and DEAD not in rest and self._reader.in_decomposition_set(rest):
                yield (rest,), 0.0, False
        for move in world.moves(where):
            after = self._reader.read(states, move.shown)
            if DEAD not in after and (move.key != key or after != states):
                yield (after, move.key), self.leg(None, where.position, move.visit.region, where.kind), False
