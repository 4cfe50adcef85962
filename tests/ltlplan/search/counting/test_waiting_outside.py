"""Robots that count wait for each other outside of regions too, where regions alone do not do."""

from __future__ import annotations

from random import Random

import pytest

from ltlplan import parse_mission, plan
from ltlplan.logic.budget import TooLarge
from ltlplan.pipeline import certified_team
from ltlplan.search.exact import assign
from verify.data import Infeasible, Mission, Unsatisfiable


def world(formula: str, robots: int = 2) -> Mission:
    starts = "".join(f"  quad{i}: {{start: [{-0.9 + 0.9 * i}, -1.8, 1.0]}}\n" for i in range(robots))
    return parse_mission(
        f"format: 1\nname: outside\nspec: {{formula: '{formula}', team: joint}}\n"
        "regions:\n  a: {center: [-1.6, 0.5, 1.0], radii: [0.7, 0.7, 0.5]}\n  b: {center: [1.6, 0.5, 1.0], radii: [0.7, 0.7, 0.5]}\n"
        f"agents:\n{starts}vehicle: crazyflie-2.1\nlimits: {{speed: 1.0}}\n"
        "workspace: {min: [-2.8, -2.4, 0.2], max: [2.8, 2.4, 1.9]}\n"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "robots"),
    [
        ("F(all(a) & F(all(free) & F all(b)))", 2),
        pytest.param("F(all(a) & F(free & F all(a)))", 2, marks=pytest.mark.slow),
        pytest.param("F(all(a) & F(free & F all(a)))", 3, marks=pytest.mark.slow),
        pytest.param("F(all(a) & F(all(free) & F all(b)))", 3, marks=pytest.mark.slow),
    ],
)
def test_robots_that_are_to_be_outside_together_wait_there(formula: str, robots: int, pace: float | str) -> None:
    made = plan(world(formula, robots), pace=pace)
    assert not made.meetings
    assert made.precedences
    assert certified_team(made).certificate.holds


@pytest.mark.slow
def test_robots_that_are_outside_together_in_the_end_rest_apart_there(pace: float | str) -> None:
    made = plan(world("F(all(a) & F free)"), pace=pace)
    assert certified_team(made).certificate.holds


ENDS = """format: 1
name: ends
spec: {formula: "F all(a)", team: joint}
regions: {a: {center: [-1.6, 0.5, 1.0], radii: [0.4, 0.4, 0.4]}}
agents: {q0: {start: [-0.9, -1.8, 1.0], end: [-0.9, 1.5, 1.0]}, q1: {start: [0.0, -1.8, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-2.8, -2.4, 0.2], max: [2.8, 2.4, 1.9]}
"""


def test_a_robot_that_ends_at_a_place_is_not_taken_for_one_that_ends_anywhere() -> None:
    made = plan(parse_mission(ENDS))
    assert {name: [set(letter) for letter in robot.word.prefix] for name, robot in made.robots.items()} == {
        "q0": [set(), {"a"}, set()],
        "q1": [set(), {"a"}],
    }


LAMPS = """format: 1
name: lamps
spec: {formula: "F(!dark & F !light)", team: joint}
regions: {home: {center: [0.0, 0.0, 1.0], radii: [0.7, 0.7, 0.5]}}
robot:
  initial: off
  states: {off: [dark], lit: [light]}
  actions: [{from: off, to: lit, at: home}, {from: lit, to: off, at: home}]
agents: {quad0: {start: [-1.5, -1.0, 1.0]}, quad1: {start: [1.5, -1.0, 1.0]}}
vehicle: crazyflie-2.1
limits: {speed: 1.0}
workspace: {min: [-2.6, -2.0, 0.2], max: [2.6, 2.0, 1.9]}
"""


@pytest.mark.slow
def test_opposite_actions_of_a_visit_that_is_the_last_are_made_in_stages(pace: float | str) -> None:
    made = plan(parse_mission(LAMPS), pace=pace)
    assert made.meetings
    assert certified_team(made).certificate.holds


@pytest.mark.slow  # half a minute: many small teams, each searched twice where there is no plan
@pytest.mark.parametrize("seed", range(60))
def test_no_plan_is_called_impossible_that_precedences_allow(seed: int) -> None:
    rng = Random(seed)
    letters = [
        "all(a)",
        "all(free)",
        "free",
        "count(a) >= 2",
        "count(b) == 1",
        "quad0.a",
        "quad1.free",
        "quad1.b",
        "count(free) <= 1",
        "!a",
    ]

    def part(deep: int) -> str:
        now = " & ".join(rng.sample(letters, rng.randint(1, 2)))
        return f"F({now}{f' & {part(deep - 1)}' if deep else ''})"

    formula = part(rng.randint(1, 3))
    if rng.random() < 0.5:
        formula += f" & G({rng.choice(letters)} | {rng.choice(letters)} | {rng.choice(letters)})"
    mission = world(formula)
    try:
        plan(mission)  # whose words the judge has found to hold under its waits
    except (Unsatisfiable, Infeasible):
        try:
            with pytest.raises(Unsatisfiable):
                assign(mission, ordered=True)
        except (TooLarge, Infeasible):
            return
