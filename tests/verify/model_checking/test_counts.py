"""Counts over time: what the judge says of timelines, held against single flights that agree with them and a plain evaluator."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

from tests.helpers.missions.random_teams import random_timeline
from tests.helpers.words.plain_team_words import holds, some_flight
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import at, mission
from verify.data import parse_formula
from verify.data.language.counting import atoms
from verify.logic.normal_form import conjuncts, normal_form
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters
from verify.model_checking.inclusion import find_broken
from verify.model_checking.robot_letters import cut_timeline, from_timeline
from verify.model_checking.team_graph import JointGraph
from verify.model_checking.timeline import Change, Relations, Timeline
from verify.model_checking.word_claims import judge_formula


def judged(text, lines, clock_error=0, **options):
    asked = mission(text, team="joint", robots=len(lines))
    (verdict,) = judge_formula(
        asked, dict(zip(asked.agents, lines, strict=True)), Relations(), clock_error=Fraction(clock_error), **options
    )
    return verdict


@pytest.mark.parametrize(("seed", "teams"), [(1, 25), *(pytest.param(seed, 1500, marks=pytest.mark.slow) for seed in (2, 3))])
def test_no_flight_breaks_what_is_said_to_hold(seed, teams):
    rng, held, decided = Random(seed), 0, 0
    for number in range(teams):
        count = rng.choice([2, 2, 3])
        names = tuple(f"q{i}" for i in range(count))
        lines = [random_timeline(rng, name, busy=0.5) for name in names]
        formula = random_counting_formula(rng, rng.randint(1, 6), names)
        error = rng.choice([0, 0, 1])
        asked = mission(str(formula), team="joint", robots=count)
        of = dict(zip(asked.agents, lines, strict=True))
        (verdict,) = judge_formula(asked, of, Relations(), clock_error=Fraction(error), detail="answer", budget=3000)
        written = parse_formula(str(formula))
        broken = [w for w in (some_flight(rng, of, Fraction(error)) for _ in range(25)) if not holds(written, w)]
        assert not (verdict and broken), (seed, number, str(formula), broken[0])
        decided += verdict.outcome != "undecided"
        held += bool(verdict)
        if not error and verdict.outcome != "undecided":
            assert bool(verdict) == _together(asked, of), (seed, number, str(formula))
    assert held > teams / 8
    assert decided > teams / 2


def _together(asked, lines):
    """Tell whether the formula holds of all words of all robots' product, as a whole."""
    letters = TeamLetters.of(asked.formula, atoms(asked.formula))
    robots = []
    for name, line in lines.items():
        robot = from_timeline(cut_timeline(line, frozenset("abc")), Relations())
        robots.append(
            type(robot)(
                name,
                tuple(letters.own(name, x) for x in robot.letters),
                robot.spans,
                robot.following,
                robot.initial,
                robot.final,
            )
        )
    try:
        graph = JointGraph(robots, timed=True, together=letters.together)
        return all(find_broken(graph, part, 20_000) is None for part in conjuncts(normal_form(asked.formula)))
    except OutOfBudget:
        return True


def line(*changes):
    """A robot's timeline from (first time, last time, status of region a) on."""
    found = tuple(Change(at(low, high), "a", status) for low, high, status in changes)
    return Timeline("", {"a": "no", "b": "no"}, found, Fraction(12))


def docked(start, end, spread=0.25):
    return line((start, start + spread, "must"), (end, end + spread, "no"))


def test_simultaneity_needs_stays_that_overlap_by_more_than_clocks_may_be_off():
    lines = [docked(1, 6), docked(5, 9), docked(8, 11)]
    assert judged("F(count(a) >= 2)", lines)
    assert judged("F(count(a) >= 2)", lines, Fraction(1, 4))
    assert judged("F(count(a) >= 2)", lines, Fraction(3, 4)).outcome == "fails"
    assert judged("F(count(a) >= 3)", lines).outcome == "fails"
    assert judged("G(count(a) <= 2)", lines)
    assert judged("G(count(a) <= 2)", lines, 2).outcome == "fails"
    assert judged("F(count(a) >= 2) & F all(!a)", lines)


def test_what_may_be_counts_for_upper_bounds_and_not_for_lower_ones():
    lines = [line((2, 2, "may"), (4, 4, "no")), line((1, 1, "must"))]
    assert judged("F(count(a) >= 1)", lines)
    assert judged("F(count(a) >= 2)", lines).outcome == "fails"
    assert judged("G(count(a) <= 1)", lines).outcome == "fails"
    assert judged("F(count(!a) == 2)", lines)


def test_a_failure_names_counts_and_times():
    verdict = judged("G(count(a) <= 1)", [docked(1, 6), docked(5, 9)])
    assert verdict.outcome == "fails"
    assert 5 <= verdict.time <= 5.25
    assert verdict.sentence.startswith("`G count(a) <= 1` fails at the team's {} with 2 or more robots in a (5.000 to 6.250 s)")
    assert any("count(a) >= 2" in letter for _, letter in verdict.readings())


@pytest.mark.parametrize("robots", [30])
def test_thirty_robots_that_meet(robots):
    lines = [docked(Fraction(1) + Fraction(i, 100), 8, 1) for i in range(robots)]
    assert judged(f"F(count(a) >= {robots}) & G(count(a) <= {robots}) & F all(!a)", lines, Fraction(1, 10))
    assert judged("F(count(a) >= 30) & each(F a)", [*lines[:29], docked(10, 11)], detail="answer").outcome != "holds"
