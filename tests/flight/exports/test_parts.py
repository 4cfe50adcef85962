"""Flights in parts, as they are exported: the bytes of each part, and scripts that upload them while robots hover."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flight
from flight.exports.crazyflies.compressed import COMPRESSED, compressed_bytes
from tests.helpers.motion.flights import legs, plan_of, small_mission
from tests.helpers.vehicles.trajectory_memory import Vehicle
from verify import certify
from verify.data import BadInput, DoesNotFit, Trajectory
from verify.data.files.trajectory_csv import read_csv
from verify.data.plan import Visit

BALLS = "a: {center: [1.0, 0.0, 1.0], radii: [0.2, 0.2, 0.2]}\nb: {center: [0.0, 1.0, 1.0], radii: [0.2, 0.2, 0.2]}"
POINTS = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def cut(path: Trajectory, *cuts: int) -> Trajectory:
    return Trajectory(path.durations, path.coefficients, cycle=path.cycle, cuts=cuts)


@pytest.fixture(scope="module")
def team():
    """Two robots, the second one beside the first, in two parts."""
    starts = ((0.0, 0.0, 1.0), (0.0, -2.5, 1.0))
    mission = small_mission("F a & F b", regions=BALLS, margin=0.05, starts=starts)
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b")]})
    paths = {"r0": cut(legs(POINTS), 2), "r1": cut(legs([np.add(point, (0, -2.5, 0)) for point in POINTS]), 2)}
    return paths, certify(plan, paths)


@pytest.fixture(scope="module")
def patrol():
    """One robot, three laps of two pieces behind a prefix of one."""
    mission = small_mission("G F a & G F b", regions=BALLS, margin=0.05, trace="infinite")
    mission = mission.model_copy(update={"spec": mission.spec.model_copy(update={"repeat": 3})})
    plan = plan_of(mission, {"r0": [Visit(region="a"), Visit(region="b"), Visit(region="a")]})
    robot = plan.robots["r0"].model_copy(update={"cycle_visit": 1, "cycle_waypoint": 0})
    path = {"r0": cut(legs([POINTS[0], POINTS[1], POINTS[3], POINTS[1]], cycle=1), 1)}
    return path, certify(plan.model_copy(update={"robots": {"r0": robot}}), path)


def test_each_part_is_a_file_of_two_pieces_at_least(team, tmp_path) -> None:
    paths, cert = team
    done = flight.export(paths, cert, tmp_path, force=True)
    names = {path.name for path in done.files}
    assert names >= {"r0-part1.csv", "r0-part2.csv", "r1-part1.csv", "r1-part2.csv", "fly_mission.py"}
    assert "r0.csv" not in names
    for name, path in paths.items():
        first, second = (read_csv((tmp_path / f"{name}-part{k}.csv").read_text()) for k in (1, 2))
        assert first == path.part(0, 2)
        assert second.coefficients[:1].tolist() == path.coefficients[2:].tolist()
        assert not second.coefficients[1, :, 1:].any()
        assert np.abs(second.evaluate(second.duration) - path.evaluate(path.duration)).max() < 1e-6
    note = (tmp_path / "README.txt").read_text()
    assert "flown in this order: 1, 2." in note
    assert "hold by a go-to" in note


def test_the_script_flies_part_by_part_and_uploads_while_robots_hover(team, script_in_world, capsys) -> None:
    world, script = script_in_world(*team)
    assert script.main(["--unchecked", "battery"]) == 0
    assert world.commands("all") == ["arm"] + ["startTrajectory"] * 2
    flown = [command for command in world.commands("r0") if not command.startswith("set ")]
    assert flown == ["takeoff"] + ["goTo"] * 5 + ["land"] * 3 + ["disarm"] * 3
    assert len(world.robots["r0"].uploads) == 2
    assert np.allclose(world.robots["r0"].place[:2], POINTS[-1][:2], atol=1e-5)
    said = capsys.readouterr().out
    assert "flown and landed" in said
    (pause,) = map(float, said.split("pauses between parts, in s: ")[1].splitlines()[0].split(","))
    assert 1.6 < pause < 2.0
    (folder,) = script.FOLDER.glob("flown-*")
    (_, ended), (began, _) = json.loads((folder / "live.json").read_text())["parts"]["flight"]
    assert began - ended == pytest.approx(pause, abs=1e-3)


def test_a_lap_is_uploaded_once_and_started_again(patrol, script_in_world, capsys) -> None:
    world, script = script_in_world(*patrol)
    assert json.loads((script.FOLDER / "flight.json").read_text())["order"] == [0, 1, 1, 1]
    assert script.main(["--unchecked", "battery"]) == 0
    assert world.commands("all").count("startTrajectory") == 4
    assert len(world.robots["r0"].uploads) == 2


def test_no_part_is_started_by_robots_that_are_elsewhere(team, script_in_world, capsys) -> None:
    world, script = script_in_world(*team)

    def at(_now: float) -> None:
        if len(world.robots["r1"].uploads) == 2:  # between the parts; within the margin, but not where the next one begins
            world.off["r1"] = np.array([0.0, 0.0, 0.03])

    world.at = at
    assert script.main(["--unchecked", "battery"]) == 1
    assert world.commands("all").count("startTrajectory") == 1
    assert "r1 is 0.030 m from the start; 0.025 m are allowed" in capsys.readouterr().out
    assert not any(robot.spinning for robot in world.robots.values())


def test_who_pauses_for_too_long_lands(team, script_in_world, capsys) -> None:
    world, script = script_in_world(*team)
    path = script.FOLDER / "flight.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"pause": 1.0}))
    assert script.main(["--unchecked", "battery"]) == 1
    assert "the pause before part 2 of 2 lasted more than 1 s" in capsys.readouterr().out
    assert not any(robot.spinning for robot in world.robots.values())


def test_parts_that_no_crazyflie_holds_are_refused(tmp_path) -> None:
    mission = small_mission("F a", regions=BALLS, margin=0.05)
    mission = mission.model_copy(update={"vehicle": mission.vehicle.changed(pieces=64)})
    there = [[k % 2, 0, 1] for k in range(36)]
    path = {"r0": cut(legs(there), 33)}
    visits = [Visit(region="a")] * 18
    cert = certify(plan_of(mission, {"r0": visits}), path)
    with pytest.raises(DoesNotFit, match=r"r0-part1 has 33 pieces; the vehicle's memory holds 31"):
        flight.export(path, cert, tmp_path, force=True)


@pytest.mark.parametrize(
    ("target", "says"),
    [
        ("crazyswarm2", r"r0 has 6 pieces; the vehicle's memory holds 4 by the mission's `pieces`\. Stream it"),
        ("crazyflie", r"r0 has 6 pieces; the vehicle's memory holds 4 by the mission's `pieces`\. Stream it"),
        ("crazyflie-compressed", r"r0 takes \d+ bytes .* the vehicle's trajectory memory of 528 bytes"),
    ],
)
def test_a_flight_that_the_missions_own_pieces_do_not_hold_is_refused(target, says, tmp_path) -> None:
    mission = small_mission("F a", regions=BALLS, margin=0.05)
    mission = mission.model_copy(update={"limits": mission.limits.model_copy(update={"pieces": 4})})
    path = legs([[k % 2, 0, 1] for k in range(7)])
    team = flight.quantised({"r0": path}) if target == "crazyflie-compressed" else {"r0": path}
    cert = certify(plan_of(mission, {"r0": [Visit(region="a")] * 3}), team)
    with pytest.raises(DoesNotFit, match=says):
        flight.export(team, cert, tmp_path, format=target, force=True)
    assert flight.export(team, cert, tmp_path / "streamed", format="px4", force=True).files


def test_a_vehicle_flies_the_parts_from_its_memory_as_certified(tmp_path) -> None:
    """40 pieces through 4096 bytes, behind cflib's own memory element: the set-points are the certified path with a pause in it."""
    pytest.importorskip("cflib", reason="cflib is not installed")
    there = [[(k % 2), 0.1 * (k // 2), 1] for k in range(41)]
    path = cut(legs(there), 20)
    mission = small_mission("true", regions="far: {center: [4.0, 4.0, 4.0], radii: [0.2, 0.2, 0.2]}", margin=0.05)
    flight.export({"r0": path}, certify(plan_of(mission, {}), {"r0": path}), tmp_path, format="crazyflie", force=True)
    first, second = (flight.upload(tmp_path, {"r0": "radio://0/80/2M"}, dry_run=True, part=part)[0].entry for part in (1, 2))
    assert (first.pieces, second.pieces) == (20, 20)
    vehicle, pause, end = Vehicle(), 7.0, float(path.knots[20])
    vehicle.upload(first)
    vehicle.start(0, 0.0)
    for now in np.linspace(0.0, end + 1.0, 400):
        assert np.abs(vehicle.set_point(now) - path.evaluate(min(now, end))).max() < 2e-5
    careless = Vehicle(vehicle.memory[:], vehicle.trajectory)
    careless.upload(second)
    assert np.abs(careless.set_point(end + 1.0) - path.evaluate(end)).max() > 0.5, "it jumps: its memory was written under it"
    vehicle.go_to(path.evaluate(end))
    vehicle.upload(second)
    assert np.abs(vehicle.set_point(end + pause) - path.evaluate(end)).max() < 2e-5
    vehicle.start(0, end + pause)
    for now in np.linspace(end, path.duration, 400):
        assert np.abs(vehicle.set_point(now + pause) - path.evaluate(now)).max() < 2e-5


def test_parts_of_an_upload_are_named(team, tmp_path) -> None:
    flight.export(*team, tmp_path, format="crazyflie", force=True)
    uris = {"r0": "radio://0/80/2M/E7E7E7E701", "r1": "radio://0/80/2M/E7E7E7E702"}
    for part in (1, 2):
        for item in flight.upload(tmp_path, uris, dry_run=True, part=part):
            assert item.data == (tmp_path / f"{item.robot}-part{part}.bin").read_bytes()
    with pytest.raises(BadInput, match="it has 2 parts, and no part 3"):
        flight.upload(tmp_path, uris, dry_run=True, part=3)
    written = json.loads((tmp_path / "upload.json").read_text())
    assert (written["order"], written["pause"]) == ([1, 2], 60.0)


def test_nobody_is_flown_without_the_pauses_of_the_others(team, tmp_path) -> None:
    paths, cert = team
    with pytest.raises(DoesNotFit, match=r"px4 flies r0 without pauses while r1 are flown otherwise"):
        flight.export(paths, cert, tmp_path / "stream", format="px4", robots=["r0"], force=True)
    flight.export(paths, cert, tmp_path / "all", format="px4", force=True)
    done = flight.export(paths, cert, tmp_path / "some", robots=["r0"], force=True)
    assert "r1 pause with them, and start each part at the same instant." in done.notes


def test_what_fits_in_the_compressed_format_is_packed_whole(tmp_path) -> None:
    there = [[(k % 2), 0.1 * (k // 2), 1] for k in range(34)]
    path = {"r0": cut(legs(there, speed=1.2), 20)}
    packed = COMPRESSED.prepare(path, 1)["r0"]
    assert packed.cuts == ()
    data, pieces = compressed_bytes("r0", packed)
    assert len(data) <= 4096
    assert pieces > 31
    far = {"r0": cut(legs(there, speed=0.2), 20)}
    with pytest.raises(DoesNotFit, match="Fly it in parts"):
        COMPRESSED.prepare(far, 1)
