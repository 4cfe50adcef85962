"""Teams that fly laps: what is said of all their words, against flights of laps made by hand, one instant after another."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.helpers.missions.worlds import world
from tests.helpers.words.timelines import APART, END, at, mission, timeline
from tests.strategies import formulas
from verify.data import BadInput, Letter, Mission, Word
from verify.logic.semantics import satisfies
from verify.model_checking.timeline import Change, Timeline
from verify.model_checking.word_claims import judge_formula

HALF = Fraction(1, 2)


def judged(formula: str, *lines: Timeline, team: str = "own", error: Fraction | int = 0):
    asked = mission(formula, team=team, robots=len(lines), trace="infinite")
    return judge_formula(asked, {line.robot: line for line in lines}, APART, clock_error=Fraction(error))[0]


def test_recurrences_are_shared():
    lines = timeline("q0", ("a", 4, 6), cycle=2), timeline("q1", ("b", 8, 9), cycle=2)
    assert judged("G F a & G F b", *lines)
    assert judged("G F a & G F c", *lines).outcome == "fails"
    assert judged("G F(a & b)", *lines, team="joint").outcome == "fails"


def test_what_happens_once_is_no_recurrence():
    lines = timeline("q0", ("a", 1, 2), cycle=3), timeline("q1", ("b", 8, 9), cycle=3)
    assert judged("F a & G F b", *lines)
    verdict = judged("G F a", *lines)
    assert verdict.outcome == "fails"
    assert not satisfies(mission("G F a").formula, verdict.counterexample)


def test_who_rests_in_a_region_is_read_in_every_lap():
    rests = Timeline("q0", dict.fromkeys("abc", "no"), (Change(at(1), "a", "must"),), Fraction(END), cycle=Fraction(2))
    other = timeline("q1", ("b", 8, 9), cycle=2)
    assert judged("G F a", rests, other)
    assert judged("F G a", rests, other).outcome == "fails"  # under `own` it asks every robot to stay there
    assert judged("F G a", rests, other, team="joint")
    assert judged("G F(a & b)", rests, other, team="joint")


@pytest.mark.parametrize(
    "formula", ["!a", "F free", "F all(free)", "q0.free & q1.free", "count(a) < 1 U q0.a", "!b W (a & q1.free)"]
)
def test_what_all_show_at_first_is_read_before_anything_changes(formula: str):
    comes = Timeline("q0", dict.fromkeys("abc", "no"), (Change(at(1), "a", "must"),), Fraction(END), cycle=Fraction(2))
    lines = comes, timeline("q1", cycle=2)
    assert judged(formula, *lines, team="joint", error=HALF)
    assert judged(f"!({formula})", *lines, team="joint").outcome == "fails"


@pytest.mark.parametrize("formula", ["G all(free)", "F G all(free)", "all(free) W false"])
def test_counts_of_the_free_that_come_to_plain_names_are_explained(formula: str):
    lines = {
        name: Timeline(name, {"a": "no"}, (Change(at(1), "a", "must"),) if name == "quad0" else (), Fraction(END))
        for name in ("quad0", "quad1")
    }
    verdict = judge_formula(world(formula, robots=2, regions={"a": (0.0, 0.0)}, team="joint"), lines, APART)[0]
    assert verdict.outcome == "fails"
    assert "!a` " in verdict.sentence
    assert verdict.region == "a"


def test_laps_keep_their_order():
    """q0 is in a first in each lap, q1 in b afterwards; the next lap comes after that."""
    lines = timeline("q0", ("a", 4, 6), cycle=2), timeline("q1", ("b", 10, 12), cycle=2)
    assert judged("!b U a & G(b -> (b | free) W a)", *lines, team="joint")
    assert judged("G(b -> !a)", *lines, team="joint")
    assert judged("!b U a", *lines)


@pytest.mark.parametrize(("error", "outcome"), [(0, "holds"), (HALF, "holds"), (2, "fails")])
def test_who_is_late_meets_who_is_in_the_next_lap(error: Fraction, outcome: str):
    """q0 is in the gate at a lap's begin, q1 at its end: with clocks that differ by more than what is between, both at once."""
    lines = timeline("q0", ("a", 3, 4), cycle=2), timeline("q1", ("b", 17, 18), cycle=2)
    verdict = judged("G !(a & b)", *lines, team="joint", error=error)
    assert verdict.outcome == outcome
    assert verdict.time == (17.0 if outcome == "fails" else None), "in the lap of who is late"


@pytest.mark.parametrize(("formula", "outcome"), [("G(count(a) <= 1)", "holds"), ("G F(count(a) >= 2)", "fails")])
def test_robots_are_counted_over_the_seam(formula: str, outcome: str):
    lines = timeline("q0", ("a", 3, 4), cycle=2), timeline("q1", ("a", 17, 18), cycle=2)
    assert judged(formula, *lines, team="joint").outcome == outcome


def test_meetings_in_each_lap_are_proved_where_stays_overlap():
    lines = timeline("q0", ("a", 4, 8), cycle=2), timeline("q1", ("a", 6, 10), cycle=2)
    assert judged("G F(count(a) >= 2)", *lines, team="joint", error=HALF)
    assert judged("G F(count(a) >= 2)", *lines, team="joint", error=1).outcome == "fails"
    assert judged("G F(q0.a & q1.a) & G F !q0.a", *lines, team="joint")
    assert judged("G F count(a & water) >= 1", *lines, team="joint").outcome == "fails"


def test_one_robot_that_counts_itself_is_judged_over_all_laps():
    line = timeline("q0", ("a", 4, 8), cycle=2)
    assert judged("G F(count(a) >= 1)", line, team="joint")
    assert judged("G F(count(b) >= 1)", line, team="joint").outcome == "fails"
    assert judged("F G(count(a) >= 1)", line, team="joint").outcome == "fails"


def test_each_lap_chooses_anew_what_labels_leave_open():
    lines = timeline("q0", grazes=(("a", 10, 11),), cycle=2), timeline("q1", ("b", 4, 6), cycle=2)
    assert judged("G F a | F G !a", *lines, team="joint")
    assert judged("G F a", *lines, team="joint").outcome == "fails"
    assert judged("F G !a", *lines).outcome == "fails"


def test_laps_that_do_not_begin_together_are_refused():
    with pytest.raises(BadInput, match="begin and end together"):
        judged("G F a", timeline("q0", cycle=2), timeline("q1", cycle=3))
    with pytest.raises(BadInput, match="half of a lap"):
        judged("G F a", timeline("q0", ("a", 4, 5), cycle=2), timeline("q1", cycle=2), error=9)
    lines = {f"q{i}": timeline(f"q{i}", cycle=1) for i in range(2)}
    with pytest.raises(BadInput, match="finite traces"):
        judge_formula(mission("F a", robots=2, trace="infinite"), lines, APART, times="parallel")


Visits = tuple[tuple[str, int, int], ...]
"""Regions with the first and the last second of a stay."""


@st.composite
def visits(draw: st.DrawFn, begin: int, end: int, most: int = 2) -> Visits:
    times = sorted(draw(st.lists(st.integers(begin + 1, end - 1), max_size=2 * most, unique=True)))
    return tuple((draw(st.sampled_from("abc")), low, high) for low, high in zip(times[::2], times[1::2], strict=False))


def shown(own: Visits, time: Fraction) -> Letter:
    """Stays are closed: at its first and last instant one is in the region."""
    return frozenset(region for region, low, high in own if low <= time <= high)


def word_of_laps(own: list[Visits], lap: int, late: list[Fraction], asked: Mission, rng: Random) -> Word:
    """Fly by hand: robot i is late by `late[i]` in each lap; read at random instants and in all letters."""
    length = END - lap
    stops = [Fraction(0), *map(Fraction, range(1, 4 * END))]
    stops = sorted({*stops, *(a + (b - a) / 2 for a, b in pairwise(stops)), *(s + d for s in stops for d in late)})

    def local(time: Fraction) -> Fraction:
        return time if time <= lap else lap + (time - lap) % length

    def letters(time: Fraction) -> list[Letter]:
        return [shown(mine, local(max(time - d, Fraction(0)))) for mine, d in zip(own, late, strict=True)]

    def read(times: list[Fraction], before: list[Letter]) -> list[Letter]:
        found: list[Letter] = []
        for time in times:
            now = letters(time)
            if asked.spec.team == "joint":
                found.append(frozenset().union(*now))
                continue
            order = [i for i, letter in enumerate(now) if letter != before[i] or rng.random() < 0.2]
            rng.shuffle(order)
            found += [now[i] for i in order]
            before[:] = now
        return found

    cut = Fraction(lap) + 1
    nobody = [frozenset({"nothing is read yet"})] * len(own)
    prefix = read([t for t in stops if t < cut], list(nobody))
    cycle = read([t for t in stops if cut <= t < cut + length], list(nobody))
    return Word(tuple(prefix), tuple(cycle))


FLOWN = given(
    formulas(size=6), st.data(), st.integers(1, 3), st.integers(3, 8), st.sampled_from(["own", "joint"]), st.randoms()
)


@settings(max_examples=12, deadline=None)
@FLOWN
def test_no_laps_by_hand_break_what_is_said_to_hold(formula, data, robots, lap, team, rng: Random):
    assert_no_laps_break_it(formula, data, robots, lap, team, rng)


@pytest.mark.slow
@settings(max_examples=400, deadline=None)
@FLOWN
def test_of_many_laps_by_hand_none_breaks_what_is_said_to_hold(formula, data, robots, lap, team, rng: Random):
    assert_no_laps_break_it(formula, data, robots, lap, team, rng)


def assert_no_laps_break_it(formula, data, robots: int, lap: int, team: str, rng: Random) -> None:
    own = [(*data.draw(visits(0, lap)), *data.draw(visits(lap, END))) for _ in range(robots)]
    error = data.draw(st.sampled_from([Fraction(0), HALF, Fraction(1)]))
    lines = [timeline(f"q{i}", *mine, cycle=lap) for i, mine in enumerate(own)]
    asked = mission(str(formula), team=team, robots=robots, trace="infinite")
    verdict = judge_formula(asked, {line.robot: line for line in lines}, APART, clock_error=error, budget=5_000)[0]
    if verdict.outcome == "holds":
        for _ in range(10):
            late = [rng.choice([Fraction(0), error, error / 2]) for _ in own]
            word = word_of_laps(own, lap, late, asked, rng)
            assert satisfies(asked.formula, word), (late, word)
