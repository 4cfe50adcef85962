"""Costs of tasks for single robots, in a given order by cheapest legs, each found once, or in the cheapest order.

A tour does tasks in a stated order, each by a cheapest way from where the one before was done, and is quick to change. A flight does them in
whatever order costs least, by a search (A*), where they are few. Both are paths over the nodes that matter of the graph of the exact
search, and keep what every robot has to keep (`task_kinds`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Part
from ltlplan.logic.product_automaton import Task
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.memoization import memoized
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.tours.task_kinds import TaskKinds

MOST_SEARCHED = 8
"""Tasks of one robot up to which the cheapest order is searched."""
STATES = 40_000
"""That the search for such orders looks at, of all robots, where nothing else is asked."""
_STATES_OF_ONE = 3_000
_EPSILON = 1e-9
Watched = tuple[tuple[int, ...], ...]
"""Of each conjunct that every robot watches: where its word has led the initial state and the accepting ones."""
Place = tuple[int, Watched]
"""A node of a robot's graph, and what it watches."""
_State = tuple[Watched, tuple[int, ...]]
"""What is watched, and the states of the free tasks."""
_DONE = -1  # in place of a node, where a robot's path is complete
_Read = TypeVar("_Read", bound=Hashable)


def path_search(
    graph: ReducedGraph,
    robot: int,
    begin: tuple[int, _Read],
    read: Callable[[_Read, int], _Read | None],
    may_end: Callable[[_Read], bool] | None = None,
    left: Callable[[tuple[int, _Read]], float] | None = None,
) -> BestFirst[tuple[int, _Read]]:
    """Return a search over the paths of one robot: over its nodes that matter, and the states of what reads their letters.

    Args:
        graph: The team's.
        robot: By index.
        begin: Its node, and the state there.
        read: The state after a letter; None where nothing is to be gone on with.
        may_end: Whether a path may end in a state; the search then ends at `is_done`. None: it walks all paths, of equal costs those
            that were reached first.
        left: Lower bound on what is left (A*).
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

    if left is None:
        return BestFirst([begin], successors, ties="first")
    return BestFirst([begin], successors, lambda key: 0.0 if key[0] == _DONE else left(key))


def is_done(key: tuple[int, object]) -> bool:
    """Tell whether a path is complete, the node before being the last one.

    Args:
        key: That a `path_search` yields.
    """
    return key[0] == _DONE


@dataclass(frozen=True, slots=True)
class Leg:
    """A cheapest way on.

    Attributes:
        cost: Of the way.
        end: Where it leads.
        nodes: On the way, the first one left out.
        letters: They show.
        done: Free tasks of one letter that are done on the way.
    """

    cost: float
    end: Place
    nodes: tuple[int, ...]
    letters: tuple[int, ...]
    done: frozenset[int]


@dataclass(frozen=True, slots=True)
class Tour:
    """Tour of one robot: its tasks, one after another.

    Attributes:
        tasks: In this order; some may be done on the way to others.
        cost: Of all legs; infinite where there is no way.
        places: Where each task is begun, and then where the last one is done.
        nodes: That matter, of the robot's graph.
        last: What it costs to finish where the last task is done.
    """

    tasks: tuple[int, ...]
    cost: float
    places: tuple[Place, ...] = ()
    nodes: tuple[int, ...] = ()
    last: float = 0.0


class Tours:
    """Costs of robots' tours.

    Attributes:
        tasks: Conjuncts that some robot has to do, by index; those that starts do are left out.
        kinds: The conjuncts by kind.
        states_left: How many states the search for flights may still look at.
    """

    def __init__(
        self, graph: ReducedGraph, task: Task, kinds: TaskKinds, most: Sequence[float] | None = None, states: int = STATES
    ) -> None:
        """Prepare tours; legs are found when they are asked for.

        Args:
            graph: The team's graph.
            task: What is to be done.
            kinds: Its conjuncts by kind.
            most: What each robot may cost at most, if anything.
            states: That the search for flights may look at, of all robots.
        """
        self.kinds, self._graph, self._parts = kinds, graph, task.parts
        self._most = most or [math.inf] * len(graph.start)
        starts = [graph.label[robot][node] for robot, node in enumerate(graph.start)]
        done = {i for i in kinds.free for letter in starts if kinds.done_by(i, letter)}
        self.tasks = tuple(i for i in (*kinds.free, *kinds.own) if i not in done)
        self._watched = (*kinds.own, *kinds.kept)
        self._own = {index: place for place, index in enumerate(self._watched) if index in kinds.own}
        one_letter = [index for index in self.tasks if index in kinds.free and self._is_done_by_a_letter(index)]
        self._doing = {
            letter: frozenset(i for i in one_letter if kinds.done_by(i, letter)) for letter in range(len(task.letters))
        }
        self._slow = frozenset(self.tasks).difference(one_letter, self._own)
        first = tuple(kinds.begun(index) for index in self._watched)
        self._begin = [self._read(first, letter) for letter in starts]
        self.states_left = states

    def __len__(self) -> int:
        return len(self._graph.start)

    @memoized
    def tour(self, robot: int, tasks: tuple[int, ...]) -> Tour:
        """Return what a robot does to make some tasks in order.

        Args:
            robot: Which one.
            tasks: Conjuncts, by index.
        """
        begun = self._begin[robot]
        return Tour(tasks, math.inf) if begun is None else self._toured(robot, tasks, begun)

    def flight(self, robot: int, tasks: tuple[int, ...]) -> Tour:
        """Return the cheapest that a robot can do to make some tasks, in whatever order, as far as that is found quickly.

        Args:
            robot: Which one.
            tasks: Conjuncts, by index, in an order that is taken where no better one is found.
        """
        found = self._searched(robot, frozenset(tasks)) if len(tasks) <= MOST_SEARCHED else None
        in_order = self.tour(robot, tasks)
        return in_order if found is None or found.cost >= in_order.cost - _EPSILON else found

    def insertions(self, robot: int, tour: Tour, task: int) -> Iterator[tuple[float, int]]:
        """Yield about what a tour would cost with one more task, and where that is put; infinite costs are left out.

        Args:
            robot: Whose tour.
            tour: That has a finite cost.
            task: The one more.
        """
        first = self._parts[task].initial
        for place, at in enumerate(tour.places):
            there = self._leg(robot, at, task, first)
            if there is None:
                continue
            if place == len(tour.tasks):
                end = self._finish(robot, there.end, (*tour.tasks, task))
                more = math.inf if end is None else there.cost + end.cost - tour.last
            else:
                then = tour.tasks[place]
                if tour.places[place + 1] == at:
                    continue  # done by then, so that this is no other tour than with the task after it
                on = self._leg(robot, there.end, then, self._parts[then].initial)
                before = self._leg(robot, at, then, self._parts[then].initial)
                if on is None or before is None:
                    continue
                more = there.cost + on.cost - before.cost
            if tour.cost + more <= self._most[robot]:
                yield tour.cost + max(more, 0.0), place

    def dearest_alone(self) -> float:
        """Return the cost of the dearest task of one letter, done by whoever does it and nothing else most cheaply."""
        tasks = [task for task in self.tasks if task not in self._slow and task not in self._own]
        alone = [min(self.tour(robot, (task,)).cost for robot in range(len(self))) for task in tasks]
        return max((cost for cost in alone if cost < math.inf), default=0.0)

    def away(self, robot: int, at: Place) -> dict[int, float]:
        """Return how far tasks are from a place: what it costs to do each of them next, where there is a way.

        Args:
            robot: Whose costs count.
            at: Where it is.
        """
        legs = ((task, self._leg(robot, at, task, self._parts[task].initial)) for task in self.tasks)
        return {task: leg.cost for task, leg in legs if leg is not None}

    def _toured(self, robot: int, tasks: tuple[int, ...], begun: Watched) -> Tour:
        at, cost = (self._graph.start[robot], begun), 0.0
        places, nodes, done = [at], [at[0]], set[int]()
        slow = {
            t: self._parts[t].row(self._parts[t].initial)[self._graph.label[robot][at[0]]] for t in tasks if t in self._slow
        }
        for task in tasks:
            if not self._is_done(task, at, done, slow):
                leg = self._leg(robot, at, task, slow.get(task, self._parts[task].initial))
                if leg is None:
                    return Tour(tasks, math.inf)
                cost, at = cost + leg.cost, leg.end
                nodes += leg.nodes
                done |= leg.done
                for letter in leg.letters if slow else ():
                    slow = {t: self._parts[t].row(state)[letter] for t, state in slow.items()}
            places.append(at)
        leg = self._finish(robot, at, tasks)
        if leg is None or cost + leg.cost > self._most[robot]:
            return Tour(tasks, math.inf)
        return Tour(tasks, cost + leg.cost, tuple(places), (*nodes, *leg.nodes), leg.cost)

    @memoized
    def _searched(self, robot: int, tasks: frozenset[int]) -> Tour | None:
        """Return the cheapest way to do some tasks (A*); None where there is none, or none was found within `states_left`."""
        begun = self._begin[robot]
        if begun is None or self.states_left <= 0:
            return None
        graph, label, free = self._graph, self._graph.label[robot], tuple(sorted(tasks.difference(self._own)))
        parts = [self._parts[task] for task in free]
        own = frozenset(tasks.intersection(self._own))

        def read(state: _State, letter: int) -> _State | None:
            after = self._read(state[0], letter)
            return None if after is None else (after, tuple([p.row(s)[letter] for p, s in zip(parts, state[1], strict=True)]))

        def may_end(state: _State) -> bool:
            return self._may_end(state[0], own) and all(map(_accepting, parts, state[1]))

        def left(key: tuple[int, _State]) -> float:
            node, (watched, states) = key
            far = 0.0
            for task, part, state in zip(free, parts, states, strict=True):
                if not part.accepting(state):
                    leg = self._leg(robot, (node, watched), task, state)
                    far = max(far, math.inf if leg is None else leg.cost)
            return far

        letter = label[graph.start[robot]]
        first: _State = begun, tuple([part.row(part.initial)[letter] for part in parts])
        search = path_search(graph, robot, (graph.start[robot], first), read, may_end, left)
        for explored, (key, cost, _) in enumerate(search, start=1):
            self.states_left -= 1
            if is_done(key):
                path = search.path(key)[:-1]
                if cost > self._most[robot]:
                    return None
                states = [
                    dict(zip(free, at[1], strict=True)) | {t: at[0][i][0] for t, i in self._own.items()} for _, at in path
                ]
                done = {task: [self._parts[task].accepting(at[task]) for at in states].index(True) for task in tasks}
                return Tour(tuple(sorted(tasks, key=done.__getitem__)), cost, (), tuple(node for node, _ in path))
            if explored > _STATES_OF_ONE or self.states_left <= 0:
                break
        return None

    def _is_done(self, task: int, at: Place, done: set[int], slow: Mapping[int, int]) -> bool:
        if task in self._own:
            return self._parts[task].accepting(at[1][self._own[task]][0])
        return self._parts[task].accepting(slow[task]) if task in slow else task in done

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

    def _may_end(self, watched: Watched, tasks: frozenset[int]) -> bool:
        """Tell whether a robot's word may end: what it does is done, and what others do is as it was, or done."""
        for index, (first, *others) in zip(self._watched, watched, strict=True):
            part = self._parts[index]
            left_alone = index in self._own and index not in tasks and first == part.initial
            if not (left_alone or part.accepting(first)) or not all(map(part.accepting, others)):
                return False
        return True

    def _leg(self, robot: int, at: Place, task: int, state: int) -> Leg | None:
        """Return the cheapest way to do a task, which is in a state; None where there is none."""
        owner = self._owner(robot, at)
        return self._slow_leg(owner, at, task, state) if task in self._slow else self._legs_from(owner, at).get(task)

    def _owner(self, robot: int, at: Place) -> int:
        """Return the first robot for which all ways from a place are the same."""
        return max(0, self._graph.key(robot, at[0])[0])

    @memoized
    def _slow_leg(self, robot: int, at: Place, task: int, state: int) -> Leg | None:
        part = self._parts[task]

        def read(key: tuple[Watched, int], letter: int) -> tuple[Watched, int] | None:
            after = self._read(key[0], letter)
            return None if after is None else (after, part.row(key[1])[letter])

        search = path_search(self._graph, robot, (at[0], (at[1], state)), read)
        end = next((key for key, _, _ in search if part.accepting(key[1][1])), None)
        path = [] if end is None else [(node, watched) for node, (watched, _) in search.path(end)]
        return None if end is None else self._as_leg(robot, path, search.costs[end])

    @memoized
    def _legs_from(self, robot: int, at: Place) -> dict[int, Leg]:
        """Return the cheapest ways to do each task of one letter, and each own task."""
        found: dict[int, Leg] = {}
        ask = set(self.tasks).difference(self._slow)
        search = path_search(self._graph, robot, at, self._read)
        for key, cost, _ in search:
            node, watched = key
            new = ask & self._doing.get(self._graph.label[robot][node], frozenset())
            new |= {task for task in self._own if task in ask and self._parts[task].accepting(watched[self._own[task]][0])}
            if new:
                found.update(dict.fromkeys(new, self._as_leg(robot, search.path(key), cost)))
                ask -= new
                if not ask:
                    break
        return found

    def _finish(self, robot: int, at: Place, tasks: tuple[int, ...]) -> Leg | None:
        """Return the cheapest way to where a robot's word may end; None where there is none."""
        return self._finished(self._owner(robot, at), at, frozenset(tasks).intersection(self._own))

    @memoized
    def _finished(self, robot: int, at: Place, own: frozenset[int]) -> Leg | None:
        search = path_search(self._graph, robot, at, self._read, lambda watched: self._may_end(watched, own))
        found = next(((key, cost) for key, cost, _ in search if is_done(key)), None)
        return None if found is None else self._as_leg(robot, search.path(found[0])[:-1], found[1])

    def _as_leg(self, robot: int, path: Sequence[Place], cost: float) -> Leg:
        """Return a way as a leg; its first place is where it begins."""
        nodes = tuple(node for node, _ in path[1:])
        letters = tuple(self._graph.label[robot][node] for node in nodes)
        done = frozenset[int]().union(*(self._doing.get(letter, ()) for letter in letters))
        return Leg(cost, path[-1], nodes, letters, done)


def _accepting(part: Part, state: int) -> bool:
    return part.accepting(state)
