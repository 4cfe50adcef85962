"""Lawler's partition against all solutions sorted by cost: choices of one number from each of several rows."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from hypothesis import given
from hypothesis import strategies as st

from ltlplan.search.lawler import Partition

Row = tuple[int, ...]
Shut = frozenset[tuple[int, int]]
ROWS = st.lists(st.lists(st.integers(0, 9), min_size=1, max_size=3).map(tuple), min_size=1, max_size=3)


def partition(rows: list[Row], *, searches: float = float("inf")) -> Partition[Shut, Row]:
    """Return choices of a place in each row; a space says which places are shut, and a choice parts it by each of its places."""

    def solve(shut: Shut) -> Iterator[tuple[int, Row]]:
        free = [[place for place in range(len(row)) if (i, place) not in shut] for i, row in enumerate(rows)]
        if all(free):
            best = tuple(min(places, key=lambda place, row=rows[i]: row[place]) for i, places in enumerate(free))
            yield sum(row[place] for row, place in zip(rows, best, strict=True)), best

    def part(shut: Shut, choice: Row) -> Iterator[Shut]:
        return (shut | {(i, place)} for i, place in enumerate(choice))

    return Partition([frozenset[tuple[int, int]]()], solve, part, searches=searches)


@given(ROWS)
def test_all_solutions_come_cheapest_first(rows: list[Row]) -> None:
    found = list(partition(rows))
    places = itertools.product(*(range(len(row)) for row in rows))
    costs = {choice: sum(row[place] for row, place in zip(rows, choice, strict=True)) for choice in places}
    assert {member.solution for member in found} == set(costs)
    assert all(member.cost == costs[member.solution] for member in found)
    assert [member.cost for member in found] == sorted(member.cost for member in found)


def test_nothing_is_searched_before_it_is_asked_for() -> None:
    choices = partition([(1, 2), (1, 2)])
    stream = iter(choices)
    assert not choices.searched
    next(stream)
    assert len(choices.searched) == 1
    next(stream)
    assert len(choices.searched) == 3


def test_equal_spaces_are_searched_once_and_no_more_than_are_allowed() -> None:
    whole = partition([(1, 2, 3), (1, 2, 3)])
    assert len({member.space for member in whole}) == len(list(partition([(1, 2, 3), (1, 2, 3)])))
    few = partition([(1, 2, 3), (1, 2, 3)], searches=4)
    assert len(list(few)) == len(few.searched) == 4
