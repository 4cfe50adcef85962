"""The script that flies a mission with crazyswarm2, held against a stand-in for its Python client."""

from __future__ import annotations

import runpy
import signal
import sys

import numpy as np
import pytest

import flight
from tests.helpers.crazyswarm_peer import World
from tests.helpers.flights import legs, plan_of, small_mission
from verify import certify
from verify.data.plan import Visit


@pytest.fixture
def world_and_script(certified, script_in_world):
    """The exported script, and robots that stand below their starts."""
    return script_in_world(*certified)


def begun(world: World) -> bool:
    return "startTrajectory" in world.commands("all")


def interrupt_at(world: World, *times: float, error: type[BaseException] = KeyboardInterrupt) -> None:
    left = list(times)

    def at(now: float) -> None:
        if left and now >= left[0]:
            left.pop(0)
            raise error

    world.at = at


def test_it_flies_the_mission_and_lands(world_and_script, capsys) -> None:
    world, script = world_and_script
    assert script.main() == 0
    assert begun(world)
    assert world.commands("all")[-4:] == ["land"] * 3 + ["disarm"]
    assert not any(robot.spinning for robot in world.robots.values())
    assert "flown and landed" in capsys.readouterr().out


def test_where_crazyswarm2_is_not_one_sentence_says_so(certified, tmp_path, monkeypatch) -> None:
    flight.export(*certified, tmp_path, anyway=True)
    monkeypatch.setitem(sys.modules, "crazyflie_py", None)
    with pytest.raises(SystemExit, match="crazyflie_py is not here: install crazyswarm2, and source its workspace"):
        runpy.run_path(str(tmp_path / "fly_mission.py"), run_name="__main__")


@pytest.mark.parametrize(("off", "starts"), [(0.02, True), (0.03, False)])
def test_it_starts_only_if_every_robot_is_within_half_a_margin(world_and_script, off, starts, capsys) -> None:
    world, script = world_and_script
    world.off = dict.fromkeys(world.robots, np.array([0.0, off, 0.0]))
    assert script.main() == (0 if starts else 1)
    assert begun(world) is starts
    assert ("too far" in capsys.readouterr().out) is not starts
    assert not any(robot.spinning for robot in world.robots.values())


def on_the_ground(world: World) -> bool:
    return not any(command in ("arm", "takeoff", "goTo") for _, command in world.told)


def test_robots_that_stand_the_wrong_way_round_do_not_climb(world_and_script, capsys) -> None:
    """Their go-to's to the starts would lead through each other."""
    world, script = world_and_script
    one, other = world.robots["quad0"], world.robots["quad1"]
    one.place, other.place = other.place, one.place
    assert script.main() == 1
    said = capsys.readouterr().out
    assert "quad0 stands " in said
    assert ", where quad1 belongs: put it at " in said
    assert on_the_ground(world)


def test_a_robot_that_stands_elsewhere_does_not_climb(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.off["quad1"] = np.array([0.06, 0.0, 0.0])
    assert script.main() == 1
    assert "quad1 stands 0.060 m from there: put it at " in capsys.readouterr().out
    assert on_the_ground(world)


def test_a_robot_that_nobody_sees_does_not_climb(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.silent_from["quad1"] = 0.0
    assert script.main() == 1
    assert "no position from quad1 within 5 s: is it seen by motion capture under its name?" in capsys.readouterr().out
    assert on_the_ground(world)


def test_robots_whose_starts_are_above_each_other_do_not_climb(script_in_world, capsys) -> None:
    ball = "a: {center: [1.5, 0.0, 0.6], radii: [0.2, 0.2, 0.2]}"
    starts = ((0.0, 0.0, 0.6), (0.2, 0.0, 1.4))
    mission = small_mission("F a", regions=ball, starts=starts, margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = {"r0": legs([starts[0], (1.5, 0.0, 0.6)]), "r1": legs([starts[1]])}
    team = flight.with_hovers(team)
    world, script = script_in_world(team, certify(plan, team))
    assert script.main() == 1
    assert "r0 and r1 start above each other and cannot climb there straight up" in capsys.readouterr().out
    assert on_the_ground(world)


def test_a_robot_that_leaves_the_margin_in_flight_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script

    def at(now: float) -> None:
        if now > 9.2:  # in flight since 8.5 s
            world.off["quad1"] = np.array([0.0, 0.0, 0.06])

    world.at = at
    assert script.main() == 1
    said = capsys.readouterr().out
    assert "stopped: quad1 is 0.0" in said
    assert "flown" not in said
    assert not any(robot.spinning for robot in world.robots.values())


def test_a_robot_without_positions_lands_the_team(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.silent_from["quad0"] = 8.9
    assert script.main() == 1
    assert "no position from quad0" in capsys.readouterr().out
    assert world.now < 16.0
    assert not any(robot.spinning for robot in world.robots.values())


@pytest.mark.parametrize("when", [2.0, 6.0, 9.0])
@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_every_way_out_lands(world_and_script, when, error, capsys) -> None:
    world, script = world_and_script
    interrupt_at(world, when, error=error)
    assert script.main() == 1
    assert f"stopped: {error.__name__}" in capsys.readouterr().out
    assert not any(robot.spinning for robot in world.robots.values())
    assert "emergency" not in world.commands("all")


def test_a_second_interruption_stops_all_motors(world_and_script, capsys) -> None:
    world, script = world_and_script
    interrupt_at(world, 9.0, 9.05)
    assert script.main() == 1
    assert world.commands("all").count("emergency") == 3
    assert "all motors are stopped" in capsys.readouterr().out
    assert not any(robot.spinning for robot in world.robots.values())


def test_an_interruption_before_the_climb_leaves_all_disarmed_on_the_ground(world_and_script) -> None:
    world, script = world_and_script
    interrupt_at(world, 0.5)
    assert script.main() == 1
    assert not any(command == "takeoff" for _, command in world.told)
    assert not world.armed


def test_a_robot_that_crazyswarm2_does_not_know_is_named_before_anything_spins(world_and_script, capsys) -> None:
    world, script = world_and_script
    del world.robots["quad1"]
    assert script.main() == 1
    assert "crazyswarm2 does not know quad1" in capsys.readouterr().out
    assert world.told == []


def test_sigterm_is_taken_as_an_interruption(world_and_script) -> None:
    world, script = world_and_script
    world.at = lambda now: signal.raise_signal(signal.SIGTERM) if 9.0 <= now < 9.01 else None
    assert script.main() == 1
    assert not any(robot.spinning for robot in world.robots.values())
