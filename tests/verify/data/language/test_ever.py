"""`ever(B) <= k`: how many robots come to B, counted by hand and by planning."""

from __future__ import annotations

import operator
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ltlplan
import refine
import verify
from verify.data import BadInput, Plan, Word
from verify.data.language.counting import written_out
from verify.data.language.formula_reader import parse_formula
from verify.logic.semantics import truth_table

ROBOTS = ("q0", "q1", "q2", "q3")
COMPARED = {">=": operator.ge, "<=": operator.le, "==": operator.eq, "<": operator.lt, ">": operator.gt}
LETTERS = st.frozensets(st.sampled_from([f"{robot}.{name}" for robot in ROBOTS for name in "ab"]))


@given(st.lists(LETTERS, min_size=1, max_size=4), st.sampled_from(sorted(COMPARED)), st.integers(0, 5), st.integers(1, 4))
def test_it_counts_the_robots_that_come_to_it(letters: list[frozenset[str]], sign: str, number: int, team: int) -> None:
    robots = ROBOTS[:team]
    formula = written_out(parse_formula(f"ever(a & !b) {sign} {number}", "ab"), robots)
    if team == 1:  # plain names are all that is left of a single robot's
        letters = [frozenset(name[3:] for name in letter if name.startswith("q0.")) for letter in letters]
    prefix = "" if team == 1 else "{}."
    for start in range(len(letters)):
        came = sum(
            any(prefix.format(robot) + "a" in letter and prefix.format(robot) + "b" not in letter for letter in letters[start:])
            for robot in robots
        )
        assert truth_table(formula, Word(tuple(letters[start:]))).at(formula) == COMPARED[sign](came, number)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ever(a)", "compare it, such as `ever(dock) <= 1`"),
        ("ever <= 1", "needs parentheses"),
        ("ever(F a) <= 1", "`F` is about other times"),
        ("ever(count(a) >= 1) <= 1", "counts robots again"),
        ("ever(a) <= -1", "it is never below 0"),
        ("ever(q0.a) <= 1", "names a robot"),
    ],
)
def test_what_cannot_be_read_is_said(text: str, said: str) -> None:
    with pytest.raises(BadInput, match=re.escape(said)):
        parse_formula(text, "ab")


def test_too_many_sets_of_robots_are_refused_with_their_number() -> None:
    with pytest.raises(BadInput, match="184756 sets of 10 of the 20 robots; 1000 are the most"):
        written_out(parse_formula("ever(a) <= 9", "ab"), tuple(f"q{i}" for i in range(20)))


MISSION = """
format: 1
name: visitors
spec: {formula: %s, team: joint}
regions:
  left: {center: [-1, 0.8, 1], radii: [0.3, 0.3, 0.3]}
  right: {center: [1, 0.8, 1], radii: [0.3, 0.3, 0.3]}
agents: {q0: {start: [-1, 0, 1]}, q1: {start: [1, 0, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""


def test_at_most_one_robot_visits_two_regions_between_them_and_that_is_certified(tmp_path: Path) -> None:
    free, bound = (_planned(tmp_path, f"F left & F right{more}") for more in ("", " & ever(left | right) <= 1"))
    assert [len(robot.visits) for robot in free.robots.values()] == [1, 1]
    assert sorted(len(robot.visits) for robot in bound.robots.values()) == [0, 2]
    assert verify.certify(bound, refine.refine(bound)).holds
    verdict = verify.check_team(bound.mission.formula, {name: robot.word for name, robot in free.robots.items()}, team="joint")
    assert verdict.sequential.outcome == "fails"


def _planned(folder: Path, formula: str) -> Plan:
    (folder / "visitors.yaml").write_text(MISSION % formula)
    return ltlplan.plan(folder / "visitors.yaml")
