"""The search for invariants: all configurations that may come up, with as few robots followed as do.

Configurations are the kernel's own (`verify.kernel.team`), found by its own moves; what is written down it checks again. Robots are followed one
at a time, then two, and so on: in most formulas each conjunct is one robot's business.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from verify.kernel.formulas import Owed
from verify.kernel.statement import Refused, Statement
from verify.kernel.team import Claim, Step, Team
from verify.kernel.timelines import Timeline
from verify.kernel.words import Configuration, flown, planned

MOST_CONFIGURATIONS = 20_000
"""Of one team, over all spans."""

MOST_TEAMS = 200
"""Choices of robots to follow that are tried."""

FOLLOWED = 3
"""Robots that are followed together, at the most; then all are tried."""


def find_formula(
    statement: Statement, timelines: Mapping[str, Timeline]
) -> dict[str, str | list[Any]]:  # of any type: JSON nests
    """Return evidence for each conjunct of a formula for which some is found, by a timeline for each robot."""
    return _found(flown(statement, timelines))


def find_ordered(statement: Statement) -> dict[str, str | list[Any]]:  # of any type: JSON nests
    """Return evidence for each conjunct that planned words satisfy it under their waits, as far as some is found."""
    return _found(planned(statement) if statement.words else ())


def _found(claims: Iterable[tuple[str, Claim]]) -> dict[str, str | list[Any]]:
    found = {key: _invariant(claim) for key, claim in claims}
    return {name: invariant for name, invariant in found.items() if invariant is not None}


def _invariant(claim: Claim) -> list[Any] | None:
    """Return an invariant of the first team that has one."""
    with suppress(Refused):
        for followed, more in itertools.islice(_choices(claim), MOST_TEAMS):
            with suppress(Refused):
                team = Team(claim, followed, more)
                found = _finite(team) if team.back is None else _Laps(team).run()
                if found is not None:
                    return _written(followed, more, *found)
    return None


def _choices(claim: Claim) -> Iterator[tuple[tuple[str, ...], frozenset[str]]]:
    """Yield robots to follow, and names to which letters are cut down besides: those first that show most of what is asked for."""
    names = claim.names
    shown = {robot: len({letter & names for letter in claim.places(robot, names).letters}) for robot in claim.robots}
    order = sorted(claim.robots, key=lambda robot: (-shown[robot], claim.robots.index(robot)))
    sizes = [size for size in range(len(order) + 1) if size <= FOLLOWED or size == len(order)]
    for more in (frozenset[str](), claim.shown - names):
        for size in sizes:
            for chosen in itertools.combinations(order, size):
                yield tuple(sorted(chosen, key=claim.robots.index)), more


class _OutOfBudget(Refused):
    """A team has too many configurations."""


@dataclass(frozen=True, slots=True)
class _Edge:
    """A step between configurations that have numbers."""

    target: int
    reads: bool
    off: Owed
    lap: bool


def _finite(team: Team) -> tuple[list[int | None], list[list[Configuration]]] | None:
    """Return the configurations of each span, those left out that another one covers; None where the flight may end badly."""
    table = team.claim.table
    waiting = list(_after(team, team.begin(), frozenset({table.root}), set()))
    sets: list[list[Configuration]] = []
    count = 0
    for span in range(team.size):
        here: dict[tuple[int, ...], list[Configuration]] = {}
        seen = set(waiting)
        work = deque(waiting)
        while work:
            one = work.popleft()
            known = here.setdefault(one.at, [])
            if any(_covers(other, one) for other in known):
                continue
            if not one.owed:
                return None
            known[:] = [other for other in known if not _covers(one, other)]
            known.append(one)
            count += 1
            if count > MOST_CONFIGURATIONS:
                raise _OutOfBudget("too many configurations")
            work.extend(_after(team, team.moves(span, (one.at, one.read)), one.owed, seen))
        sets.append(sorted((one for row in here.values() for one in row), key=_order))
        if span + 1 == team.size:
            break
        seen = set()
        waiting = [new for one in sets[-1] for new in _after(team, team.handed(span, (one.at, one.read))[1], one.owed, seen)]
    if any(team.may_end((one.at, one.read)) and table.empty_word_keeps(one.owed) for one in sets[-1]):
        return None
    return [None], sets


def _after(team: Team, steps: Iterable[Step], owed: Owed, seen: set[Configuration]) -> Iterator[Configuration]:
    """Yield what steps lead to, but for what was seen before."""
    for letter, (at, read) in steps:
        for then in (owed,) if letter is None else [then for then, _ in team.claim.table.after(letter, owed)]:
            if (new := Configuration(at, read, then)) not in seen:
                seen.add(new)
                yield new


def _covers(one: Configuration, other: Configuration) -> bool:
    return one.at == other.at and one.read & other.read == other.read and one.owed <= other.owed


def _order(one: Configuration) -> tuple[tuple[int, ...], int, list[int], int]:
    return one.at, one.read, sorted(one.owed), one.level


class _Laps:
    """All configurations of a team that flies laps, and their levels."""

    def __init__(self, team: Team) -> None:
        self.team = team
        self.numbers: dict[tuple[int, Configuration], int] = {}
        self.order: list[tuple[int, Configuration]] = []
        self.edges: list[list[_Edge]] = []

    def run(self) -> tuple[list[int | None], list[list[Configuration]]] | None:
        """Return what each level names, and the configurations of each span; None where a word may break the formula."""
        for step in self.team.begin():
            self._follow(0, step, frozenset({self.team.claim.table.root}), lap=False)
        for span, one in self.order:  # grows while it is walked
            steps = list(self.team.moves(span, (one.at, one.read)))
            then, handed = self.team.handed(span, (one.at, one.read))
            edges = [edge for step in steps for edge in self._follow(span, step, one.owed, lap=False)]
            edges += [edge for step in handed for edge in self._follow(then, step, one.owed, lap=then <= span)]
            self.edges.append(list(dict.fromkeys(edges)))
        return self._levels()

    def _follow(self, span: int, step: Step, owed: Owed, *, lap: bool) -> list[_Edge]:
        letter, (at, read) = step
        found: list[_Edge] = []
        for then, off in ((owed, owed),) if letter is None else self.team.claim.table.after(letter, owed):
            key = span, Configuration(at, read, then)
            if key not in self.numbers:
                if len(self.order) >= MOST_CONFIGURATIONS:
                    raise _OutOfBudget("too many configurations")
                self.numbers[key] = len(self.order)
                self.order.append(key)
            found.append(_Edge(self.numbers[key], letter is not None, off, lap))
        return found

    def _levels(self) -> tuple[list[int | None], list[list[Configuration]]] | None:
        """Give each configuration a level: components that lead nowhere else first."""
        named: list[int | None] = []
        level = [-1] * len(self.order)
        for component in _components([[edge.target for edge in row] for row in self.edges]):
            inside = set(component)
            own = [edge for node in component for edge in self.edges[node] if edge.target in inside]
            name: int | None = None  # the lap
            if any(edge.lap for edge in own):
                puts_off = [edge.off for edge in own if edge.reads]
                name = min((u for u in frozenset.intersection(*puts_off)), default=None) if puts_off else None
                if name is None:
                    return None
            least = 0
            for edge in (edge for node in component for edge in self.edges[node] if edge.target not in inside):
                there = level[edge.target]
                stays = not edge.lap if name is None else not edge.reads or name in edge.off
                least = max(least, there if stays and named[there] == name else there + 1)
            fitting = next((k for k in range(least, len(named)) if named[k] == name), None)
            if fitting is None:
                fitting = len(named)
                named.append(name)
            for node in component:
                level[node] = fitting
        sets: list[list[Configuration]] = [[] for _ in range(self.team.size)]
        for (span, one), height in zip(self.order, level, strict=True):
            sets[span].append(one._replace(level=height))
        return named or [None], [sorted(here, key=_order) for here in sets]


def _components(following: Sequence[Sequence[int]]) -> Iterator[list[int]]:
    """Yield strongly connected components (Tarjan 1972), those first that lead to no other."""
    index = [-1] * len(following)
    low = [0] * len(following)
    stack: list[int] = []
    on_stack = [False] * len(following)
    count = 0
    for root in range(len(following)):
        if index[root] >= 0:
            continue
        work = [(root, 0)]
        while work:
            node, edge = work.pop()
            if edge == 0:
                index[node] = low[node] = count
                count += 1
                stack.append(node)
                on_stack[node] = True
            elif on_stack[following[node][edge - 1]]:
                low[node] = min(low[node], low[following[node][edge - 1]])
            while edge < len(following[node]) and index[following[node][edge]] >= 0:
                target = following[node][edge]
                if on_stack[target]:
                    low[node] = min(low[node], index[target])
                edge += 1
            if edge < len(following[node]):
                work += [(node, edge + 1), (following[node][edge], 0)]
            elif low[node] == index[node]:
                component: list[int] = []
                while not component or component[-1] != node:
                    component.append(stack.pop())
                    on_stack[component[-1]] = False
                yield component


def _written(
    followed: Sequence[str],
    more: frozenset[str],
    levels: Sequence[int | None],
    sets: Sequence[Sequence[Configuration]],
) -> list[Any]:
    """Return an invariant as the kernel reads it."""
    owed: dict[Owed, int] = {}
    known: dict[tuple[tuple[int, ...], ...], int] = {}
    runs: list[list[int]] = []
    for here in sets:
        rows: list[tuple[int, ...]] = []
        for one in here:
            number = owed.setdefault(one.owed, len(owed))
            rows.append((number, one.level, one.read, *one.at))
        which = known.setdefault(tuple(rows), len(known))
        if runs and runs[-1][0] == which:
            runs[-1][1] += 1
        else:
            runs.append([which, 1])
    alternatives = [sorted(one) for one in owed]
    return [list(followed), sorted(more), alternatives, list(levels), [[list(row) for row in rows] for rows in known], runs]
