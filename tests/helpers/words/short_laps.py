"""All short laps of small teams, one after another: which of those that keep a formula, however robots are read, is cheapest, in sum or for the dearest robot.

Nothing is shared with the searches but Spot's automaton of the formula's opposite, under `own`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import networkx as nx

from ltlplan.logic.small_automata import small_automaton
from ltlplan.systems.transition_systems import TransitionSystem
from tests.helpers.words.brute_force import for_ever
from verify.data import Formula, Letter

_GRAIN = 1e-7

_Number = TypeVar("_Number", int, float)

Shown = tuple[tuple[Letter, ...], ...]
"""The letters of all robots, one event after another."""


@dataclass(frozen=True)
class World:
    """What is asked of whom, and whether the sum of costs is to be least or what the dearest robot pays."""

    each: tuple[TransitionSystem, ...]
    formula: Formula
    names: tuple[str, ...]
    team: str = "joint"
    repeat: int = 1
    together: bool = False
    objective: str = "longest"


def least_cost(world: World, below: float) -> float:
    """Return what any laps cost at the least, if that is below a limit; infinite otherwise."""
    best, total = math.inf, max if world.objective == "longest" else sum
    kept = cache(lambda shown, movers, home: _keeps(world, shown, movers, home))
    begin = tuple(system.initial for system in world.each)
    ways: list[tuple[tuple[tuple[int, ...], ...], tuple[int, ...], tuple[tuple[float, ...], ...]]] = [
        ((begin,), (), ((0.0,) * len(begin),))
    ]
    while ways:
        nodes, movers, paid = ways.pop()
        for home, there in enumerate(nodes):
            if there != nodes[-1] or not all(_rests(world, robot, node) for robot, node in enumerate(there)):
                continue
            cost = total([a + world.repeat * (b - a) for a, b in zip(paid[home], paid[-1], strict=True)])
            if cost < min(best, below) - _GRAIN and kept(_shown(world, nodes), movers, home):
                best = cost
        for robot, after, costs in _steps(world, nodes[-1], paid[-1]):
            if total(costs) < min(best, below) - _GRAIN:
                ways.append(((*nodes, after), (*movers, robot), (*paid, costs)))
    return best


def _steps(
    world: World, nodes: tuple[int, ...], paid: tuple[float, ...]
) -> Iterator[tuple[int, tuple[int, ...], tuple[float, ...]]]:
    flying = [robot for robot, node in enumerate(nodes) if not _rests(world, robot, node)]
    for robot in range(len(nodes)) if world.together or not flying else flying:
        for target, cost in world.each[robot].edges[nodes[robot]]:
            if target != nodes[robot]:
                yield robot, _put(nodes, robot, target), _put(paid, robot, paid[robot] + cost)


def _put(values: tuple[_Number, ...], index: int, value: _Number) -> tuple[_Number, ...]:
    return (*values[:index], value, *values[index + 1 :])


def _rests(world: World, robot: int, node: int) -> bool:
    system = world.each[robot]
    return not system.nodes or not system.nodes[node].flying or node == system.initial


def _shown(world: World, nodes: Sequence[tuple[int, ...]]) -> Shown:
    return tuple(tuple(s.labels[n] for s, n in zip(world.each, at, strict=True)) for at in nodes)


def _keeps(world: World, shown: Shown, movers: tuple[int, ...], home: int) -> bool:
    """Tell whether laps keep the formula, however robots are read."""
    if world.team == "own":
        return not _is_broken(world.formula, shown, movers, home)
    held = [dict(zip(world.names, letters, strict=True)) for letters in shown]
    lap = held[home + 1 :] or held[home:]
    return for_ever(world.formula, world.names, held[: home + 1], lap)


def _is_broken(formula: Formula, shown: Shown, movers: tuple[int, ...], home: int) -> bool:
    """Tell whether some readings of laps break a formula: each robot is read at least once in each of its letters and in each lap."""
    opposite = small_automaton(Formula("!", (formula,)), "infinite")
    everyone, last = (1 << len(shown[0])) - 1, len(shown) - 1
    graph: nx.DiGraph[tuple[int, int, int]] = nx.DiGraph()
    begin: tuple[int, int, int] = (0, 0, opposite.initial)
    graph.add_node(begin)
    open_: list[tuple[int, int, int]] = [begin]
    seams: set[tuple[tuple[int, int, int], tuple[int, int, int]]] = set()
    while open_:
        place = open_.pop()
        at, read, state = place
        after = [
            (at, read | 1 << robot, target)
            for robot, letter in enumerate(shown[at])
            for target in opposite.successors(state, letter)
        ]
        if at < last:
            mover = movers[at]
            if shown[at + 1] == shown[at]:
                after.append((at + 1, read, state))
            elif read >> mover & 1:
                after.append((at + 1, read & ~(1 << mover), state))
        elif read == everyone:
            seams.add((place, (home, 0, state)))
            after.append((home, 0, state))
        for each in after:
            if each not in graph:
                open_.append(each)
            graph.add_edge(place, each)
    return any(
        any(a in part and b in part for a, b in seams) and any(state in opposite.accepting for _, _, state in part)
        for part in nx.strongly_connected_components(graph)
    )
