"""Regions that a formula never lets a robot leave or enter: only what holds of that robot in every word that satisfies it."""

from __future__ import annotations

import pytest

from verify.data import Mission, parse_mission
from verify.data.language.lasting import lasting_regions


def mission(formula: str, team: str, robots: int = 2) -> Mission:
    """Robots outside two regions."""
    agents = ", ".join(f"{name}: {{start: [{0.6 * i}, -0.9, 1]}}" for i, name in enumerate("ab"[:robots]))
    return parse_mission(f"""
format: 1
name: rooms
spec: {{formula: "{formula}", team: {team}}}
regions: {{room: {{center: [-1, 0.4, 1], size: [0.6, 0.6, 0.4]}}, pit: {{center: [1, 0.4, 1], size: [0.6, 0.6, 0.4]}}}}
agents: {{{agents}}}
vehicle: crazyflie-2.1
workspace: {{min: [-1.6, -1.3, 0.2], max: [1.6, 1.3, 1.8]}}
""")


@pytest.mark.parametrize(
    ("formula", "team", "kept", "never"),
    [
        ("G room", "own", {"room"}, set[str]()),
        ("G room", "joint", set[str](), set[str]()),  # some robot is in it, no matter which
        ("G all(room)", "joint", {"room"}, set[str]()),
        ("G a.room & G !b.pit", "joint", {"room"}, set[str]()),
        ("each(G room)", "joint", {"room"}, set[str]()),
        ("G !(pit | room)", "joint", set[str](), {"pit", "room"}),
        ("G !some(pit)", "joint", set[str](), {"pit"}),
        ("G(count(pit) <= 1)", "joint", set[str](), set[str]()),
        ("G all(room & !pit)", "joint", {"room"}, {"pit"}),
        ("G(room & !pit | !pit)", "own", set[str](), {"pit"}),
        ("F room & F G !pit & (!pit U room)", "own", set[str](), set[str]()),
    ],
)
def test_regions_that_a_robot_may_never_leave_or_enter(formula: str, team: str, kept: set[str], never: set[str]) -> None:
    asked = mission(formula, team)
    assert lasting_regions(asked, "a", inside=True) == kept
    assert lasting_regions(asked, "a", inside=False) == never


def test_one_robot_alone_is_the_one_that_is_in_a_room() -> None:
    assert lasting_regions(mission("G room", "joint", robots=1), "a", inside=True) == {"room"}
