"""Sharing many tasks so that the dearest robot costs little, where an exact search is out of reach: auctions, then exchanges.

Tasks here are the conjuncts that any robot can do at any time: nothing ever loses them, and what is done stays done (`F a`,
`F(a & F b)`). Each is given to one robot, whose path for all of its tasks is a cheapest one that also keeps all other conjuncts by
itself. Where no robot needs more than one, a bottleneck assignment shares them (Gross 1959); else they are auctioned one after another
to whom they leave the cheapest path (minimax sequential auctions: Lagoudakis et al. 2005), and then the dearest robot's tasks are
given away or exchanged for as long as that helps. Nothing here proves that words keep the formula in all orders: who calls looks.

With n robots and m tasks: a table of n x m costs, then some m paths for one robot each (`task_paths`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ltlplan.logic.conjunct_automata import Deterministic, Part, is_task, reached_states
from ltlplan.logic.product_automaton import Task
from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.task_paths import GRAIN, Steps, TaskPaths
from ltlplan.search.team_planning import TeamRun

MOST_STEPS = 3_000_000
"""Steps between places, of all robots that share none, up to which tables of costs are made."""


def share_by_insertion(
    graph: ReducedGraph, task: Task, allows: Callable[[int, float], bool], states: int
) -> tuple[TeamRun, float] | None:
    """Share a task's conjuncts among robots.

    Args:
        graph: The team's graph.
        task: What is to be done.
        allows: Whether a robot, by index, may cost that much.
        states: How many states of single robots may be looked at; what was found until then stands.

    Returns:
        A path for each robot, each cheapest for what that robot is to do, and a bound: no plan's dearest robot costs less. None where a conjunct
        is neither a task nor kept by robots that rest at their starts, or where no way to share was found.
    """
    steps = Steps(graph)
    if len(steps.source) > MOST_STEPS:
        return None
    kinds = [isinstance(part, Deterministic) and is_task(part, reached_states(part)) for part in task.parts]
    kept = tuple(index for index, is_free in enumerate(kinds) if not is_free)
    tasks = tuple(index for index, is_free in enumerate(kinds) if is_free and not _done_at_start(graph, task.parts[index]))
    robots = TaskPaths(task, steps, kept, tasks, allows, states)
    if not all(len(robots.flight(robot, frozenset())[1]) == 1 for robot in range(len(graph.start))):
        return None
    found = _assigned(robots) or _auctioned(robots)
    if found is None:
        return None
    found = _exchanged(robots, found)
    flights = [robots.flight(robot, own) for robot, own in enumerate(found)]
    paths = tuple(graph.expand(robot, nodes) for robot, (_, nodes) in enumerate(flights))
    return TeamRun(paths, max(cost for cost, _ in flights), states - robots.states_left), robots.bound


def _done_at_start(graph: ReducedGraph, part: Part) -> bool:
    letters = {graph.label[robot][node] for robot, node in enumerate(graph.start)}
    return any(part.accepting(part.row(part.initial)[letter]) for letter in letters)


def _assigned(robots: TaskPaths) -> list[frozenset[int]] | None:
    """Give each robot at most one task so that the dearest costs least, and all together as little as then possible."""
    pairs = cheapest_assignment(robots.alone, longest=True, slack=GRAIN) if len(robots.tasks) <= len(robots) else None
    if pairs is None:
        return None
    found = [frozenset(robots.tasks[column] for row, column in pairs if row == robot) for robot in range(len(robots))]
    return found if max(robots.cost(robot, tasks) for robot, tasks in enumerate(found)) < np.inf else None


def _auctioned(robots: TaskPaths) -> list[frozenset[int]] | None:
    """Give the tasks away one after another, each time the one whose best bidder then pays least."""
    found = [frozenset[int]() for _ in range(len(robots))]
    bids = robots.alone.copy()  # lower bounds until they are looked at, as they grow while the robot wins others
    while np.isfinite(bids).any():
        robot, column = map(int, np.unravel_index(np.argmin(bids), bids.shape))
        won = found[robot] | {robots.tasks[column]}
        cost = robots.cost(robot, won)
        if robots.spent:
            return None
        if cost > bids[robot, column] + GRAIN:
            bids[robot, column] = cost
        else:
            found[robot], bids[:, column] = won, np.inf
    return found if sum(map(len, found)) == len(robots.tasks) else None


def _exchanged(robots: TaskPaths, found: list[frozenset[int]]) -> list[frozenset[int]]:
    """Give the dearest robot's tasks away, or exchange them, for as long as that lowers the dearest."""
    found = list(found)
    while not robots.spent:
        costs = [robots.cost(robot, tasks) for robot, tasks in enumerate(found)]
        dearest = max(range(len(costs)), key=lambda robot: costs[robot])
        if costs[dearest] <= robots.bound + 2 * GRAIN:
            break
        better = next(_lower(robots, found, dearest, costs[dearest]), None)
        if better is None:
            break
        other, own, others = better
        found[dearest], found[other] = own, others
    return found


def _lower(
    robots: TaskPaths, found: Sequence[frozenset[int]], dearest: int, most: float
) -> Iterator[tuple[int, frozenset[int], frozenset[int]]]:
    """Yield another robot and what both then do, where neither costs as much as the dearest did."""
    own = sorted(found[dearest])
    others = [robot for robot in range(len(robots)) if robot != dearest]
    given = [(robot, index, None) for index in own for robot in others]
    swapped = [(robot, index, back) for index in own for robot in others for back in sorted(found[robot])]
    for robot, index, back in itertools.chain(given, swapped):
        mine = found[dearest] - {index} | ({back} if back is not None else set[int]())
        theirs = found[robot] - {back} | {index} if back is not None else found[robot] | {index}
        if max(robots.least(robot, theirs), robots.least(dearest, mine)) < most - GRAIN:
            if robots.cost(robot, theirs) < most - GRAIN and robots.cost(dearest, mine) < most - GRAIN:
                yield robot, mine, theirs
            if robots.spent:
                return
