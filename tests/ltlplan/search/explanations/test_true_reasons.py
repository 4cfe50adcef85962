"""Reasons for "no plan" that name what is really in the way: overlapping regions, actions that end inside, robots that fly in turns."""

from __future__ import annotations

import pytest

from ltlplan import parse_mission
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from verify.data import Mission


def mission(formula: str, *, gap: float = 1.6, team: str = "own", robots: int = 1) -> Mission:
    """Two hoops a and b, so far apart; in a robots load, in b they are done."""
    agents = ", ".join(f"q{i}: {{start: [{0.6 * i - 0.3}, -0.9, 1]}}" for i in range(robots))
    return parse_mission(f"""
format: 1
name: reasons
spec: {{formula: "{formula}", team: {team}}}
hoops:
  a: {{center: [-0.8, 0.5, 1], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}
  b: {{center: [{gap - 0.8}, 0.5, 1], radii: [0.2, 0.2, 0.2], opening: 0.25, rim: 0.02}}
regions: {{c: {{center: [0, -0.2, 1], radii: [0.15, 0.15, 0.15]}}}}
robot:
  initial: empty
  states: {{empty: [], full: [loaded], end: [done]}}
  actions: [{{from: empty, to: full, at: a}}, {{from: full, to: end, at: b}}]
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}}
""")


def reasons(asked: Mission) -> str:
    with pytest.raises(NoPlan) as caught:
        assign(asked)
    return " ".join(caught.value.reasons)


@pytest.mark.parametrize("gap", [0.1, 0.2])
def test_overlapping_hoops_are_named_with_how_far_apart_they_are(gap: float) -> None:
    said = reasons(mission("F a & F b", gap=gap))
    assert f"a and b overlap, their middles {gap:g} m apart" in said
    assert "Move them apart" in said
    assert assign(mission("F a & F b")).robots  # which does help


@pytest.mark.parametrize(
    ("formula", "action"),
    [
        ("F loaded & G(loaded -> !a)", "empty -> full is made inside a, which changes loaded,"),
        ("G(a -> !loaded) & F loaded", "empty -> full is made inside a"),
        ("F done & G(b -> loaded)", "full -> end is made inside b, which changes done and loaded,"),
    ],
)
def test_an_action_that_ends_inside_its_region_is_the_reason(formula: str, action: str) -> None:
    said = reasons(mission(formula))
    assert f"The action {action}" in said
    assert "still there when it ends" in said


def test_what_is_asked_outside_of_the_actions_region_is_planned() -> None:
    assert assign(mission("F loaded & G(loaded -> !c | a)")).robots


def test_a_joint_team_flies_in_turns_where_that_is_asked() -> None:
    for formula in ("F(a & b & F free)", "G(a -> b) & F a"):
        assert assign(mission(formula, team="joint", robots=2)).precedences
    start = reasons(mission("b & F c", team="joint", robots=2))
    assert all(f"{name} starts in free flight, in no region." in start for name in ("q0", "q1"))
