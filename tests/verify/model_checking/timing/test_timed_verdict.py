"""Bounds in seconds on label timelines: deadlines to the tick, margins, clocks, the flight's end, and random tubes."""

from __future__ import annotations

import functools
import random
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import pytest

from tests.helpers.few import few_of
from tests.helpers.words.timed_signals import drawn_formula, drawn_signal, truth
from verify.data.files.mission_file import parse_mission
from verify.data.language.formula import Formula
from verify.data.language.formula_reader import parse_formula
from verify.data.mission import Mission
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.timing.timed_verdict import TimedJudge
from verify.model_checking.word_claims import judge_formula

NAMES = ("a", "b", "c")
MICROSECOND = Fraction(1, 1_000_000)
MILLISECOND = Fraction(1, 1_000)


def _timeline(*changes: tuple[Fraction | float, str, Status], duration: Fraction | float = 20, robot: str = "r") -> Timeline:
    """Return a timeline that begins out of all regions, with changes at exact times."""
    found = tuple(Change(Enclosure(Fraction(time), Fraction(time)), region, status) for time, region, status in changes)
    return Timeline(robot, dict.fromkeys(NAMES, "no"), found, Fraction(duration))


def _judged(text: str | Formula, *timelines: Timeline, error: Fraction | float = 0, slack: bool = True) -> Verdict:
    formula = parse_formula(text) if isinstance(text, str) else text
    judge = TimedJudge({timeline.robot: timeline for timeline in timelines}, Relations(), Fraction(error))
    return judge.judge(formula, slack=slack)


def test_a_deadline_is_met_or_missed_by_a_microsecond_at_margin_0() -> None:
    assert _judged("F[0,10] a", _timeline((10, "a", "must"))).outcome == "holds"
    assert _judged("F[0,10] a", _timeline((10 - MICROSECOND, "a", "must"))).outcome == "holds"
    missed = _judged("F[0,10] a", _timeline((10 + MICROSECOND, "a", "must")))
    assert missed.outcome == "fails"
    assert "after its deadline" in missed.sentence


def test_with_a_margin_between_the_earliest_and_the_sure_arrival_nothing_is_decided() -> None:
    def arrival(may: Fraction, must: Fraction) -> Verdict:
        return _judged("F[0,10] a", _timeline((may, "a", "may"), (must, "a", "must")))

    assert arrival(Fraction(9), 10 - MILLISECOND).outcome == "holds"
    assert arrival(10 + MILLISECOND, Fraction(11)).outcome == "fails"
    assert arrival(10 - MILLISECOND, 10 + MILLISECOND).outcome == "undecided"


def test_slack_is_how_late_everything_could_be() -> None:
    found = _judged("F[0,10] a", _timeline((8, "a", "must")))
    assert found.slack == pytest.approx(2.0, abs=1e-4)
    assert found.slack is not None
    assert found.slack <= 2.0
    assert "too late" in found.sentence
    dwell = _judged("F[0,10] G[0,5] a", _timeline((2, "a", "must"), (9, "a", "no")))
    assert dwell.slack == pytest.approx(2.0, abs=1e-4)  # it may come so late, and leave on time
    between = _judged("F[0,10] a", _timeline((10 - MILLISECOND * Fraction(3, 20), "a", "must")))
    assert "with 0.0001 s to spare" in between.sentence  # of 0.15 ms, rounded down
    small = _judged("F[0,10] a", _timeline((10 - MILLISECOND / 10, "a", "must")))
    assert small.slack == pytest.approx(1e-4, abs=5e-5)


def test_clocks_that_differ_by_more_than_the_slack_undo_a_verdict() -> None:
    flight = _timeline((8, "a", "must"))
    assert _judged("F[0,10] a", flight, error=Fraction(2)).outcome == "holds"
    assert _judged("F[0,10] a", flight, error=2 + MILLISECOND).outcome == "undecided"
    late = _timeline((12, "a", "must"))
    assert _judged("F[0,10] a", late, error=2 - MILLISECOND).outcome == "fails"
    assert _judged("F[0,10] a", late, error=Fraction(2)).outcome == "undecided"


def test_a_dwell_is_lost_to_clocks_that_drift_during_it() -> None:
    flight = _timeline((2, "a", "must"), (8, "a", "no"))
    assert _judged("F[0,10] G[0,5] a", flight, error=Fraction(1, 2)).outcome == "holds"
    assert _judged("F[0,10] G[0,5] a", flight, error=Fraction(1, 2) + MILLISECOND).outcome == "undecided"


def test_nobody_wins_by_landing() -> None:
    short = _timeline((3, "a", "must"), duration=5)
    assert _judged("F[0,10] G[0,2] a", short).outcome == "holds"
    held = _judged("F[0,10] G[0,5] a", short)
    assert held.outcome == "undecided"
    assert "held for 3 s after its end" in held.sentence
    assert _judged("G[0,10] !b", short).outcome == "undecided"
    assert _judged("G (a -> F[0,10] a)", short).outcome == "holds"
    assert _judged("G F[0,10] a", short).outcome == "holds"
    assert _judged("F[8,inf] a", short).outcome == "undecided"
    assert _judged("F[0,10] b", short).outcome == "fails"


@pytest.mark.parametrize(
    "text", ["F G[0,5] a", "F[2,inf] G[0,5] a", "F F[8,10] a", "true U G[0,5] a", "a M F[8,10] a", "F (a & G[0,5] a)"]
)
def test_what_is_bounded_is_reached_in_flight_and_not_by_landing(text: str) -> None:
    short = _judged(text, _timeline((Fraction(49, 10), "a", "must"), duration=5))
    assert short.outcome != "holds"
    long = _judged(text, _timeline((0, "a", "must"), duration=15))
    assert long.outcome == "holds"


def test_a_hover_that_would_never_do_is_not_given_in_seconds() -> None:
    assert "held for ever after its end" in _judged("G F G[0,1] a", _timeline((3, "a", "must"), duration=5)).sentence


def test_a_region_that_is_left_or_entered_at_the_very_end_is_held_from_there_on() -> None:
    left = _timeline((0, "a", "must"), (5, "a", "no"), duration=5)
    assert _judged("F (!a & F[0,1] !b)", left).outcome != "holds"
    assert _judged("G (a & F[0,1] !b)", left).outcome != "fails"
    entered = _timeline((5, "a", "must"), duration=5)
    assert _judged("F (a & F[0,1] !b)", entered).outcome == "holds"
    perhaps = _timeline((3, "a", "may"), (5, "a", "must"), duration=5)
    assert _judged("F (a & F[0,1] !b)", perhaps).outcome == "undecided"


def test_windows_nest_and_end_where_the_flight_ends() -> None:
    flight = _timeline((2, "a", "must"), (4, "a", "no"), (7, "b", "must"), duration=10)
    assert _judged("G[0,6] (a -> F[0,5] b)", flight).outcome == "holds"
    assert _judged("G[0,6] (a -> F[0,4] b)", flight).outcome == "fails"
    assert _judged("G[0,10] !c", flight).outcome == "holds"
    assert _judged("F[1,2] (a & F[3,5] b)", flight).outcome == "holds"
    assert _judged("F[1,2] (a & F[0,4.5] b)", flight).outcome == "fails"
    leaves = _timeline((0, "a", "must"), (4, "a", "no"), duration=10)
    assert _judged("a U[0,5] !a", leaves).outcome == "holds"
    assert _judged("a U[0,4] !a", leaves).outcome == "fails"  # regions are closed: it is out just after 4 s


def test_nothing_is_sure_of_labels_that_contradict_themselves() -> None:
    inner_without_outer = _timeline((2, "a", "must"))
    judge = TimedJudge({"r": inner_without_outer}, Relations(nested=frozenset({("a", "b")})), Fraction(0))
    for text in ("F[0,5] c & F[0,9] (a & b)", "F[3,5] c | F[4,4] b", "G[3,5] !b & F[3,5] a & F[3,5] b"):
        assert judge.judge(parse_formula(text), slack=False).outcome != "holds"


def test_robots_and_counts_are_told_apart_in_time() -> None:
    one = _timeline((2, "a", "must"), (6, "a", "no"), robot="r")
    other = _timeline((5, "a", "must"), (9, "a", "no"), robot="s")
    assert _judged("F[0,6] count(a) >= 2", one, other).outcome == "holds"
    assert _judged("F[0,6] count(a) >= 2", one, other, error=Fraction(3, 4)).outcome == "undecided"
    assert _judged("F[0,4] s.a", one, other).outcome == "fails"
    assert _judged("F[0,5] s.a & F[0,2] r.a", one, other).outcome == "holds"


def test_what_an_action_changes_is_either_at_its_instant() -> None:
    base = _timeline((1, "a", "must"), (9, "a", "no"))
    flight = Timeline(
        "r", base.initial, base.changes, base.duration, actions=(InternalChange(Fraction(5), "", "", "a", 0, frozenset({"c"})),)
    )
    assert _judged("F[0,5] c", flight).outcome == "undecided"
    assert _judged(f"F[0,{float(5 + MICROSECOND):.6f}] c", flight).outcome == "holds"
    assert _judged("G[0,5] !c", flight).outcome == "undecided"


def _signal_of(statuses: Sequence[str], rng: random.Random) -> list[bool]:
    """Return a flight in the tube: closed, and where it only may be inside anything."""
    cells = [status == "must" or (status == "may" and rng.random() < 0.5) for status in statuses]
    for k in range(0, len(cells), 2):
        beside = [cells[i] for i in (k - 1, k + 1) if 0 <= i < len(cells)]
        cells[k] = cells[k] or (any(beside) and statuses[k] != "no")
    return cells


def _tube(rng: random.Random, seconds: int, *, often: float = 0.35) -> Timeline:
    """Return a random timeline over whole seconds."""
    changes, initial = list[Change](), dict[str, Status]()
    for name in NAMES:
        status: Status = rng.choice(("no", "may", "must"))
        initial[name] = status
        for second in range(1, seconds):
            after: Status = rng.choice(("no", "may", "must")) if rng.random() < often else status
            if after != status:
                changes.append(Change(Enclosure(Fraction(second), Fraction(second)), name, after))
            status = after
    changes.sort(key=lambda change: change.time.low)
    return Timeline("r", initial, tuple(changes), Fraction(seconds))


def _statuses(timeline: Timeline, name: str, seconds: int) -> list[str]:
    """Return a region's status in each cell, read from the timeline anew; a direct change is inside at its instant."""
    row, status = list[str](), timeline.initial[name]
    for cell in range(2 * seconds + 1):
        here = [change for change in timeline.changes if change.region == name and 2 * change.time.low == cell]
        if here:
            row.append("may" if "may" in (status, here[-1].status) else "must")
            status = here[-1].status
        else:
            row.append(status)
    return row


def assert_no_flight_contradicts(seed: int, count: int, flights: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        seconds = rng.randint(2, 8)
        timeline = _tube(rng, seconds)
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        verdict = _judged(formula, timeline, slack=False)
        for _ in range(flights):
            signals = {name: _signal_of(_statuses(timeline, name, seconds), rng) for name in NAMES}
            holds = truth(formula, signals, 1)[0]
            assert not (verdict.outcome == "holds" and not holds), (str(formula), timeline, signals)
            assert not (verdict.outcome == "fails" and holds), (str(formula), timeline, signals)


@few_of(1, "seed", range(3))
def test_no_flight_of_a_tube_contradicts_the_verdict(seed: int) -> None:
    assert_no_flight_contradicts(seed, 60, 6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 230))
def test_no_flight_of_many_tubes_contradicts_the_verdict(seed: int) -> None:
    assert_no_flight_contradicts(seed, 400, 12)


def assert_exact_labels_are_decided(seed: int, count: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        seconds = rng.randint(1, 8)
        signals = {name: drawn_signal(rng, seconds, closed=True) for name in NAMES}
        changes = [
            Change(Enclosure(Fraction(cell // 2), Fraction(cell // 2)), name, "must" if cells[cell] else "no")
            for name, cells in signals.items()
            for cell in range(1, len(cells), 2)
            if cells[cell] != (cells[cell - 2] if cell > 1 else cells[0])
        ]
        if any(
            cells[k] and not any(cells[max(k - 1, 0) : k + 2 : 2])
            for cells in signals.values()
            for k in range(0, len(cells), 2)
        ):
            continue  # touched for an instant only, which timelines do not tell
        changes.sort(key=lambda change: change.time.low)
        timeline = Timeline("r", {n: "must" if c[0] else "no" for n, c in signals.items()}, tuple(changes), Fraction(seconds))
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        holds = truth(formula, signals, 1)[0]
        verdict = _judged(formula, timeline, slack=False)
        relies = "only where the flight's last letter is held" in verdict.sentence
        assert verdict.outcome == ("undecided" if relies else "holds" if holds else "fails"), (str(formula), signals, verdict)
        assert holds or not relies


@pytest.mark.parametrize("seed", range(3))
def test_exact_labels_are_decided(seed: int) -> None:
    assert_exact_labels_are_decided(seed, 120)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(300, 330))
def test_many_exact_labels_are_decided(seed: int) -> None:
    assert_exact_labels_are_decided(seed, 1000)


def assert_bounds_contradict_no_words(seed: int, count: int) -> None:
    """Hold bounds [0,inf] against the judge of words: they never contradict each other, and agree on one operator over Boolean operands."""
    rng = random.Random(seed)
    for number in range(count):
        timeline = _tube(
            rng, rng.randint(2, 7), often=0.8 if number % 2 else 0.35
        )  # many regions change at one instant, or few
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        unbounded = _replaced(formula, None)
        timed = _judged(_replaced(formula, (Fraction(0), None)), timeline, slack=False)
        words = judge_formula(_mission(str(unbounded)), {"r": timeline}, Relations())[0]
        assert timed.outcome in ("undecided", words.outcome), (str(unbounded), timeline)


def test_one_region_is_entered_at_the_instant_at_which_another_is_left() -> None:
    instant = Enclosure(Fraction(1), Fraction(1))
    changes = (Change(instant, "b", "must"), Change(instant, "c", "no"))
    timeline = Timeline("r", {"a": "must", "b": "no", "c": "must"}, changes, Fraction(2))
    assert _judged(parse_formula("(c U[0,inf] b) R[0,inf] c"), timeline, slack=False).outcome == "holds"
    assert judge_formula(_mission("(c U b) R c"), {"r": timeline}, Relations())[0].outcome == "holds"


def _replaced(node: Formula, window: tuple[Fraction, None] | None) -> Formula:
    parts = tuple(_replaced(part, window) for part in node.arguments)
    timed = node.operator in ("F", "G", "U", "R", "W", "M")
    return replace(node, arguments=parts, window=window if timed else None)


@functools.cache
def _mission(formula: str) -> Mission:
    regions = "".join(f"  {name}: {{center: [{i}.5, 1, 1], radii: [0.2, 0.2, 0.2]}}\n" for i, name in enumerate(NAMES))
    return parse_mission(
        f"format: 1\nname: law\nspec: {{formula: '{formula}'}}\nregions:\n{regions}agents: {{r: {{start: [0.1, 0.1, 1]}}}}\n"
        "vehicle: crazyflie-2.1\nworkspace: {min: [0, 0, 0.1], max: [4, 4, 3]}\nmargin: 0.05\n"
    )


@few_of(1, "seed", range(2))
def test_bounds_from_0_to_infinity_never_contradict_the_judge_of_words(seed: int) -> None:
    assert_bounds_contradict_no_words(seed, 40)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(400, 410))
def test_many_bounds_from_0_to_infinity_never_contradict_the_judge_of_words(seed: int) -> None:
    assert_bounds_contradict_no_words(seed, 400)


@few_of(1, "count", [10, 30])
@few_of(3, "text", ["F {p}", "G {p}", "{p} U {q}", "{p} R {q}", "{p} W {q}", "{p} M {q}"])
def test_one_operator_over_boolean_operands_is_judged_as_by_words(text: str, count: int) -> None:
    rng = random.Random(text)
    booleans = ["a", "!a", "a & b", "a | !b", "a -> c", "!(b & c)", "a | !a"]
    for _ in range(count):
        formula = parse_formula(text.format(p=f"({rng.choice(booleans)})", q=f"({rng.choice(booleans)})"))
        timeline = _tube(rng, rng.randint(2, 7))
        timed = _judged(_replaced(formula, (Fraction(0), None)), timeline, slack=False)
        words = judge_formula(_mission(str(formula)), {"r": timeline}, Relations())[0]
        assert (timed.outcome == "holds") == (words.outcome == "holds"), (str(formula), timeline, timed, words)
