"""Plans of teams whose robots are counted: paths, concurrent steps, and the robots that rest between these."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ltlplan.search.counting.concurrent_steps import stages
from ltlplan.search.counting.counting_propositions import Marks, Sums
from ltlplan.systems.transition_systems import TransitionSystem

Turn = tuple[int, int, int]
"""A robot's move in a plan: which robot, and its places in its path before and after that move."""


@dataclass(frozen=True, slots=True)
class CountedPlan:
    """The robots' paths, and which robot waits for which others.

    Attributes:
        paths: Nodes of each robot's system.
        turns: Moves, in an order that satisfies the formula.
        stages: Turns, by index, that are made at the same time; those of one stage begin when all of the one before have ended.
        cost: Sum over the robots, or the highest cost of one.
        bound: No plan that makes one move after another costs less.
        reached: States that were seen.
        stays: Whether some robot stays for good where no other robot can wait for it.
    """

    paths: tuple[tuple[int, ...], ...]
    turns: tuple[Turn, ...]
    stages: tuple[tuple[int, ...], ...]
    cost: float
    bound: float
    reached: int
    stays: bool = False


@dataclass(frozen=True, slots=True)
class Flown:
    """One robot's move in a plan.

    Attributes:
        robot: Its number.
        path: Nodes of its system after the one that it leaves.
        shown: The marks that it makes on the way.
        cost: Of the way.
    """

    robot: int
    path: tuple[int, ...]
    shown: tuple[Sums, ...]
    cost: float


def in_stages(systems: Sequence[TransitionSystem], marks: Marks, moves: Sequence[Flown]) -> CountedPlan | None:
    """Return a plan in as few concurrent steps as its order allows; None where its moves, one after another, violate the formula.

    Args:
        systems: One for each robot.
        marks: The formula's propositions.
        moves: In order.

    Returns:
        The cost is the sum of the moves; the bound and the states are left at 0.
    """
    begin = [marks.of(system.robot, system.labels[system.initial]) for system in systems]
    found = stages(marks, begin, [(move.robot, move.shown) for move in moves])
    if found is None:
        return None
    paths: list[tuple[int, ...]] = [(system.initial,) for system in systems]
    turns: list[Turn] = []
    for move in moves:
        before = paths[move.robot]
        paths[move.robot] = (*before, *move.path)
        turns.append((move.robot, len(before), len(paths[move.robot])))
    return CountedPlan(tuple(paths), tuple(turns), tuple(found), sum(move.cost for move in moves), 0.0, 0)


def has_room(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them between two stages, and at the end.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    return not rooms or all(
        _regions(systems, enumerate(after))[region] <= most for _, _, after in _rests(plan) for region, most in rooms.items()
    )


def paths_are_free(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them, and no robot flies through one that resting robots fill.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    for at, stage, _ in _rests(plan):
        moving = {plan.turns[turn][0] for turn in stage}
        waiting = _regions(systems, ((robot, node) for robot, node in enumerate(at) if robot not in moving))
        for robot, before, after in (plan.turns[turn] for turn in stage):
            passed = _regions(systems, ((robot, node) for node in plan.paths[robot][before:after]))
            if any(waiting[region] >= rooms[region] for region in passed.keys() & rooms.keys()):
                return False
    return has_room(systems, plan, rooms)


def stays_apart(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether no robot waits for another, and no small region has too many in it or just outside it in the end.

    Where to hover outside regions beside others, and to wait there, is not planned.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    ends = Counter(system.nodes[path[-1]].place for system, path in zip(systems, plan.paths, strict=True))
    fits = all(ends[region] <= most for region, most in rooms.items())
    return fits and len(plan.stages) == 1 and paths_are_free(systems, plan, rooms)


def _rests(plan: CountedPlan) -> Iterator[tuple[Sequence[int], tuple[int, ...], Sequence[int]]]:
    """Yield each stage with the node of each robot before and after it."""
    at = tuple(path[0] for path in plan.paths)
    for stage in plan.stages:
        ends = {plan.turns[turn][0]: plan.turns[turn][2] for turn in stage}  # of several turns of one robot the last one
        after = tuple(plan.paths[robot][ends[robot] - 1] if robot in ends else node for robot, node in enumerate(at))
        yield at, stage, after
        at = after


def _regions(systems: Sequence[TransitionSystem], nodes: Iterable[tuple[int, int]]) -> Counter[str]:
    """Return how often each region occurs in the nodes of some robots."""
    return Counter(region for robot, node in nodes for region in systems[robot].nodes[node].regions)
