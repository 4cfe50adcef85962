"""A pace at every door: files and library; what is none is one clear fault."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import ltlplan
from ltlplan.planner import pace_of, with_pace
from verify.data import BadInput, MissionError, mission_to_yaml, parse_mission

TEXT = """
format: 1
name: small
spec: {formula: F b}
regions: {b: {center: [0.5, 1, 1], radii: [0.2, 0.2, 0.2]}}
agents: {quad0: {start: [-0.2, 0, 1]}, quad1: {start: [-0.2, 1, 1]}}
vehicle: crazyflie-2.1
workspace: {min: [-2, -2, 0.2], max: [2, 2, 2]}
"""
REFUSED = "share of the fastest flight, above 0 up to 1, or"


def of_planner(pace: str) -> str:
    return TEXT + f"planner: {{pace: {pace}}}\n"


def of_agent(pace: str) -> str:
    return TEXT.replace("start: [-0.2, 0, 1]", f"start: [-0.2, 0, 1], pace: {pace}")


@pytest.mark.parametrize("pace", ["1", "0.7", "1e-3", "nominal"])
def test_files_have_a_pace_and_agents_their_own(pace: str) -> None:
    asked = "nominal" if pace == "nominal" else float(pace)
    planner, agent = parse_mission(of_planner(pace)), parse_mission(of_agent(pace))
    assert [planner.pace_of(name) for name in planner.agents] == [asked, asked]
    assert [agent.pace_of(name) for name in agent.agents] == [asked, 0.7]
    assert parse_mission(mission_to_yaml(planner)) == planner
    assert parse_mission(mission_to_yaml(agent)) == agent


@pytest.mark.parametrize("pace", ["0", "-0.5", "1.01", ".nan", ".inf", "true", "fast", "time", "'0.7'", "[1]", "{}"])
def test_a_pace_that_is_none_is_one_fault_where_it_is_written(pace: str) -> None:
    for text, keys in ((of_planner(pace), ("planner", "pace")), (of_agent(pace), ("agents", "quad0", "pace"))):
        with pytest.raises(MissionError) as refused:
            parse_mission(text)
        (fault,) = refused.value.faults
        assert fault.keys == keys
        assert REFUSED in fault.reason


def test_a_given_pace_is_the_planners_and_agents_keep_their_own() -> None:
    mission = parse_mission(of_agent("0.2"))
    given = with_pace(mission, 1)
    assert [given.pace_of(name) for name in given.agents] == [0.2, 1.0]
    assert given.digest() != mission.digest()
    assert with_pace(mission, None) is with_pace(mission, 0.7) is mission
    assert with_pace(mission, np.float32(0.5)).planner.pace == 0.5  # type: ignore[arg-type]
    assert ltlplan.plan(mission, pace="nominal").mission.planner.pace == "nominal"


@pytest.mark.parametrize("pace", [0, 2, -1, True, float("nan"), "0.5", "time", "", [1], np.array([0.5, 0.6])])
def test_what_is_no_pace_is_refused_by_plan_and_run(pace: Any) -> None:
    for door in (ltlplan.plan, ltlplan.run):
        with pytest.raises(BadInput, match=f"A pace is a {REFUSED}"):
            door(parse_mission(TEXT), pace=pace)


def test_words_of_a_command_are_numbers_where_they_can_be() -> None:
    assert (pace_of(None), pace_of("0.5"), pace_of("1"), pace_of("nominal")) == (None, 0.5, 1.0, "nominal")
