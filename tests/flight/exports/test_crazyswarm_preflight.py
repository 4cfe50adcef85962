"""Checks of the exported script for crazyswarm2 before anything spins, held against a stand-in for its Python client."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import flight
from tests.helpers.few import few_of
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.vehicles.crazyswarm_flights import ACCEPTED, BALL, all_off, begun, on_the_ground, once
from tests.helpers.vehicles.crazyswarm_peer import Robot
from verify import certify
from verify.data.plan import Visit


@pytest.mark.parametrize(("off", "climbs"), [(0.02, True), (0.03, False)])
def test_it_climbs_only_if_every_robot_is_within_half_a_margin(world_and_script, off, climbs, capsys) -> None:
    world, script = world_and_script
    world.off = dict.fromkeys(world.robots, np.array([0.0, off, 0.0]))
    assert script.main(ACCEPTED) == (0 if climbs else 1)
    assert begun(world) is climbs
    assert ("0.025 m are allowed: put it at (1.200, 0.900)" in capsys.readouterr().out) is not climbs
    assert all_off(world)


@few_of(
    8,
    ("wrong", "says"),
    [
        (lambda w: w.headings.update(quad1=0.4), "quad1's heading is 23 degrees off: turn it to 0 degrees"),
        (lambda w: w.levels.update(quad0=0.0), "quad0's battery lasts 0 s of the "),
        (lambda w: w.volts.update(quad0=3.5), "quad0's battery has 3.50 V: charge or change it"),
        (lambda w: w.supervisors.update(quad1=32), "quad1 is not ready: put it level"),
        (lambda w: w.supervisors.update(quad1=0), "quad1 is not ready: put it level"),
        (lambda w: w.supervisors.update(quad1=2), "quad1 is not ready: put it level"),
        (
            lambda w: w.stubborn.update({("quad1", "ctrlMel.mass"): 0.029}),
            "quad1: ctrlMel.mass is 0.029, not 0.033: look whether crazyswarm2 was started with the exported crazyflies.yaml",
        ),
        (lambda w: w.robots["quad1"].paramTypeDict.pop("ctrlMel.mass"), "quad1's firmware does not have ctrlMel.mass: update it"),
        (lambda w: setattr(w, "variances", lambda name, now: 0.01 * now * (name == "quad1")), "quad1's estimator has not settled"),
        (lambda w: setattr(w.robots["quad1"], "uri", w.robots["quad0"].uri), "two robots have one address"),
        (lambda w: w.volts.update(quad0=np.nan), "quad0's battery has nan V: charge or change it"),
        (lambda w: setattr(w, "variances", lambda name, now: np.nan), "quad1's estimator has not settled"),
        (lambda w: w.headings.update(quad1=np.nan), "quad1's heading is nan degrees off"),
        (lambda w: w.off.update(quad1=np.array([0.0, 0.0, -0.1])), "quad1 stands at z = -0.100 m: the ground is at z = 0"),
        (lambda w: w.off.update(quad1=np.array([0.06, 0.0, 0.0])), "quad1 is 0.060 m from below its start; 0.025 m are allowed: put it at "),
    ],
)  # fmt: skip
def test_nothing_spins_where_something_is_wrong(world_and_script, wrong, says, capsys) -> None:
    world, script = world_and_script
    wrong(world)
    assert script.main(ACCEPTED) == 1
    assert says in capsys.readouterr().out
    assert on_the_ground(world)


def test_a_restless_place_is_refused(world_and_script, capsys) -> None:
    world, script = world_and_script
    rng = np.random.default_rng(0)
    world.at = lambda now: world.off.update(quad0=np.array([*rng.uniform(-0.02, 0.02, 2), 0.0]))
    assert script.main(ACCEPTED) == 1
    assert "quad0's place wanders by 0.0" in capsys.readouterr().out
    assert on_the_ground(world)


def test_a_battery_that_does_not_last_is_refused(script_in_world, capsys) -> None:
    mission = small_mission("F a", regions=BALL, starts=((0.0, 0.0, 0.6),), margin=0.05)
    mission = mission.model_copy(update={"vehicle": mission.vehicle.changed(endurance=40.0)})
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([(0.0, 0.0, 0.6), (1.5, 0.0, 0.6)])})
    world, script = script_in_world(team, certify(plan, team))
    world.levels["r0"] = 40.0
    assert script.main(ACCEPTED) == 1
    assert "r0's battery lasts 16 s of the " in capsys.readouterr().out
    assert on_the_ground(world)
    world.levels["r0"] = 90.0
    once(world, "startTrajectory", lambda: world.levels.update(r0=30.0))
    assert script.main(ACCEPTED) == 1
    assert "r0's battery lasts 12 s more" in capsys.readouterr().out
    assert all_off(world)


def test_robots_that_stand_the_wrong_way_round_do_not_climb(world_and_script, capsys) -> None:
    """Their go-to's to the starts would lead through each other."""
    world, script = world_and_script
    one, other = world.robots["quad0"], world.robots["quad1"]
    one.place, other.place = other.place, one.place
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "quad0 is 1.800 m from below its start, and is where quad1 belongs" in said
    assert on_the_ground(world)


def test_a_robot_that_nobody_sees_does_not_climb(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.silent_from["quad1"] = 0.0
    assert script.main(ACCEPTED) == 1
    assert "no position from quad1 within 5 s: is it seen by motion capture under its name?" in capsys.readouterr().out
    assert on_the_ground(world)


def test_two_robots_that_are_one_body_do_not_climb(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.robots["quad1"].place = world.robots["quad0"].place
    assert script.main(ACCEPTED) == 1
    assert "quad0 and quad1 are measured at one place" in capsys.readouterr().out


def test_an_older_client_is_flown_with_and_what_it_does_not_tell_has_to_be_accepted(
    world_and_script, monkeypatch, capsys
) -> None:
    world, script = world_and_script
    for name in ("poseStamped", "get_status", "getParam", "setParam"):
        monkeypatch.delattr(Robot, name)
    monkeypatch.setitem(sys.modules, "crazyflie_interfaces.msg", None)
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert said.endswith(
        "add --unchecked age --unchecked heading --unchecked ready --unchecked estimator --unchecked parameters to fly without that\n"
    )
    assert on_the_ground(world)
    assert script.main([part for name in script.NAMES for part in ("--unchecked", name)]) == 0
    assert all_off(world)
    said = capsys.readouterr().out
    for what in (
        "how old quad0's positions are: this version of crazyswarm2 does not date them",
        "whether quad0's estimator has settled: its variances are not reported",
        "whether quad0 is ready: no `status` is reported of it",
        "the heading of quad1: it is not reported",
        "the parameters of quad1: crazyswarm2 lists none of them",
    ):
        assert f"not checked: {what}" in said
    kept_there = json.loads((script.FOLDER / "flown-002" / "live.json").read_text())
    assert any("not checked: the heading of quad0" in event["sentence"] for event in kept_there["events"])
    monkeypatch.delattr(Robot, "get_position")
    assert script.main(ACCEPTED) == 1
    assert "this version of crazyswarm2 measures no positions: update it" in capsys.readouterr().out


@pytest.fixture
def stacked(script_in_world):
    """Robots whose starts and ends are too near to each other, seen from above."""
    starts = ((0.0, 0.0, 0.6), (0.2, 0.0, 1.4))
    mission = small_mission("F a", regions=BALL, starts=starts, margin=0.05)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([starts[0], (1.5, 0.0, 0.6), starts[0]]), "r1": legs([starts[1]])})
    return script_in_world(team, certify(plan, team))


def test_robots_whose_starts_are_above_each_other_do_not_climb(stacked, capsys) -> None:
    world, script = stacked
    assert script.main(ACCEPTED) == 1
    said = capsys.readouterr().out
    assert "stopped: climb not certified: r0 and r1 start too near to each other, seen from above" in said
    assert script.main([*ACCEPTED, "--hovering"]) == 1
    said = capsys.readouterr().out
    assert "stopped: landing not certified: r0 and r1 end too near to each other, seen from above; add --watch-landing" in said
    assert world.told == []
    note = (script.FOLDER / "README.txt").read_text()
    assert "Climb not certified: r0 and r1 start too near" in note
    assert "  * the landing, as said above;" in note


def test_robots_that_hover_at_their_starts_already_fly_from_there(stacked) -> None:
    world, script = stacked
    assert script.main([*ACCEPTED, "--hovering", "--watch-landing"]) == 1, "they stand on the ground"
    assert on_the_ground(world)
    for name, place in {"r0": [0.0, 0.0, 0.6], "r1": [0.2, 0.0, 1.4]}.items():
        world.robots[name].hover(place)
    assert script.main([*ACCEPTED, "--hovering", "--watch-landing"]) == 0
    assert "takeoff" not in world.commands("r0")
    assert begun(world)
    assert all_off(world)


def test_a_robot_that_crazyswarm2_does_not_know_is_named_before_anything_spins(world_and_script, capsys) -> None:
    world, script = world_and_script
    del world.robots["quad1"]
    assert script.main(ACCEPTED) == 1
    assert "crazyswarm2 does not know quad1; it knows quad0" in capsys.readouterr().out
    assert world.told == []


def test_a_robot_that_does_not_arm_leaves_all_on_the_ground(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.supervisors["quad1"] = 1  # could be armed, and never is
    assert script.main(ACCEPTED) == 1
    assert "stopped: quad1 did not arm" in capsys.readouterr().out
    assert not any(command in ("takeoff", "goTo", "land") for _, command in world.told)
    assert all_off(world)


def test_a_margin_that_measurements_use_up_is_refused(script_in_world, capsys) -> None:
    mission = small_mission("F a", regions=BALL, starts=((0.0, 0.0, 0.6),), margin=0.02)
    plan = plan_of(mission, {"r0": (Visit(region="a"),)})
    team = flight.with_hovers({"r0": legs([(0.0, 0.0, 0.6), (1.5, 0.0, 0.6)])})
    world, script = script_in_world(team, certify(plan, team))
    assert script.main(ACCEPTED) == 1
    assert (
        "stopped: the margin is 0.02 m, and a measurement may be off by 0.01 m: a margin above 0.02 m leaves"
        in capsys.readouterr().out
    )
    assert world.told == []


@pytest.fixture
def brushless(certified, script_in_world):
    """Robots that have to be armed, and whose motors spin up then."""

    def make(spin_up: float = 0.26):
        world, script = script_in_world(*certified)
        for name, robot in list(world.robots.items()):
            world.robots[name] = Robot(name, world, robot.place, brushless=True, spin_up=spin_up)
        return world, script

    return make


def test_brushless_robots_climb_once_their_motors_have_spun_up(brushless) -> None:
    world, script = brushless()
    assert script.main(ACCEPTED) == 0
    assert world.busy == [], "no command came before it could fly"
    assert all_off(world)


def test_motors_that_do_not_spin_up_leave_all_on_the_ground(brushless, capsys) -> None:
    world, script = brushless(np.inf)
    assert script.main(ACCEPTED) == 1
    assert "quad0, quad1 " in (said := capsys.readouterr().out)
    assert "did not spin up: look at what its supervisor says" in said or "did not arm" in said
    assert "takeoff" not in world.commands("quad0")
    assert all_off(world)
