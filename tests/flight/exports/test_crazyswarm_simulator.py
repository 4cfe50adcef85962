"""The exported script with a stand-in for crazyswarm2's own simulator, which has tf and nothing else to see robots by."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flight
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.vehicles.crazyswarm_simulator import BELIEVED, MASS, SimulatedRobot, SimulatedWorld
from verify import certify, check_flight, load_flight_log
from verify.data.plan import Visit
from verify.recordings.flight_reference import FlightReference

pytestmark = pytest.mark.slow

BALL = "a: {center: [1.0, 0.0, 0.6], radii: [0.2, 0.2, 0.2]}"
STARTS = ((0.0, 0.0, 0.6), (0.0, 1.0, 0.6))
ACCEPTED = [part for name in ("ready", "estimator", "battery", "parameters") for part in ("--unchecked", name)]


@pytest.fixture
def simulated(script_in_world):
    """A certified mission, the robots of the simulator, and the script that flies it there."""

    def make(**more):
        mission = small_mission("F a", regions=BALL, starts=STARTS, margin=0.05)
        plan = plan_of(mission, {"r0": (Visit(region="a"),)})
        team = flight.with_hovers({"r0": legs([STARTS[0], (1.0, 0.0, 0.6)], speed=0.3), "r1": legs([STARTS[1]])})
        cert = certify(plan, team)
        world, script = script_in_world(team, cert, SimulatedWorld(**more), SimulatedRobot)
        world.fly(mission)
        return FlightReference.of_certificate(cert, team, plan), world, script

    return make


def test_an_export_is_flown_in_crazyswarm2s_simulator_inside_its_tube(simulated, capsys) -> None:
    asked, world, script = simulated()
    assert script.main(ACCEPTED) == 0, capsys.readouterr().out
    said = capsys.readouterr().out
    assert "the simulator's controller takes no mass: heights are asked higher by r0 " in said
    (folder,) = script.FOLDER.glob("flown-*")
    samples = load_flight_log(folder / "live.csv", asked.mission)
    verdict = check_flight(samples, asked, start=0.0, error=1e-3, max_speed=1.0)
    assert verdict.outcome == "holds", verdict.sentence
    assert all(robot.place[2] < 0.1 for robot in world.robots.values())
    assert world.messages > 1900 * world.now, "as often as the simulator steps"
    worst = json.loads((folder / "live.json").read_text())["worst"]["flight"]
    lacks = (MASS - BELIEVED) * 9.81 / 1.25
    assert lacks > 0.025, "without it nobody would be within half a margin of its start"
    assert max(worst.values()) < 0.045


def test_what_the_simulator_does_not_know_has_to_be_accepted(simulated, capsys) -> None:
    _, world, script = simulated()
    assert script.main([]) == 1
    said = capsys.readouterr().out
    assert "add --unchecked ready --unchecked estimator --unchecked battery --unchecked parameters to fly without that" in said
    assert "takeoff" not in world.commands("r0")


def test_a_script_that_does_not_go_by_the_simulators_clock_takes_no_pose_from_tf(simulated, capsys) -> None:
    """Motion capture publishes tf of real robots, too, whose heights must not be asked higher."""
    _, world, script = simulated(simulated_clock=False)
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "no position from r0, r1 within 5 s" in said
    assert "in crazyswarm2's simulator, which has only tf, add --ros-args -p use_sim_time:=True" in said
    assert "takeoff" not in world.commands("r0")


def test_robots_that_do_not_come_to_hover_at_their_starts_land(simulated, capsys) -> None:
    _, world, script = simulated(believed=0.004)
    assert script.main(ACCEPTED) == 1
    assert "do not come to hover at their starts in the simulator" in capsys.readouterr().out
    assert world.commands("all").count("startTrajectory") == 0
    assert np.all([robot.place[2] < 0.1 for robot in world.robots.values()])
