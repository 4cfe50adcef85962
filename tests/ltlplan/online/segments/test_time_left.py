"""What is left of bounds in seconds after a part of a flight, against brute force on signals and by examples."""

from __future__ import annotations

import random
from fractions import Fraction

import pytest

from ltlplan.online.segments.time_left import Flown, part_left
from tests.helpers.words.timed_signals import drawn_formula, drawn_signal, truth
from verify.data.language.formula import FALSE, TRUE
from verify.data.language.formula_reader import parse_formula
from verify.model_checking.timeline import Change, Enclosure, Relations, Status, Timeline

NAMES = ("a", "b", "c")
_LONGEST = 100
"""Nodes of what is left up to which brute force decides it."""


def _line(signals: dict[str, list[bool]], seconds: int) -> Timeline:
    changes = [
        Change(Enclosure(Fraction(cell // 2), Fraction(cell // 2)), name, "must" if cells[cell] else "no")
        for name, cells in signals.items()
        for cell in range(1, 2 * seconds + 1, 2)
        if cells[cell] != (cells[cell - 2] if cell > 1 else cells[0])
    ]
    changes.sort(key=lambda change: change.time.low)
    first: dict[str, Status] = {name: "must" if cells[0] else "no" for name, cells in signals.items()}
    return Timeline("r", first, tuple(changes), Fraction(seconds))


def _flown(line: Timeline, since: int, *, later: int = 0, error: str = "0") -> Flown:
    return Flown({"r": line}, Relations(), Fraction(error), Fraction(since), Fraction(since + later))


def assert_the_rest_decides_the_whole(seed: int, count: int) -> None:
    """Cut signals in two at a whole second: what is left holds of the rest where the formula holds of the whole."""
    rng = random.Random(seed)
    for _ in range(count):
        seconds = rng.randint(2, 8)
        cut = rng.randint(1, seconds)
        signals = {name: drawn_signal(rng, seconds, closed=True) for name in NAMES}
        touched = any(
            cells[k] and not any(cells[max(k - 1, 0) : k + 2 : 2])
            for cells in signals.values()
            for k in range(0, len(cells), 2)
        )
        turns = any(len(set(cells[2 * cut - 1 : 2 * cut + 2])) > 1 for cells in signals.values())
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        if touched or turns:  # robots hover between two pieces of a flight
            continue
        left = part_left(formula, _flown(_line(signals, cut), cut))
        if sum(1 for _ in left.walk()) > _LONGEST:
            continue
        rest = {name: cells[2 * cut :] for name, cells in signals.items()}
        assert truth(left, rest, 1)[0] == truth(formula, signals, 1)[0], (str(formula), str(left), cut, signals)


@pytest.mark.parametrize("seed", range(2))
def test_what_is_left_holds_of_the_rest_where_the_formula_holds_of_the_whole(seed: int) -> None:
    assert_the_rest_decides_the_whole(seed, 150)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_what_is_left_of_many_formulas_holds_of_the_rest_where_they_hold_of_the_whole(seed: int) -> None:
    assert_the_rest_decides_the_whole(seed, 1000)


def _in_a(*, begins: int, ends: int | None = None, flown: int) -> Timeline:
    changes = [Change(Enclosure(Fraction(begins), Fraction(begins)), "a", "must")]
    if ends is not None:
        changes.append(Change(Enclosure(Fraction(ends), Fraction(ends)), "a", "no"))
    return Timeline("r", {"a": "no", "b": "no"}, tuple(changes), Fraction(flown))


@pytest.mark.parametrize(
    ("asked", "left"),
    [
        ("F[0,30] a", "true"),
        ("F[0,30] b", "F[0,18] b"),
        ("F[20,30] b", "F[8,18] b"),
        ("F[0,15] G[0,5] a", "G[0,2] a | F[0,3] G[0,5] a"),
        ("G[0,60] (a -> F[0,10] b)", "F[0,7] b & G[0,48] (a -> F[0,10] b)"),
        ("!b U[0,20] a", "true"),
        ("!b U[10,20] (a & b)", "!b U[0,8] (a & b)"),
        ("G[0,20] !b", "G[0,8] !b"),
        ("G[0,12] !b", "true"),
        ("G[0,11] !b", "true"),
        ("F[0,5] b", "false"),
        ("G F[0,30] b", "F[0,18] b & G F[0,30] b"),
    ],
)
def test_bounds_are_counted_from_where_the_rest_begins(asked: str, left: str) -> None:
    """The robot came into a 9 s after the start, 3 s ago, and is there."""
    assert part_left(parse_formula(asked), _flown(_in_a(begins=9, flown=12), 12)) == parse_formula(left)


def test_a_rest_that_may_begin_later_has_less_time_for_what_is_due_and_more_for_what_lasts() -> None:
    flown = _flown(_in_a(begins=9, flown=12), 12, later=4)
    assert part_left(parse_formula("F[20,30] b"), flown) == parse_formula("F[8,14] b")
    assert part_left(parse_formula("G[20,30] !b"), flown) == parse_formula("G[4,18] !b")
    assert part_left(parse_formula("F[0,15] b"), flown) == FALSE
    assert part_left(parse_formula("F[0,15] a"), flown) == TRUE


def test_what_only_may_have_been_shown_was_not() -> None:
    touched = Timeline(
        "r",
        {"a": "no"},
        (Change(Enclosure(Fraction(2), Fraction(2)), "a", "may"), Change(Enclosure(Fraction(4), Fraction(4)), "a", "no")),
        Fraction(6),
    )
    assert part_left(parse_formula("F[0,10] a"), _flown(touched, 6)) == parse_formula("F[0,4] a")
    assert part_left(parse_formula("G[0,5] !a"), _flown(touched, 6)) == FALSE


def test_clocks_that_are_apart_take_from_a_dwell() -> None:
    flown = _flown(_in_a(begins=9, flown=12), 12, error="0.1")
    assert part_left(parse_formula("F[0,15] G[0,5] a"), flown) == parse_formula("G[0,2.1] a | F[0,3] G[0,5] a")
