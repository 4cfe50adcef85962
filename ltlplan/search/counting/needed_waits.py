"""Waits between robots that are counted, no more of them than the formula needs."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ltlplan.search.counting.counted_plans import CountedPlan
from ltlplan.search.counting.counting_propositions import ConjunctMarks, Marks, Sums
from ltlplan.search.counting.interleavings import Interleaved, KindWait, in_all_orders, total
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter


def needed_waits(systems: Sequence[TransitionSystem], marks: Marks, plan: CountedPlan) -> list[tuple[int, int]] | None:
    """Return pairs of turns, by index, of which the second one begins when the first one has ended: no more than the formula needs.

    Robots that do the same wait for each other between their turns at first, and for nobody else. Where the formula does not hold in all
    orders that this leaves, all turns of a stage come before those of the next ones. Then waits are dropped one after another, where the
    formula holds without them (deordering: Baeckstroem, JAIR 1998). Each conjunct is looked at apart, by the changes that it sees. None says
    that not even stages could be tried within the budget.

    Args:
        systems: One for each robot.
        marks: What the formula sees.
        plan: Its paths, turns and stages.
    """
    letters = [tuple(system.labels[node] for node in path) for system, path in zip(systems, plan.paths, strict=True)]
    shown = [[marks.of(system.robot, letter) for letter in way] for system, way in zip(systems, letters, strict=True)]
    for staged in (False, True):
        kinds = _kinds_of(systems, plan, letters, marks.named, staged=staged)
        waits = _possible_waits(plan, kinds, staged=staged)
        seen = [_Seen(conjunct, shown, [kind.robots for kind in kinds]) for conjunct in marks.conjuncts]
        if all(part.holds(waits) for part in seen):
            kept = sorted(
                waits, key=lambda wait: (wait.first == wait.then, wait.due > 1)
            )  # others' and those at starts go first
            for wait in tuple(kept):
                left = [other for other in kept if other != wait]
                if all(part.holds(left) for part in seen):
                    kept = left
            return sorted(pair for wait in kept for pair in waits[wait])
    return None


@dataclass(frozen=True, slots=True)
class _Kind:
    """Robots that do the same.

    Attributes:
        robots: By number.
        turns: Of each robot its turns, by index, in order.
    """

    robots: list[int]
    turns: list[list[int]]


def _kinds_of(
    systems: Sequence[TransitionSystem],
    plan: CountedPlan,
    letters: Sequence[tuple[Letter, ...]],
    named: frozenset[str],
    *,
    staged: bool,
) -> list[_Kind]:
    """Return the robots with turns, those together that make the same letters; where stages count, in the same ones."""
    own: dict[int, list[int]] = defaultdict(list)
    for index, (robot, _, _) in enumerate(plan.turns):
        own[robot].append(index)
    stage_of = _stage_of(plan)
    alike: dict[object, _Kind] = defaultdict(lambda: _Kind([], []))
    for robot, indices in own.items():
        name = systems[robot].robot
        does = tuple((*plan.turns[index][1:], stage_of[index] if staged else 0) for index in indices)
        kind = alike[letters[robot], does, name if name in named else ""]
        kind.robots.append(robot)
        kind.turns.append(indices)
    return list(alike.values())


def _possible_waits(plan: CountedPlan, kinds: Sequence[_Kind], *, staged: bool) -> dict[KindWait, list[tuple[int, int]]]:
    """Return waits between kinds, each with its pairs of turns: from stage to stage, or from a kind's turn to its own next one."""
    stage_of, waits = _stage_of(plan), dict[KindWait, list[tuple[int, int]]]()
    for (one, first), (other, then) in itertools.product(enumerate(kinds), repeat=2):
        for (at, i), (to, j) in itertools.product(enumerate(first.turns[0]), enumerate(then.turns[0])):
            if not (stage_of[i] < stage_of[j] if staged else one == other and to == at + 1):
                continue
            pairs = [
                (done[at], due[to])
                for done, due in itertools.product(first.turns, then.turns)
                if plan.turns[done[at]][0] != plan.turns[due[to]][0]
            ]
            if pairs:
                waits[KindWait(one, plan.turns[i][2] - 1, other, plan.turns[j][1])] = pairs
    return waits


def _stage_of(plan: CountedPlan) -> dict[int, int]:
    return {turn: number for number, stage in enumerate(plan.stages) for turn in stage}


class _Seen:
    """View of a team by one conjunct: only the letters at which its marks change."""

    def __init__(self, conjunct: ConjunctMarks, team: Sequence[Sequence[Sums]], kinds: Sequence[Sequence[int]]) -> None:
        self._conjunct = conjunct
        self._places: list[list[int]] = []
        shown = [list(map(conjunct.cut, way)) for way in team]
        ways: list[tuple[Sums, ...]] = []
        for robots in kinds:
            way = shown[robots[0]]
            changes = [0, *(int(a != b) for a, b in itertools.pairwise(way))]
            self._places.append(list(itertools.accumulate(changes)))
            ways.append(tuple(each for each, change in zip(way, [1, *changes[1:]], strict=True) if change))
        moving = {robot for robots in kinds for robot in robots}
        still = [way[0] for robot, way in enumerate(shown) if robot not in moving]
        others = total(still or [(0,) * len(shown[0][0])])
        self._team = Interleaved(tuple(ways), tuple(map(len, kinds)), others)
        self._begin = {conjunct.read(conjunct.part.initial, total([way[0] for way in shown]))}
        alike = Counter(way for way, robots in zip(ways, kinds, strict=True) for _ in robots)
        self._always = self._holds(Interleaved(tuple(alike), tuple(alike.values()), others), ())

    def holds(self, waits: Iterable[KindWait]) -> bool:
        """Tell whether the conjunct holds in all orders that keep waits, as far as could be tried.

        Many hold in all orders whatever robots wait for: then robots that look alike to them are of one kind.
        """
        places = self._places
        own = [replace(wait, done=places[wait.first][wait.done], due=places[wait.then][wait.due - 1] + 1) for wait in waits]
        return self._always or self._holds(self._team, own)

    def _holds(self, team: Interleaved, waits: Sequence[KindWait]) -> bool:
        return bool(in_all_orders(self._conjunct.read, self._begin, team, waits, self._conjunct.part.accepting))
