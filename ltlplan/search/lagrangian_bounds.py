"""The dearest robot by sums: searches for a least sum, with each robot's costs weighted, bound and lower what the dearest one pays.

Whatever the weights, which add up to 1, the dearest robot pays at least as much as all do by weight (Lagrangian relaxation). So each search for
a least weighted sum gives a lower bound and a plan; then whoever paid most weighs more. Plans that no weights make the cheapest are
found by keeping whoever pays most out of one of the regions that it visits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from ltlplan.logic.budget import TooLarge
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible

Plan = TypeVar("Plan")

BY_WEIGHTED_SUMS = (
    "The dearest robot's cost was lowered by several searches for sums; a plan whose dearest robot costs less may exist."
)
"""What is said of such a plan where that is not ruled out."""

_ROUNDS = 6
_STEP = 2.0
_TRIES = 24
_TIES = 1e-6


@dataclass(frozen=True, slots=True)
class LeastSum(Generic[Plan]):
    """What a search for a least sum answers.

    Attributes:
        plan: The plan that was found.
        costs: What each robot pays for it, without any weights.
        paths: The nodes of its system that each robot goes through.
        least: No plan has a smaller sum, by weight; None where that is not known.
    """

    plan: Plan
    costs: tuple[float, ...]
    paths: tuple[tuple[int, ...], ...]
    least: float | None


def lower_the_dearest(
    systems: Sequence[TransitionSystem],
    first: LeastSum[Plan],
    search: Callable[[Sequence[TransitionSystem]], LeastSum[Plan] | None],
) -> tuple[LeastSum[Plan], float | None]:
    """Return the plan whose dearest robot pays least of a few, and a lower bound on what the dearest pays in any.

    Args:
        systems: One for each robot.
        first: Found without weights.
        search: Finds a least sum for systems with other costs.
    """
    count = len(systems)
    weights = [1.0] * count  # they add up to `count`
    best, bound, last = first, None if first.least is None else first.least / count, first
    for number in range(1, _ROUNDS + 1):
        dearest = max(best.costs)
        if dearest <= 0.0 or (bound is not None and dearest <= bound + _TIES):
            break
        paid = max(last.costs) or 1.0
        weights = [w * math.exp(_STEP / number * own / paid) for w, own in zip(weights, last.costs, strict=True)]
        weights = [w * count / sum(weights) for w in weights]
        found = _found(search, [_weighted(system, w) for system, w in zip(systems, weights, strict=True)])
        if found is None:
            break
        last = found
        if max(found.costs) < max(best.costs) - _TIES:
            best = found
        if found.least is not None:
            bound = max(bound or 0.0, found.least / count)
    return _kept_out(systems, best, bound, search), bound


def _found(
    search: Callable[[Sequence[TransitionSystem]], LeastSum[Plan] | None], systems: Sequence[TransitionSystem]
) -> LeastSum[Plan] | None:
    try:
        return search(systems)
    except (TooLarge, Infeasible):
        return None


def _kept_out(
    systems: Sequence[TransitionSystem],
    best: LeastSum[Plan],
    bound: float | None,
    search: Callable[[Sequence[TransitionSystem]], LeastSum[Plan] | None],
) -> LeastSum[Plan]:
    """Return a plan whose dearest robot pays less, by keeping the dearest robot out of its regions for as long as that helps."""
    worlds, tries = list(systems), 0
    while tries < _TRIES and (bound is None or max(best.costs) > bound + _TIES):
        dearest = max(range(len(best.costs)), key=lambda robot: best.costs[robot])
        world = worlds[dearest]
        regions = (
            {region for node in best.paths[dearest] for region in world.nodes[node].regions} if world.nodes else set[str]()
        )
        shut = [_without(world, region) for region in sorted(regions)[: _TRIES - tries]]
        tries += max(1, len(shut))
        found = [_found(search, [*worlds[:dearest], other, *worlds[dearest + 1 :]]) for other in shut]
        lower = [(max(each.costs), index) for index, each in enumerate(found) if each is not None]
        least, index = min(lower, default=(math.inf, 0))
        if least >= max(best.costs) - _TIES or (better := found[index]) is None:
            break
        best, worlds[dearest] = better, shut[index]
    return best


def _without(system: TransitionSystem, region: str) -> TransitionSystem:
    """Return what a robot can do that never enters a region."""
    into = [region in node.regions for node in system.nodes]
    return replace(system, edges=tuple(tuple(step for step in row if not into[step[0]]) for row in system.edges))


def _weighted(system: TransitionSystem, weight: float) -> TransitionSystem:
    edges = tuple(tuple((target, cost * weight) for target, cost in row) for row in system.edges)
    final = None if system.final is None else {node: cost * weight for node, cost in system.final.items()}
    return replace(system, edges=edges, final=final)
