"""Systems that differ in one thing from what a robot can do: to see whether that thing is what stands in the way of a plan."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Literal

from ltlplan.systems.transition_systems import TransitionSystem
from verify.data.sections import Action


def without(world: TransitionSystem, region: str) -> TransitionSystem:
    """Return a system in which a region cannot be entered.

    Args:
        world: What a robot can do.
        region: Name.
    """
    edges = tuple(
        tuple((target, cost) for target, cost in out if region not in world.labels[target] or region in world.labels[source])
        for source, out in enumerate(world.edges)
    )
    return replace(world, edges=edges)


def with_internal(world: TransitionSystem, proposition: str) -> TransitionSystem:
    """Return a system in which every state shows an internal proposition.

    Args:
        world: What a robot can do.
        proposition: Name.
    """
    return replace(world, labels=tuple(label | {proposition} for label in world.labels))


def leaving_at_once(world: TransitionSystem, action: Action) -> TransitionSystem:
    """Return a system in which a robot that has made an action is not seen in the region of that action any more.

    Args:
        world: What a robot can do.
        action: Of its internal automaton.
    """
    gone = [action.at in node.regions and not node.flying and node.internal == action.target for node in world.nodes]
    labels = tuple(label - {action.at} if away else label for label, away in zip(world.labels, gone, strict=True))
    return replace(world, labels=labels)


def sure_at_walls(
    world: TransitionSystem, pairs: Collection[tuple[str, str]], shown: Literal["one", "both"]
) -> TransitionSystem:
    """Return a system in which a robot at a wall between two rooms is for sure in the one that it enters, or in both.

    Args:
        world: What a robot can do.
        pairs: The rooms, each pair in the order of the alphabet.
        shown: Whether it is in the other room no more, or still.
    """
    passed = {node: rooms for node, rooms in world.walls.items() if (min(rooms), max(rooms)) in pairs}
    gone = {node: rooms[:1] for node, rooms in passed.items() if shown == "one"}
    labels = tuple(label - set(gone.get(node, ())) for node, label in enumerate(world.labels))
    return replace(world, labels=labels, walls={node: rooms for node, rooms in world.walls.items() if node not in passed})


def without_free_flight(world: TransitionSystem) -> TransitionSystem:
    """Return a system in which robots go from region to region without being seen in between."""
    edges = tuple(
        tuple(
            (after, cost + more)
            for target, cost in out
            for after, more in (world.edges[target] if world.nodes[target].flying else ((target, 0.0),))
        )
        + (() if world.nodes[source].flying else tuple((t, c) for t, c in out if world.nodes[t].flying))
        for source, out in enumerate(world.edges)
    )
    return replace(world, edges=edges)
