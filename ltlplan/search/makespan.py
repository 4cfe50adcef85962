"""Plans with the smallest makespan: the bottleneck robot costs as little as can be (`objective: longest`).

The team automaton is walked as for the smallest sum, but a path is judged by two numbers: what the bottleneck so far
cost, and what the one that flies has cost so far. A path is dropped only where another one is no worse in both, so one
state may come with several paths, which a `BestFirst` has not.
"""

from __future__ import annotations

import heapq

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget
from ltlplan.logic.task import Task
from ltlplan.logic.transition_monoid import OrderCheck, TransitionMonoid
from ltlplan.search.heuristic import UNREACHABLE
from ltlplan.search.reduced_graph import ReducedGraph, Team, letter_classes
from ltlplan.search.team_search import PlanningOutcome, TeamRun, moves, plan_team
from ltlplan.search.team_states import TeamStates

_Key = tuple[int, int, int]  # which robot flies, at which node, in which state of the search


def plan_makespan(team: Team, task: Task, budget: Budget) -> tuple[PlanningOutcome, float, bool]:
    """Return the plan with the cheapest bottleneck robot, a lower bound on that cost, and whether the search was exhausted.

    Where a tenth of the budget of states does not suffice, the plan with the smallest sum is returned instead.

    Args:
        team: Whose graph.
        task: What is to be done.
        budget: Bounds on the search.

    Raises:
        TooLarge: Not even the smallest sum was found within the budget.
    """
    graph, everything, check = ReducedGraph(team, *letter_classes(task)), TransitionMonoid(task), OrderCheck(task)
    tried, refused, first = 0, None, None
    tracked: set[int] = set()  # conjuncts for which elements are told apart: those that some order broke
    while True:
        found, bound, exhausted, more = _search(graph, TeamStates(graph, task, sorted(tracked)), budget)
        tried += more
        first = first or found
        if not exhausted:
            return plan_team(team, task, budget), bound, False
        elements = [] if found is None else [everything.of(letters) for letters in team.letters_of(found.paths)]
        broken = check.failing_parts(elements) if elements else ()
        if not broken:
            return PlanningOutcome(found, first, max(tried, 1), refused, bound), bound, True
        refused = refused or check.failing_order(elements)
        tracked.update(broken)


def _search(graph: ReducedGraph, states: TeamStates, budget: Budget) -> tuple[TeamRun | None, float, bool, int]:
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
        if ending is not None and robot < last:
            target = graph.start[robot + 1]
            between = states.handed_over(at)
            after = DEAD if between == DEAD else states.after(between, graph.label[robot + 1][target])
            if after != DEAD:
                following.append(((robot + 1, target, after), max(bottleneck, own + ending), 0.0, total + ending))
        elif ending is not None and states.is_accepting(at):
            heapq.heappush(heap, (max(bottleneck, own + ending), total + ending, entry, bottleneck, own, True))
        for target, after, step in moves(graph, states, robot, node, at):
            following.append(((robot, target, after), bottleneck, own + step, total + step))
        for target_key, m, c, whole in following:
            rest = states.rest(target_key[2], target_key[0], target_key[1])
            if rest < UNREACHABLE and not any(a <= m and b <= c for a, b in fronts.get(target_key, ())):
                left = last - target_key[0] + 1
                entries.append((target_key, entry))
                heapq.heappush(heap, (max(m, c, (c + rest) / left), whole, len(entries) - 1, m, c, False))
    return None, UNREACHABLE, True, tried


def _paths(graph: ReducedGraph, entries: list[tuple[_Key, int]], at: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in graph.start]
    while at >= 0:
        (robot, node, _), at = entries[at]
        paths[robot].append(node)
    return tuple(graph.expand(robot, path[::-1]) for robot, path in enumerate(paths))
