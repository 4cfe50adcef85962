"""Plans whose robots' own costs count: with the smallest makespan (`objective: longest`), or with none above what it may cost.

The team automaton is walked as for the smallest sum, but a path is judged by two numbers: the objective so far (what the bottleneck
cost, or the sum), and what the one that flies has cost so far. A path is dropped only where another one is no worse in both, so one
state may come with several paths, which a `BestFirst` has not.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.product_automaton import Task
from ltlplan.logic.transition_monoid import Element, OrderCheck, TransitionMonoid
from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.insertion import share_by_insertion
from ltlplan.search.reduced_graph import ReducedGraph, Team, letter_classes
from ltlplan.search.team_search import PlanningOutcome, TeamRun, moves, plan_team
from ltlplan.search.team_states import SearchStates, TeamStates

_Key = tuple[int, int, int]  # which robot flies, at which node, in which state of the search


@dataclass(frozen=True, slots=True)
class Rule:
    """What a plan is judged by.

    Attributes:
        longest: Whether the dearest robot counts, not the sum.
        most: What each robot may cost at most; None for no limit.
    """

    longest: bool = True
    most: Sequence[float] | None = None

    def allows(self, robot: int, own: float) -> bool:
        """Tell whether a robot may cost that much.

        Args:
            robot: Which one.
            own: What it costs.
        """
        return self.most is None or own <= self.most[robot] + _SLACK

    def before(self, reached: float, step: float) -> float:
        """Return the objective when a robot that has not finished has flown on.

        Args:
            reached: The objective before.
            step: What flying on costs.
        """
        return reached if self.longest else reached + step

    def after(self, reached: float, own: float, ending: float) -> float:
        """Return the objective when a robot has finished.

        Args:
            reached: The objective before.
            own: What it has cost.
            ending: What finishing costs.
        """
        return max(reached, own + ending) if self.longest else reached + ending

    def bound(self, reached: float, own: float, rest: float, left: int) -> float:
        """Return a lower bound on the objective.

        Args:
            reached: The objective so far.
            own: What the robot that flies has cost.
            rest: A lower bound on what all together still cost.
            left: How many robots can share that.
        """
        return max(reached, own, (own + rest) / left) if self.longest else reached + rest


MANY = 10
"""Robots from which on tasks are shared by insertion before any search: where its bound is met there is nothing to search for."""

_MAKESPAN = Rule()
_SLACK = 1e-6
"""What the tiny amounts that break ties may add to a robot's cost."""


def plan_makespan(team: Team, task: Task, budget: Budget, rule: Rule = _MAKESPAN) -> tuple[PlanningOutcome, float, bool]:
    """Return the best plan by a rule, a lower bound on its objective, and whether the search was exhausted.

    Many robots' tasks are shared by `insertion` first, which ends the matter where its bound is met. Where a tenth of the budget of
    states does not suffice for a search, that stands, or else the plan with the smallest sum, if the rule allows it.

    Args:
        team: Whose graph.
        task: What is to be done.
        budget: Bounds on the search.
        rule: What is best, and what is allowed; by default the cheapest bottleneck robot.

    Raises:
        TooLarge: Not even the smallest sum was found within the budget, or the rule does not allow it.
    """
    graph, everything, check = ReducedGraph(team, *letter_classes(task)), TransitionMonoid(task), OrderCheck(task)

    def elements_of(run: TeamRun) -> list[Element]:
        return [everything.of(letters) for letters in team.letters_of(run.paths)]

    def inserted() -> tuple[PlanningOutcome, float, bool] | None:
        shared = share_by_insertion(graph, task, rule.allows, budget.states // 10) if rule.longest else None
        if shared is None:
            return None
        run = TeamRun(shared.paths, sum(shared.costs), 0, shared.reached)
        if check.failing_parts(elements_of(run)):
            return None
        bound = max(shared.bound, _spread(graph, task, rule))
        return PlanningOutcome(run, run, 1, None, bound), bound, max(shared.costs) <= bound + _SLACK

    first = inserted() if len(team) >= MANY else None
    if first is not None and first[-1]:
        return first
    found, exhausted = best_by_rule(
        graph,
        lambda tracked: TeamStates(graph, task, tracked),
        lambda run: check.failing_parts(elements_of(run)),
        lambda run: check.failing_order(elements_of(run)),
        budget,
        rule,
    )
    if exhausted:
        return found, found.bound, True
    shared = first or inserted()
    if shared is not None:
        return shared[0], max(found.bound, shared[1]), False
    return _by_sum(team, task, budget, rule), found.bound, False


def _spread(graph: ReducedGraph, task: Task, rule: Rule) -> float:
    """Return a lower bound on the objective: what is surely to be flown in all, spread evenly over all robots."""
    states = TeamStates(graph, task)
    begin = states.after(states.initial, graph.label[0][graph.start[0]])
    return 0.0 if begin == DEAD else rule.bound(0.0, 0.0, states.rest(begin, 0, graph.start[0]), len(graph.start)) - _SLACK


def best_by_rule(  # as many as a search and its checks have: see `refined_until_kept`, and the rule
    graph: ReducedGraph,
    states_for: Callable[[Sequence[int]], SearchStates],
    broken: Callable[[TeamRun], Sequence[int]],
    failing: Callable[[TeamRun], tuple[int, ...] | None],
    budget: Budget,
    rule: Rule,
) -> tuple[PlanningOutcome, bool]:
    """Search for the best run by a rule, again with what words do to the conjuncts that were broken tracked, until a run is kept by all.

    Args:
        graph: The team's graph.
        states_for: The search's states when these conjuncts, by index, are tracked.
        broken: The conjuncts that some order of a run's words breaks.
        failing: An order in which a run's words break the task; None where every order keeps it.
        budget: Bounds on the search; a tenth of the states is spent.
        rule: What is best, and what is allowed.

    Returns:
        What was found, with a lower bound on its objective, and whether the search was exhausted; where it was not, nothing was found.
    """
    tried, refused, first = 0, None, None
    tracked: set[int] = set()  # conjuncts for which what words do is told apart: those that some order broke
    while True:
        found, bound, exhausted, more = _search(graph, states_for(sorted(tracked)), budget, rule)
        tried += more
        first = first or found
        if not exhausted:
            return PlanningOutcome(None, first, tried, refused, bound), False
        wrong = () if found is None else broken(found)
        if found is None or not wrong:
            return PlanningOutcome(found, first, max(tried, 1), refused, bound), True
        refused = refused or failing(found)
        tracked.update(wrong)


def _by_sum(team: Team, task: Task, budget: Budget, rule: Rule) -> PlanningOutcome:
    """Return the plan with the smallest sum.

    Raises:
        TooLarge: It was not found, or the rule does not allow it.
    """
    found = plan_team(team, task, budget)
    if found.run is not None and not allowed_by(rule, team, found.run):
        raise too_many_states(budget)
    return found


def allowed_by(rule: Rule, team: Team, run: TeamRun) -> bool:
    """Tell whether no robot costs more than a rule lets it.

    Args:
        rule: Gives the limits.
        team: Whose systems.
        run: A path for each robot.
    """
    for robot, (system, path) in enumerate(zip(team.systems, run.paths, strict=True)):
        steps = [min(cost for node, cost in system.edges[a] if node == b) for a, b in pairwise(path) if a != b]
        if not rule.allows(robot, sum(steps)):
            return False
    return True


def too_many_states(budget: Budget) -> TooLarge:
    """Return the error of a search that kept limits on robots and was not exhausted.

    Args:
        budget: Of which it spent a tenth of the states.
    """
    return TooLarge("Keeping every vehicle's endurance needs", budget.states // 10, "states", budget.states // 10)


def _search(graph: ReducedGraph, states: SearchStates, budget: Budget, rule: Rule) -> tuple[TeamRun | None, float, bool, int]:
    """Return a best run that keeps the tracked conjuncts in every order, its bound, whether it is one, and plans tried."""
    last = len(graph.start) - 1
    begin = states.after(states.initial, graph.label[0][graph.start[0]])
    if begin == DEAD:
        return None, UNREACHABLE, True, 0
    entries: list[tuple[_Key, int]] = [((0, graph.start[0], begin), -1)]
    heap: list[tuple[float, float, int, float, float, bool]] = [(0.0, 0.0, 0, 0.0, 0.0, False)]
    fronts: dict[_Key, list[tuple[float, float]]] = {}
    explored = tried = 0
    while heap:
        bound, total, entry, bottleneck, own, complete = heapq.heappop(heap)
        key, _ = entries[entry]
        if complete:
            tried += 1
            if states.holds_in_every_order(key[2]):
                return TeamRun(_paths(graph, entries, entry), bound, explored, len(entries)), bound, True, tried
            continue
        front = fronts.setdefault(key, [])
        if any(m <= bottleneck and c <= own for m, c in front):
            continue
        front.append((bottleneck, own))
        explored += 1
        if explored > budget.states // 10 or tried > budget.candidates:
            return None, bound, False, tried
        robot, node, at = key
        following: list[tuple[_Key, float, float, float]] = []
        ending = graph.successors(robot, node).ending
        if ending is not None and not rule.allows(robot, own + ending):
            ending = None
        if ending is not None and robot < last:
            target = graph.start[robot + 1]
            between = states.handed_over(at)
            after = DEAD if between == DEAD else states.after(between, graph.label[robot + 1][target])
            if after != DEAD:
                following.append(((robot + 1, target, after), rule.after(bottleneck, own, ending), 0.0, total + ending))
        elif ending is not None and states.is_accepting(at):
            heapq.heappush(heap, (rule.after(bottleneck, own, ending), total + ending, entry, bottleneck, own, True))
        for target, after, step in moves(graph, states, robot, node, at):
            if rule.allows(robot, own + step):
                following.append(((robot, target, after), rule.before(bottleneck, step), own + step, total + step))
        for target_key, m, c, whole in following:
            rest = states.rest(target_key[2], target_key[0], target_key[1])
            if rest < UNREACHABLE and not any(a <= m and b <= c for a, b in fronts.get(target_key, ())):
                left = last - target_key[0] + 1
                entries.append((target_key, entry))
                heapq.heappush(heap, (rule.bound(m, c, rest, left), whole, len(entries) - 1, m, c, False))
    return None, UNREACHABLE, True, tried


def _paths(graph: ReducedGraph, entries: list[tuple[_Key, int]], at: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in graph.start]
    while at >= 0:
        (robot, node, _), at = entries[at]
        paths[robot].append(node)
    return tuple(graph.expand(robot, path[::-1]) for robot, path in enumerate(paths))
