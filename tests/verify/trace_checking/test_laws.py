"""Laws of teams' words: who a robot is called, in which order robots stand, and how a count is written, changes no verdict."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import reduce

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from verify import check_team
from verify.data import Formula, Word, parse_formula
from verify.data.sections import TeamReading
from verify.testing import formulas, team_words

ROBOTS = ("quad0", "quad1", "quad2")
NAMES = ("a", "b")
PLACE = "place"
"""Stands for what is written in several ways."""

laws = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
readings = st.sampled_from(["own", "joint"])
teams = team_words(ROBOTS, NAMES, most=2)


def outcomes(formula: Formula, words: Mapping[str, Word], reading: TeamReading) -> tuple[str, str]:
    verdict = check_team(formula, words, reading)
    return verdict.sequential.outcome, verdict.parallel.outcome


def renamed(formula: Formula, new: Mapping[str, str]) -> Formula:
    text = str(formula)
    for old, name in new.items():
        text = text.replace(f"{old}.", f"{name}.")
    return parse_formula(text)


@laws
@given(st.data(), readings, teams)
def test_names_and_order_of_robots_change_nothing(data: st.DataObject, reading: TeamReading, words: dict[str, Word]) -> None:
    formula = data.draw(formulas(NAMES, robots=ROBOTS if reading == "joint" else (), size=6))
    new = dict(zip(ROBOTS, data.draw(st.permutations(["x", "y", "z"])), strict=True))
    order = data.draw(st.permutations(ROBOTS))
    moved = {new[robot]: words[robot] for robot in order}
    assert outcomes(renamed(formula, new), moved, reading) == outcomes(formula, words, reading)


@laws
@given(formulas(NAMES, robots=ROBOTS, size=6), teams, st.permutations(ROBOTS))
def test_robots_that_are_not_named_may_change_places(formula: Formula, words: dict[str, Word], order: Sequence[str]) -> None:
    unnamed = formula if not any(node.robot for node in formula.nodes()) else Formula("each", (parse_formula("F a -> F b"),))
    shuffled = dict(zip(order, words.values(), strict=True))
    assert outcomes(unnamed, shuffled, "joint") == outcomes(unnamed, words, "joint")


@laws
@given(st.data(), formulas(NAMES, size=5), team_words(ROBOTS[:2], NAMES, most=2))
def test_under_joint_a_robot_that_shows_nothing_changes_no_plain_name_and_no_count_of_what_is_shown(
    data: st.DataObject, formula: Formula, words: dict[str, Word]
) -> None:
    """Plain names, and counts of what an empty letter does not satisfy; `all`, `each` and `count(!a)` count who is there."""
    shown = data.draw(st.sampled_from(["count(a) >= 2", "count(a & !b) == 1", "some(a & b)", "count(a | b) < 2", "quad0.a"]))
    asked = Formula("|", (formula, Formula("F", (parse_formula(shown),))))
    idle = {**words, "idle": Word.of([[]])}
    assert outcomes(asked, idle, "joint") == outcomes(asked, words, "joint")


@laws
@given(formulas(NAMES, size=6), team_words(ROBOTS[:2], NAMES, most=2), st.booleans())
def test_under_own_one_idle_robot_is_read_like_many(formula: Formula, words: dict[str, Word], shows: bool) -> None:
    """In every interleaving; one robot after another, each is read in its turn, and two idle ones may be read at two places."""
    letter = ["a"] if shows else []
    one = {**words, "idle": Word.of([letter])}
    two = {**one, "another": Word.of([letter])}
    assert check_team(formula, two).parallel.outcome == check_team(formula, one).parallel.outcome


def test_under_own_an_idle_robot_may_change_a_verdict() -> None:
    words = {"quad0": Word.of([["a"], ["b"]])}
    idle = {**words, "idle": Word.of([[]])}
    assert check_team("a U b", words)
    assert not check_team("a U b", idle)
    assert not check_team("F !(a | b)", words)
    assert check_team("F !(a | b)", idle)
    asked = parse_formula("!F(!a & !b & F(a & F(!a & !b)))")
    alone = {"quad0": Word.of([["a"]]), "idle": Word.of([[]])}
    assert check_team(asked, alone).sequential
    assert not check_team(asked, {**alone, "another": Word.of([[]])}).sequential


def both(operator: str, parts: Sequence[str]) -> str:
    return reduce(lambda one, other: f"({one}) {operator} ({other})", parts)


def of(robot: str, counted: str) -> str:
    return str(parse_formula(counted).of(robot))


def written(counted: str, k: int) -> dict[str, list[str]]:
    """Return texts that mean the same, by what the first of them is."""
    own = [of(robot, counted) for robot in ROBOTS]
    least = both("|", [both("&", some) for some in itertools.combinations(own, k)])
    return {
        "some": [f"some({counted})", f"count({counted}) >= 1", f"count({counted}) > 0", both("|", own), f"!all(!({counted}))"],
        "all": [f"all({counted})", f"count(!({counted})) == 0", both("&", own), f"!some(!({counted}))", f"count({counted}) == 3"],
        "at least": [f"count({counted}) >= {k}", f"count({counted}) > {k - 1}", f"!(count({counted}) < {k})", least],
        "exactly": [f"count({counted}) == {k}", f"count({counted}) >= {k} & !(count({counted}) > {k})", f"count(!({counted})) == {3 - k}"],
    }  # fmt: skip


@laws
@given(st.data(), formulas((*NAMES, PLACE), size=5), teams)
def test_counts_are_what_they_say_written_out(data: st.DataObject, around: Formula, words: dict[str, Word]) -> None:
    counted = data.draw(st.sampled_from(["a", "a & b", "a | !b", "a xor b", "!a"]))
    k = data.draw(st.integers(1, 3))
    same = data.draw(st.sampled_from(list(written(counted, k).values())))
    found = {outcomes(around.substitute({PLACE: parse_formula(text)}), words, "joint") for text in same}
    assert len(found) == 1, (str(around), same)


@laws
@given(formulas(NAMES, size=5), teams)
def test_each_is_the_conjunction_over_the_robots(formula: Formula, words: dict[str, Word]) -> None:
    each = Formula("each", (formula,))
    out = parse_formula(both("&", [str(formula.of(robot)) for robot in ROBOTS]))
    assert outcomes(each, words, "joint") == outcomes(out, words, "joint")


@pytest.mark.parametrize("k", [0, 4])
def test_counts_that_no_team_or_every_team_keeps(k: int) -> None:
    words = {robot: Word.of([[], ["a"]]) for robot in ROBOTS}
    assert bool(check_team(f"F(count(a) >= {k})", words, "joint")) == (k == 0)
    assert bool(check_team(f"G(count(a) < {k})", words, "joint")) == (k == 4)
