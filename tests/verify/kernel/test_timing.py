"""Times at which the kernel says that formulas with bounds hold: against brute force, against the judge, and false claims."""

from __future__ import annotations

import itertools
import json
import math
import random
from collections.abc import Mapping, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval

from tests.helpers.few import few_of
from tests.helpers.kernel.kernel_words import kernel_timeline
from tests.helpers.kernel.proofs import checked, missing, tables
from tests.helpers.missions.random_teams import short_timeline
from tests.helpers.motion.flights import legs, quantised
from tests.helpers.motion.small_flights import A, B, Flight, mission, planned, small_flight, to
from tests.helpers.words.timed_signals import Cells, drawn_formula, drawn_signal, truth, until_of_cells
from tests.verify.kernel.test_refused import changed
from verify import judge
from verify.data.language.counting import written_out
from verify.data.language.formula import Formula
from verify.data.language.formula_reader import parse_formula
from verify.data.trajectory import Trajectory
from verify.kernel.__main__ import statement_lines
from verify.kernel.statement import Refused, Statement, read_statement
from verify.kernel.team import Claim, Places
from verify.kernel.timing import FOREVER, Times, check_timing, surely, until, within, without
from verify.model_checking.timeline import Relations
from verify.model_checking.timing.timed_verdict import TimedJudge
from verify.proofs.finder import prove
from verify.proofs.formula_tree import tree_of

NAMES = ("a", "b", "c")


def times_of(cells: Cells) -> Times:
    """Return the times of cells: instants and open seconds, of which the last goes on for ever."""
    cuts = [(Fraction(k // 2), k % 2 == 1) for k in range(len(cells))]
    spans = zip(cuts, [*cuts[1:], FOREVER], cells, strict=True)
    return within((low, high) for low, high, is_in in spans if is_in)


def has(times: Times, cell: int) -> bool:
    at = (Fraction(cell // 2), cell % 2 == 1)
    return any(low <= at < high for low, high in times)


def places(robot: str, letters: Sequence[frozenset[str]]) -> Places:
    """Return places of a robot that shows one letter in each cell; at an instant it may show those beside, too."""
    windows = [(Fraction(k // 2), Fraction((k + 1) // 2)) for k in range(len(letters))]
    return Places(robot, [0] * len(letters), letters, letters, windows, [], [0], frozenset({len(letters) - 1}))


def claim_of(tree: Any, robots: Mapping[str, Sequence[frozenset[str]]]) -> Claim:
    states = SimpleNamespace(states={"s": frozenset(NAMES)})
    statement = SimpleNamespace(robots=dict.fromkeys(robots, states), joint=True, clock_error=Fraction(0), regions={})
    return Claim(cast("Statement", statement), tree, lambda robot, _: places(robot, robots[robot]))


def letters_of(signals: Mapping[str, Cells]) -> list[frozenset[str]]:
    count = len(next(iter(signals.values())))
    return [frozenset(name for name, cells in signals.items() if cells[k]) for k in range(count)]


@few_of(2, "seed", range(4))
def test_until_is_as_by_brute_force(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(500):
        seconds, low = rng.randint(1, 6), rng.choice([0, 0, 1, 2])
        high = rng.choice([None, low, low + 1, low + 2, low + 4])
        held, reached = (drawn_signal(rng, seconds, closed=False) for _ in range(2))
        later = [2 * (low + (high or 0)) + 6, 0][high is None and low == 0]
        expected = until_of_cells(held + held[-1:] * later, reached + reached[-1:] * later, low, high, 0)
        found = until((times_of(held), times_of(reached)), (Fraction(low), math.inf if high is None else Fraction(high)))
        cells = range(2 * seconds + 1)
        assert [has(found, k) for k in cells] == [expected[k] for k in cells], (held, reached, low, high)
        cuts = [cut for span in found for cut in span]
        assert all(one < other for one, other in itertools.pairwise(cuts))


@few_of(1, "count", [150, 500])
def test_sets_of_times(count: int) -> None:
    rng = random.Random(1)
    for _ in range(count):
        sets = [drawn_signal(rng, 5, closed=False) for _ in range(rng.randint(0, 4))]
        for least in range(-1, len(sets) + 2):
            spans = [span for cells in sets for span in times_of(cells)]
            found = within(spans, least)
            assert [has(found, k) for k in range(11)] == [sum(cells[k] for cells in sets) >= least for k in range(11)]
            assert [has(without(found), k) for k in range(11)] == [not has(found, k) for k in range(11)]


def assert_no_wrong_yes(seed: int, count: int) -> tuple[int, int]:
    """Hold the kernel against brute force on formulas and signals of one robot on the reference clock; return how much it says of what is so."""
    rng, said, so = random.Random(seed), 0, 0
    for _ in range(count):
        seconds = rng.randint(1, 8)
        signals = {name: drawn_signal(rng, seconds, closed=rng.random() < 0.5) for name in NAMES}
        formula = drawn_formula(rng, NAMES, rng.randint(1, 4))
        for tree, negated in ((tree_of(formula), False), (["!", tree_of(formula)], True)):
            found = surely(claim_of(tree, {"r": letters_of(signals)}), (Fraction(seconds), Fraction(0)))
            expected = truth(formula, signals, 2 * seconds + 1)
            for k, holds in enumerate(expected):
                assert not has(found, k) or holds != negated, (str(formula), signals, k)
                said, so = said + has(found, k), so + (holds != negated)
    return said, so


@few_of(2, "seed", range(4))
def test_what_it_says_of_a_signal_is_so(seed: int) -> None:
    said, so = assert_no_wrong_yes(seed, 100)
    assert said > 0.4 * so


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 120))
def test_what_it_says_of_many_signals_is_so(seed: int) -> None:
    assert_no_wrong_yes(seed, 2500)


@few_of(1, "seed", range(3))
def test_clocks_may_differ_and_change(seed: int) -> None:
    """Each robot shows at each time what its path shows by its own clock, which is off by any amount up to the error."""
    rng, yes = random.Random(seed), 0
    for _ in range(150):
        seconds, error = rng.randint(3, 8), rng.randint(1, 2)
        robots = {name: drawn_signal(rng, seconds, closed=False) for name in ("r", "s")}
        text = str(drawn_formula(rng, ("A", "B"), rng.randint(1, 3)))
        text = text.replace("A", rng.choice(["r.a", "count(a) >= 2"])).replace("B", rng.choice(["s.a", "a", "count(a) <= 1"]))
        formula = written_out(parse_formula(text), ("r", "s"))
        shown = {name: letters_of({"a": cells}) for name, cells in robots.items()}
        found = surely(claim_of(tree_of(formula), shown), (Fraction(seconds), Fraction(error)))
        if not found or not has(found, 0):
            continue
        yes += 1
        for _ in range(5):
            late = {name: drawn_delays(rng, 2 * (seconds + error) + 1, 2 * error) for name in robots}
            cells = {
                name: [robots[name][min(max(k + late[name][k], 0), 2 * seconds)] for k in range(2 * (seconds + error) + 1)]
                for name in robots
            }
            both = list(zip(*cells.values(), strict=True))
            signals = {"r.a": cells["r"], "s.a": cells["s"], "a": [any(one) for one in both]}
            signals |= {f"count(a) >= {least}": [sum(one) >= least for one in both] for least in range(4)}
            assert truth(named(formula), signals, 1)[0], (text, robots, error, late)
    assert yes > 5


def named(formula: Formula) -> Formula:
    """Return a formula whose propositions are names."""
    return formula.rebuilt(
        lambda node, parts: (
            Formula("name", (), node.atom)
            if node.operator in ("name", "count")
            else Formula(node.operator, parts, window=node.window)
        )
    )


def drawn_delays(rng: random.Random, count: int, most: int) -> list[int]:
    """Return delays of a clock, whole cells of its kind: an instant shows what some instant shows."""
    return [2 * rng.randint(-most // 2, most // 2) for _ in range(count)]


@few_of(1, "seed", range(3))
def test_nobody_wins_by_landing(seed: int) -> None:
    """What it says of formulas all of whose operators have an end holds whatever is shown after the flight."""
    rng, yes = random.Random(seed), 0
    for _ in range(300):
        seconds = rng.randint(2, 6)
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        if any(node.operator in "FGURWM" and (node.window is None or node.window[1] is None) for node in formula.nodes()):
            continue
        signals = {name: drawn_signal(rng, seconds, closed=False) for name in NAMES}
        found = surely(claim_of(tree_of(formula), {"r": letters_of(signals)}), (Fraction(seconds), Fraction(0)))
        if has(found, 0):
            yes += 1
            later = {name: [*cells, *drawn_signal(rng, 8, closed=False)[1:]] for name, cells in signals.items()}
            assert truth(formula, later, 1)[0], (str(formula), later)
    assert yes > 20


def test_it_never_says_more_than_the_judge() -> None:
    rng, yes, total = random.Random(1), 0, 0
    for number in range(200):
        error = Fraction(rng.choice([0, 0, 1]), 10)
        lines = {f"q{k}": short_timeline(rng, f"q{k}", touching=rng.random() < 0.3) for k in range(rng.randint(1, 2))}
        end = max(line.duration for line in lines.values())
        lines = {name: line for name, line in lines.items() if line.duration == end}
        formula = drawn_formula(rng, NAMES, rng.randint(1, 3))
        if not formula.timed:
            continue
        robots = {name: SimpleNamespace(states={"s": frozenset({"carrying"})}, cuts=()) for name in lines}
        statement = SimpleNamespace(lasso=False, joint=True, robots=robots, clock_error=error, regions=dict.fromkeys(NAMES))
        if not all({*NAMES} <= set(line.initial) for line in lines.values()):
            continue
        courses = {name: SimpleNamespace(timeline=kernel_timeline(line), end=line.duration) for name, line in lines.items()}
        outcome = TimedJudge(lines, Relations(), error).judge(formula, slack=False).outcome
        total += outcome == "holds"
        try:
            check_timing((cast("Statement", statement), tree_of(formula)), cast("Any", courses))
        except Refused:
            continue
        yes += 1
        assert outcome == "holds", (number, str(formula))
    assert yes > 0.5 * total > 10


# Flights


def deadline(seconds: str, speed: float = 0.25, *, stays: bool = True) -> Flight:
    """Return a flight without a margin that flies on to a region for 2 s, which is 0.5 m away, and stays, or ends at once."""
    of = mission(
        f"F[0,{seconds}] a & F[0,{seconds}] G[0,1] a", [0, 0, 1],
        regions="a: {center: [1, 0, 1], size: [1, 0.5, 0.5]}", margin="0.0", clock_error="0.0",
    )  # fmt: skip
    still, high = [0.0] * 8, [1.0, *[0.0] * 7]
    pieces = [[[0.0, speed, *[0.0] * 6], still, high, still], [[2 * speed, *[0.0] * 7], still, high, still]][: 1 + stays]
    return planned(of, {"r0": to("a")}), {"r0": quantised(Trajectory([2.0, 3.0][: 1 + stays], np.array(pieces)))}


def timing_of(flight: Flight) -> list[bool]:
    plan, team = flight
    proof = prove(plan, team, judge(plan, team, largest=False))
    claims = checked(proof.statement, proof.evidence, tables(plan, team))
    return [not claim.missing for claim in claims if claim.name == "timing"]


def test_a_microsecond_at_margin_0() -> None:
    assert timing_of(deadline("2.000001")) == [True, True]
    assert timing_of(deadline("1.999999")) == [False, False]
    assert timing_of(deadline("2", 0.26)) == [True, True]


@pytest.mark.parametrize(("later", "is_checked"), [(1e-4, True), (-1e-4, False)])
def test_a_tenth_of_a_millisecond_at_a_margin(later: float, is_checked: bool) -> None:
    path = legs([[0, 0, 1], [1, 0, 1]])
    low, high = 0.0, 2.0
    for _ in range(50):  # until it is in the region by the margin
        middle = (low + high) / 2
        low, high = (middle, high) if polyval(middle, path.coefficients[0, 0]) < 1 - 0.2 + 0.05 else (low, middle)
    of = mission(f"F[0,{high + later:.7f}] a", [0, 0, 1], regions=A, clock_error="0.0")
    assert timing_of((planned(of, {"r0": to("a")}), {"r0": path})) == [is_checked]


def test_a_flight_that_lands_early() -> None:
    assert timing_of(deadline("2", 0.26, stays=False)) == [True, False]


EDITS: list[tuple[str, dict[str, Any]]] = [
    ("deadlines", {"timed__0__0": "F[0,1.5]"}),
    ("deadlines", {"timed__0__1__0": "G[0,3.8]"}),
    ("deadlines", {"timed__1__0": "F[0,4.5]"}),
    ("deadlines", {"timed__1__0": "F[5.5,6]"}),
    ("deadlines", {"timed__2__0": "U[0,1.5]"}),
    ("deadlines", {"timed__3__1__2__0": "F[0,3]"}),
    ("deadlines", {"timed__4__0": "G[0,1.5]"}),
    ("deadlines", {"timed__4__0": "G[0,0.1"}),
    ("deadlines", {"timed__4__0": "G[0.1,0]"}),
    ("deadlines", {"timed__4__0": "G[0,1e1]"}),
    ("deadlines", {"timed__4__0": "G[0,-1]"}),
    ("deadlines", {"timed__4__0": "until[0,1]"}),
    ("deadlines", {"clock_error": 1.0}),
    ("deadlines", {"joint": False}),
    ("deadlines", {"robots__r0__cuts": [0]}),
    ("deadline and action", {"timed__0__0": "F[2,2.1]"}),
    ("deadline and action", {"timed__0__0": "F[2.9,3]", "timed__0__1": ["!", ["name", "carrying"]]}),
]


@few_of(3, ("name", "edits"), EDITS)
def test_what_is_edited_is_not_checked(name: str, edits: dict[str, Any]) -> None:
    plan, team = small_flight(name)
    proof = prove(plan, team, judge(plan, team, largest=False))
    assert missing(checked(proof.statement, proof.evidence, tables(plan, team))) == set()
    assert "timing" in missing(checked(changed(proof.statement, **edits), proof.evidence, tables(plan, team)))


def test_words_measure_no_time() -> None:
    plan, team = small_flight("deadlines")
    proof = prove(plan, team, judge(plan, team, largest=False))
    table = json.loads(proof.statement)
    for formula in (table["timed"][0], ["count", 2, table["timed"][0]]):
        for edits in ({"formula": formula}, {"timed": [["count", 2, formula]]}):
            assert missing(checked(changed(proof.statement, **edits), proof.evidence, tables(plan, team)))


def test_laps_are_not_covered() -> None:
    of = mission(
        "G F[0,30] a & G F b", [-1, 1, 1], regions=f"{A}, {B}", spec="trace: infinite, repeat: 2", clock_error="0.0",
    )  # fmt: skip
    plan = planned(of, {"r0": to("a", "b")}, cycles={"r0": 0})
    team = {"r0": legs([[-1, 1, 1], [0, 0, 1], [1, 0, 1], [1, 2, 1], [0, 0, 1]], cycle=1)}
    proof = prove(plan, team, judge(plan, team, largest=False))
    claims = checked(proof.statement, proof.evidence, tables(plan, team))
    assert [(one.name, one.missing) for one in claims if one.missing] == [
        ("timing", "bounds in seconds are not followed through laps")
    ]


def test_the_statement_is_printed_with_its_bounds() -> None:
    plan, team = small_flight("deadlines")
    statement = read_statement(prove(plan, team, judge(plan, team, largest=False)).statement)
    lines = [line for line in statement_lines(statement) if "time 0" in line]
    assert [line.partition(": ")[2] for line in lines] == [
        "F[0,2.5] G[0,2] a",
        "F[1,5.5] (count((a | b)) >= 2)",
        "(!b U[0,2.5] r0.a)",
        "G (r0.a -> F[0,4] b)",
        "G[0,1.25] !(r0.a xor r1.b)",
    ]
