"""Windows that no flight fits, and visits that are due where nobody may be: refused before anything is planned."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import pytest

import ltlplan
from ltlplan.replanning.timing.horizons import kept_out, least_duration, too_long
from tests.helpers.missions.timed_rooms import room
from tests.helpers.words.timed_signals import drawn_formula, drawn_signal
from verify.data import Infeasible
from verify.data.language.formula_reader import parse_formula
from verify.model_checking.timing.instants import at
from verify.model_checking.timing.team_instants import TeamInstants
from verify.model_checking.timing.timed_formula import TimedFormula


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("F[5,9] dock", 5),
        ("G[0,9] dock", 9),
        ("F[5,9] G[1,4] dock", 9),
        ("F[0,9] dock | G[0,4] pit", 0),
        ("F[3,9] dock & G[0,4] pit", 4),
        ("!F[3,9] dock", 9),
        ("!(F[3,9] dock -> F[20,30] pit)", 30),
        ("dock U[7,inf] pit", 7),
        ("dock R[0,30] pit", 0),
        ("G F[5,9] dock", 0),
        ("F[8,9] dock xor G[0,4] pit", 0),
    ],
)
def test_a_flight_lasts_until_its_windows_are_over(text: str, seconds: int) -> None:
    assert least_duration(parse_formula(text)) == seconds


@pytest.mark.parametrize("seed", range(2))
def test_no_shorter_flight_is_proved(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(300):
        seconds = rng.randint(1, 8)
        signals = {name: drawn_signal(rng, seconds, closed=False) for name in "abc"}
        formula = drawn_formula(rng, ("a", "b", "c"), rng.randint(1, 3))
        letters = [frozenset(name for name in signals if signals[name][cell]) for cell in range(2 * seconds + 1)]
        team = TeamInstants(tuple(range(len(letters))), tuple(frozenset({letter}) for letter in letters))
        if at(TimedFormula(team, end=seconds, scale=1).sure(formula).flown, 0):
            assert least_duration(formula) <= seconds, (str(formula), signals)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("F[1000000,1000001] dock", "a flight of at least 1000000 s, and no longer flight is planned than 3600 s"),
        ("G[0,1000000] !dock", "a flight of at least 1000000 s"),
        ("F[0,10] G[0,100000] dock", "a flight of at least 100000 s"),
        ("F[5,6] dock & G[0,10] !dock", "`F[5,6] dock` and `G[0,10] !dock` cannot both hold: until 10 s nobody may be there."),
        ("F[5,6] (dock | pit) & G[4,10] !(pit | dock)", "until 10 s nobody may be there"),
        ("F[0,0.1] dock", "by straight ways"),
    ],
)
def test_a_window_that_no_flight_fits_is_refused_before_planning(text: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def planned(*_: object, **__: object) -> None:
        raise AssertionError("it is planned")

    monkeypatch.setattr("ltlplan.replanning.timing.plans_in_time.planned_without_bounds", planned)
    with pytest.raises(Infeasible) as refused:
        ltlplan.plan(room(text))
    assert said in str(refused.value)


def test_a_battery_that_does_not_last_until_a_window_is_over_is_named() -> None:
    mission = room("F[0,20] G[0,300] dock", planner="limits: {endurance: 200}")
    assert "a flight of at least 300 s, and quad0's `endurance` allows no longer one than 189 s" in too_long(mission)
    assert not too_long(room("F[0,20] G[0,100] dock", planner="limits: {endurance: 200}"))


@pytest.mark.parametrize(
    "text",
    [
        "F[5,11] dock & G[0,10] !dock",
        "F[5,6] dock & G[0,5.5] !dock",
        "F[5,6] (dock | pit) & G[0,9] !dock",
        "F[5,6] dock & G[0,9] !pit",
    ],
)
def test_what_may_be_in_time_is_not_refused(text: str) -> None:
    assert not kept_out(room(text))
    assert not math.isinf(least_duration(parse_formula(text)))
    assert least_duration(parse_formula(text)) <= Fraction(10)
