"""Assignment of the parts of a counted plan to robots: robots of one kind that are not named exchange parts that show the same letters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ltlplan.search.counting.counted_plans import CountedPlan
from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.systems.transition_systems import TransitionSystem


def taken_by_the_cheapest(
    systems: Sequence[TransitionSystem],
    plan: CountedPlan,
    kinds: Sequence[str],
    price: Callable[[int, tuple[int, ...]], float],
    *,
    longest: bool,
) -> CountedPlan:
    """Return a plan whose parts are taken so that they cost least.

    A part may be taken by a robot of the same kind that shows the very letters of it, one after another, from its own start: then the
    team shows what it showed, and whatever counts ask for holds as before.

    Args:
        systems: One for each robot.
        plan: Whose parts are given out anew.
        kinds: For each robot a key that robots have in common which may take each other's parts.
        price: What a robot's path along nodes of its system costs.
        longest: Whether the dearest robot counts, not the sum.
    """
    robots = range(len(systems))
    paths = {
        (robot, part): found
        for robot in robots
        for part in robots
        if kinds[robot] == kinds[part] and (found := _path(systems, plan, robot, part)) is not None
    }
    prices = np.full((len(systems), len(systems)), math.inf)
    for (robot, part), path in paths.items():
        prices[robot, part] = price(robot, path)
    if not np.isfinite(prices[robots, robots]).all():
        return plan
    pairs = cheapest_assignment(prices, longest=longest)
    assert pairs is not None  # each may keep its own
    takes = [part for _, part in pairs]
    taker = {part: robot for robot, part in enumerate(takes)}
    if takes == list(robots):
        return plan
    return replace(
        plan,
        paths=tuple(paths[robot, takes[robot]] for robot in robots),
        turns=tuple((taker[part], begin, end) for part, begin, end in plan.turns),
    )


def _path(systems: Sequence[TransitionSystem], plan: CountedPlan, robot: int, part: int) -> tuple[int, ...] | None:
    """Return a robot's path for another one's part; None where it has no such path, or would show other letters on it."""
    own, other, path = systems[robot], systems[part], plan.paths[part]
    if robot == part:
        return path
    index = {node: number for number, node in enumerate(own.nodes)}
    start = other.nodes[other.initial]
    found = [own.initial]
    for number in path[1:]:
        node = other.nodes[number]
        if node.position == start.position and node.place == start.place:  # where it begins, seen from there
            here = own.nodes[own.initial]
            entered = here.entered if node.entered == start.entered else node.entered
            node = replace(node, position=here.position, place=here.place, entered=entered)
        if node not in index:
            return None
        found.append(index[node])
    shown = [own.labels[number] for number in found] == [other.labels[number] for number in path]
    joined = all(any(target == b for target, _ in own.edges[a]) for a, b in itertools.pairwise(found) if a != b)
    return tuple(found) if shown and joined else None
