"""Flights of the exported script for crazyswarm2 that something ends early: alarms, errors and interruptions."""

from __future__ import annotations

import json
import pathlib
import re
import signal
import sys

import numpy as np
import pytest

import flight
from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.vehicles.crazyswarm_flights import ACCEPTED, BALL, all_off, interrupt, kept, on_the_ground, once
from tests.helpers.vehicles.crazyswarm_peer import Robot
from verify import certify
from verify.data.plan import Visit


def test_a_robot_that_leaves_the_margin_in_flight_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script
    once(world, "startTrajectory", lambda: world.off.update(quad1=np.array([0.0, 0.0, 0.06])))
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "stopped: quad1 is 0.0" in said
    assert "flown" not in said.replace("flown-001", "")
    assert [command for command in world.commands("quad0") if command != "disarm"][-4:] == ["goTo", "land", "land", "land"]
    assert all_off(world)


def test_robots_that_come_too_near_to_each_other_land(script_in_world, capsys) -> None:
    starts = ((0.0, 0.0, 0.6), (0.0, 0.55, 0.6))
    mission = small_mission("F a", regions=BALL, starts=starts, margin=0.1)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([starts[0], (1.5, 0.0, 0.6)]), "r1": legs([starts[1]])})
    world, script = script_in_world(team, certify(plan, team))
    path = script.FOLDER / "flight.json"
    data = json.loads(path.read_text())
    data["separation"] = [["r0", "r1", 0.5]]
    path.write_text(json.dumps(data))
    once(world, "startTrajectory", lambda: world.off.update(r1=np.array([0.0, -0.06, 0.0])), later=0.0)
    assert script.main(ACCEPTED) == 1
    assert re.search(r"(r0 and r1|r1 and r0) are 0\.4\d+ m apart, and 0\.500 m are asked", capsys.readouterr().out)
    assert all_off(world)


def test_a_robot_outside_of_the_workspace_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script
    path = script.FOLDER / "flight.json"
    data = json.loads(path.read_text())
    assert data["workspace"]["low"] == 0.2
    data["workspace"]["high"] = 0.75
    path.write_text(json.dumps(data))
    assert script.main(ACCEPTED) == 1
    assert "m outside of the workspace" in capsys.readouterr().out
    assert all_off(world)


def test_a_robot_without_positions_lands_the_team_which_does_not_hold_then(world_and_script, capsys) -> None:
    world, script = world_and_script

    def lose() -> None:
        world.silent_from["quad0"] = world.now

    once(world, "startTrajectory", lose)
    assert script.main(ACCEPTED) == 1
    assert "quad0 was not seen for 0.2 s" in capsys.readouterr().out
    after = world.told[world.told.index(("all", "startTrajectory")) :]
    assert ("quad1", "goTo") not in after
    assert all(("land" in world.commands(name)) for name in world.robots)


def test_a_tumbled_robot_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script
    once(world, "startTrajectory", lambda: setattr(world.robots["quad0"].supervisor, "tumbled", True))
    assert script.main(ACCEPTED) == 1
    assert "stopped: quad0 has tumbled, or is locked" in capsys.readouterr().out
    assert all_off(world)


def test_a_robot_that_does_not_land_is_told_again_and_its_motors_are_stopped(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.deaf.add("quad1")
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "quad1 is not known to stand: watch it" in said
    assert world.commands("quad1").count("land") > 3
    assert "emergency" in world.commands("all")
    assert all_off(world)


@few_of(2, "after", ["arm", "takeoff", "goTo", "startTrajectory"])
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_every_way_out_lands(world_and_script, after, error, capsys) -> None:
    world, script = world_and_script
    once(world, after, interrupt(error))
    assert script.main(ACCEPTED) == 1
    assert f"stopped: {error.__name__}" in capsys.readouterr().out
    assert all_off(world)
    assert "emergency" not in world.commands("all")
    assert kept(script)["reason"].startswith(error.__name__)


def test_an_interruption_while_all_land_as_planned_has_them_go_on_landing(world_and_script) -> None:
    world, script = world_and_script
    once(world, "land", interrupt(), later=0.05)
    assert script.main(ACCEPTED) == 1
    assert "emergency" not in world.commands("all")
    assert all_off(world)


def test_a_second_interruption_stops_all_motors(world_and_script, capsys) -> None:
    world, script = world_and_script

    def first() -> None:
        once(world, "goTo", interrupt(), later=0.5)  # while they hold
        raise KeyboardInterrupt

    once(world, "startTrajectory", first)
    assert script.main(ACCEPTED) == 1
    assert world.commands("all").count("emergency") == 3
    assert "all motors are stopped" in capsys.readouterr().out
    assert not any(robot.spinning for robot in world.robots.values())


def test_an_interruption_before_the_climb_leaves_all_disarmed_on_the_ground(world_and_script) -> None:
    world, script = world_and_script
    world.at = lambda now: interrupt()() if now > 0.5 else None
    assert script.main(ACCEPTED) == 1
    assert on_the_ground(world)


def test_sigterm_is_taken_as_an_interruption(world_and_script) -> None:
    world, script = world_and_script
    once(world, "startTrajectory", lambda: signal.raise_signal(signal.SIGTERM))
    assert script.main(ACCEPTED) == 1
    assert all_off(world)


def test_a_computer_that_is_too_busy_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script

    def hang() -> None:
        world.now += 0.5

    once(world, "startTrajectory", hang)
    assert script.main(ACCEPTED) == 1
    assert "nobody was looked at for 0.5" in capsys.readouterr().out
    assert all_off(world)


def test_a_script_that_is_killed_has_written_what_happened_until_then(world_and_script) -> None:
    world, script = world_and_script
    seen: list[tuple[int, dict]] = []

    def look() -> None:
        (folder,) = script.FOLDER.glob("flown-*")
        seen.append((len((folder / "poses.csv").read_text().splitlines()), json.loads((folder / "live.json").read_text())))

    once(world, "startTrajectory", look)
    script.main(ACCEPTED)
    ((rows, data),) = seen
    assert rows > 100
    assert list(data["starts"]) == ["climb", "way", "flight"]
    assert data["reason"] == "it was not ended by the script itself"


def test_a_disk_that_is_full_keeps_nobody_from_landing(world_and_script, monkeypatch, capsys) -> None:
    world, script = world_and_script

    def fill() -> None:
        def full(*_given, **_named):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(sys.modules["flying.record"].Record, "_append", full)
        monkeypatch.setattr(pathlib.Path, "write_text", full)

    once(world, "startTrajectory", fill)
    assert script.main(ACCEPTED) == 0
    assert capsys.readouterr().out.count("cannot be written to") == 1
    assert all_off(world)


def test_an_error_while_robots_brake_has_them_land(world_and_script, monkeypatch) -> None:
    world, script = world_and_script

    def fail(*_given) -> None:
        raise RuntimeError("no")

    def lose() -> None:
        monkeypatch.setattr(Robot, "goTo", fail)
        raise KeyboardInterrupt

    once(world, "startTrajectory", lose)
    assert script.main(ACCEPTED) == 1
    assert "emergency" not in world.commands("all")
    assert all_off(world)


@few_of(1, "later", [0.1, 1.0, 2.0, 4.0])
def test_an_interruption_at_any_time_of_a_landing_lets_nobody_fall_or_rise(world_and_script, later) -> None:
    world, script = world_and_script
    once(world, "land", interrupt(), later=later)
    assert script.main(ACCEPTED) == 1
    assert all_off(world)
    assert all(robot.supervisor.said.count("landed") == 1 for robot in world.robots.values()), (
        "who stands is not told to land again"
    )
