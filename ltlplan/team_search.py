"""The cheapest way for a team to share a task: paths of the team automaton T (2022 paper, Defs. 4.6 and 4.7).

T is walked robot by robot, in one fixed order, and made as it is walked, over the nodes that matter (`team`). Every plan
whose words keep the task in all orders is a path of T in the fixed order too, if robots may be switched in every state; so
a cheapest path is a lower bound, and it is the optimum as soon as its words pass in all orders. The decomposition set would
only let some of these switches pass without looking at the words. Where the cheapest path is refused, the search begins
again and also keeps apart what each robot's word does (its kind) to the conjuncts that some order broke, so that no refused
combination of kinds comes twice.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.automata import DEAD
from ltlplan.budget import Budget, TooLarge
from ltlplan.conjunction import Kind, Kinds, OrderCheck, Task
from ltlplan.guide import LOST, Guide
from ltlplan.team import Roads, Team


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
    roads = Roads(team, task)
    run, tried = _search(roads, Situations(roads, task), budget)
    first = run
    if first is None or len(team) == 1:
        return Checked(first, first, 0 if first is None else 1, None)
    everything, check = Kinds(task), OrderCheck(task)

    def kinds_of(run: TeamRun) -> list[Kind]:
        return [everything.of(letters) for letters in team.letters_of(run.paths)]

    refused = check.failing_order(kinds_of(first))
    apart: set[int] = set()
    while run is not None and (broken := check.failing_parts(kinds_of(run))):
        apart.update(broken)  # from now on what words do to these conjuncts is kept apart as well
        run, more = _search(roads, Situations(roads, task, sorted(apart)), budget)
        tried += more
    return Checked(run, first, tried, refused)


def cheapest_path(team: Team, task: Task, budget: Budget) -> TeamRun | None:
    """Return a cheapest path of the team automaton with switches everywhere, in the systems' order, or None.

    Raises:
        TooLarge: The budget of states was used up.
    """
    roads = Roads(team, task)
    return _search(roads, Situations(roads, task), budget)[0]


class Situations:
    """How far a team is, as one number: the state of the task and, for the conjuncts kept apart, the kinds of the words.

    Args:
        roads: The team's graph.
        task: What is to be done.
        apart: The conjuncts, by index, for which the words must also keep the task in every order.
    """

    def __init__(self, roads: Roads, task: Task, apart: Sequence[int] = ()) -> None:
        self.task = task
        self._guide = Guide(task, roads.entering)
        self._kinds, self._check = Kinds(task, apart), OrderCheck(task, apart)
        self._letters = len(task.letters)
        self._states: list[int] = []
        self._own: list[Kind] = []
        self._done: list[tuple[Kind, ...]] = []
        self._numbers: dict[tuple[int, Kind, tuple[Kind, ...]], int] = {}
        self._rows: list[list[int | None]] = []
        self._switched: dict[int, int] = {}
        self.rest: list[float] = []
        self.initial = self._number(task.initial, self._kinds.identity, ())

    def after(self, number: int, letter: int) -> int:
        """Return the situation after a letter; `DEAD` where the task is lost, for this order of the robots or for another."""
        row = self._rows[number]
        found = row[letter]
        if found is None:
            found = DEAD
            state = self.task.row(self._states[number])[letter]
            if state != DEAD and self._guide(state) < LOST:
                kind = self._kinds.read(self._own[number], letter)
                if not self._kinds.loses(kind):
                    found = self._number(state, kind, self._done[number])
            row[letter] = found
        return found

    def handed_over(self, number: int) -> int:
        """Return the situation when a robot's word has ended and the next one's has not begun; `DEAD` where some order is lost."""
        found = self._switched.get(number)
        if found is None:
            found, kind, done = DEAD, self._own[number], self._done[number]
            if kind != self._kinds.identity:
                done = tuple(sorted((*done, kind)))
            if self._check.failing_order(done, finished=False) is None:
                found = self._number(self._states[number], self._kinds.identity, done)
            self._switched[number] = found
        return found

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return self.task.is_accepting(self._states[number])

    def holds_in_every_order(self, number: int) -> bool:
        """Tell whether the words keep the conjuncts kept apart in every order of the robots."""
        return self._check.failing_order([*self._done[number], self._own[number]]) is None

    def _number(self, state: int, own: Kind, done: tuple[Kind, ...]) -> int:
        key = (state, own, done)
        found = self._numbers.get(key)
        if found is None:
            found = self._numbers[key] = len(self._states)
            self._states.append(state)
            self._own.append(own)
            self._done.append(done)
            self._rows.append([None] * self._letters)
            self.rest.append(self._guide(state))
        return found


def moves(roads: Roads, situations: Situations, robot: int, node: int, at: int) -> Iterator[tuple[int, int, float]]:
    """Yield what the robot that flies may do next: (node, situation, cost), without steps that gain nothing."""
    label = roads.label[robot]
    for target, step in roads.ways(robot, node).edges:
        after = situations.after(at, label[target])
        if after != DEAD and not (after == at and roads.useless(robot, node, target, step)):
            yield target, after, step


def _search(roads: Roads, situations: Situations, budget: Budget) -> tuple[TeamRun | None, int]:
    """Return a cheapest path whose words keep the conjuncts kept apart in every order, or None, and how many were tried (A*)."""
    robots, width = len(roads.start), roads.width
    begin = situations.after(situations.initial, roads.label[0][roads.start[0]])
    if begin == DEAD:
        return None, 0
    rest = situations.rest
    first = begin * robots * width + roads.start[0]
    best: dict[int, float] = {first: 0.0}
    parent: dict[int, int] = {first: -1}
    heap: list[tuple[float, bool, int]] = [(rest[begin], True, first)]  # bound, whether the path goes on, where it is
    closed: set[int] = set()
    tried = 0
    while heap:
        bound, goes_on, key = heapq.heappop(heap)
        if not goes_on:
            tried += 1
            if situations.holds_in_every_order(key // (robots * width)):
                return TeamRun(_paths(roads, parent, key), bound, len(closed), len(best)), tried
            if tried >= budget.candidates:
                raise TooLarge("Finding a plan that holds in every order takes", tried + 1, "complete plans", budget.candidates)
            continue
        if key in closed:
            continue
        closed.add(key)
        if len(closed) > budget.states:
            raise TooLarge("The search needs", len(closed), "states", budget.states)
        at, place = divmod(key, robots * width)
        robot, node = divmod(place, width)
        cost = best[key]
        following = [
            ((after * robots + robot) * width + target, after, cost + step)
            for target, after, step in moves(roads, situations, robot, node, at)
        ]
        ending = roads.ways(robot, node).ending
        if ending is not None and robot + 1 < robots:
            target = roads.start[robot + 1]
            between = situations.handed_over(at)
            after = DEAD if between == DEAD else situations.after(between, roads.label[robot + 1][target])
            if after != DEAD:
                following.append(((after * robots + robot + 1) * width + target, after, cost + ending))
        elif ending is not None and situations.is_accepting(at):
            heapq.heappush(heap, (cost + ending, False, key))
        for target_key, after, total in following:
            if total < best.get(target_key, LOST):
                best[target_key] = total
                parent[target_key] = key
                heapq.heappush(heap, (total + rest[after], True, target_key))
    return None, tried


def _paths(roads: Roads, parent: dict[int, int], key: int) -> tuple[tuple[int, ...], ...]:
    """Return each robot's nodes along the path that leads to a key."""
    robots = len(roads.start)
    paths: list[list[int]] = [[] for _ in range(robots)]
    while key != -1:
        robot, node = divmod(key % (robots * roads.width), roads.width)
        paths[robot].append(node)
        key = parent[key]
    return tuple(roads.expand(robot, path[::-1]) for robot, path in enumerate(paths))
