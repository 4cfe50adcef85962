"""Bounds in seconds on laps for ever: against brute force, and laws of laps."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import pytest

from tests.helpers.few import few_of
from tests.helpers.words.timed_signals import Cells, drawn_formula, drawn_signal, truth_for_ever
from tests.helpers.words.timelines import mission
from verify.data.language.formula import TEMPORAL, Formula
from verify.data.language.formula_reader import parse_formula
from verify.logic.verdict import Verdict
from verify.model_checking.timeline import Change, Enclosure, InternalChange, Relations, Status, Timeline
from verify.model_checking.timing.instants import shows
from verify.model_checking.timing.laps import Recurrence, unrolled
from verify.model_checking.timing.team_instants import TeamInstants
from verify.model_checking.timing.timed_formula import TimedFormula
from verify.model_checking.timing.timed_verdict import TimedJudge
from verify.model_checking.word_claims import judge_formula

NAMES = ("a", "b", "c")
Time = Fraction | float


def _lasso(rng: random.Random) -> tuple[dict[str, Cells], int]:
    """Return random signals of prefix and lap, and the lap's number of cells."""
    prefix, lap = rng.randint(0, 5), rng.randint(1, 5)
    signals = {name: drawn_signal(rng, prefix + lap, closed=False)[:-1] for name in NAMES}
    return signals, 2 * lap


def _evaluated(signals: Mapping[str, Cells], loop: int) -> TimedFormula:
    count = len(next(iter(signals.values())))
    letters = [frozenset(name for name in signals if signals[name][cell]) for cell in range(count)]
    team = TeamInstants(tuple(range(count)), tuple(frozenset({letter}) for letter in letters))
    return TimedFormula(team, Recurrence((count - loop) // 2, loop // 2), scale=1)


def _stretched(node: Formula, factor: int) -> Formula:
    """Return a formula with all bounds so many times greater, to look many laps ahead."""
    window = node.window and (node.window[0] * factor, None if node.window[1] is None else node.window[1] * factor)
    return replace(node, arguments=tuple(_stretched(part, factor) for part in node.arguments), window=window)


def assert_as_by_brute_force(seed: int, count: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        signals, loop = _lasso(rng)
        formula = _stretched(drawn_formula(rng, NAMES, rng.randint(1, 4)), rng.choice([1, 1, 1, 4]))
        expected = truth_for_ever(formula, signals, loop)
        timed = _evaluated(signals, loop)
        yes, no = timed.sure(formula), timed.sure(formula, negated=True)
        for cell, holds in enumerate(expected):
            assert shows(yes.held, cell) == holds, (str(formula), signals, loop, cell)
            assert shows(no.held, cell) != holds, (str(formula), signals, loop, cell)


@pytest.mark.parametrize("seed", range(4))
def test_formulas_on_known_laps_are_decided_as_by_brute_force(seed: int) -> None:
    assert_as_by_brute_force(seed, 100)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_twenty_thousand_formulas_on_laps_are_decided_as_by_brute_force(seed: int) -> None:
    assert_as_by_brute_force(seed, 1000)


def _line(*visits: tuple[str, float, float], cycle: Time = 0, lasts: Time = 10, edge: Time = 0, robot: str = "r") -> Timeline:
    """Return laps with visits (region, from, to); each end is open for `edge` before and after it."""
    changes: list[Change] = []
    for region, start, stop in visits:
        if edge:
            statuses: list[tuple[Time, Status]] = [
                (Fraction(start) - edge, "may"),
                (Fraction(start) + edge, "must"),
                (Fraction(stop) - edge, "may"),
                (Fraction(stop) + edge, "no"),
            ]
        else:
            statuses = [(start, "must"), (stop, "no")]
        changes += [Change(Enclosure(Fraction(time), Fraction(time)), region, status) for time, status in statuses]
    changes.sort(key=lambda change: change.time.low)
    return Timeline(robot, dict.fromkeys(NAMES, "no"), tuple(changes), Fraction(lasts), cycle=Fraction(cycle))


def _judged(text: str | Formula, *lines: Timeline, error: Time = 0, slack: bool = False) -> Verdict:
    formula = parse_formula(text) if isinstance(text, str) else text
    return TimedJudge({line.robot: line for line in lines}, Relations(), Fraction(error)).judge(formula, slack=slack)


MICROSECOND = Fraction(1, 1_000_000)
PATROL = _line(("a", 2, 3), ("b", 6, 7))


def test_a_recurrence_is_met_in_every_lap_or_missed_by_a_microsecond() -> None:
    assert _judged("G F[0,9] a", PATROL).outcome == "holds"
    assert _judged(f"G F[0,{float(9 - MICROSECOND):.6f}] a", PATROL).outcome == "fails"
    assert _judged("G F[0,8.5] a", PATROL).sentence.endswith(
        "fails: asked at 3 s, `a` comes at 12 s, 0.5 s after its deadline."
    )
    assert _judged("G F[0,9] c", PATROL).sentence.endswith("asked at 0 s, `c` never comes.")


def test_a_bounded_response_is_held_over_the_seam() -> None:
    assert _judged("G (a -> F[0,4] b)", PATROL).outcome == "holds"
    assert _judged("G (b -> F[0,6] a)", PATROL).outcome == "holds"
    late = _judged("G (b -> F[0,5.5] a)", PATROL)
    assert late.sentence.endswith("asked at 6 s, `a` comes at 12 s, 0.5 s after its deadline.")
    assert _judged("G F[0,14] G[0,1] a", PATROL).outcome == "holds"
    assert _judged("G F[0,14] G[0,1.1] a", PATROL).outcome == "fails"
    assert _judged("G (!a -> !a W G[0,1] a)", PATROL).outcome == "holds"
    assert _judged("G (!a -> !a W G[0,1.001] a)", PATROL).outcome == "fails"


def test_bounds_of_many_laps_are_counted_to_the_end() -> None:
    often = "F[0,1] (a & F[9,inf] (a & F[9,10] a))"
    assert _judged(f"F[992,993] {often}", PATROL).outcome == "holds"
    assert _judged(f"F[994,1000] {often}", PATROL).outcome == "fails"
    assert _judged("G[993.001,1001.999] !a", PATROL).outcome == "holds"
    assert _judged("G[993,1001] !a", PATROL).outcome == "fails"
    assert "ends at 1002 s" in _judged("G[993.001,1002] !a", PATROL).sentence
    assert "comes at 1002 s, 1 s after" in _judged("F[994,1001] a", PATROL).sentence


def test_what_the_prefix_shows_is_shown_once() -> None:
    line = _line(("c", 1, 2), ("a", 5, 6), cycle=4)
    assert _judged("F[0,1] c & G[2.5,inf] !c", line).outcome == "holds"
    assert _judged("G F[0,50] c", line).outcome == "fails"
    assert _judged("F[10,1000] c", line).outcome == "fails"
    assert _judged("G F[0,5] a", line).outcome == "holds"
    assert _judged("G[4,inf] F[0,5] a", line).outcome == "holds"


def test_clocks_and_margins_widen_what_is_asked_between_laps() -> None:
    half = Fraction(1, 2)
    assert _judged("G F[0,10] a", PATROL, error=half).outcome == "holds"
    assert _judged("G F[0,10] a", PATROL, error=half + MICROSECOND).outcome == "undecided"
    assert _judged("G F[0,7.999] a", PATROL, error=half).outcome == "fails"
    assert _judged("G F[0,8] a", PATROL, error=half).outcome == "undecided"
    tube = _line(("a", 2, 3), edge=Fraction(1, 4))
    assert _judged("G F[0,9.501] a", tube).outcome == "holds"
    assert _judged("G F[0,9.5] a", tube).outcome == "undecided"
    assert _judged("G F[0,8.499] a", tube).outcome == "fails"


def test_slack_counts_all_laps() -> None:
    found = _judged("G F[0,10] a", PATROL, slack=True)
    assert found.slack == pytest.approx(1.0, abs=1e-4)
    assert found.slack is not None
    assert found.slack <= 1.0
    assert _judged("G F[0,21] true", PATROL, slack=True).slack is None
    assert _judged("F[0,100] (a & F[3,5] b)", PATROL, slack=True).slack == pytest.approx(1.0, abs=1e-4)


def test_robots_are_counted_over_the_seam() -> None:
    one, other = _line(("a", 8, 10), robot="r"), _line(("a", 0.5, 3), robot="s")
    rests = replace(one, initial={**one.initial, "a": "must"}, changes=(one.changes[1], one.changes[0]))
    stays = Timeline("r", rests.initial, (Change(Enclosure(Fraction(1), Fraction(1)), "a", "no"), one.changes[0]), Fraction(10), cycle=Fraction(0))  # fmt: skip
    assert _judged("G F[0,10] count(a) >= 2", stays, other).outcome == "holds"
    assert _judged("G F[0,9] count(a) >= 2", stays, other).outcome == "fails"
    assert _judged("G F[0,10.1] count(a) >= 2", stays, other, error=Fraction(1, 20)).outcome == "holds"
    assert _judged("G F[0,11] count(a) >= 2", stays, other, error=Fraction(3, 10)).outcome == "undecided"
    assert _judged("G (s.a -> F[0,7.5] r.a)", stays, other).outcome == "holds"


def test_an_action_of_a_lap_is_done_again_in_each() -> None:
    line = _line(("a", 2, 3), ("b", 6, 7))
    fill, drop = (
        InternalChange(Fraction(t), "", "", r, 0, s) for t, r, s in ((2.5, "a", frozenset({"c"})), (6.5, "b", frozenset[str]()))
    )
    flight = replace(line, initial={"a": "no", "b": "no"}, actions=(fill, drop))
    assert _judged("G (c -> F[0,4.001] !c) & G F[0,6.001] c", flight).outcome == "holds"
    assert _judged("G (c -> F[0,3.9] !c)", flight).outcome == "fails"
    assert _judged("G F[0,5.9] c", flight).outcome == "fails"


def _doubled(line: Timeline) -> Timeline:
    """Return the same laps, two of them called one."""
    return replace(unrolled(line, 2), cycle=line.cycle)


def _longer(line: Timeline) -> Timeline:
    """Return the same laps, the first of them in the prefix."""
    return replace(unrolled(line, 2), cycle=line.duration)


def _tube(rng: random.Random) -> Timeline:
    """Return random laps over whole seconds."""
    prefix, lap = rng.randint(0, 3), rng.randint(1, 5)
    changes, initial = list[Change](), dict[str, Status]()
    for name in NAMES:
        status: Status = rng.choice(("no", "may", "must"))
        initial[name] = status
        for second in range(1, prefix + lap + rng.choice([0, 0, 1])):
            after: Status = rng.choice(("no", "may", "must")) if rng.random() < 0.35 else status
            if after != status:
                changes.append(Change(Enclosure(Fraction(second), Fraction(second)), name, after))
            status = after
    changes.sort(key=lambda change: change.time.low)
    return Timeline("r", initial, tuple(changes), Fraction(prefix + lap), cycle=Fraction(prefix))


def _statuses(line: Timeline, name: str) -> tuple[list[str], list[str]]:
    """Return a region's status in each cell of the first lap, with its prefix, and in each later one, read from the timeline anew."""
    assert line.cycle is not None
    row, status = list[str](), line.initial[name]
    for cell in range(2 * int(line.duration) + 1):
        here = [change for change in line.changes if change.region == name and 2 * change.time.low == cell]
        if here:
            row.append("may" if "may" in (status, here[-1].status) else "must")
            status = here[-1].status
        else:
            row.append(status)
    end = row.pop()
    again = row[2 * int(line.cycle) :]
    seam = {end, again[0], row[-1], again[1]}
    return row, [seam.pop() if len(seam) == 1 else "may", *again[1:]]


def _flight(line: Timeline, rng: random.Random) -> tuple[dict[str, Cells], int]:
    """Return a flight in the tube that repeats its last two laps, three laps after the first."""
    assert line.cycle is not None
    loop = 4 * int(line.duration - line.cycle)
    signals: dict[str, Cells] = {}
    for name in NAMES:
        first, again = _statuses(line, name)
        row = [*first, *again * 3]
        cells = [status == "must" or (status == "may" and rng.random() < 0.5) for status in row]
        before = {0: None, len(cells) - loop: -1}  # the cell before the loop and its last one
        for k in range(0, len(cells), 2):
            beside = [cells[i] for i in (k - 1, k + 1, *((-1,) if before.get(k) else ())) if i >= 0 or before.get(k)]
            cells[k] = cells[k] or (any(beside) and row[k] != "no")
        signals[name] = cells
    return signals, loop


def _closes(line: Timeline) -> bool:
    """Return whether nothing changes where a lap begins or ends, and each region has the same status there."""
    assert line.cycle is not None
    rows = (_statuses(line, name) for name in NAMES)
    return all(change.time.low not in (line.cycle, line.duration) for change in line.changes) and all(
        len({first[-1], *again[:2], first[-len(again)]}) == 1 for first, again in rows
    )


def assert_no_flight_contradicts(seed: int, count: int, flights: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        line = _tube(rng)
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        verdict = _judged(formula, line)
        for other in (_doubled(line), _longer(line)):
            again = _judged(formula, other).outcome  # where a lap does not end as it begins, more may be left open
            assert again == verdict.outcome or (again == "undecided" and not _closes(line)), (str(formula), line)
        for _ in range(flights):
            signals, loop = _flight(line, rng)
            holds = truth_for_ever(formula, signals, loop)[0]
            assert not (verdict.outcome == "holds" and not holds), (str(formula), line, signals)
            assert not (verdict.outcome == "fails" and holds), (str(formula), line, signals)


@few_of(1, "seed", range(3))
def test_no_flight_of_laps_contradicts_the_verdict(seed: int) -> None:
    assert_no_flight_contradicts(seed, 40, 6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 220))
def test_no_flight_of_many_laps_contradicts_the_verdict(seed: int) -> None:
    assert_no_flight_contradicts(seed, 300, 12)


def assert_exact_laps_are_decided(seed: int, count: int) -> None:
    rng = random.Random(seed)
    for _ in range(count):
        prefix, lap = rng.randint(0, 4), rng.randint(1, 6)
        signals = {name: drawn_signal(rng, prefix + lap, closed=True)[:-1] for name in NAMES}
        for cells in (
            signals.values()
        ):  # a lap ends as it begins, so that the seam opens nothing, and no region is touched for an instant
            cells[2 * prefix + 1] = cells[-1]
            for k in range(0, len(cells), 2):
                cells[k] = cells[k + 1] or (k > 0 and cells[k - 1])
        changes = [
            Change(Enclosure(Fraction(cell // 2), Fraction(cell // 2)), name, "must" if cells[cell] else "no")
            for name, cells in signals.items()
            for cell in range(3, len(cells), 2)
            if cells[cell] != cells[cell - 2]
        ]
        if any(2 * change.time.low == 2 * prefix for change in changes):
            continue
        changes.sort(key=lambda change: change.time.low)
        initial: dict[str, Status] = {name: "must" if cells[1] else "no" for name, cells in signals.items()}
        line = Timeline("r", initial, tuple(changes), Fraction(prefix + lap), cycle=Fraction(prefix))
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        holds = truth_for_ever(formula, signals, 2 * lap)[0]
        assert _judged(formula, line).outcome == ("holds" if holds else "fails"), (str(formula), signals, lap)


@pytest.mark.parametrize("seed", range(3))
def test_exact_laps_are_decided(seed: int) -> None:
    assert_exact_laps_are_decided(seed, 120)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(300, 320))
def test_many_exact_laps_are_decided(seed: int) -> None:
    assert_exact_laps_are_decided(seed, 1000)


def _windows(node: Formula, window: tuple[Fraction, None] | None) -> Formula:
    parts = tuple(_windows(part, window) for part in node.arguments)
    return replace(node, arguments=parts, window=window if node.operator in TEMPORAL else None)


def assert_bounds_contradict_no_words(seed: int, count: int) -> None:
    """Hold bounds [0,inf] against the judge of words over laps for ever."""
    rng = random.Random(seed)
    for _ in range(count):
        line = _tube(rng)
        if not _closes(line):  # the judge of words leaves the first lap's begin open, too
            continue
        formula = _windows(drawn_formula(rng, NAMES, rng.randint(1, 3)), None)
        timed = _judged(_windows(formula, (Fraction(0), None)), line)
        words = judge_formula(mission(str(formula), trace="infinite"), {"r": line}, Relations())[0]
        assert timed.outcome in ("undecided", words.outcome), (str(formula), line)


@pytest.mark.parametrize("seed", range(2))
def test_bounds_from_0_to_infinity_never_contradict_the_words_of_laps(seed: int) -> None:
    assert_bounds_contradict_no_words(seed, 40)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(400, 410))
def test_many_bounds_from_0_to_infinity_never_contradict_the_words_of_laps(seed: int) -> None:
    assert_bounds_contradict_no_words(seed, 400)
