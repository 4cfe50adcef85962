"""What tasks cost single robots: a table of what is left to fly to do each alone, and cheapest paths for sets of them.

With n robots and m tasks: a table of n x m costs by one search backwards from each task, then a path for one robot each time one is asked for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.logic.product_automaton import Task
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.robot_paths import is_done, path_search

Floats = NDArray[np.float64]
States = tuple[int, ...]

GRAIN = 1e-6
"""Costs that differ by less are the same: tiny amounts break ties between equally long ways."""


class Steps:
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
        places = [(max(owner, 0), node) for owner, node in names]
        after = [graph.successors(robot, node) for robot, node in places]
        rows = [
            (number, self.number[graph.key(robot, target)], cost)
            for number, ((robot, _), here) in enumerate(zip(places, after, strict=True))
            for target, cost in here.edges
        ]
        steps = np.array(rows, dtype=np.float64).reshape(-1, 3)
        self.source, self.target, self.cost = steps[:, 0].astype(np.int64), steps[:, 1].astype(np.int64), steps[:, 2]
        self.letter = np.array([graph.label[robot][node] for robot, node in places], dtype=np.int64)
        self.ending = np.array([np.inf if here.ending is None else here.ending for here in after])

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


class TaskPaths:
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
        steps: Steps,
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
        self._column = {index: column for column, index in enumerate(tasks)}
        starts = [steps.number[graph.key(robot, node)] for robot, node in enumerate(graph.start)]
        self.alone = np.zeros((len(starts), len(tasks)))
        firsts: list[float] = [0.0]
        for column, index in enumerate(tasks):
            part = task.parts[index]
            assert isinstance(part, Deterministic)  # tasks are
            left = self._left[index] = steps.left(part)
            begun = [part.row(part.initial)[letter] for letter in steps.letter[starts]]
            self.alone[:, column] = left[starts, begun]
            if len(part.identity) == 2:  # one letter does it, so one robot does
                firsts.append(float(self.alone[:, column].min()))
        self.bound = max(firsts) - GRAIN

    def __len__(self) -> int:
        return len(self._graph.start)

    @property
    def spent(self) -> bool:
        """Whether no more states may be looked at."""
        return self.states_left <= 0

    def cost(self, robot: int, tasks: frozenset[int]) -> float:
        """Return what a robot's cheapest path for some tasks costs; infinite where there is none.

        Args:
            robot: By index.
            tasks: Conjuncts, by index.
        """
        return self.flight(robot, tasks)[0]

    def least(self, robot: int, tasks: frozenset[int]) -> float:
        """Return a lower bound on that cost, without a search.

        Args:
            robot: By index.
            tasks: Conjuncts, by index.
        """
        known = self._known.get((robot, tasks))
        if known is not None:
            return known[0]
        return max((float(self.alone[robot, self._column[index]]) for index in tasks), default=0.0)

    def flight(self, robot: int, tasks: frozenset[int]) -> tuple[float, list[int]]:
        """Return a robot's cheapest path for some tasks, as nodes that matter, and its cost; infinite where there is none.

        Args:
            robot: By index.
            tasks: Conjuncts, by index.
        """
        key = (robot, tasks)
        if key not in self._known:
            self._known[key] = self._searched(robot, tasks)
        return self._known[key]

    def _searched(self, robot: int, tasks: frozenset[int]) -> tuple[float, list[int]]:
        """A* over the robot's node and the states of the kept conjuncts and of the tasks."""
        graph, label, order = self._graph, self._graph.label[robot], (*self._kept, *sorted(tasks))
        parts = [self._parts[index] for index in order]
        left = [(place, self._left[index]) for place, index in enumerate(order) if index in tasks]
        number, key_of = self._steps.number, graph.key

        def read(states: States, letter: int) -> States | None:
            after = tuple(part.row(state)[letter] for part, state in zip(parts, states, strict=True))
            return None if DEAD in after else after

        def may_end(states: States) -> bool:
            return all(part.accepting(state) for part, state in zip(parts, states, strict=True))

        def heuristic(key: tuple[int, States]) -> float:
            at = number[key_of(robot, key[0])]
            return max((float(table[at, key[1][place]]) for place, table in left), default=0.0)

        start = graph.start[robot]
        begin = read(tuple(part.initial for part in parts), label[start])
        if begin is None:
            return np.inf, []
        search = path_search(graph, robot, (start, begin), read, may_end, heuristic)
        for key, cost, _ in search:
            self.states_left -= 1
            if is_done(key):
                nodes = [node for node, _ in search.path(key)[:-1]]
                return (cost, nodes) if self._allows(robot, cost) else (np.inf, [])
            if self.spent:
                break
        return np.inf, []
