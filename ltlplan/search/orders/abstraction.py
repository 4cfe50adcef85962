"""Smaller systems that can do all that robots can, as far as some propositions show it: what they cannot do the robots cannot.

Nodes that look alike are one. Where a robot can come from one to another that only looks alike, its letter is read anew; so such
an event leads from a node to its twin.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ltlplan.search.label_setting import distances
from ltlplan.search.orders.state_sets import Shown
from ltlplan.systems.transition_systems import TransitionSystem


def alike_merged(
    system: TransitionSystem, shown: Sequence[Shown], is_idle: Callable[[Shown], bool]
) -> tuple[TransitionSystem, list[Shown]]:
    """Return a system whose nodes are what a robot can show, and what each of them shows.

    Args:
        system: The robot's.
        shown: For each node what the formula sees there.
        is_idle: Whether it makes no difference that something is read again.
    """
    reached = distances([system.initial], lambda node: [(target, 1.0) for target, _ in system.edges[node]])
    order = list(dict.fromkeys(shown[node] for node in reached))
    number = {own: 2 * i for i, own in enumerate(order)}
    edges: list[dict[int, float]] = [{} for _ in range(2 * len(order))]

    def lower(source: int, target: int, cost: float) -> None:
        edges[source][target] = min(cost, edges[source].get(target, cost))

    for node in reached:
        here = number[shown[node]]
        for target, cost in system.edges[node]:
            there = number[shown[target]]
            if here != there:
                for twin in (0, 1):
                    lower(here + twin, there, cost)
            elif system.labels[target] != system.labels[node] and not is_idle(shown[node]):
                lower(here, here + 1, 0.0)
                lower(here + 1, here, 0.0)
    ends: dict[int, float] | None = None
    if system.final is not None:
        ends = {}
        for node in reached.keys() & system.final.keys():
            ends |= {number[shown[node]] + twin: 0.0 for twin in (0, 1)}
    labels = tuple(frozenset({f"{i}"}) for i in range(2 * len(order)))
    merged = replace(
        system,
        labels=labels,
        edges=tuple(tuple(sorted(own.items())) for own in edges),
        initial=0,
        final=ends,
        nodes=(),
        walls={},
    )
    return merged, [own for own in order for _ in (0, 1)]
