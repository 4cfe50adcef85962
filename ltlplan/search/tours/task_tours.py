"""Costs of tasks for single robots, one after another by cheapest ways, each of which is found once.

A tour does tasks in a stated order, each by a cheapest way from where the one before was done. It is a path over the nodes that matter of the
graph of the exact search, and keeps what every robot has to keep (`task_kinds`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.product_automaton import Task
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.tours.task_kinds import TaskKinds

Watched = tuple[tuple[int, ...], ...]
"""Of each conjunct that every robot watches: where its word has led the initial state and the accepting ones."""
Place = tuple[int, Watched]
"""A node of a robot's graph, and what it watches."""
_DONE = -1  # in place of a node, where a robot's path is complete
_Read = TypeVar("_Read", bound=Hashable)


def path_search(
    graph: ReducedGraph,
    robot: int,
    begin: tuple[int, _Read],
    read: Callable[[_Read, int], _Read | None],
    may_end: Callable[[_Read], bool] | None = None,
) -> BestFirst[tuple[int, _Read]]:
    """Return a search over the paths of one robot: over its nodes that matter, and the states of what reads their letters.

    Args:
        graph: The team's.
        robot: By index.
        begin: Its node, and the state there.
        read: The state after a letter; None where nothing is to be gone on with.
        may_end: Whether a path may end in a state; the search then ends at `_DONE`. None: it walks all paths.
    """
    label = graph.label[robot]

    def successors(key: tuple[int, _Read]) -> Iterator[tuple[tuple[int, _Read], float]]:
        node, state = key
        if node == _DONE:
            return
        here = graph.successors(robot, node)
        if may_end is not None and here.ending is not None and may_end(state):
            yield (_DONE, begin[1]), here.ending
        for target, step in here.edges:
            after = read(state, label[target])
            if after is not None:
                yield (target, after), step

    return BestFirst([begin], successors, ties="first")


@dataclass(frozen=True, slots=True)
class Tour:
    """A cheapest way on of one robot, or all of its tour: its tasks, one after another.

    Attributes:
        cost: Of the way; infinite where there is none.
        end: Where it leads; of a tour, where the last task is done.
        nodes: That matter, of the robot's graph; of a way on the first one is left out.
    """

    cost: float
    end: Place
    nodes: tuple[int, ...] = ()


class Tours:
    """Costs of robots' tours.

    Attributes:
        tasks: Conjuncts that some robot has to do, by index; those that starts do are left out.
        kinds: The conjuncts by kind.
        priced: How many tours were priced.
    """

    def __init__(self, graph: ReducedGraph, task: Task, kinds: TaskKinds, most: Sequence[float] | None = None) -> None:
        """Prepare tours; legs are found when they are asked for.

        Args:
            graph: The team's graph.
            task: What is to be done.
            kinds: Its conjuncts by kind.
            most: What each robot may cost at most, if anything.
        """
        self.kinds, self._graph, self._parts, self.priced = kinds, graph, task.parts, 0
        self._most = most or [math.inf] * len(graph.start)
        starts = [graph.label[robot][node] for robot, node in enumerate(graph.start)]
        done = {i for i in kinds.free for letter in starts if kinds.done_by(i, letter)}
        self.tasks = tuple(i for i in (*kinds.free, *kinds.own) if i not in done)
        self._of_a_letter = frozenset(i for i in self.tasks if i in kinds.free and self._is_done_by_a_letter(i))
        letters = range(len(task.letters))
        self._doing = [frozenset(i for i in self._of_a_letter if kinds.done_by(i, letter)) for letter in letters]
        self._moved = [  # tasks that each letter takes to another state
            [i for i in self.tasks if any(self._parts[i].row(state)[letter] != state for state in kinds.reached[i])]
            for letter in letters
        ]
        self._watched = (*kinds.own, *kinds.kept)
        first = tuple(kinds.begun(index) for index in self._watched)
        self._begin = [self._read(first, letter) for letter in starts]

    def __len__(self) -> int:
        return len(self._graph.start)

    @memoized
    def tour(self, robot: int, tasks: tuple[int, ...]) -> Tour:
        """Return what a robot does to make some tasks in order.

        Args:
            robot: Which one.
            tasks: Conjuncts, by index; one that takes several letters may stand twice, where it is gone on with and where it is done.
        """
        self.priced += 1
        begun, start, label = self._begin[robot], self._graph.start[robot], self._graph.label[robot]
        nowhere = Tour(math.inf, (start, ()))
        if begun is None:
            return nowhere
        at, cost, nodes = (start, begun), 0.0, [start]
        states = {task: self._parts[task].row(self._parts[task].initial)[label[start]] for task in tasks}
        for place, task in enumerate(tasks, start=1):
            if self._parts[task].accepting(states[task]):
                continue
            leg = self._leg(self._owner(robot, at), at, task, states[task], task in tasks[place:])
            if leg is None:
                return nowhere
            cost, at = cost + leg.cost, leg.end
            nodes += leg.nodes
            for letter in [label[node] for node in leg.nodes]:
                states.update({t: self._parts[t].row(states[t])[letter] for t in self._moved[letter] if t in states})
        last = self._finish(self._owner(robot, at), at, frozenset(tasks).intersection(self.kinds.own))
        if last is None or cost + last.cost > self._most[robot]:
            return nowhere
        return Tour(cost + last.cost, at, (*nodes, *last.nodes))

    def more(self, tasks: tuple[int, ...], task: int) -> Iterator[tuple[int, ...]]:
        """Yield tours with one more task: one that takes several letters may be begun before others and done after them.

        Args:
            tasks: That are done so far.
            task: The one more.
        """
        for at in range(len(tasks) + 1):
            begun = (*tasks[:at], task)
            yield (*begun, *tasks[at:])
            if task in self.kinds.free and task not in self._of_a_letter:
                yield from ((*begun, *tasks[at:end], task, *tasks[end:]) for end in range(at + 1, len(tasks) + 1))

    def dearest_alone(self) -> float:
        """Return the cost of the dearest task of one letter, done by whoever does it and nothing else most cheaply."""
        alone = [min(self.tour(robot, (task,)).cost for robot in range(len(self))) for task in self._of_a_letter]
        return max((cost for cost in alone if cost < math.inf), default=0.0)

    @memoized
    def away(self, robot: int, task: int) -> dict[int, float]:
        """Return how far tasks are from where a robot does one: what it costs to do each of them next, where there is a way.

        Args:
            robot: Whose costs count.
            task: The one that it does first.
        """
        done = self.tour(robot, (task,))
        at, others = done.end, self.tasks if done.cost < math.inf else ()
        legs = ((t, self._leg(self._owner(robot, at), at, t, self._parts[t].initial, False)) for t in others)
        return {task: leg.cost for task, leg in legs if leg is not None}

    def _is_done_by_a_letter(self, index: int) -> bool:
        part = self._parts[index]
        return all(after == part.initial or part.accepting(after) for after in part.row(part.initial))

    def _read(self, watched: Watched, letter: int) -> Watched | None:
        """Return what is watched after a letter; None where a conjunct is lost."""
        found: list[tuple[int, ...]] = []
        for index, states in zip(self._watched, watched, strict=True):
            row = self._parts[index].row
            after = tuple([row(state)[letter] for state in states])
            if DEAD in after:
                return None
            found.append(after)
        return tuple(found)

    def _may_end(self, watched: Watched, own: frozenset[int]) -> bool:
        """Tell whether a robot's word may end: what it does is done, and what others do is as it was, or done."""
        others_do = set(self.kinds.own) - own
        return all(
            (part.accepting(first) or (index in others_do and first == part.initial)) and all(map(part.accepting, others))
            for index, (first, *others) in zip(self._watched, watched, strict=True)
            for part in (self._parts[index],)
        )

    def _owner(self, robot: int, at: Place) -> int:
        """Return the first robot for which all ways from a place are the same."""
        return max(0, self._graph.key(robot, at[0])[0])

    @memoized
    def _leg(self, robot: int, at: Place, task: int, state: int, only_on: bool) -> Tour | None:
        """Return the cheapest way to do a task, which is in a state, or only to go on with it; None where there is none."""
        if task in self._of_a_letter:
            return self._legs_from(robot, at).get(task)
        part = self._parts[task]

        def read(key: tuple[Watched, int], letter: int) -> tuple[Watched, int] | None:
            after = self._read(key[0], letter)
            return None if after is None else (after, part.row(key[1])[letter])

        search = path_search(self._graph, robot, (at[0], (at[1], state)), read)
        for key, cost, _ in search:
            if part.accepting(key[1][1]) or (only_on and key[1][1] != state):
                return Tour(cost, (key[0], key[1][0]), tuple(node for node, _ in search.path(key)[1:]))
        return None

    @memoized
    def _legs_from(self, robot: int, at: Place) -> dict[int, Tour]:
        """Return the cheapest ways to do each task of one letter."""
        found: dict[int, Tour] = {}
        search = path_search(self._graph, robot, at, self._read)
        for key, cost, _ in search:
            if new := self._doing[self._graph.label[robot][key[0]]] - found.keys():
                found.update(dict.fromkeys(new, Tour(cost, key, tuple(node for node, _ in search.path(key)[1:]))))
                if len(found) == len(self._of_a_letter):
                    break
        return found

    @memoized
    def _finish(self, robot: int, at: Place, own: frozenset[int]) -> Tour | None:
        """Return the cheapest way to where a robot's word may end; None where there is none."""
        search = path_search(self._graph, robot, at, self._read, lambda watched: self._may_end(watched, own))
        for key, cost, _ in search:
            if key[0] == _DONE:
                return Tour(cost, at, tuple(node for node, _ in search.path(key)[1:-1]))
        return None
