"""Robots that step aside: flown where another one has to pass, judged by the checker and by distances of their places from all other ways."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import ltlplan
from ltlplan.pipeline import certified_team
from ltlplan.replanning.stepping_aside import aside
from tests.helpers.missions.refused_missions import CASES, STEPS_ASIDE
from verify.data import Plan, parse_mission


def planned(text: str) -> Plan:
    """Return the plan of a mission file's text."""
    return ltlplan.plan(parse_mission(text))


@pytest.mark.parametrize("name", [name for name in STEPS_ASIDE if "makes room" not in name])
def test_a_place_aside_is_off_all_other_ways(name: str) -> None:
    plan = planned(STEPS_ASIDE[name].text)
    other_plan = next(aside(plan, list(plan.robots)[-2:]))
    (robot,) = [each for each in plan.robots if other_plan.robots[each] != plan.robots[each]]
    changed, mission = other_plan.robots[robot], plan.mission
    assert not other_plan.complete
    assert len(changed.times) == len(changed.waypoints)
    assert list(changed.times) == sorted(changed.times)
    assert [visit.region for visit in changed.visits] == [
        region
        for before, after in itertools.pairwise([frozenset[str](), *changed.word.letters])
        for region in sorted((after - before) & mission.all_regions.keys())
    ]
    dense = np.linspace(0.0, 1.0, 101)[:, None]
    for other in (each for each in plan.robots if each != robot):
        points = np.array([at.position for at in plan.robots[other].waypoints])
        way = np.concatenate([a + dense * (b - a) for a, b in itertools.pairwise(points)] or [points])
        places = [np.array(at.position) for at in changed.waypoints if at.role == "via" and at.region is None]
        far = max(float(np.linalg.norm(way - place, axis=1).min()) for place in places)
        assert far >= mission.separation + 2.0 * mission.margin


@pytest.mark.parametrize(
    "name", ["two robots swap places in a room", "two robots swap places in a tube", "two robots swap ends in a tube"]
)
def test_no_robot_steps_aside_where_it_may_not_or_has_no_place(name: str) -> None:
    plan = planned(CASES[name].text)
    assert not list(aside(plan, list(plan.robots)))


@pytest.mark.parametrize(
    "name", ["one of two robots may not leave a room", "a robot that may not leave a region makes room in it"]
)
def test_a_plan_with_a_robot_aside_is_certified(name: str) -> None:
    plan = planned(STEPS_ASIDE[name].text)
    assert certified_team(next(aside(plan, list(plan.robots)))).certificate.holds


OTHERWISE = ("two robots swap places through a corridor",)
"""Missions that other words mend before a robot steps aside."""


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERWISE)
def test_other_words_come_before_a_step_aside(name: str) -> None:
    found = certified_team(planned(STEPS_ASIDE[name].text))
    assert found.certificate.holds
    assert any("given up for others" in note for note in found.plan.notes)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in STEPS_ASIDE if "comes back" not in name and name not in OTHERWISE])
def test_a_robot_that_steps_aside_is_flown(name: str) -> None:
    """All but the one whose other words are tried first, from which no robot steps aside: its plan is certified where it does at once."""
    found = certified_team(planned(STEPS_ASIDE[name].text))
    assert found.certificate.holds
    assert any("out of the way of" in note for note in found.plan.notes)
    assert not found.plan.complete


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one of two robots may not leave a room", "the one in front comes out first"])
def test_renamed_robots_step_aside_as_well(name: str) -> None:
    text = STEPS_ASIDE[name].text
    renamed = text.replace("a.", "zoe.").replace("a: {start", "zoe: {start")
    assert certified_team(planned(renamed)).certificate.holds
