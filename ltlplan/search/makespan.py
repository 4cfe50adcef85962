"""Plans whose dearest robot is as cheap as can be (`objective: longest`).

The team automaton is walked as for the smallest sum, but a path is judged by two numbers: what the dearest robot before
cost, and what the one that flies has cost so far. A path is dropped only where another one is no worse in both.
"""

from __future__ import annotations

import heapq

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget
from ltlplan.logic.task import Task
from ltlplan.logic.transition_monoid import Kinds, OrderCheck
from ltlplan.search.heuristic import LOST
from ltlplan.search.reduced_graph import Roads, Team, letter_classes
from ltlplan.search.team_search import Checked, Situations, TeamRun, moves, plan_team

_Key = tuple[int, int, int]  # which robot flies, at which node, in which situation


def plan_longest(team: Team, task: Task, budget: Budget) -> tuple[Checked, float, bool]:
    """Return the plan with the cheapest dearest robot, a lower bound on that cost, and whether the search was exhausted.

    Where a tenth of the budget of states does not suffice, the plan with the smallest sum is returned instead.

    Raises:
        TooLarge: Not even the smallest sum was found within the budget.
    """
    roads, everything, check = Roads(team, *letter_classes(task)), Kinds(task), OrderCheck(task)
    tried, refused, first = 0, None, None
    apart: set[int] = set()  # conjuncts to which what words do is kept apart: those that some order broke
    while True:
        found, bound, exhausted, more = _search(roads, Situations(roads, task, sorted(apart)), budget)
        tried += more
        first = first or found
        if not exhausted:
            return plan_team(team, task, budget), bound, False
        kinds = [] if found is None else [everything.of(letters) for letters in team.letters_of(found.paths)]
        broken = check.failing_parts(kinds) if kinds else ()
        if not broken:
            return Checked(found, first, max(tried, 1), refused, bound), bound, True
        refused = refused or check.failing_order(kinds)
        apart.update(broken)


def _search(roads: Roads, situations: Situations, budget: Budget) -> tuple[TeamRun | None, float, bool, int]:
    """Return a best run that keeps the conjuncts kept apart in every order, its bound, whether it is one, and plans tried."""
    last = len(roads.start) - 1
    begin = situations.after(situations.initial, roads.label[0][roads.start[0]])
    if begin == DEAD:
        return None, LOST, True, 0
    entries: list[tuple[_Key, int]] = [((0, roads.start[0], begin), -1)]
    heap: list[tuple[float, float, int, float, float, bool]] = [(0.0, 0.0, 0, 0.0, 0.0, False)]
    fronts: dict[_Key, list[tuple[float, float]]] = {}
    explored = tried = 0
    while heap:
        bound, total, entry, dearest, own, complete = heapq.heappop(heap)
        key, _ = entries[entry]
        if complete:
            tried += 1
            if situations.holds_in_every_order(key[2]):
                return TeamRun(_paths(roads, entries, entry), bound, explored, len(entries)), bound, True, tried
            continue
        front = fronts.setdefault(key, [])
        if any(m <= dearest and c <= own for m, c in front):
            continue
        front.append((dearest, own))
        explored += 1
        if explored > budget.states // 10 or tried > budget.candidates:
            return None, bound, False, tried
        robot, node, at = key
        following: list[tuple[_Key, float, float, float]] = []
        ending = roads.ways(robot, node).ending
        if ending is not None and robot < last:
            target = roads.start[robot + 1]
            between = situations.handed_over(at)
            after = DEAD if between == DEAD else situations.after(between, roads.label[robot + 1][target])
            if after != DEAD:
                following.append(((robot + 1, target, after), max(dearest, own + ending), 0.0, total + ending))
        elif ending is not None and situations.is_accepting(at):
            heapq.heappush(heap, (max(dearest, own + ending), total + ending, entry, dearest, own, True))
        for target, after, step in moves(roads, situations, robot, node, at):
            following.append(((robot, target, after), dearest, own + step, total + step))
        for target_key, m, c, whole in following:
            rest = situations.rest(target_key[2], target_key[0], target_key[1])
            if rest < LOST and not any(a <= m and b <= c for a, b in fronts.get(target_key, ())):
                left = last - target_key[0] + 1
                entries.append((target_key, entry))
                heapq.heappush(heap, (max(m, c, (c + rest) / left), whole, len(entries) - 1, m, c, False))
    return None, LOST, True, tried


def _paths(roads: Roads, entries: list[tuple[_Key, int]], at: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in roads.start]
    while at >= 0:
        (robot, node, _), at = entries[at]
        paths[robot].append(node)
    return tuple(roads.expand(robot, path[::-1]) for robot, path in enumerate(paths))
