"""What people mistype in formulas that count or name robots, and in weights of soft parts: each is told what, where and what would be right."""

from __future__ import annotations

import pytest

from verify.data import parse_mission
from verify.data.validation.faults import MissionError

WORLD = """
format: 1
name: x
spec: {{formula: "{formula}", team: {team}, soft: [{soft}]}}
regions:
  dock: {{center: [0, 0, 1], radii: [0.6, 0.6, 0.5]}}
  b: {{center: [2, 0, 1], radii: [0.6, 0.6, 0.5]}}
agents: {{quad0: {{start: [-1, -1, 1]}}, quad1: {{start: [1, -1, 1]}}}}
vehicle: crazyflie-2.1
workspace: {{min: [-3, -3, 0.2], max: [3, 3, 2]}}
"""


def said(formula: str, *, team: str = "joint", soft: str = "") -> str:
    with pytest.raises(MissionError) as error:
        parse_mission(WORLD.format(formula=formula, team=team, soft=soft))
    return str(error.value)


@pytest.mark.parametrize("formula", ["F(count(dock) >= 2)", "F all(dock)", "G some(dock)", "F quad0.dock", "each(F dock)"])
def test_under_own_what_is_said_of_several_robots_is_refused_with_the_reason(formula: str) -> None:
    message = said(formula, team="own")
    assert "spec.formula" in message
    assert "Write `team: joint`" in message


@pytest.mark.parametrize(
    ("formula", "says"),
    [
        ("F quod0.dock", "'quod0' is not a robot of this mission. Did you mean 'quad0'? Robots: quad0, quad1."),
        ("F quad0.dok", "'dok' is not a name of this mission. Did you mean 'dock'?"),
        ("F quad0.quad1", "It is a robot; write `quad1.p` where p is what it shows."),
        ("F(count(dok) >= 2)", "Did you mean 'dock'?"),
        ("F(count(quad0.dock) >= 1)", "`quad0.dock` names a robot"),
        ("F(count(F dock) >= 2)", "`F` is about other times. Write it around the count, `ever(...)`"),
        ("F all(dock U b)", "`U` is about other times"),
        ("F(count(count(dock) >= 1) >= 2)", "`count` counts robots again"),
        ("F(count(dock))", "compare it, such as `count(dock) >= 2`"),
        ("F count", "needs parentheses, such as `count(dock) >= 2`; it cannot be a name"),
        ("F(count(dock) = 2)", "Equal numbers of robots are written `==`"),
        ("F(count(dock) != 2)", "Other numbers of robots are written `!(count(...) == 2)`"),
        ("F(count(dock) >= -1)", "it is never below 0"),
        ("F(count(dock) >= two)", "a whole number of robots is expected, such as 2"),
        ("F(count(dock) >= 10000000000)", "a whole number of robots is expected, of nine digits at the most"),
        ("F(2 <= count(dock))", "The count stands first: `count(...) >= 2`"),
        ("F(count() >= 2)", "`)` stands where a proposition is expected"),
    ],
)
def test_a_mistyped_count_or_name_is_told_at_its_place(formula: str, says: str) -> None:
    message = said(formula)
    assert says in message
    assert formula in message
    assert message.rstrip().endswith("^")


@pytest.mark.parametrize(
    ("weight", "says"),
    [
        ("0", "greater than 0, not 0"),
        ("-1", "greater than 0, not -1"),
        (".nan", "a finite number, not nan"),
        (".inf", "a finite number, not inf"),
        ("heavy", "a valid number, not 'heavy'"),
    ],
)
def test_a_weight_is_a_finite_number_above_zero(weight: str, says: str) -> None:
    message = said("F dock", soft=f"{{formula: F b, weight: {weight}}}")
    assert "spec.soft.0.weight" in message
    assert says in message


def test_soft_parts_are_held_to_the_same_rules() -> None:
    assert "spec.soft.0.formula" in said("F dock", soft="{formula: F quad9.b}")
    assert "Write `team: joint`" in said("F dock", team="own", soft='{formula: "F(count(b) >= 2)"}')
    assert "is about other times" in said("F dock", soft='{formula: "F(count(F b) >= 2)"}')
