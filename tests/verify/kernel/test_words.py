"""The kernel's half of words: what it accepts is so by brute force and by the judge, and what the judge proves has a proof that it accepts."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from random import Random
from typing import Any

import pytest

from tests.helpers.few import few_of
from tests.helpers.kernel.edits import edited
from tests.helpers.kernel.kernel_words import (
    kernel_proves_transitions,
    kernel_says_yes,
    kernel_statement,
    kernel_timeline,
    opened,
    proof_of,
)
from tests.helpers.missions.random_teams import lap_timeline, random_formula, random_timeline, short_timeline
from tests.helpers.words.brute_force import Laps, Timed, for_ever, outcomes
from tests.helpers.words.plain_team_words import holds
from tests.helpers.words.random_counts import random_counting_formula
from tests.helpers.words.timelines import END, at, fill, mission, timeline
from verify.data import Formula, parse_formula
from verify.kernel.formulas import Table, conjuncts, show
from verify.kernel.statement import Refused
from verify.kernel.trees import Evidence
from verify.kernel.words import check_words, flown
from verify.model_checking.timeline import Change, Relations, Timeline
from verify.model_checking.word_claims import judge_formula, judge_transitions
from verify.proofs.formula_tree import tree_of


def asked(rng: Random, robots: tuple[str, ...], size: int) -> tuple[Formula, str]:
    """Return a formula and how the team is read."""
    if rng.random() < 0.45:
        return random_counting_formula(rng, rng.randint(1, size), robots), "joint"
    return random_formula(rng, rng.randint(1, size)), rng.choice(["own", "joint"])


def flight(rng: Random) -> tuple[Formula, str, dict[str, Timeline], int]:
    """Return a formula, how it is read, a team's timelines and a clock error."""
    robots = tuple(f"q{i}" for i in range(rng.choice([1, 2, 2, 3])))
    formula, reading = asked(rng, robots, 6)
    touching = rng.random() < 0.3
    lines = {robot: opened(short_timeline(rng, robot, touching=touching)) for robot in robots}
    return formula, reading, lines, rng.choice([0, 0, 0, 1]) if len(robots) == 2 else 0


@pytest.mark.parametrize(("seed", "number"), [(1, 12), *(pytest.param(s, 1500, marks=pytest.mark.slow) for s in (2, 3, 4))])
def test_flights_agree_with_brute_force_and_judge(seed: int, number: int) -> None:
    rng = Random(seed)
    found: set[bool] = set()
    for _ in range(number):
        formula, reading, lines, error = flight(rng)
        given = mission(str(formula), team=reading, robots=len(lines))
        mine = kernel_says_yes(given, lines, error)
        case = str(formula), reading, error, lines
        assert not mine or outcomes(formula, tuple(lines), Timed(lines, reading, error)) == {True}, case
        (verdict,) = judge_formula(given, lines, Relations(), clock_error=Fraction(error), detail="answer")
        assert mine == (verdict.outcome == "holds"), case
        found.add(mine)
    assert found == {True, False}


@pytest.mark.parametrize(("seed", "number"), [(1, 4), *(pytest.param(s, 200, marks=pytest.mark.slow) for s in (2, 3))])
def test_laps_agree_with_the_judge_and_with_words_that_are_drawn(seed: int, number: int) -> None:
    rng = Random(seed)
    found: set[bool] = set()
    for _ in range(number):
        robots = tuple(f"q{i}" for i in range(rng.choice([1, 2, 2, 3])))
        formula, reading = asked(rng, robots, 6)
        lines = {robot: opened(lap_timeline(rng, robot)) for robot in robots}
        error = rng.choice([0, 0, 0, 1]) if len(robots) > 1 else 0
        given = mission(str(formula), team=reading, robots=len(robots), trace="infinite")
        mine = kernel_says_yes(given, lines, error)
        case = str(formula), reading, error, lines
        (verdict,) = judge_formula(given, lines, Relations(), clock_error=Fraction(error), detail="answer")
        assert mine == (verdict.outcome == "holds"), case
        words = [Laps(lines, reading, error).word(rng) for _ in range(4 if mine else 0)]
        assert all(for_ever(formula, robots, *word) for word in words if word is not None), case
        found.add(mine)
    assert found == {True, False}


@pytest.mark.parametrize(("seed", "number"), [(1, 30), pytest.param(2, 3000, marks=pytest.mark.slow)])
def test_transitions_agree_with_the_judge(seed: int, number: int) -> None:
    rng = Random(seed)
    found: set[bool] = set()
    for _ in range(number):
        lap = rng.random() < 0.4
        line = lap_timeline(rng, "q0") if lap else short_timeline(rng, "q0", touching=rng.random() < 0.3)
        line = replace(opened(rng.choice([line, random_timeline(rng, "q0", busy=0.7)]) if not lap else line), actions=())
        vertices = ["home", "a", "b", "c"]
        edges = tuple((x, y) for x in vertices for y in vertices[1:] if x != y and rng.random() < 0.6)
        if not edges:
            continue
        world = {"start": "home", "edges": edges, "directed": rng.random() < 0.5}
        given = mission("true", environment=world, trace="infinite" if lap else "finite")
        (verdict,) = judge_transitions(given, {"q0": line}, Relations())
        assert kernel_proves_transitions(given, line) == (verdict.outcome == "holds"), (world, line)
        found.add(bool(verdict))
    assert found == {True, False}


ONE = Relations(nested=frozenset({("a", "b"), ("b", "a")}))
"""a and b are one region under two names."""


@pytest.mark.parametrize(
    ("edges", "every_order"),
    [
        ((("home", "a"),), False),
        ((("home", "c"),), False),
        ((("home", "a"), ("a", "b")), False),
        ((("home", "a"), ("home", "b"), ("a", "b")), True),
    ],
)
def test_regions_that_are_one_and_entered_at_one_instant(edges: tuple[tuple[str, str], ...], every_order: bool) -> None:
    """Neither order is a way that two equal regions can be entered: edges for both are asked for."""
    line = Timeline("q0", dict.fromkeys("abc", "no"), (Change(at(2), "a", "must"), Change(at(2), "b", "must")), Fraction(END))
    given = mission("true", environment={"start": "home", "edges": edges})
    assert bool(judge_transitions(given, {"q0": line}, ONE)[0]) == every_order
    assert kernel_proves_transitions(given, line) == every_order


def as_one(line: Timeline) -> Timeline:
    """Return a timeline whose b is its a, without actions."""
    own = [change for change in line.changes if change.region != "b"]
    both = [replace(change, region=region) for change in own for region in ("ab" if change.region == "a" else "c")]
    return replace(line, initial={**line.initial, "b": line.initial["a"]}, changes=tuple(both), actions=())


@pytest.mark.parametrize(("seed", "number"), [(1, 30), pytest.param(2, 2000, marks=pytest.mark.slow)])
def test_kernel_and_judge_agree_on_regions_that_are_one(seed: int, number: int) -> None:
    rng = Random(seed)
    found: set[tuple[bool, bool]] = set()
    for _ in range(number):
        line = opened(as_one(short_timeline(rng, "q0", touching=rng.random() < 0.3)))
        edges = tuple((x, y) for x in ("home", "a", "b", "c") for y in "abc" if x != y and rng.random() < 0.6)
        if not edges:
            continue
        given = mission("true", environment={"start": "home", "edges": edges, "directed": rng.random() < 0.5})
        pair = kernel_proves_transitions(given, line), bool(judge_transitions(given, {"q0": line}, ONE)[0])
        assert pair[0] == pair[1], (edges, line)
        found.add(pair)
    assert found == {(False, False), (True, True)}


def test_one_leaves_as_another_one_comes() -> None:
    """Both orders one after the other satisfy it; at one instant a goes and b comes."""
    formula = "F(a & b) | F(!a & !b)"
    leaves, comes = (
        Timeline("q0", {"a": "must", "b": "no", "c": "no"}, (Change(at(5), "a", "no"),), Fraction(END)),
        (Timeline("q1", dict.fromkeys("abc", "no"), (Change(at(5), "b", "must"),), Fraction(END))),
    )
    lines = {"q0": leaves, "q1": comes}
    assert not kernel_says_yes(mission(formula, team="joint", robots=2), lines)
    later = replace(comes, changes=(Change(at(6), "b", "must"),))
    assert kernel_says_yes(mission(formula, team="joint", robots=2), lines | {"q1": later})
    assert not kernel_says_yes(mission(formula, team="joint", robots=2), lines | {"q1": later}, 1)


def test_a_letter_that_is_held_is_read_after_another_ones() -> None:
    """q0 has entered a before q1 enters b, and is read there after q1 may have been read in b, unless it has left."""
    first = timeline("q0", ("a", 2, 6))
    given = mission("!b U a", robots=2)
    assert not kernel_says_yes(given, {"q0": first, "q1": timeline("q1", ("b", 4, 8))})
    assert kernel_says_yes(given, {"q0": first, "q1": timeline("q1", ("b", 7, 8))})
    assert not kernel_says_yes(given, {"q0": first, "q1": timeline("q1", ("b", 7, 8))}, 1)


@pytest.mark.parametrize("team", ["own", "joint"])
def test_actions_are_followed(team: str) -> None:
    fills = timeline("q0", ("a", 2, 6), ("b", 8, 9), actions=(fill(4),))
    other = timeline("q1", ("c", 3, 12))
    lines = {"q0": fills, "q1": other}
    assert kernel_says_yes(mission("F(a & water) & F(b & water) & G(b -> water)", team=team, robots=2), lines)
    assert not kernel_says_yes(mission("G(a -> water)", team=team, robots=2), lines)


@few_of(
    2,
    ("formula", "accepted"),
    [
        ("F(count(a) >= 2)", True),
        ("F all(a)", True),
        ("G(count(a) <= 2)", False),
        ("F(count(a) >= 2 & F all(free))", True),
        ("F(q0.a & q1.a) & G(q2.a -> !q0.b)", True),
        pytest.param("F(count(a & b) >= 4)", False, marks=pytest.mark.slow),  # some seconds
    ],
)
def test_many_robots_are_counted(formula: str, accepted: bool) -> None:
    lines = {f"q{i}": timeline(f"q{i}", ("a", 2 + i / 8, 12 + i / 8), edge=0.25) for i in range(20)}
    assert kernel_says_yes(mission(formula, team="joint", robots=20), lines, Fraction(1, 4)) == accepted


@pytest.mark.parametrize("number", [4, pytest.param(100, marks=pytest.mark.slow)])
def test_proofs_of_others_are_no_proofs(number: int) -> None:
    """An invariant of one flight, held against another one that breaks the formula."""
    rng = Random(5)
    tried = refused = 0
    while tried < number:
        formula, reading, lines, error = flight(rng)
        given = mission(str(formula), team=reading, robots=len(lines))
        *_, evidence = proof_of(given, lines, error)
        touching = {robot: short_timeline(rng, robot, touching=False) for robot in lines}
        if len(evidence) == 0 or outcomes(formula, tuple(lines), Timed(touching, reading, error)) == {True}:
            continue
        tried += 1
        statement = kernel_statement(given, Fraction(error))
        own = {name: kernel_timeline(line) for name, line in touching.items()}
        with pytest.raises(Refused):
            check_words(flown(statement, own), Evidence(evidence))
        refused += 1
    assert refused == number


@pytest.mark.parametrize(("seed", "number"), [(1, 6), pytest.param(2, 300, marks=pytest.mark.slow)])
def test_edited_proofs_are_refused_or_still_prove(seed: int, number: int) -> None:
    """No edit of a proof makes the kernel fail in another way, or accept what is not so."""
    rng = Random(seed)
    for _ in range(number):
        formula, reading, lines, error = flight(rng)
        given = mission(str(formula), team=reading, robots=len(lines))
        statement, own, evidence = proof_of(given, lines, error)
        if len(evidence) == 0:
            continue
        is_so = outcomes(formula, tuple(lines), Timed(lines, reading, error)) == {True}
        for _ in range(60):
            changed = edited(rng, evidence)
            for _ in range(rng.choice([0, 0, 1, 3])):
                changed = edited(rng, changed)
            try:
                check_words(flown(statement, own), Evidence(changed if isinstance(changed, dict) else {}))
            except Refused:
                continue
            assert is_so, (str(formula), reading, error, lines, changed)


@pytest.mark.parametrize(("seed", "number"), [(1, 2), pytest.param(2, 150, marks=pytest.mark.slow)])
def test_edited_proofs_of_laps_are_refused_or_still_prove(seed: int, number: int) -> None:
    """Levels, untils and places of laps as well; held against the same flight, and against another one."""
    rng = Random(seed)
    while number > 0:
        robots = ("q0", "q1")[: rng.choice([1, 1, 2])]
        formula, reading = asked(rng, robots, 6)
        given = mission(str(formula), team=reading, robots=len(robots), trace="infinite")
        honest, other = ({robot: lap_timeline(rng, robot) for robot in robots} for _ in range(2))
        statement, _, evidence = proof_of(given, honest)
        if len(evidence) == 0:
            continue
        number -= 1
        for lines in (honest, other):
            (verdict,) = judge_formula(given, lines, Relations(), detail="answer")
            own = {name: kernel_timeline(line) for name, line in lines.items()}
            for _ in range(80):
                changed = edited(rng, evidence)
                for _ in range(rng.choice([0, 0, 1, 3])):
                    changed = edited(rng, changed)
                try:
                    check_words(flown(statement, own), Evidence(changed if isinstance(changed, dict) else {}))
                except Refused:
                    continue
                assert verdict.outcome == "holds", (str(formula), reading, lines, changed)


@pytest.mark.parametrize(("seed", "number"), [(1, 80), pytest.param(2, 5000, marks=pytest.mark.slow)])
def test_what_is_left_of_a_formula_is_what_the_rest_of_a_word_has_to_do(seed: int, number: int) -> None:
    rng = Random(seed)
    for _ in range(number):
        formula = random_formula(rng, rng.randint(1, 8))
        table = Table(json.loads(json.dumps(tree_of(formula))), "abc")
        word = [frozenset(n for n in ("a", "b", "c", "water") if rng.random() < 0.4) for _ in range(rng.randint(1, 5))]
        owed = {frozenset({table.root})}
        for letter in word:
            seen = table.letter_of(letter)
            owed = {then for one in owed for then, _ in table.after(seen, one)}
        broken = any(map(table.empty_word_keeps, owed))
        assert broken != holds(formula, [{"": letter} for letter in word]), (str(formula), word)


def test_conjuncts_and_text_say_what_the_formula_says() -> None:
    rng = Random(3)
    for _ in range(300):
        formula = random_formula(rng, rng.randint(1, 9))
        tree = tree_of(formula)
        text = parse_formula(show(tree))
        parts = [parse_formula(show(part)) for part in conjuncts(tree)]
        for _ in range(5):
            word = [{"": frozenset(n for n in "abc" if rng.random() < 0.4)} for _ in range(rng.randint(1, 4))]
            assert holds(text, word) == holds(formula, word) == all(holds(part, word) for part in parts)


@pytest.mark.parametrize(
    ("tree", "message"),
    [
        (["next", ["name", "a"]], "'next' is not covered"),
        (["name", "nowhere"], "'nowhere', which no robot shows"),
        (["count", 2, ["name", "a"]], "counts robots that are read one by one"),
        (["robot", "q9", ["name", "a"]], "names robot 'q9'"),
        (["count", 2, ["F", ["name", "a"]]], "no combination of names"),
        (["count", 1, ["count", 2, ["name", "a"]]], "no combination of names"),
        (["count", 1, ["!", ["robot", "q0", ["name", "a"]]]], "no combination of names"),
        (["robot", "q0", ["robot", "q1", ["name", "a"]]], "no combination of names"),
        (["U", ["name", "a"]], "'U' is not covered"),
        ("a", "no list"),
        ([], "no list"),
        (["name", 3], "'name' is not covered"),
    ],
)
def test_formulas_that_are_none(tree: Any, message: str) -> None:
    statement = kernel_statement(mission("F a"), Fraction(0))
    statement.formula = tree  # type: ignore[misc]
    with pytest.raises(Refused, match=message):
        check_words(flown(statement, {"q0": kernel_timeline(timeline("q0"))}), Evidence({}))
