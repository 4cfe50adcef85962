"""Plans whose dearest robot is as cheap as can be (`objective: longest`).

The team automaton is walked as for the smallest sum, but a path is judged by two numbers: what the dearest robot before
cost, and what the one that flies has cost so far. A path is dropped only where another one is no worse in both.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from ltlplan.automata import DEAD
from ltlplan.budget import Budget
from ltlplan.conjunction import Kind, Kinds, OrderCheck, Task
from ltlplan.guide import LOST, Guide
from ltlplan.team_search import Checked, Team, TeamRun, letters_of, plan_team

_Key = tuple[int, int, Kind, tuple[Kind, ...]]


def plan_longest(team: Team, task: Task, budget: Budget) -> tuple[Checked, float, bool]:
    """Return the plan with the cheapest dearest robot, a lower bound on that cost, and whether the search was exhausted.

    Where a tenth of the budget of states does not suffice, the plan with the smallest sum is returned instead.

    Raises:
        TooLarge: Not even the smallest sum was found within the budget.
    """
    everything, check = Kinds(task), OrderCheck(task)
    tried, refused, first = 0, None, None
    apart: set[int] = set()  # conjuncts to which what words do is kept apart: those that some order broke
    while True:
        found, bound, exhausted, more = _search(team, task, sorted(apart), budget)
        tried += more
        first = first or found
        if not exhausted:
            return plan_team(team, task, budget), bound, False
        kinds = [] if found is None else [everything.of(letters) for letters in letters_of(team, found)]
        broken = check.failing_parts(kinds) if kinds else ()
        if not broken:
            return Checked(found, first, max(tried, 1), refused), bound, True
        refused = refused or check.failing_order(kinds)
        apart.update(broken)


def _search(team: Team, task: Task, apart: Sequence[int], budget: Budget) -> tuple[TeamRun | None, float, bool, int]:
    """Return a best run that keeps the conjuncts kept apart in every order, its bound, whether it is one, and plans tried."""
    kinds, check = Kinds(task, apart), OrderCheck(task, apart)
    last = len(team.systems) - 1
    label, final, robot, edges = team.label, team.final, team.robot, team.edges
    guide = Guide(task, team.entering)
    begin = task.row(task.initial)[label[team.start[0]]]
    if begin == DEAD or guide(begin) == LOST:
        return None, LOST, True, 0
    start: _Key = (begin, team.start[0], kinds.read(kinds.identity, label[team.start[0]]), ())
    entries: list[tuple[_Key, int]] = [(start, -1)]
    heap: list[tuple[float, float, int, float, float, bool]] = [(0.0, 0.0, 0, 0.0, 0.0, False)]
    fronts: dict[_Key, list[tuple[float, float]]] = {}
    explored = tried = 0
    while heap:
        bound, total, entry, dearest, own, complete = heapq.heappop(heap)
        key, _ = entries[entry]
        if complete:
            tried += 1
            if check.failing_order([*key[3], key[2]]) is None:
                return TeamRun(_paths(team, entries, entry), bound, explored, len(entries)), bound, True, tried
            continue
        front = fronts.setdefault(key, [])
        if any(m <= dearest and c <= own for m, c in front):
            continue
        front.append((dearest, own))
        explored += 1
        if explored > budget.states // 10 or tried > budget.candidates:
            return None, bound, False, tried
        state, node, kind, done = key
        row = task.row(state)
        following: list[tuple[_Key, float, float, float]] = []
        ending = final[node]
        if ending is not None and robot[node] < last:
            target = team.start[robot[node] + 1]
            after = row[label[target]]
            finished = done if kind == kinds.identity else tuple(sorted((*done, kind)))
            if after != DEAD and check.failing_order(finished, finished=False) is None:
                fresh = kinds.read(kinds.identity, label[target])
                following.append(((after, target, fresh, finished), max(dearest, own + ending), 0.0, total + ending))
        elif ending is not None and task.is_accepting(state):
            heapq.heappush(heap, (max(dearest, own + ending), total + ending, entry, dearest, own, True))
        still = row[label[node]] == state
        for target, step in edges[node]:
            after = row[label[target]]
            if after == DEAD:
                continue
            kind_after = kinds.read(kind, label[target])
            if kinds.loses(kind_after):
                continue
            same = after == state and still and kind_after == kind and kinds.read(kind, label[node]) == kind
            if same and team.useless(node, target, step):
                continue
            following.append(((after, target, kind_after, done), dearest, own + step + 1e-10, total + step))
        for target_key, m, c, whole in following:
            rest = guide(target_key[0])
            if rest < LOST and not any(a <= m and b <= c for a, b in fronts.get(target_key, ())):
                left = last - robot[target_key[1]] + 1
                entries.append((target_key, entry))
                heapq.heappush(heap, (max(m, c, (c + rest) / left), whole, len(entries) - 1, m, c, False))
    return None, LOST, True, tried


def _paths(team: Team, entries: list[tuple[_Key, int]], at: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in team.systems]
    while at >= 0:
        key, at = entries[at]
        paths[team.robot[key[1]]].append(key[1] - team.offset[team.robot[key[1]]])
    return tuple(tuple(reversed(path)) for path in paths)
