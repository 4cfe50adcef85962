"""The script that flies a mission with crazyswarm2, held against a stand-in for its Python client: flights to their ends."""

from __future__ import annotations

import json
import runpy
import sys

import numpy as np
import pytest

import flight
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.vehicles.crazyswarm_flights import ACCEPTED, BALL, all_off, begun, kept, once
from tests.helpers.vehicles.crazyswarm_peer import Robot
from verify import certify, check_flight, load_flight_log
from verify.data.plan import Visit
from verify.recordings.flight_reference import FlightReference


def test_it_flies_the_mission_and_lands(world_and_script, capsys) -> None:
    world, script = world_and_script
    assert script.main(ACCEPTED) == 0
    assert begun(world)
    assert world.told[-1] == ("quad1", "disarm")
    assert all_off(world)
    said = capsys.readouterr().out
    assert "climb certified\nlanding certified\n" in said
    assert said.endswith("flown and landed\n")
    data = kept(script)
    assert list(data["starts"]) == ["climb", "way", "flight", "landing"] == list(data["ends"])
    assert data["reason"] == ""
    assert data["parameters"]["quad0"]["ctrlMel.mass"] == 0.033
    assert data["batteries"]["quad1"] == {"share": 0.9, "volt": 4.1}


def test_what_it_writes_is_judged_to_be_the_flight_and_older_ones_stay(script_in_world) -> None:
    mission = small_mission("F a", regions=BALL, starts=((0.0, 0.0, 0.6), (0.0, 1.0, 0.6)), margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([(0.0, 0.0, 0.6), (1.5, 0.0, 0.6)], speed=0.5), "r1": legs([(0.0, 1.0, 0.6)])})
    cert = certify(plan, team)
    _, script = script_in_world(team, cert)
    mine = script.FOLDER / "flown-001"
    mine.mkdir()
    (mine / "live.csv").write_text("older")
    assert script.main(ACCEPTED) == 0
    assert (mine / "live.csv").read_text() == "older"
    samples = load_flight_log(script.FOLDER / "flown-002" / "live.csv", mission)
    verdict = check_flight(samples, FlightReference.of_certificate(cert, team, plan), start=0.0, error=1e-6, max_speed=1.2)
    assert verdict.outcome == "holds", verdict.sentence


def test_where_crazyswarm2_is_not_one_sentence_says_so(certified, tmp_path, monkeypatch, capsys) -> None:
    flight.export(*certified, tmp_path, force=True)
    monkeypatch.setitem(sys.modules, "crazyflie_py", None)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "argv", ["fly_mission.py"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(tmp_path / "fly_mission.py"), run_name="__main__")
    assert ended.value.code == 1
    assert "crazyflie_py is not here: install crazyswarm2, and source its workspace" in capsys.readouterr().out


def test_robots_that_stand_on_a_table_land_on_it_or_on_the_floor(script_in_world) -> None:
    mission = small_mission("F a", regions=BALL, starts=((0.0, 0.0, 0.6), (0.0, 1.0, 0.6)), margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([(0.0, 0.0, 0.6), (1.5, 0.0, 0.6)]), "r1": legs([(0.0, 1.0, 0.6)])})
    world, script = script_in_world(team, certify(plan, team))
    for robot in world.robots.values():
        robot.place[2] = 0.15
    assert script.main(ACCEPTED) == 0
    assert [robot.place[2] for robot in world.robots.values()] == pytest.approx([0.0, 0.15])
    assert all(impact < 1.1 for impact in world.impacts.values()), "as from where a landing ends"


def test_a_mission_that_is_turned_and_moved_in_the_laboratory_is_watched_there(script_in_world) -> None:
    frame = "frame: {rotation_deg: 90, offset: [3.0, -1.0, 0.1]}"
    mission = small_mission("F a", regions=BALL, starts=((0.0, 0.0, 0.6), (0.0, 1.0, 0.6)), extra=frame, margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([(0.0, 0.0, 0.6), (1.5, 0.0, 0.6)]), "r1": legs([(0.0, 1.0, 0.6)])})
    world, script = script_in_world(team, certify(plan, team))
    for name, robot in world.robots.items():
        robot.place, robot.heading = mission.frame.to_laboratory(team[name].evaluate(0.0)[:3]) * (1, 1, 0), np.radians(90.0)
    assert script.main(ACCEPTED) == 0
    team_there = script.Team(json.loads((script.FOLDER / "flight.json").read_text()))
    rng, found = np.random.default_rng(0), set()
    for place in rng.uniform(-7.0, 7.0, (300, 3)):
        outside = float(np.max(np.abs(place) - 5.0))
        if abs(outside) > 0.02:
            fault = team_there.workspace_fault("r0", tuple(mission.frame.to_laboratory(place).tolist()))
            assert bool(fault) is (outside > 0.0)
            found.add(bool(fault))
    assert len(found) == 2


def test_a_robot_that_leaves_its_column_as_it_lands_is_told_at_the_end(world_and_script, capsys) -> None:
    world, script = world_and_script
    once(world, "land", lambda: world.off.update(quad1=np.array([0.07, 0.0, 0.0])), later=0.0)
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "stopped: all have landed, but in landing quad1 is 0.070 m from its plan; the margin is 0.05 m" in said
    assert "emergency" not in world.commands("all")
    assert all_off(world)


def test_motors_stop_by_the_landing_itself_and_robots_are_disarmed_where_they_stand(world_and_script) -> None:
    """Disarming in flight stops motors and planner: from 0.15 m the ground is met at 1.6 m/s."""
    world, script = world_and_script
    heights: dict[str, list[float]] = {name: [] for name in world.robots}
    for name, robot in world.robots.items():
        arm = robot.arm

        def disarm(on: bool, name=name, robot=robot, arm=arm) -> None:
            if not on:
                heights[name].append(float(robot.place[2]))
            arm(on)

        robot.arm = disarm
    assert script.main(ACCEPTED) == 0
    assert world.fell == []
    assert all(rows and max(rows) == 0.0 for rows in heights.values())
    assert all("landed" in robot.supervisor.said for robot in world.robots.values())
    assert all(world.impacts[name] < 1.1 for name in world.robots)


def test_where_no_supervisor_says_so_robots_are_disarmed_by_height_and_speed(world_and_script, monkeypatch) -> None:
    world, script = world_and_script
    monkeypatch.delattr(Robot, "get_status")
    assert script.main([*ACCEPTED, "--unchecked", "ready"]) == 0
    assert all_off(world)
    assert all(world.impacts[name] < 1.1 for name in world.robots)
