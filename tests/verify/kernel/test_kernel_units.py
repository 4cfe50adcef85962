"""Single functions of the kernel, at their edges."""

from __future__ import annotations

import math
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.helpers.kernel.kernel_words import kernel_statement, proof_of
from tests.helpers.missions.random_teams import random_formula
from tests.helpers.words.plain_team_words import holds
from tests.helpers.words.timelines import mission
from verify.data.files.mission_file import parse_mission
from verify.kernel import VERSION, statement, trees
from verify.kernel.checking import Check, Checked, Owed
from verify.kernel.flights import HEADER, LARGEST, MOST_PIECES, Path, Segment, read_team
from verify.kernel.formulas import Table, _least
from verify.kernel.statement import Inequality, Refused, Ring, Shape, Wait, read_json
from verify.kernel.team import check_transitions
from verify.kernel.timelines import Course, Span, Stay, Timeline, joined
from verify.kernel.trees import Cell, Evidence, Polynomial, root
from verify.kernel.words import check_words, flown, waits_between
from verify.kernel.zones import Flight, Flown, Pair, Two, _scale, asked, opening, rim, terms_of
from verify.model_checking import timeline as judge
from verify.proofs import words as words_search
from verify.proofs.formula_tree import tree_of

ZERO = Fraction(0)


def table(*rows: list[object]) -> str:
    return "\n".join(",".join(map(str, row)) for row in (HEADER, *rows)) + "\n"


def row(duration: object = 1, **cells: object) -> list[object]:
    """Return a piece that hovers at the origin, with some cells by their number."""
    found: list[object] = [duration, *[0] * 32]
    for key, value in cells.items():
        found[int(key.removeprefix("c"))] = value
    return found


def read(*rows: list[object]) -> Any:
    robot = SimpleNamespace(start=(ZERO,) * 3, cycle=None)
    return read_team(SimpleNamespace(robots={"r": robot}, lasso=False, repeat=1), {"r": table(*rows)})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "rows", [[row()], [row(LARGEST)], [row(c5=LARGEST)], [row(c9=-LARGEST)], [row(1e-6)], [row()] * MOST_PIECES]
)
def test_flights_that_are_read(rows: list[list[object]]) -> None:
    assert len(read(*rows).paths["r"].pieces) == len(rows)


@pytest.mark.parametrize(
    "rows",
    [[], [row(0)], [row(-1)], [row(1e-60)], [row(c5=LARGEST * 1.001)], [row(c9=-LARGEST * 1.001)], [row(LARGEST * 1.001)], [row()[:-1]], [[*row(), 0]],
     [row("")], [row("nan")], [row("1_0")], [row("0x1")], [row("1" + "0" * 70)], [row(c5="1e39")], [row()] * (MOST_PIECES + 1)],
)  # fmt: skip
def test_flights_that_are_none(rows: list[list[object]]) -> None:
    with pytest.raises(Refused):
        read(*rows)


def test_numbers_are_those_that_a_vehicle_reads() -> None:
    path = read(row("0.1", c1="0.3")).paths["r"]
    assert path.pieces[0].stop == Fraction(13421773, 1 << 27)
    assert path.pieces[0].axes[0].at(0) == Fraction(10066330, 1 << 25)


def test_roots_are_enclosed() -> None:
    for value in (ZERO, Fraction(1), Fraction(4, 9), Fraction(2), Fraction(1, 3), Fraction(10**12 + 1, 7)):
        low, high = root(value)
        assert low**2 <= value <= high**2
        assert high - low <= Fraction(1, 1 << 70)
        assert (low == high) == (value in (0, 1, Fraction(4, 9)))


def test_a_stay_holds_at_the_ends_of_what_is_sure() -> None:
    stay = Stay(ZERO, Fraction(9), "a", [Span(Fraction(1), Fraction(2), "must"), Span(Fraction(4), Fraction(5), "must")])
    for start, stop, sure in (
        (1, 2, True),
        (1, 1, True),
        (2, 2, True),
        (0, 1, False),
        (2, 3, False),
        (1, 5, False),
        (4, 5, True),
        (5, 6, False),
    ):
        assert stay.surely_holds(Fraction(start), Fraction(stop)) == sure


def spans(text: str) -> list[Span]:
    """Return spans of a second, of an instant where a letter is large."""
    marks, found, time = {"n": "no", "m": "must", "?": "may"}, list[Span](), 0
    for letter in text:
        later = time + (not letter.isupper())
        found.append(Span(Fraction(time), Fraction(later), marks[letter.lower()]))
        time = later
    return found


@pytest.mark.parametrize(
    ("before", "after"),
    [("nn", "n"), ("nm", "nm"), ("n?m", "n?m"), ("n??m", "n?m"), ("nNm", "nm"), ("?M?", "?M?"), ("M", "M"), ("Mm", "m"), ("m?", "m?"), ("nnmm", "nm")],
)  # fmt: skip
def test_spans_of_one_mark_are_one_and_what_differs_is_apart(before: str, after: str) -> None:
    found = joined(spans(before))
    assert [span.mark for span in found] == [span.mark for span in spans(after)]
    assert all(a.stop == b.start for a, b in pairwise(found))
    assert (found[0].start, found[-1].stop) == (0, spans(before)[-1].stop)


@pytest.mark.parametrize(("marks", "accepted"), [("2n", True), ("?n", False), ("n?", False)])
def test_nothing_is_open_in_a_region_not_even_on_a_step(marks: str, accepted: bool) -> None:
    body = Shape((ZERO,) * 3, ((Inequality(Fraction(1), (Fraction(1), ZERO, ZERO)),),))
    axes = [Polynomial.of([Fraction(5)])] * 3
    segments = [Segment(ZERO, ZERO, axes), Segment(ZERO, Fraction(1), axes)]
    statement: Any = SimpleNamespace(margin=Fraction(1, 16), regions={"a": body})
    course = Course(statement, Path("r", SimpleNamespace(), segments, segments[1:], None), Evidence({"inside/r/a": marks}))  # type: ignore[arg-type]
    if accepted:
        assert course.rows == {"a": (Span(ZERO, Fraction(1), "no"),)}
    else:
        with pytest.raises(Refused, match="come back"):
            course.rows  # noqa: B018


def test_of_alternatives_that_owe_as_much_one_is_left() -> None:
    """The one that puts off least, of those that owe the same, and none that owes more and puts off as much."""
    one, two = frozenset({1}), frozenset({1, 2})
    assert _least([(one, two), (one, one), (two, one), (two, frozenset())]) == ((one, one), (two, frozenset()))


def test_alternatives_ask_for_no_more_than_they_have_to() -> None:
    """None asks for what another one asks for, and for more; whatever order they are found in."""
    rng = Random(4)
    for _ in range(300):
        formula = random_formula(rng, rng.randint(3, 8))
        found = Table(tree_of(formula), "abc")
        owed = [frozenset({found.root})]
        word = [frozenset(n for n in ("a", "b", "c", "water") if rng.random() < 0.4) for _ in range(rng.randint(1, 3))]
        for letter in word:
            every = [found.after(found.letter_of(letter), one) for one in owed]
            for ways in every:
                assert not any(a is not b and a[0] <= b[0] and a[1] <= b[1] for a in ways for b in ways)
            owed = [then for ways in every for then, _ in ways]
        assert any(map(found.empty_word_keeps, owed)) != holds(formula, [{"": letter} for letter in word])


def transitions_hold(robot: SimpleNamespace, line: Timeline) -> bool:
    statement: Any = SimpleNamespace(regions=dict.fromkeys(line.rows), robots={"q": robot})
    try:
        check_transitions(statement, line)
    except Refused:
        return False
    return True


@pytest.mark.parametrize(("closed", "accepted"), [("a", False), ("b", True)])
def test_a_robot_may_not_stay_where_it_may_not_go(closed: str, accepted: bool) -> None:
    line = Timeline("q", Fraction(9), {"a": tuple(spans("mmmmmmmmm")), "b": tuple(spans("nnnnnnnnn"))}, frozenset(), (), None)
    robot = SimpleNamespace(edges=None, vertex="", closed=frozenset(closed))
    assert transitions_hold(robot, line) == accepted


def test_a_quadric_moves_by_as_much_as_its_form_stretches() -> None:
    """By the root of the greatest eigenvalue, whatever axis it is near."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        rows = rng.integers(-8, 9, (3, 3)) * rng.permutation([1, 1, 4])[:, None]
        form = rows.T @ rows + np.eye(3, dtype=int)
        quadratic: Any = tuple(tuple(Fraction(int(x), 16) for x in row) for row in form)
        _, (_, _, outside) = asked(terms_of(Inequality(Fraction(1), None, quadratic), (ZERO,) * 3), Fraction(1))
        grown, wanted = math.sqrt(outside + 1) - 1, math.sqrt(np.linalg.eigvalsh(form / 16).max())
        assert wanted * (1 - 1e-12) <= grown <= wanted * (1 + 1e-6)


def test_a_robot_sets_out_when_its_word_first_leaves_where_it_begins() -> None:
    words = {"q0": (frozenset[str](), frozenset("a")), "q1": (frozenset("c"), frozenset[str](), frozenset("b"))}
    robots = {
        name: SimpleNamespace(visits=(SimpleNamespace(region=region),), changes=(), states={})
        for name, region in (("q0", "a"), ("q1", "b"))
    }
    wait = Wait(("q0", 0), ("q1", 0), "entered", "sets out")
    statement: Any = SimpleNamespace(regions=dict.fromkeys("abc"), words=words, robots=robots, waits=(wait,))
    assert list(waits_between(statement)) == [(("q0", 1), ("q1", 1))]


def test_distances_are_of_segments_that_share_some_time() -> None:
    """Two paths that both begin another piece at one instant, and cross; clocks that differ may show it while another robot flies its other piece."""
    ways = ([-1, 1], [0, 1]), ([1, -1], [0, -1])
    zero, flights = Polynomial.of([ZERO]), list[Flight]()
    statement: Any = SimpleNamespace(separation=Fraction(1, 4), separation_z=None, margin=ZERO)
    for axis, way in enumerate(ways):
        pieces = [Polynomial.of(list(map(Fraction, row))) for row in way]
        axes = [[piece, zero, zero] if axis == 0 else [zero, piece, zero] for piece in pieces]
        segments = [Segment(Fraction(3 * k), Fraction(3 * k + 3), row) for k, row in enumerate(axes)]
        step = Segment(ZERO, ZERO, [Polynomial.of([row.at(0)]) for row in axes[0]])
        flights.append(Flight(statement, Path("r", SimpleNamespace(radius=ZERO), [step, *segments], segments, None)))  # type: ignore[arg-type]
    pair = Pair(statement.separation, *flights)
    assert len(list(pair.parts(ZERO))) == 2
    both = list(pair.parts(Fraction(1)))
    assert [two.holds("k") for two in both] == [False] * 4
    first, _ = both[1].halves()
    assert first.holds("k")
    assert not first._replace(error=Fraction(2)).holds("k")
    together = list(Pair(statement.separation, flights[0], flights[0]).parts(ZERO))
    assert [two.holds("m") for two in together] == [False] * 2, "no way leads from middle to middle"


@pytest.mark.parametrize(("error", "accepted"), [("1.99", True), ("2", False), ("3", False)])
def test_clocks_that_differ_by_half_a_lap_prove_nothing(error: str, accepted: bool) -> None:
    """Not even what is always so: whatever number of spans a proof names."""
    statement = kernel_statement(mission("true", team="joint", robots=2, trace="infinite"), Fraction(error))
    rows = {name: (Span(ZERO, Fraction(4), "no"),) for name in statement.regions}
    lines = {name: Timeline(name, Fraction(4), rows, frozenset(), (), ZERO) for name in statement.robots}
    found = False
    for size in range(1, 30):
        evidence = Evidence({"formula/0": [[], [], [], [None], [[]], [[0, size]]]})
        with suppress(Refused):
            check_words(flown(statement, lines), evidence)
            found = True
    assert found == accepted


def test_of_steps_the_longest_of_each_robot_counts() -> None:
    """A robot with steps of 3 and 4, beside one with a step of 1."""
    zero, flights = Polynomial.of([ZERO]), list[Flight]()
    statement: Any = SimpleNamespace(separation=Fraction(1, 2), separation_z=None, margin=Fraction(1, 16))
    for places in ([0, 3, 7], [0, 1, 1]):
        segments: list[Segment] = []
        for k, (before, after) in enumerate(zip([0, *places], places, strict=False)):
            start = Fraction(k)
            segments.append(Segment(start, start, [Polynomial.of([Fraction(before), Fraction(after - before)]), zero, zero]))
            segments.append(Segment(start, start + 1, [Polynomial.of([Fraction(after)]), zero, zero, zero]))
        robot: Any = SimpleNamespace(radius=Fraction(1, 8))
        flights.append(Flight(statement, Path("r", robot, segments, segments[1::2], None)))
    least = Pair(statement.separation, *flights).least
    assert abs(least - (Fraction(1, 2) + Fraction(1, 8) + 5)) < Fraction(1, 1 << 60)


@pytest.mark.parametrize("number", [150, pytest.param(400, marks=pytest.mark.slow)])
def test_rims_and_openings_are_as_far_as_they_are(number: int) -> None:
    """Of places beside a hoop, in any direction: what is said is so, and said of all places that are a little farther away."""
    rng = np.random.default_rng(7)
    wide, thick, length = 0.5, 0.125, 0.25
    said = {True: 0, False: 0}
    for _ in range(number):
        normal = np.add(rng.integers(-4, 5, 3), [0, 0, 5])
        unit = normal / np.linalg.norm(normal)
        across = np.cross(unit, [1, 0, 0])
        across /= np.linalg.norm(across)
        aside, above = rng.uniform(0, 1.2), rng.uniform(-0.6, 0.6)
        place = [Fraction(float(x)) for x in np.array([1, 2, 3]) + aside * across + above * unit]
        ring = Ring(tuple(Fraction(int(x)) for x in normal), Fraction(wide), Fraction(thick))  # type: ignore[arg-type]
        hoop = Shape((Fraction(1), Fraction(2), Fraction(3)), (), ring)
        segment = Segment(ZERO, Fraction(1), [Polynomial.of([x]) for x in place])
        away = math.hypot(max(wide - aside, 0, aside - wide - thick), max(abs(above) - thick / 2, 0))
        disc = math.hypot(max(aside - wide, 0), above)
        for rules, distance in ((rim(hoop, Fraction(length)), away), (opening(hoop, (Fraction(length), ZERO)), disc)):
            is_far = Cell(segment.sum, rules).holds("n")
            said[is_far] += 1
            assert not (is_far and distance < length)
            if rules.keys() == {"n"}:
                assert is_far or distance < length * 1.03
            else:
                assert is_far or distance < length * 1.5
        inside = Cell(segment.sum, opening(hoop, (Fraction(1, 32), Fraction(1, 8)))).holds("F")
        assert inside == (aside < wide - 0.125 - 0.03125), "what stands still flies on"
    assert 8 * min(said.values()) > number


def test_clocks_that_differ_see_a_lap_s_beginning_behind_its_end() -> None:
    zero = Polynomial.of([ZERO])
    segments = [Segment(ZERO, ZERO, [zero] * 3), *(Segment(Fraction(k), Fraction(k + 1), [zero] * 4) for k in range(4))]
    path = Path("r", SimpleNamespace(radius=ZERO), segments, segments[1:], Fraction(1))  # type: ignore[arg-type]
    flight = Flight(SimpleNamespace(separation=ZERO, separation_z=None, margin=ZERO), path)  # type: ignore[arg-type]
    times = [[(one.start, one.stop) for one in flight.around(error)] for error in (ZERO, Fraction(1, 2), Fraction(1))]
    once = [(k, k + 1) for k in range(4)]
    assert times == [once, [*once, (4, 5)], [*once, (4, 5), (5, 6)]]


@pytest.mark.parametrize(("begin", "apart"), [("1.25", False), ("1.26", True)])
def test_no_clocks_show_times_that_differ_by_more_than_the_error(begin: str, apart: bool) -> None:
    parts = Flown(ZERO, Fraction(1), [], []), Flown(Fraction(begin), Fraction(3), [], [])
    for one, other in (parts, parts[::-1]):
        assert Two(one, other, Fraction(1, 4), ZERO).holds("k") == apart


def test_a_lap_that_never_keeps_its_promise_is_refused_at_one_level_for_all() -> None:
    """As by a search that gives all configurations one level: what is put off for ever would be covered by itself."""

    def one_level(laps: words_search._Laps) -> tuple[list[int | None], list[list[words_search.Configuration]]]:
        sets: list[list[words_search.Configuration]] = [[] for _ in range(laps.team.size)]
        for span, one in laps.order:
            sets[span].append(one._replace(level=0))
        return [None], sets

    mission = parse_mission(
        "format: 1\nname: lap\nspec: {formula: G F a, trace: infinite}\nregions: {a: {center: [0, 0, 1], radii: [0.3, 0.3, 0.3]}}\n"
        "agents: {r0: {start: [1, 0, 1]}}\nvehicle: crazyflie-2.1\nworkspace: {min: [-2, -2, 0.1], max: [2, 2, 3]}\nmargin: 0.05\n"
    )
    line = judge.Timeline("r0", {"a": "no"}, (), Fraction(2), cycle=Fraction(1))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(words_search._Laps, "_levels", one_level)
        statement, own, evidence = proof_of(mission, {"r0": line})
    assert evidence
    with pytest.raises(Refused, match="leaves out"):
        check_words(flown(statement, own), Evidence(evidence))


def test_versions_rise_when_what_is_checked_changes() -> None:
    """Another number here means that files of earlier flights are refused, or checked by another kernel than their certificate names."""
    assert (VERSION, statement.FORMAT, trees.FORMAT) == (6, 4, 5)


def test_json_with_a_key_twice_is_refused() -> None:
    assert read_json('{"a": 1, "b": {"a": 2}}', "proof.json") == {"a": 1, "b": {"a": 2}}
    with pytest.raises(Refused, match=r"proof\.json has a key twice"):
        read_json('{"a": {"b": 1, "b": 2}}', "proof.json")
    with pytest.raises(Refused, match=r"proof.json cannot be read: Expecting"):
        read_json('{"a": ', "proof.json")


def test_the_scale_of_a_quadric_is_its_greatest_eigenvalue_from_above() -> None:
    dice = Random(3)
    drawn = [[[Fraction(dice.randint(-8, 8), 4) for _ in range(3)] for _ in range(3)] for _ in range(40)]
    for rows in (
        [[1, 0, 0], [0, 1, 0], [0, 0, 3]],
        [[3, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 3, 0], [0, 0, 1]],
        *drawn,
    ):
        square = [[sum((Fraction(a) * b for a, b in zip(one, other, strict=True)), ZERO) for other in rows] for one in rows]
        terms = tuple(square[i][j] * (1 if i == j else 2) for i in range(3) for j in range(i, 3))
        greatest = float(np.linalg.eigvalsh(np.array(square, dtype=float)).max())
        assert greatest * (1 - 1e-12) <= float(_scale((*terms, *[ZERO] * 4))) ** 2 <= greatest * (1 + 1e-6)


def course_of(lap: Fraction | None) -> Course:
    """Return a course of 8 s along nothing in particular."""
    segments = [Segment(ZERO, Fraction(8), [Polynomial.of([ZERO])] * 3)]
    robot = SimpleNamespace(cycle_visit=None)
    return Course(SimpleNamespace(regions={}), Path("r", robot, segments, segments, lap), Evidence({}))  # type: ignore[arg-type]


def test_ways_to_a_visit_last_until_its_path_has_left_for_good() -> None:
    """Up to the first time surely in the region, and again from the last one on while the nominal path is at the edge."""
    course = course_of(None)
    spans = [(0, 2, "no"), (2, 3, "may"), (3, 4, "must"), (4, 5, "may"), (5, 8, "no")]
    stay = Stay(Fraction(2), Fraction(6), "a", [Span(Fraction(3), Fraction(4), "must")])
    course.__dict__.update(
        row=lambda _kind, _name: tuple(Span(Fraction(a), Fraction(b), mark) for a, b, mark in spans),
        flown=[stay], _begun_and_stays=([], [stay]),
    )  # fmt: skip
    assert course.windows(0) == [(0, 3), (4, 5)]


def test_what_is_waited_for_may_last_until_the_last_lap_that_is_looked_at_ends() -> None:
    assert course_of(None)._last == 8
    assert course_of(Fraction(3))._last == 8 + 2 * 5


def test_a_fault_of_the_kernels_own_proves_nothing_of_the_claim_that_it_names() -> None:
    check = SimpleNamespace(_proved=set(), evidence=None)
    told = Check._judge(check, Owed("formula", ("r0",), lambda: 1 // 0))  # type: ignore[arg-type]
    assert told == Checked("formula", ("r0",), "", "the kernel cannot follow it: ZeroDivisionError")
