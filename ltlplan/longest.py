"""Plans whose dearest robot is as cheap as can be (`objective: longest`).

The team automaton is walked as for the smallest sum, but a path is judged by two numbers: what the dearest robot before
cost, and what the one that flies has cost so far. A path is dropped only where another one is no worse in both.
"""

from __future__ import annotations

import heapq

from ltlplan.automata import DEAD
from ltlplan.budget import Budget
from ltlplan.conjunction import Kind, Kinds, OrderCheck, Task
from ltlplan.guide import LOST, Guide
from ltlplan.team_search import Checked, Team, TeamRun, letters_of, plan_team

_Key = tuple[int, int, Kind, tuple[Kind, ...]]
_NOTHING: Kind = ()


def plan_longest(team: Team, task: Task, budget: Budget) -> tuple[Checked, float, bool]:
    """Return the plan with the cheapest dearest robot, a lower bound on that cost, and whether the search was exhausted.

    Where a tenth of the budget of states does not suffice, the plan with the smallest sum is returned instead.

    Raises:
        TooLarge: Not even the smallest sum was found within the budget.
    """
    kinds, check = Kinds(task), OrderCheck(task)
    tried, refused, first = 0, None, None
    for apart in (False, True):  # at first without keeping the words' kinds apart
        found, bound, exhausted, more, bad = _search(team, task, kinds, check, budget, apart)
        tried += more
        refused = refused or bad
        first = first or found
        if not exhausted:
            break
        if found is None or bad is None:
            return Checked(found, found, max(tried, 1), refused), bound, True
    return plan_team(team, task, budget), bound, False


def _search(
    team: Team, task: Task, kinds: Kinds, check: OrderCheck, budget: Budget, apart: bool
) -> tuple[TeamRun | None, float, bool, int, tuple[int, ...] | None]:
    """Return a best run (checked in all orders if kinds are kept apart), its bound, whether it is one, plans tried, a refusal."""
    last = len(team.systems) - 1
    label, final, robot, edges = team.label, team.final, team.robot, team.edges
    guide = Guide(task, team.entering)
    begin = task.row(task.initial)[label[team.start[0]]]
    if begin == DEAD or guide(begin) == LOST:
        return None, LOST, True, 0, None
    first_kind = kinds.read(kinds.identity, label[team.start[0]]) if apart else _NOTHING
    start: _Key = (begin, team.start[0], first_kind, ())
    entries: list[tuple[_Key, int]] = [(start, -1)]
    heap: list[tuple[float, float, int, float, float, bool]] = [(0.0, 0.0, 0, 0.0, 0.0, False)]
    fronts: dict[_Key, list[tuple[float, float]]] = {}
    explored = tried = 0
    refused: tuple[int, ...] | None = None
    while heap:
        bound, total, entry, dearest, own, complete = heapq.heappop(heap)
        key, _ = entries[entry]
        if complete:
            tried += 1
            run = TeamRun(_paths(team, entries, entry), bound, explored, len(entries))
            if apart:
                bad = check.failing_order([*key[3], key[2]])
                if bad is None:
                    return run, bound, True, tried, None
                refused = bad
                continue
            bad = check.failing_order([kinds.of(letters) for letters in letters_of(team, run)]) if last else None
            return run, bound, True, tried, bad
        front = fronts.setdefault(key, [])
        if any(m <= dearest and c <= own for m, c in front):
            continue
        front.append((dearest, own))
        explored += 1
        if explored > budget.states // 10 or tried > budget.candidates:
            return None, bound, False, tried, refused
        state, node, kind, done = key
        row = task.row(state)
        following: list[tuple[_Key, float, float, float]] = []
        ending = final[node]
        if ending is not None and robot[node] < last:
            target = team.start[robot[node] + 1]
            after = row[label[target]]
            finished = tuple(sorted((*done, kind))) if apart else ()
            if after != DEAD and (not apart or check.failing_order(finished, finished=False) is None):
                fresh = kinds.read(kinds.identity, label[target]) if apart else _NOTHING
                following.append(((after, target, fresh, finished), max(dearest, own + ending), 0.0, total + ending))
        elif ending is not None and task.is_accepting(state):
            heapq.heappush(heap, (max(dearest, own + ending), total + ending, entry, dearest, own, True))
        still = row[label[node]] == state
        for target, step in edges[node]:
            after = row[label[target]]
            if after == DEAD or (not apart and after == state and still and team.useless(node, target, step)):
                continue
            kind_after = kinds.read(kind, label[target]) if apart else _NOTHING
            following.append(((after, target, kind_after, done), dearest, own + step + 1e-10, total + step))
        for target_key, m, c, whole in following:
            rest = guide(target_key[0])
            if rest < LOST and not any(a <= m and b <= c for a, b in fronts.get(target_key, ())):
                left = last - robot[target_key[1]] + 1
                entries.append((target_key, entry))
                heapq.heappush(heap, (max(m, c, (c + rest) / left), whole, len(entries) - 1, m, c, False))
    return None, LOST, True, tried, refused


def _paths(team: Team, entries: list[tuple[_Key, int]], at: int) -> tuple[tuple[int, ...], ...]:
    paths: list[list[int]] = [[] for _ in team.systems]
    while at >= 0:
        key, at = entries[at]
        paths[team.robot[key[1]]].append(key[1] - team.offset[team.robot[key[1]]])
    return tuple(tuple(reversed(path)) for path in paths)
