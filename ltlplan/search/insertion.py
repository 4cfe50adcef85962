"""Sharing many tasks so that the dearest robot costs little, where an exact search is out of reach: auctions, then exchanges.

Tasks here are the conjuncts that any robot can do at any time: nothing ever loses them, and what is done stays done (`F a`,
`F(a & F b)`). Each is given to one robot, whose path for all of its tasks is a cheapest one that also keeps all other conjuncts by
itself. Where no robot needs more than one, a bottleneck assignment shares them (Gross 1959); else they are auctioned one after another
to whom they leave the cheapest path (minimax sequential auctions: Lagoudakis et al. 2005), and then the dearest robot's tasks are
given away or exchanged for as long as that helps. Nothing here proves that words keep the formula in all orders: who calls looks.

With n robots and m tasks: a table of n x m costs by one search backwards from each task, then some m paths for one robot each.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra, maximum_bipartite_matching

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_readers import Deterministic, Part
from ltlplan.logic.task import Task
from ltlplan.search.best_first import BestFirst
from ltlplan.search.reduced_graph import ReducedGraph

Floats = NDArray[np.float64]
States = tuple[int, ...]

MOST_STEPS = 3_000_000
"""Steps between places, of all robots that share none, up to which tables of costs are made."""

_GRAIN = 1e-6  # costs that differ by less are the same: tiny amounts break ties between equally long ways
_DONE = (-1, -1, ())  # where a robot's path is complete


@dataclass(frozen=True, slots=True)
class Shared:
    """Tasks shared among robots.

    Attributes:
        paths: The nodes of each robot's system.
        costs: What each robot's path costs.
        bound: No plan's dearest robot costs less.
        reached: States that were looked at.
    """

    paths: tuple[tuple[int, ...], ...]
    costs: tuple[float, ...]
    bound: float
    reached: int


def share_by_insertion(graph: ReducedGraph, task: Task, allows: Callable[[int, float], bool], states: int) -> Shared | None:
    """Share a task's conjuncts among robots.

    Args:
        graph: The team's graph.
        task: What is to be done.
        allows: Whether a robot, by index, may cost that much.
        states: How many states of single robots may be looked at; what was found until then stands.

    Returns:
        A path for each robot, each cheapest for what that robot is to do; None where a conjunct is neither a task nor kept by robots
        that rest at their starts, or where no way to share was found.
    """
    steps = _Steps(graph)
    if len(steps.source) > MOST_STEPS:
        return None
    tasks = [index for index, part in enumerate(task.parts) if _is_task(part)]
    kept = [index for index in range(len(task.parts)) if index not in set(tasks)]
    open_tasks = [index for index in tasks if not _done_at_start(graph, task.parts[index])]
    robots = _Robots(task, steps, tuple(kept), tuple(open_tasks), allows, states)
    if not all(len(robots.flight(robot, frozenset())[1]) == 1 for robot in range(len(graph.start))):
        return None
    found = _assigned(robots) or _auctioned(robots)
    if found is None:
        return None
    found = _exchanged(robots, found)
    flights = [robots.flight(robot, own) for robot, own in enumerate(found)]
    paths = tuple(graph.expand(robot, nodes) for robot, (_, nodes) in enumerate(flights))
    return Shared(paths, tuple(cost for cost, _ in flights), robots.bound, states - robots.states_left)


def _is_task(part: Part) -> bool:
    """Tell whether a conjunct is never lost, and what is done stays done."""
    if not isinstance(part, Deterministic):
        return False
    reached, waiting = {part.initial}, [part.initial]
    for state in waiting:  # grows while it is walked
        row = part.row(state)
        if DEAD in row or (part.accepting(state) and not all(part.accepting(after) for after in row)):
            return False
        more = set(row) - reached
        reached |= more
        waiting += sorted(more)
    return not part.accepting(part.initial)


def _done_at_start(graph: ReducedGraph, part: Part) -> bool:
    letters = {graph.label[robot][node] for robot, node in enumerate(graph.start)}
    return any(part.accepting(part.row(part.initial)[letter]) for letter in letters)


class _Steps:
    """All steps between nodes that matter, as arrays.

    Attributes:
        graph: The team's.
        number: Of each node, by its name in the whole team.
        source, target: Numbers of the nodes of each step. Shape (steps,).
        cost: Of each step. Shape (steps,).
        letter: What each node shows. Shape (nodes,).
        ending: What it costs to end at each node; infinite where a robot may not. Shape (nodes,).
    """

    def __init__(self, graph: ReducedGraph) -> None:
        names = graph.reached()
        self.graph = graph
        self.number = {name: number for number, name in enumerate(names)}
        rows: list[tuple[int, int, float]] = []
        letters: list[int] = []
        endings: list[float] = []
        for number, (owner, node) in enumerate(names):
            robot = max(owner, 0)
            here = graph.successors(robot, node)
            letters.append(graph.label[robot][node])
            endings.append(np.inf if here.ending is None else here.ending)
            rows += [(number, self.number[graph.key(robot, target)], cost) for target, cost in here.edges]
        self.source = np.array([row[0] for row in rows], dtype=np.int64)
        self.target = np.array([row[1] for row in rows], dtype=np.int64)
        self.cost = np.array([row[2] for row in rows])
        self.letter, self.ending = np.array(letters, dtype=np.int64), np.array(endings)

    def left(self, part: Deterministic) -> Floats:
        """Return what is left to fly from each node until one conjunct is done and the path has ended.

        Args:
            part: The conjunct; its state at a node is the one after the node's letter was read.

        Returns:
            Least costs, infinite where there is no way. Shape (nodes, states).
        """
        nodes, states = len(self.letter), len(part.identity)
        rows = np.array([part.row(state) for state in part.identity], dtype=np.int64)
        after = rows[:, self.letter[self.target]]  # (states, steps)
        goal = nodes * states
        accepting = np.array([part.accepting(state) for state in part.identity])
        ends = np.flatnonzero((accepting[:, None] & np.isfinite(self.ending)[None, :]).ravel())
        back_from = np.concatenate([(after * nodes + self.target).ravel(), np.full(len(ends), goal)])
        back_to = np.concatenate([(np.arange(states)[:, None] * nodes + self.source).ravel(), ends])
        costs = np.concatenate([np.tile(self.cost, states), np.tile(self.ending, states)[ends]])
        graph = csr_matrix((np.maximum(costs, 1e-12), (back_from, back_to)), shape=(goal + 1, goal + 1))
        return dijkstra(graph, indices=goal)[:goal].reshape(states, nodes).T


class _Robots:
    """What tasks cost each robot.

    Args:
        task: What is to be done.
        steps: The team's graph, as arrays.
        kept: Conjuncts, by index, that every robot keeps by itself.
        tasks: Conjuncts, by index, that are to be shared.
        allows: Whether a robot may cost that much.
        states: How many states may be looked at.

    Attributes:
        tasks: As given.
        alone: What each robot pays for each task and nothing else, at least. Shape (robots, tasks).
        bound: No plan's dearest robot costs less.
        states_left: How many states may still be looked at.
    """

    def __init__(
        self,
        task: Task,
        steps: _Steps,
        kept: tuple[int, ...],
        tasks: tuple[int, ...],
        allows: Callable[[int, float], bool],
        states: int,
    ) -> None:
        graph = self._graph = steps.graph
        self._parts, self._steps, self._kept, self.tasks = task.parts, steps, kept, tasks
        self._allows, self.states_left = allows, states
        self._left: dict[int, Floats] = {}
        self._known: dict[tuple[int, frozenset[int]], tuple[float, list[int]]] = {}
        starts = [steps.number[graph.key(robot, node)] for robot, node in enumerate(graph.start)]
        self.alone = np.zeros((len(starts), len(tasks)))
        firsts: list[float] = [0.0]
        for column, index in enumerate(tasks):
            part = self._deterministic(index)
            left = self._left[index] = steps.left(part)
            begun = [part.row(part.initial)[letter] for letter in steps.letter[starts]]
            self.alone[:, column] = left[starts, begun]
            if len(part.identity) == 2:  # one letter does it, so one robot does
                firsts.append(float(self.alone[:, column].min()))
        self.bound = max(firsts) - _GRAIN

    def __len__(self) -> int:
        return len(self._graph.start)

    @property
    def spent(self) -> bool:
        """Whether no more states may be looked at."""
        return self.states_left <= 0

    def cost(self, robot: int, tasks: frozenset[int]) -> float:
        """Return what a robot's cheapest path for some tasks costs; infinite where there is none."""
        return self.flight(robot, tasks)[0]

    def least(self, robot: int, tasks: frozenset[int]) -> float:
        """Return a lower bound on that cost, without a search."""
        known = self._known.get((robot, tasks))
        if known is not None:
            return known[0]
        return max((float(self.alone[robot, self._column[index]]) for index in tasks), default=0.0)

    def flight(self, robot: int, tasks: frozenset[int]) -> tuple[float, list[int]]:
        """Return a robot's cheapest path for some tasks, as nodes that matter, and its cost; infinite where there is none."""
        key = (robot, tasks)
        if key not in self._known:
            self._known[key] = self._searched(robot, tasks)
        return self._known[key]

    @cached_property
    def _column(self) -> dict[int, int]:
        return {index: column for column, index in enumerate(self.tasks)}

    def _deterministic(self, index: int) -> Deterministic:
        part = self._parts[index]
        assert isinstance(part, Deterministic)  # tasks are
        return part

    def _searched(self, robot: int, tasks: frozenset[int]) -> tuple[float, list[int]]:
        """A* over the robot's node and the states of the kept conjuncts and of the tasks."""
        graph, label, order = self._graph, self._graph.label[robot], (*self._kept, *sorted(tasks))
        parts = [self._parts[index] for index in order]
        left = [(place, self._left[index]) for place, index in enumerate(order) if index in tasks]
        number, key_of = self._steps.number, graph.key

        def read(states: States, letter: int) -> States | None:
            after = tuple(part.row(state)[letter] for part, state in zip(parts, states, strict=True))
            return None if DEAD in after else after

        def successors(key: tuple[int, int, States]) -> Iterator[tuple[tuple[int, int, States], float]]:
            _, node, states = key
            here = graph.successors(robot, node)
            if here.ending is not None and all(part.accepting(state) for part, state in zip(parts, states, strict=True)):
                yield _DONE, here.ending
            for target, step in here.edges:
                after = read(states, label[target])
                if after is not None and not (after == states and graph.redundant(robot, node, target, step)):
                    yield (0, target, after), step

        def heuristic(key: tuple[int, int, States]) -> float:
            if key == _DONE:
                return 0.0
            at = number[key_of(robot, key[1])]
            return max((float(table[at, key[2][place]]) for place, table in left), default=0.0)

        start = graph.start[robot]
        begin = read(tuple(part.initial for part in parts), label[start])
        if begin is None:
            return np.inf, []
        search = BestFirst([(0, start, begin)], successors, heuristic)
        for key, cost, _ in search:
            self.states_left -= 1
            if key == _DONE:
                nodes = [node for _, node, _ in search.path(key)[:-1]]
                return (cost, nodes) if self._allows(robot, cost) else (np.inf, [])
            if self.spent:
                break
        return np.inf, []


def _assigned(robots: _Robots) -> list[frozenset[int]] | None:
    """Give each robot at most one task so that the dearest costs least, and all together as little as then possible."""
    if len(robots.tasks) > len(robots):
        return None
    from scipy.optimize import linear_sum_assignment  # here: it takes long to load, and few plans need it

    costs = robots.alone
    limits = np.unique(costs[np.isfinite(costs)])
    low, high = 0, len(limits)
    while low < high:
        middle = (low + high) // 2
        matched = maximum_bipartite_matching(csr_matrix(limits[middle] >= costs.T), perm_type="column")
        low, high = (low, middle) if (matched >= 0).all() else (middle + 1, high)
    if low == len(limits):
        return None
    cheap = np.where(costs <= limits[low] + _GRAIN, costs, 1e6 * (1.0 + limits[low]))
    rows, columns = linear_sum_assignment(cheap)
    own = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    found = [frozenset([robots.tasks[own[robot]]] if robot in own else list[int]()) for robot in range(len(robots))]
    return found if max(robots.cost(robot, tasks) for robot, tasks in enumerate(found)) < np.inf else None


def _auctioned(robots: _Robots) -> list[frozenset[int]] | None:
    """Give the tasks away one after another, each time the one whose best bidder then pays least."""
    found = [frozenset[int]() for _ in range(len(robots))]
    taken: set[int] = set()
    bids = [(robots.least(robot, frozenset({index})), robot, index) for robot in range(len(robots)) for index in robots.tasks]
    heapq.heapify(bids)
    while len(taken) < len(robots.tasks) and bids:
        bid, robot, index = heapq.heappop(bids)
        if index in taken:
            continue
        cost = robots.cost(robot, found[robot] | {index})
        if robots.spent:
            return None
        if cost == np.inf:
            continue
        if cost > bid + _GRAIN:  # bids are lower bounds until they are looked at, and grow as the robot wins others
            heapq.heappush(bids, (cost, robot, index))
            continue
        found[robot] |= {index}
        taken.add(index)
    return found if len(taken) == len(robots.tasks) else None


def _exchanged(robots: _Robots, found: list[frozenset[int]]) -> list[frozenset[int]]:
    """Give the dearest robot's tasks away, or exchange them, for as long as that lowers the dearest."""
    found = list(found)
    while not robots.spent:
        costs = [robots.cost(robot, tasks) for robot, tasks in enumerate(found)]
        dearest = max(range(len(costs)), key=lambda robot: costs[robot])
        if costs[dearest] <= robots.bound + 2 * _GRAIN:
            break
        better = next(_lower(robots, found, dearest, costs[dearest]), None)
        if better is None:
            break
        other, own, others = better
        found[dearest], found[other] = own, others
    return found


def _lower(
    robots: _Robots, found: Sequence[frozenset[int]], dearest: int, most: float
) -> Iterator[tuple[int, frozenset[int], frozenset[int]]]:
    """Yield another robot and what both then do, where neither costs as much as the dearest did."""
    own = sorted(found[dearest])
    others = [robot for robot in range(len(robots)) if robot != dearest]
    given = [(robot, index, None) for index in own for robot in others]
    swapped = [(robot, index, back) for index in own for robot in others for back in sorted(found[robot])]
    for robot, index, back in itertools.chain(given, swapped):
        mine = found[dearest] - {index} | ({back} if back is not None else set[int]())
        theirs = found[robot] - {back} | {index} if back is not None else found[robot] | {index}
        if max(robots.least(robot, theirs), robots.least(dearest, mine)) < most - _GRAIN:
            if robots.cost(robot, theirs) < most - _GRAIN and robots.cost(dearest, mine) < most - _GRAIN:
                yield robot, mine, theirs
            if robots.spent:
                return
