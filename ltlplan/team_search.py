"""The cheapest way for a team to share a task: paths of the team automaton T (2022 paper, Defs. 4.6 and 4.7).

T is walked robot by robot, in one fixed order, and made as it is walked. Every plan whose words keep the task in all orders
is a path of T in the fixed order too, if robots may be switched in every state; so a cheapest path is a lower bound, and it
is the optimum as soon as its words pass in all orders. The decomposition set would only let some of these switches pass
without looking at the words. Where the cheapest path is refused, the search begins again and also keeps apart what each
robot's word does (its kind) to the conjuncts that some order broke, so that no refused combination of kinds comes twice.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from ltlplan.automata import DEAD
from ltlplan.budget import Budget, TooLarge
from ltlplan.conjunction import Kind, Kinds, OrderCheck, Task
from ltlplan.guide import LOST, Guide
from ltlplan.systems import TransitionSystem
from verify.data import Letter

_Key = tuple[int, int, Kind, tuple[Kind, ...]]


@dataclass(frozen=True, slots=True)
class TeamRun:
    """One path of the team automaton.

    Attributes:
        paths: The nodes of each robot's system, in the order of the systems.
        cost: Sum of the edges' costs and preferences.
        explored: States that were expanded.
        reached: States that were seen.
    """

    paths: tuple[tuple[int, ...], ...]
    cost: float
    explored: int
    reached: int


class Team:
    """The systems of all robots laid side by side, with their letters numbered.

    Attributes:
        letters: All letters that any robot can show.
        start: Index of each robot's first node.
    """

    def __init__(self, systems: Sequence[TransitionSystem]) -> None:
        numbers: dict[Letter, int] = {}
        self.systems = tuple(systems)
        self.start: list[int] = []
        self.label: list[int] = []
        self.edges: list[list[tuple[int, float]]] = []
        self.final: list[float | None] = []
        self.robot: list[int] = []
        self.offset: list[int] = []
        for index, system in enumerate(systems):
            base = len(self.label)
            self.offset.append(base)
            self.start.append(base + system.initial)
            self.label += [numbers.setdefault(label, len(numbers)) for label in system.labels]
            self.edges += [[(base + target, cost) for target, cost in edges] for edges in system.edges]
            final = system.final
            self.final += [0.0] * len(system.labels) if final is None else [final.get(i) for i in range(len(system.labels))]
            self.robot += [index] * len(system.labels)
        self.letters = tuple(numbers)
        self.entering = [float("inf")] * len(numbers)
        for start in self.start:
            self.entering[self.label[start]] = 0.0  # robots begin there at no cost
        for edges in self.edges:
            for target, cost in edges:
                if cost < self.entering[self.label[target]]:
                    self.entering[self.label[target]] = cost
        self._through: dict[tuple[int, int], bool] = {}

    def __len__(self) -> int:
        return len(self.label)

    def useless(self, source: int, target: int, cost: float) -> bool:
        """Tell whether passing through `target` gains nothing where its letter changes nothing.

        So it is where `target` only leads on to a node like `source` from which nothing can be reached more cheaply.
        """
        key = (source, target)
        found = self._through.get(key)
        if found is None:
            found = self._through[key] = self._is_useless(source, target, cost)
        return found

    def _is_useless(self, source: int, target: int, cost: float) -> bool:
        if self.final[source] is None or len(self.edges[target]) != 1:
            return False
        (on, leaving) = self.edges[target][0]
        if self.label[on] != self.label[source]:
            return False
        direct = dict(self.edges[source])
        spent = cost + leaving + 1e-12
        return all(node in direct and direct[node] <= spent + more for node, more in self.edges[on])


def cheapest_path(team: Team, task: Task, budget: Budget) -> TeamRun | None:
    """Return a cheapest path of the team automaton with switches everywhere, in the systems' order, or None.

    Raises:
        TooLarge: The budget of states was used up.
    """
    width, last = len(team), len(team.systems) - 1
    label, final, robot, edges = team.label, team.final, team.robot, team.edges
    begin = task.row(task.initial)[label[team.start[0]]]
    if begin == DEAD:
        return None
    guide = Guide(task, team.entering)
    first = begin * width + team.start[0]
    best: dict[int, float] = {first: 0.0}
    parent: dict[int, int] = {first: -1}
    heap: list[tuple[float, int]] = [(guide(begin), first)] if guide(begin) < LOST else []
    closed: set[int] = set()
    goal = -2
    while heap:
        _, key = heapq.heappop(heap)
        if key == goal:
            return TeamRun(_paths(team, parent, parent[goal], width), best[goal], len(closed), len(best))
        if key in closed:
            continue
        closed.add(key)
        cost = best[key]
        if len(closed) > budget.states:
            raise TooLarge("The search needs", len(closed), "states", budget.states)
        state, node = divmod(key, width)
        row = task.row(state)
        ending = final[node]
        if ending is not None:
            if robot[node] < last:
                following = team.start[robot[node] + 1]
                moves = [(row[label[following]] * width + following, cost + ending)] if row[label[following]] != DEAD else []
            else:
                moves = [(goal, cost + ending)] if task.is_accepting(state) else []
            for target, total in moves:
                rest = 0.0 if target == goal else guide(target // width)
                if total < best.get(target, LOST) and rest < LOST:
                    best[target] = total
                    parent[target] = key
                    heapq.heappush(heap, (total + rest, target))
        still = row[label[node]] == state
        for target, step in edges[node]:
            after = row[label[target]]
            if after == DEAD or (after == state and still and team.useless(node, target, step)):
                continue
            target_key = after * width + target
            total = cost + step + 1e-10
            if total < best.get(target_key, LOST):
                rest = guide(after)
                if rest < LOST:
                    best[target_key] = total
                    parent[target_key] = key
                    heapq.heappush(heap, (total + rest, target_key))
    return None


def _paths(team: Team, parent: dict[int, int], key: int, width: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in team.systems]
    while key != -1:
        node = key % width
        paths[team.robot[node]].append(node - team.offset[team.robot[node]])
        key = parent[key]
    return tuple(tuple(reversed(path)) for path in paths)


@dataclass(frozen=True, slots=True)
class Checked:
    """The outcome of planning for a team.

    Attributes:
        run: The cheapest run whose words keep the task in every order, or None.
        first: The cheapest run in the fixed order, or None.
        tried: Complete plans that were checked in all orders.
        refused: For the first refused plan, the order that broke it.
    """

    run: TeamRun | None
    first: TeamRun | None
    tried: int
    refused: tuple[int, ...] | None


def plan_team(team: Team, task: Task, budget: Budget) -> Checked:
    """Return the cheapest team run that keeps the task in every order of the robots.

    Raises:
        TooLarge: A budget was used up.
    """
    first = cheapest_path(team, task, budget)
    if first is None:
        return Checked(None, None, 0, None)
    if len(team.systems) == 1:
        return Checked(first, first, 1, None)
    everything, check = Kinds(task), OrderCheck(task)

    def kinds_of(run: TeamRun) -> list[Kind]:
        return [everything.of(letters) for letters in letters_of(team, run)]

    refused = check.failing_order(kinds_of(first))
    apart: set[int] = set()
    run: TeamRun | None = first
    tried = 1
    while run is not None and (broken := check.failing_parts(kinds_of(run))):
        apart.update(broken)  # from now on what words do to these conjuncts is kept apart as well
        run, more = _by_kinds(team, task, sorted(apart), budget)
        tried += more
    return Checked(run, first, tried, refused)


def letters_of(team: Team, run: TeamRun) -> list[list[int]]:
    """Return each robot's letters along a run, by number."""
    return [[team.label[team.offset[i] + node] for node in path] for i, path in enumerate(run.paths)]


def _by_kinds(team: Team, task: Task, apart: Sequence[int], budget: Budget) -> tuple[TeamRun | None, int]:
    """Search with the kinds of all words kept apart for some conjuncts; the first plan that keeps these is a cheapest one."""
    kinds, check = Kinds(task, apart), OrderCheck(task, apart)
    last = len(team.systems) - 1
    label, final, robot, edges = team.label, team.final, team.robot, team.edges
    begin = task.row(task.initial)[label[team.start[0]]]
    if begin == DEAD:
        return None, 0

    guide = Guide(task, team.entering)
    if guide(begin) == LOST:
        return None, 0
    start: _Key = (begin, team.start[0], kinds.read(kinds.identity, label[team.start[0]]), ())
    best: dict[_Key, float] = {start: 0.0}
    parent: dict[_Key, _Key | None] = {start: None}
    heap: list[tuple[float, int, _Key, bool]] = [(guide(begin), 0, start, False)]
    closed: set[_Key] = set()
    pushed = tried = 0
    while heap:
        bound, _, key, complete = heapq.heappop(heap)
        if complete:
            tried += 1
            if check.failing_order([*key[3], key[2]]) is None:
                return TeamRun(_kind_paths(team, parent, key), bound, len(closed), len(best)), tried
            if tried >= budget.candidates:
                raise TooLarge("Finding a plan that holds in every order takes", tried + 1, "complete plans", budget.candidates)
            continue
        if key in closed:
            continue
        closed.add(key)
        if len(closed) > budget.states:
            raise TooLarge("The search needs", len(closed), "states", budget.states)
        state, node, kind, done = key
        cost = best[key]
        row = task.row(state)
        ending = final[node]
        if ending is not None:
            if robot[node] < last:
                following = team.start[robot[node] + 1]
                after = row[label[following]]
                finished = done if kind == kinds.identity else tuple(sorted((*done, kind)))
                if after != DEAD and guide(after) < LOST and check.failing_order(finished, finished=False) is None:
                    target = (after, following, kinds.read(kinds.identity, label[following]), finished)
                    if cost + ending < best.get(target, float("inf")):
                        best[target] = cost + ending
                        parent[target] = key
                        pushed += 1
                        heapq.heappush(heap, (cost + ending + guide(after), pushed, target, False))
            elif task.is_accepting(state):
                pushed += 1
                heapq.heappush(heap, (cost + ending, pushed, key, True))
        for node_after, step in edges[node]:
            after = row[label[node_after]]
            if after == DEAD or guide(after) == LOST:
                continue
            kind_after = kinds.read(kind, label[node_after])
            if kinds.loses(kind_after):
                continue
            if (
                after == state
                and row[label[node]] == state
                and kind_after == kind
                and kinds.read(kind, label[node]) == kind
                and team.useless(node, node_after, step)
            ):
                continue
            target = (after, node_after, kind_after, done)
            total = cost + step + 1e-10
            if total < best.get(target, float("inf")):
                best[target] = total
                parent[target] = key
                pushed += 1
                heapq.heappush(heap, (total + guide(after), pushed, target, False))
    return None, tried


def _kind_paths(team: Team, parent: dict[_Key, _Key | None], key: _Key | None) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in team.systems]
    while key is not None:
        node = key[1]
        paths[team.robot[node]].append(node - team.offset[team.robot[node]])
        key = parent[key]
    return tuple(tuple(reversed(path)) for path in paths)
