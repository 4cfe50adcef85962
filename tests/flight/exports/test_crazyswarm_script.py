"""The script that flies a mission with crazyswarm2, held against a stand-in for its Python client."""

from __future__ import annotations

import json
import pathlib
import re
import runpy
import signal
import sys

import numpy as np
import pytest

import flight
from tests.helpers.crazyswarm_peer import Robot, World
from tests.helpers.few import few_of
from tests.helpers.flights import legs, plan_of, small_mission
from verify import certify, check_flight, load_flight_log
from verify.data.plan import Visit
from verify.recordings.flight_reference import FlightReference

BALL = "a: {center: [1.5, 0.0, 0.6], radii: [0.2, 0.2, 0.2]}"


@pytest.fixture
def world_and_script(certified, script_in_world):
    """The exported script, and robots that stand below their starts."""
    return script_in_world(*certified)


def begun(world: World) -> bool:
    return "startTrajectory" in world.commands("all")


def on_the_ground(world: World) -> bool:
    return not any(command in ("arm", "takeoff", "goTo") for _, command in world.told)


ACCEPTED = ["--unchecked", "battery"]  # the shipped Crazyflies have no endurance


def all_off(world: World) -> bool:
    """Whether motors stand still, and nobody's were cut in the air."""
    return not any(robot.spinning for robot in world.robots.values()) and not world.armed and not world.fell


def once(world: World, after: str, do, later: float = 0.3) -> None:
    """Have something happen once, some time after a command was told."""
    since: list[float] = []

    def at(now: float) -> None:
        if not since and any(command == after for _, command in world.told):
            since.append(now + later)
        if since and since[0] <= now:
            since[0] = np.inf
            do()

    world.at = at


def interrupt(error: type[BaseException] = KeyboardInterrupt):
    def do() -> None:
        raise error

    return do


def kept(script) -> dict:
    (folder,) = script.FOLDER.glob("flown-*")
    return json.loads((folder / "live.json").read_text())


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


def test_a_robot_that_crazyswarm2_does_not_know_is_named_before_anything_spins(world_and_script, capsys) -> None:
    world, script = world_and_script
    del world.robots["quad1"]
    assert script.main(ACCEPTED) == 1
    assert "crazyswarm2 does not know quad1; it knows quad0" in capsys.readouterr().out
    assert world.told == []


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


def test_a_robot_that_does_not_arm_leaves_all_on_the_ground(world_and_script, capsys) -> None:
    world, script = world_and_script
    world.supervisors["quad1"] = 1  # could be armed, and never is
    assert script.main(ACCEPTED) == 1
    assert "stopped: quad1 did not arm" in capsys.readouterr().out
    assert not any(command in ("takeoff", "goTo", "land") for _, command in world.told)
    assert all_off(world)


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


@few_of(1, "later", [0.1, 1.0, 2.0, 4.0])
def test_an_interruption_at_any_time_of_a_landing_lets_nobody_fall_or_rise(world_and_script, later) -> None:
    world, script = world_and_script
    once(world, "land", interrupt(), later=later)
    assert script.main(ACCEPTED) == 1
    assert all_off(world)
    assert all(robot.supervisor.said.count("landed") == 1 for robot in world.robots.values()), (
        "who stands is not told to land again"
    )
