"""Formulas with bounds in seconds against brute force, and against each other."""

from __future__ import annotations

import random

import pytest

from tests.helpers.words.timed_signals import drawn_formula, drawn_signal, truth
from verify.data.language.formula import TRUE
from verify.data.language.formula_reader import parse_formula
from verify.data.language.relaxation import relaxed
from verify.model_checking.timing.instants import shows
from verify.model_checking.timing.team_instants import TeamInstants
from verify.model_checking.timing.timed_formula import TimedFormula

NAMES = ("a", "b", "c")


def _team(signals: dict[str, list[bool]]) -> TeamInstants:
    cells = len(next(iter(signals.values())))
    letters = [frozenset(name for name in signals if signals[name][cell]) for cell in range(cells)]
    return TeamInstants(tuple(range(cells)), tuple(frozenset({letter}) for letter in letters))


def assert_as_by_brute_force(seed: int, count: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        seconds = rng.randint(1, 8)
        signals = {name: drawn_signal(rng, seconds, closed=False) for name in NAMES}
        formula = drawn_formula(rng, NAMES, rng.randint(1, 4))
        expected = truth(formula, signals, 2 * seconds + 1)
        timed = TimedFormula(_team(signals), end=seconds, scale=1)
        yes, no = timed.sure(formula), timed.sure(formula, negated=True)
        for cell, holds in enumerate(expected):
            assert shows(yes.held, cell) == holds, (str(formula), signals, cell)
            assert shows(no.held, cell) != holds, (str(formula), signals, cell)


@pytest.mark.parametrize("seed", range(4))
def test_formulas_on_known_signals_are_decided_as_by_brute_force(seed: int) -> None:
    assert_as_by_brute_force(seed, 150)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 150))
def test_fifty_thousand_formulas_are_decided_as_by_brute_force(seed: int) -> None:
    assert_as_by_brute_force(seed, 1000)


@pytest.mark.parametrize("operator", ["G[0,0.1]", "F[0,0.1]", "a R[0,0.1]", "a W[0,0.1]", "a M[0,0.1]", "a U[0,0.1]"])
def test_a_formula_as_deep_as_can_be_read_is_decided(operator: str) -> None:
    formula = parse_formula(f"{operator} " * 190 + "!b")
    timed = TimedFormula(TeamInstants((0,), (frozenset({frozenset({"a"})}),)), end=1000, scale=10)
    assert shows(timed.sure(formula).flown, 0)


def test_many_choices_over_bounds_are_relaxed_at_once() -> None:
    for sign in ("xor", "<->"):
        assert relaxed(parse_formula(f" {sign} ".join(f"F[0,{i}] a" for i in range(1, 60)))) == TRUE
    assert relaxed(parse_formula("F[0,1] a xor G[0,1] b")) != TRUE
