"""The cheapest way for a team to share a task: paths of the team automaton T (2022 paper, Defs. 4.6 and 4.7).

T is walked robot by robot, in one fixed order, and made as it is walked, over the nodes that matter (`reduced_graph`). Every plan
whose words keep the task in all orders is a path of T in the fixed order too, if robots may be switched in every state; so
a cheapest path is a lower bound, and it is the optimum as soon as its words pass in all orders. The decomposition set would
only let some of these switches pass without looking at the words. Where the cheapest path is refused, the search begins
again and also keeps apart what each robot's word does (its kind) to the conjuncts that some order broke, so that no refused
combination of kinds comes twice.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.task import Task
from ltlplan.logic.transition_monoid import Kind, Kinds, OrderCheck
from ltlplan.search.heuristic import LOST, Guide
from ltlplan.search.landmarks import Needs
from ltlplan.search.reduced_graph import Roads, Team, letter_classes

GREEDY = (1.5, 3.0)  # how much the rest counts where any run will do; with the first, runs are nearer the cheapest
MAX_SINGLES = 20  # robots up to which each is tried as the only one that flies


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
        run: The cheapest run whose words keep the task in every order, or None; where `stopped`, any such run.
        first: The cheapest run in the fixed order, or None.
        tried: Complete plans that were checked in all orders.
        refused: For the first refused plan, the order that broke it.
        bound: No plan costs less.
        stopped: The budget that ended the search before `run` was known to be the cheapest; None where it was exhausted.
    """

    run: TeamRun | None
    first: TeamRun | None
    tried: int
    refused: tuple[int, ...] | None
    bound: float
    stopped: TooLarge | None = None


class Situation(Protocol):
    """How far a team is, as one number, for a search that follows its robots one after another.

    Attributes:
        initial: Before anything was read.
    """

    initial: int

    def rest(self, number: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost that is left with a robot at a node, which falls by no more than a step costs."""
        ...

    def after(self, number: int, letter: int) -> int:
        """Return the situation after a letter of the robot that flies; `DEAD` where the task is lost."""
        ...

    def handed_over(self, number: int) -> int:
        """Return the situation between a robot's word and the next one's; `DEAD` where some order of the robots is lost."""
        ...

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        ...

    def holds_in_every_order(self, number: int) -> bool:
        """Tell whether the words keep what is kept apart in every order of the robots."""
        ...


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a walk over the team automaton found.

    Attributes:
        run: A run whose words keep in every order what is kept apart; None where there is none, or none was found.
        tried: Complete plans that were looked at.
        bound: No such run costs less; infinite where there is none.
        stopped: The budget that ended the walk; None where it was exhausted.
    """

    run: TeamRun | None
    tried: int
    bound: float
    stopped: TooLarge | None = None


def plan_team(team: Team, task: Task, budget: Budget) -> Checked:
    """Return the cheapest team run that keeps the task in every order of the robots.

    Raises:
        TooLarge: A budget was used up before any plan was found.
    """
    roads = Roads(team, *letter_classes(task))
    everything, check = Kinds(task), OrderCheck(task)

    def kinds_of(run: TeamRun) -> list[Kind]:
        return [everything.of(letters) for letters in team.letters_of(run.paths)]

    return refine_until_kept(
        roads,
        lambda apart: Situations(roads, task, apart),
        lambda run: check.failing_parts(kinds_of(run)),
        lambda run: check.failing_order(kinds_of(run)),
        budget,
    )


def refine_until_kept(
    roads: Roads,
    situations: Callable[[Sequence[int]], Situation],
    broken: Callable[[TeamRun], Sequence[int]],
    failing: Callable[[TeamRun], tuple[int, ...] | None],
    budget: Budget,
) -> Checked:
    """Search, and search again with what words do to the conjuncts that were broken kept apart, until a run is kept by all.

    Every search returns a cheapest run among more and more that are left out for being broken, so its cost is a lower bound,
    and the first run that no order breaks is a cheapest one. Where a budget ends this, any run that every order keeps
    is looked for, greedily.

    Args:
        roads: The team's graph.
        situations: What to remember when these conjuncts, by index, are kept apart.
        broken: The conjuncts that some order of a run's words breaks.
        failing: An order in which a run's words break the task; None where every order keeps it.
        budget: Bounds on each search.

    Raises:
        TooLarge: A budget was used up before any run was found that every order keeps.
    """
    apart: set[int] = set()
    first: TeamRun | None = None
    refused: tuple[int, ...] | None = None
    bound, tried = 0.0, 0
    while True:
        try:
            found = search_team(roads, situations(sorted(apart)), budget)
            more = () if found.run is None else broken(found.run)
        except TooLarge as error:  # of trying orders
            found, more = Outcome(None, 0, bound, error), ()
        bound, tried = max(bound, found.bound), tried + found.tried
        first = first or found.run
        if found.stopped is not None:
            stopped = Checked(None, first, tried, refused, bound, found.stopped)
            return _any_run(roads, situations, broken, apart, stopped, budget)
        if found.run is None or not more:
            return Checked(found.run, first, tried, refused, bound)
        refused = refused or failing(found.run)
        apart.update(more)


def _any_run(
    roads: Roads,
    situations: Callable[[Sequence[int]], Situation],
    broken: Callable[[TeamRun], Sequence[int]],
    apart: Collection[int],
    stopped: Checked,
    budget: Budget,
) -> Checked:
    """Look for any run that every order keeps, where the search for a cheapest one was stopped.

    The estimate of the rest counts for more than what was spent (weighted A*, Pohl 1970): first only the robots fly that do
    so in the cheapest run of the fixed order, then all, at last each by itself. The first run that is found is taken.
    `apart` are the conjuncts that were kept apart until then; more are added where an order breaks what is found.

    Raises:
        TooLarge: None was found; the error that stopped the search.
    """
    assert stopped.stopped is not None
    third = replace(budget, states=max(1, budget.states // 3))
    small = replace(budget, states=max(1, third.states // len(roads.start)))
    near, far = GREEDY
    ways: list[tuple[float, frozenset[int] | None, Budget]] = [(near, None, third), (far, None, third)]
    if stopped.first is not None:
        active = frozenset(robot for robot, path in enumerate(stopped.first.paths) if len(path) > 1)
        ways = [(near, active, third), *ways[:1], (far, active, third), *ways[1:]]
    if len(roads.start) <= MAX_SINGLES:
        ways += [(far, frozenset({robot}), small) for robot in range(len(roads.start))]
    for weight, flying, limit in ways:
        kept = set(apart)
        try:
            while (found := search_team(roads, situations(sorted(kept)), limit, weight=weight, flying=flying).run) is not None:
                more = broken(found)
                if not more:
                    return replace(stopped, run=found, first=stopped.first or found)
                kept.update(more)
        except TooLarge:  # of trying orders; another way may need fewer
            continue
    raise stopped.stopped


def cheapest_path(team: Team, task: Task, budget: Budget) -> TeamRun | None:
    """Return a cheapest path of the team automaton with switches everywhere, in the systems' order, or None.

    Raises:
        TooLarge: The budget of states was used up.
    """
    roads = Roads(team, *letter_classes(task))
    found = search_team(roads, Situations(roads, task), budget)
    if found.stopped is not None:
        raise found.stopped
    return found.run


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
        self._needs = Needs(task, roads)
        self._kinds, self._check = Kinds(task, apart), OrderCheck(task, apart)
        self._states: list[int] = []
        self._own: list[Kind] = []
        self._done: list[tuple[Kind, ...]] = []
        self._numbers: dict[tuple[int, Kind, tuple[Kind, ...]], int] = {}
        self._after: list[dict[int, int]] = []
        self._switched: dict[int, int] = {}
        self._rest: list[float] = []
        self._missing: list[int] = []
        self.initial = self._number(task.initial, self._kinds.identity, ())

    def after(self, number: int, letter: int) -> int:
        """Return the situation after a letter; `DEAD` where the task is lost, for this order of the robots or for another."""
        found = self._after[number].get(letter)
        if found is None:
            found = DEAD
            state = self.task.row(self._states[number])[letter]
            if state != DEAD and self._guide(state) < LOST:
                kind = self._kinds.read(self._own[number], letter)
                if not self._kinds.loses(kind):
                    found = self._number(state, kind, self._done[number])
            self._after[number][letter] = found
        return found

    def handed_over(self, number: int) -> int:
        """Return the situation between a robot's word and the next one's; `DEAD` where some order of the robots is lost."""
        found = self._switched.get(number)
        if found is None:
            found, kind, done = DEAD, self._own[number], self._done[number]
            if kind != self._kinds.identity:
                done = tuple(sorted((*done, kind)))
            if self._check.failing_order(done, finished=False) is None:
                found = self._number(self._states[number], self._kinds.identity, done)
            self._switched[number] = found
        return found

    def rest(self, number: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost that is left with a robot at a node."""
        return max(self._rest[number], self._needs.spanning(self._missing[number], robot, node))

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
            self._after.append({})
            self._rest.append(self._guide(state))
            self._missing.append(self._needs(state))
        return found


def moves(roads: Roads, situations: Situation, robot: int, node: int, at: int) -> Iterator[tuple[int, int, float]]:
    """Yield what the robot that flies may do next: (node, situation, cost), without steps that gain nothing."""
    label = roads.label[robot]
    for target, step in roads.ways(robot, node).edges:
        after = situations.after(at, label[target])
        if after != DEAD and not (after == at and roads.useless(robot, node, target, step)):
            yield target, after, step


def search_team(
    roads: Roads, situations: Situation, budget: Budget, *, weight: float = 1.0, flying: frozenset[int] | None = None
) -> Outcome:
    """Return a cheapest run whose words keep in every order what the situations keep apart.

    This is A* (Hart, Nilsson and Raphael 1968); the estimates never fall by more than a step costs, so no state comes twice.

    Args:
        roads: The team's graph.
        situations: What is remembered besides where the robots are.
        budget: Bounds on the states expanded and the complete plans looked at.
        weight: How much the estimate of the rest counts; with more than 1 some run is found sooner, not the cheapest.
        flying: The robots that may leave their starts; all where None.
    """
    robots, width = len(roads.start), roads.width
    begin = situations.after(situations.initial, roads.label[0][roads.start[0]])
    if begin == DEAD:
        return Outcome(None, 0, LOST)
    rest = situations.rest
    first = begin * robots * width + roads.start[0]
    best: dict[int, float] = {first: 0.0}
    parent: dict[int, int] = {first: -1}
    heap: list[tuple[float, bool, int]] = [
        (rest(begin, 0, roads.start[0]), True, first)
    ]  # bound, whether the path goes on, where it is
    closed: set[int] = set()
    tried = 0
    while heap:
        bound, goes_on, key = heapq.heappop(heap)
        if not goes_on:
            tried += 1
            if situations.holds_in_every_order(key // (robots * width)):
                run = TeamRun(_paths(roads, parent, key), bound, len(closed), len(best))
                return Outcome(run, tried, bound if weight == 1.0 and flying is None else 0.0)
            if tried >= budget.candidates:
                few = TooLarge("Finding a plan that holds in every order takes", tried + 1, "complete plans", budget.candidates)
                return Outcome(None, tried, bound, few)
            continue
        if key in closed:
            continue
        closed.add(key)
        if len(closed) > budget.states:
            return Outcome(None, tried, bound, TooLarge("The search needs", len(closed), "states", budget.states))
        at, place = divmod(key, robots * width)
        robot, node = divmod(place, width)
        cost = best[key]
        following = [
            ((after * robots + robot) * width + target, after, cost + step)
            for target, after, step in moves(roads, situations, robot, node, at)
            if flying is None or robot in flying
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
            if total < best.get(target_key, LOST) and target_key not in closed:
                left = rest(after, *divmod(target_key % (robots * width), width))
                if left < LOST:
                    best[target_key] = total
                    parent[target_key] = key
                    heapq.heappush(heap, (total + weight * left, True, target_key))
    return Outcome(None, tried, LOST)


def _paths(roads: Roads, parent: dict[int, int], key: int) -> tuple[tuple[int, ...], ...]:
    """Return each robot's nodes along the path that leads to a key."""
    robots = len(roads.start)
    paths: list[list[int]] = [[] for _ in range(robots)]
    while key != -1:
        robot, node = divmod(key % (robots * roads.width), roads.width)
        paths[robot].append(node)
        key = parent[key]
    return tuple(roads.expand(robot, path[::-1]) for robot, path in enumerate(paths))
