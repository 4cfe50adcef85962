"""Laws of time: scaled time, flights that are late by what their slack allows, and what no continuation keeps."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import pytest

from tests.helpers.few import few_of
from tests.helpers.words.timed_signals import drawn_formula, drawn_signal, truth, truth_for_ever
from verify.data.language.formula import Formula
from verify.data.language.relaxation import relaxed
from verify.model_checking.timeline import Change, Enclosure, Relations, Status, Timeline
from verify.model_checking.timing.timed_verdict import RESOLUTION, TimedJudge

NAMES = ("a", "b", "c")
_OPPOSITE = {"holds": ("fails",), "fails": ("holds", "undecided"), "undecided": ("fails", "undecided")}
"""Verdicts on the negation; one may hold only where the last letter is held after the flight, which is undecided."""


def _drawn(rng: random.Random, *, laps: bool, may: bool = True) -> Timeline:
    """Return a random timeline over whole seconds; a lap ends as it begins."""
    prefix, length = rng.randint(1, 3), rng.randint(2, 5)
    changes, initial = list[Change](), dict[str, Status]()
    statuses: tuple[Status, ...] = ("no", "may", "must") if may else ("no", "must")
    for name in NAMES:
        row: list[Status] = [rng.choice(statuses)]
        while len(row) < prefix + length:
            row.append(rng.choice(statuses) if rng.random() < 0.35 else row[-1])
        row[prefix - 1] = row[prefix] = row[-1]
        initial[name] = row[0]
        changes += [
            Change(Enclosure(Fraction(at), Fraction(at)), name, row[at]) for at in range(1, len(row)) if row[at] != row[at - 1]
        ]
    changes.sort(key=lambda change: change.time.low)
    return Timeline("r", initial, tuple(changes), Fraction(prefix + length), cycle=Fraction(prefix) if laps else None)


def _mapped(line: Timeline, factor: Fraction, delay: Fraction = Fraction(0)) -> Timeline:
    """Return a timeline whose times are stretched, and come later."""

    def at(time: Fraction) -> Fraction:
        return time * factor + delay

    changes = tuple(replace(change, time=Enclosure(at(change.time.low), at(change.time.high))) for change in line.changes)
    return replace(line, changes=changes, duration=at(line.duration), cycle=None if line.cycle is None else at(line.cycle))


def _stretched(node: Formula, factor: Fraction) -> Formula:
    window = node.window and (node.window[0] * factor, None if node.window[1] is None else node.window[1] * factor)
    return replace(node, arguments=tuple(_stretched(part, factor) for part in node.arguments), window=window)


@pytest.mark.parametrize("laps", [False, True])
def test_time_may_be_counted_in_any_unit(laps: bool) -> None:
    rng = random.Random(int(laps))
    for _ in range(60):
        line, error, factor = (
            _drawn(rng, laps=laps),
            Fraction(rng.choice([0, 0, 1]), 3),
            Fraction(rng.randint(1, 9), rng.randint(1, 9)),
        )
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        one = TimedJudge({"r": line}, Relations(), error).judge(formula, slack=False)
        judge = TimedJudge({"r": _mapped(line, factor)}, Relations(), error * factor)
        assert judge.judge(_stretched(formula, factor), slack=False).outcome == one.outcome, (str(formula), line, factor)


@few_of(1, "laps", [False, True])
def test_what_holds_of_a_flight_holds_later_of_one_that_is_later(laps: bool) -> None:
    """A flight that waits at its start, and what is asked after that wait, are judged as the flight itself is."""
    rng = random.Random(2 + laps)
    for _ in range(60):
        line, delay = _drawn(rng, laps=laps), Fraction(rng.randint(1, 20), rng.randint(1, 9))
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        one = TimedJudge({"r": line}, Relations(), Fraction(0)).judge(formula, slack=False)
        late = TimedJudge({"r": _mapped(line, Fraction(1), delay)}, Relations(), Fraction(0))
        for operator in ("F", "G"):
            asked = Formula(operator, (formula,), window=(delay, delay))
            verdict = late.judge(asked, slack=False)
            assert verdict.outcome == one.outcome, (str(formula), line, delay)
            assert late.judge(Formula("!", (asked,)), slack=False).outcome in _OPPOSITE[verdict.outcome]


@few_of(1, "laps", [False, True])
def test_flights_may_be_as_late_as_their_slack_says(laps: bool) -> None:
    rng, found = random.Random(10 + int(laps)), 0
    for _ in range(120):
        line = _drawn(rng, laps=laps)
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        judge = TimedJudge({"r": line}, Relations(), Fraction(0))
        if judge.judge(formula, slack=False).outcome != "holds" or not formula.timed:
            continue
        slack = judge.slack(formula)
        late = [Fraction(7, 2), Fraction(40)] if slack.seconds is None else [slack.seconds, slack.seconds / 2]
        for delay in late:
            delayed = TimedJudge({"r": _mapped(line, Fraction(1), delay)}, Relations(), Fraction(0))
            assert delayed.judge(formula, slack=False).outcome == "holds", (str(formula), line, slack)
        if slack.seconds is not None:  # and no later than that
            found += 1
            assert (
                TimedJudge({"r": line}, Relations(), slack.seconds + RESOLUTION).judge(formula, slack=False).outcome != "holds"
            )
    assert found > 5


@few_of(1, "seed", range(2))
def test_what_is_lost_is_kept_by_no_continuation(seed: int) -> None:
    rng, lost = random.Random(20 + seed), 0
    for _ in range(150):
        line = _drawn(rng, laps=False, may=False)
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        since = TimedJudge({"r": line}, Relations(), Fraction(0)).lost_from(formula)
        if since is None:
            continue
        lost += 1
        flown = 2 * int(since) + (2 if since % 1 else 1)  # cells of which something is known by then
        rows: dict[str, list[bool]] = {}
        for name in NAMES:
            status, row = line.initial[name], list[bool]()
            for cell in range(2 * int(line.duration) + 1):
                here = [change for change in line.changes if change.region == name and 2 * change.time.low == cell]
                row.append(status == "must" or bool(here))
                status = here[-1].status if here else status
            rows[name] = row
        for _ in range(20):
            signals: dict[str, list[bool]] = {}
            for name, row in rows.items():
                value, more = rng.random() < 0.5, list[bool]()
                for _ in range(40):
                    value = rng.random() < 0.5 if rng.random() < 0.3 else value
                    more.append(value)
                signals[name] = [*row[:flown], *more]
            assert not truth(formula, signals, 1)[0], (str(formula), line, since)
    assert lost > 10


def test_what_follows_for_words_of_laps_is_kept_by_all_that_keep_the_bounds() -> None:
    rng, kept = random.Random(30), 0
    for _ in range(1500):
        prefix, lap = rng.randint(0, 4), rng.randint(1, 4)
        signals = {name: drawn_signal(rng, prefix + lap, closed=True)[:-1] for name in NAMES}
        formula = drawn_formula(rng, NAMES, rng.randint(1, 4))
        if formula.timed and truth_for_ever(formula, signals, 2 * lap)[0]:
            kept += 1
            assert truth_for_ever(relaxed(formula), signals, 2 * lap)[0], (str(formula), signals, lap)
    assert kept > 300
