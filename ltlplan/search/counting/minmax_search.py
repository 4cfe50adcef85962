"""The search for `objective: longest`: what each robot has paid counts, so that a state comes with several ways to share it.

Robots in one class can do the same, so that a state is (the conjuncts' states, the class of each robot, in order), and a way to it is what
each of them has paid; one is dropped where another one is no worse for any robot. Orders of moves that lead to the same are one.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.search.counting.classes import ClassMove, Numbers, numbers_of
from ltlplan.search.counting.conjunct_bound import ConjunctBound
from ltlplan.search.counting.counter_search import Course, NumberSearch
from ltlplan.search.counting.counting_propositions import States
from ltlplan.search.counting.cover_bound import CoverBound
from ltlplan.search.team_reading import UNREACHABLE

_TIES = 1e-6  # m
_GREED = 0.5
"""How much what is left for each robot counts beside the bound, where the cheapest is not found: then any that is cheaper is looked for."""

_Robot = tuple[int, float, int]
"""A robot's class, what it has paid, and its number."""


@dataclass(frozen=True, slots=True)
class Dearest:
    """What a search for the cheapest dearest robot found.

    Attributes:
        course: One whose dearest robot costs less than was asked about; its cost is that robot's. None where none was found.
        bound: No course's dearest robot costs less, or less than was asked about.
    """

    course: Course | None
    bound: float


@dataclass(frozen=True, slots=True)
class _Entry:
    states: States
    team: tuple[_Robot, ...]
    before: int
    made: tuple[int, ClassMove] | None


def cheapest_dearest(search: NumberSearch, begin: Sequence[int], below: float, most: int) -> Dearest:
    """Look for a course whose dearest robot costs as little as possible.

    Where the states do not suffice, as many are spent on any that costs less.

    Args:
        search: Over classes in which robots whose first moves cost differently are told apart.
        begin: The class of each robot.
        below: What the dearest robot is to cost less than.
        most: States that may be looked at.
    """
    found, exhausted = _walk(search, begin, below, most, greed=0.0)
    if exhausted:
        return found
    best: Course | None = None
    while (better := _walk(search, begin, below, most, greed=_GREED)[0].course) is not None:
        best, below = better, better.cost
    return Dearest(best, found.bound)


def _walk(search: NumberSearch, begin: Sequence[int], below: float, most: int, *, greed: float) -> tuple[Dearest, bool]:
    """Return what was found, and whether the states sufficed; greedy for little that is left it finds any that is cheaper than `below`."""
    classes = search.classes
    conjuncts, cover = ConjunctBound(classes), CoverBound(classes)

    def bounds(states: States, team: tuple[_Robot, ...], numbers: Numbers) -> tuple[float, float]:
        """Return what the dearest robot costs at the least, and what all still pay."""
        sums = classes.sums(numbers)
        left = max(conjuncts(states, sums), cover(states, sums, numbers))
        paid = [own for _, own, _ in team]
        if left == UNREACHABLE:
            return UNREACHABLE, left
        least = cover.dearest(states, sums, [(place, own) for place, own, _ in team])
        return max(*paid, least, (sum(paid) + left) / len(paid)), left

    first = classes.marks.begin(classes.sums(classes.begin))
    if first is None:
        return Dearest(None, below), True
    entries = [_Entry(first, tuple(sorted((place, 0.0, robot) for robot, place in enumerate(begin))), -1, None)]
    least, left = bounds(first, entries[0].team, classes.begin)
    heap, fronts = [(least, left, 0)], dict[object, list[tuple[float, ...]]]()
    for explored in itertools.count(1):
        if not heap:
            return Dearest(None, below), True
        least, _, at = heapq.heappop(heap)
        if least >= below - _TIES and not greed:
            return Dearest(None, below), True
        entry = entries[at]
        numbers = numbers_of([place for place, _, _ in entry.team], len(classes.moves))
        if classes.marks.accepting(entry.states) and search.may_end(numbers):
            moves, who = _way(entries, at)
            dearest = max(own for _, own, _ in entry.team)
            return Dearest(Course(moves, dearest, dearest, len(entries), who), dearest), True
        if explored > most:
            return Dearest(None, least), False
        if not _is_new(fronts, entry):
            continue
        for further in _following(search, entry, numbers, at):
            after = numbers_of([place for place, _, _ in further.team], len(classes.moves))
            bound, left = bounds(further.states, further.team, after)
            if bound < below - _TIES:
                entries.append(further)
                rank = bound + greed * left / len(begin) if greed else max(bound, least)
                heapq.heappush(heap, (rank, left, len(entries) - 1))
    raise AssertionError


def _is_new(fronts: dict[object, list[tuple[float, ...]]], entry: _Entry) -> bool:
    """Tell whether no way to the same state was no worse for any robot, and remember this one."""
    front = fronts.setdefault((entry.states, tuple(place for place, _, _ in entry.team)), [])
    paid = tuple(own for _, own, _ in entry.team)
    if any(all(known <= own for known, own in zip(other, paid, strict=True)) for other in front):
        return False
    front.append(paid)
    return True


def _following(search: NumberSearch, entry: _Entry, numbers: Numbers, at: int) -> Iterator[_Entry]:
    """Yield what one robot's moves lead to; of robots in one class that have paid the same, one moves."""
    sums, leaving, moved = search.classes.sums(numbers), search.leaves(numbers), set[tuple[int, float]]()
    for index, (place, paid, robot) in enumerate(entry.team):
        if (leaving is not None and place not in leaving) or (place, paid) in moved:
            continue
        moved.add((place, paid))
        others = (*entry.team[:index], *entry.team[index + 1 :])
        for move, changes in search.ways[place]:
            after = search.after(entry.states, sums, changes)
            if after is None:
                continue
            team = tuple(sorted((*others, (move.target, paid + move.cost, robot))))
            if search.fits(numbers_of([own for own, _, _ in team], len(numbers)), move):
                yield _Entry(after, team, at, (robot, move))


def _way(entries: Sequence[_Entry], at: int) -> tuple[tuple[ClassMove, ...], tuple[int, ...]]:
    """Return the moves that lead to an entry, and who makes them."""
    made: list[tuple[int, ClassMove]] = []
    while (step := entries[at].made) is not None:
        made.append(step)
        at = entries[at].before
    return tuple(move for _, move in reversed(made)), tuple(robot for robot, _ in reversed(made))
