"""Exports: exact when read back by the targets' own code, and the same each time."""

from __future__ import annotations

import dataclasses
import itertools
import json

import numpy as np
import pytest
from ruamel.yaml import YAML

import flight
from flight.exports.crazyflies.compressed import compressed_bytes
from flight.exports.crazyflies.crazyflie import write_entry
from flight.exports.crazyflies.memory import MEMORY, Entry, poly4d_bytes, side_by_side
from flight.exports.px4 import to_ned
from tests.helpers.motion.stand_ins import flight as made_flight
from tests.helpers.motion.stand_ins import hoop6, hover, rest_to_rest, stand_in
from tests.helpers.vehicles.trajectory_bytes import compressed_trajectory, poly4d_trajectory
from verify.data import BadInput, DoesNotFit, Trajectory
from verify.data.files.trajectory_csv import read_csv


def test_every_export_says_what_voids_its_certificate(certified, tmp_path):
    team, cert = certified
    for name in ("crazyswarm2", "crazyflie"):
        done = flight.export(team, cert, tmp_path / name, format=name, force=True)
        note = done.files[-1].read_text()
        assert done.digest == cert.digest()
        for word in (cert.digest(), "voids", "climb", "relative", "crazyflie-2.1", "0.05 m"):
            assert word in note


def test_csv_reads_back_exactly_as_crazyswarm2_reads_it(certified, tmp_path):
    team, cert = certified
    flight.export(team, cert, tmp_path, force=True)
    for name, path in team.items():
        assert read_csv((tmp_path / f"{name}.csv").read_text()).coefficients[: len(path)].tolist() == path.coefficients.tolist()
        rows = np.loadtxt(tmp_path / f"{name}.csv", delimiter=",", skiprows=1, usecols=range(33))
        assert np.array_equal(rows[: len(path), 0].astype(np.float32), path.durations.astype(np.float32))
        assert np.array_equal(rows[: len(path), 1:].astype(np.float32).reshape(-1, 4, 8), path.coefficients.astype(np.float32))


def test_a_one_piece_flight_is_exported_as_two_that_were_certified(certified, tmp_path):
    plan, team = made_flight()
    assert len(team["quad1"]) == 1
    with pytest.raises(DoesNotFit, match=r"quad1 has one piece.*with_hovers"):
        flight.export(team, stand_in(plan, team), tmp_path / "one", force=True)
    longer = certified[0]["quad1"]
    assert len(longer) == 2
    assert np.allclose(longer.evaluate([2.6, 3.5]), team["quad1"].evaluate(2.5), atol=2e-7)
    done = flight.export(*certified, tmp_path / "two", force=True)
    assert np.loadtxt(tmp_path / "two" / "quad1.csv", delimiter=",", skiprows=1, usecols=range(33)).shape == (2, 33)
    assert read_csv((tmp_path / "two" / "quad1.csv").read_text()) == longer
    assert not any("second piece" in note for note in done.notes)


def test_a_hover_of_one_piece_is_cut_into_the_same_hover():
    for cycle in (None, 0):
        one = Trajectory(hover(duration=1.5).durations, hover().coefficients, cycle=cycle)
        two = flight.with_hovers({"q": one})["q"]
        assert two.durations.tolist() == [0.75, 0.75]
        assert two.cycle == cycle
        assert np.array_equal(two.coefficients, np.repeat(one.coefficients, 2, axis=0))
        assert flight.with_hovers({"q": two})["q"] == two


def test_crazyflies_yaml_names_the_robots_and_their_places(certified, tmp_path):
    flight.export(*certified, tmp_path, uris={"quad0": "radio://0/80/2M/E7E7E7E7AA"}, force=True)
    made = YAML(typ="safe", pure=True).load((tmp_path / "crazyflies.yaml").read_text())
    assert made["robots"]["quad0"]["uri"] == "radio://0/80/2M/E7E7E7E7AA"
    assert made["robots"]["quad1"]["initial_position"] == [1.2, 0.9, 0.0]
    told = made["robots"]["quad1"]["firmware_params"]
    assert told["stabilizer"] == {"estimator": 2, "controller": 2}
    assert told["ctrlMel"] == {"mass": 0.033, "massThrust": 132000.0}
    assert told["locSrv"] == {"extPosStdDev": 0.001, "extQuatStdDev": 0.05}
    assert set(made["robot_types"]) == {"ltlplan"}
    reported = made["all"]["firmware_logging"]["custom_topics"]["estimator"]["vars"]
    assert reported == ["kalman.varX", "kalman.varY", "kalman.varZ", "pm.batteryLevel"], "varPX is a variance of velocity"


def test_names_of_robots_are_text_to_readers_of_every_version(certified, tmp_path):
    """A YAML 1.1 reader, as ROS has it, takes an unquoted `no` for a Boolean."""
    flight.export(*certified, tmp_path, force=True)
    text = (tmp_path / "crazyflies.yaml").read_text()
    for old, new in (("quad0", "no"), ("quad1", "on")):
        assert f'"{old}":' in text
        text = text.replace(old, new)
    reader = YAML(typ="safe", pure=True)
    reader.version = (1, 1)
    assert set(reader.load(text)["robots"]) == {"no", "on"}


def test_poly4d_bytes_are_what_cflib_packs(certified, tmp_path):
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    team, cert = certified
    flight.export(team, cert, tmp_path, format="crazyflie", trajectory_ids={"quad1": 7}, offset=264, force=True)
    table = json.loads((tmp_path / "upload.json").read_text())
    assert table["certificate"] == cert.digest()
    for name, path in team.items():
        packed = b"".join(
            bytes(memory.Poly4D(d, *(memory.Poly4D.Poly(axis) for axis in piece)).pack())
            for d, piece in zip(path.durations.tolist(), path.coefficients.tolist(), strict=True)
        )
        assert (tmp_path / f"{name}.bin").read_bytes() == packed
        assert poly4d_trajectory(packed) == path
    assert table["robots"]["quad1"] | {"start": 0, "duration": 0} == {
        "file": "quad1.bin", "trajectory_id": 7, "offset": 264, "pieces": 2, "type": "poly4d", "start": 0, "duration": 0,
    }  # fmt: skip


@dataclasses.dataclass
class Radio:
    """Stands in for the radio link under cflib's memory element."""

    written: list

    def write(self, element, address, data, flush_queue):
        self.written.append((address, bytes(data)))
        element.write_done(element, address)


def test_an_upload_writes_those_bytes_at_that_offset_through_cflib(certified, tmp_path):
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    flight.export(*certified, tmp_path, format="crazyflie", offset=132, force=True)
    uris = {"quad0": "radio://0/80/2M/E7E7E7E701", "quad1": "radio://0/80/2M/E7E7E7E702"}
    for item in flight.upload(tmp_path, uris, dry_run=True):
        radio = Radio([])
        element = memory.TrajectoryMemory(id=1, type=0x12, size=MEMORY, mem_handler=radio)
        assert write_entry(element, item.entry)
        assert radio.written == [(132, (tmp_path / f"{item.robot}.bin").read_bytes())]
    with pytest.raises(BadInput, match="quad1"):
        flight.upload(tmp_path, {"quad0": "radio://0/80/2M/E7E7E7E701"}, dry_run=True)
    with pytest.raises(BadInput, match="no Crazyflie export"):
        flight.upload(tmp_path / "nowhere", uris, dry_run=True)


def test_trajectories_lie_side_by_side_without_overlapping():
    parts = {k: (f"t{k}", poly4d_bytes("t", hover(k + 1)), k + 1) for k in range(4)}
    entries = side_by_side({**parts, 9: ("odd", b"x" * 10, 1), 10: ("last", b"y" * 8, 1)}, 0, begin=4)
    taken = [(entry.offset, entry.offset + len(entry.data)) for entry in entries]
    assert all(entry.offset % 4 == 0 for entry in entries)
    assert all(end <= begin for (_, end), (begin, _) in itertools.pairwise(taken))
    assert isinstance(entries[0], Entry)
    with pytest.raises(DoesNotFit, match="out of range"):
        side_by_side({-1: parts[0]}, 0)


def test_a_quantised_path_is_near_smooth_and_survives_its_bytes_exactly():
    path = hoop6()
    (made,) = flight.quantised({"q": path}).values()
    times = np.linspace(0, path.duration, 2000)
    assert np.max(np.linalg.norm(made.evaluate(times)[:, :3] - path.evaluate(times)[:, :3], axis=1)) < 0.02
    for order, allowed in enumerate((1e-6, 1e-5, 1e-4, 2e-3)):
        ends = np.array([made.evaluate(made.knots[1:-1] - 1e-12, order), made.evaluate(made.knots[1:-1] + 1e-12, order)])
        assert np.max(np.abs(ends[0] - ends[1])) < allowed
    data, pieces = compressed_bytes("q", made)
    assert pieces == len(made)
    assert compressed_trajectory(data) == made


def test_a_quantised_lap_closes_on_itself():
    line = rest_to_rest([(0, 0, 1), (1, 0, 1), (0, 1, 1.2), (1, 0, 1)], [1.7, 2.3, 1.9])
    path = Trajectory(line.durations, line.coefficients, cycle=1)
    made = flight.quantised({"q": path})["q"]
    assert made.cycle is not None
    laps = made.flattened(3)
    data, pieces = compressed_bytes("q", laps)
    assert compressed_trajectory(data) == laps
    assert pieces == len(laps)
    begin = float(made.knots[made.cycle])
    for order in range(3):
        assert np.allclose(made.evaluate(made.duration - 1e-12, order), made.evaluate(begin, order), atol=1e-4)


def turning(begin: float, end: float) -> Trajectory:
    """A straight line that turns from one heading to another, in rad."""
    line = rest_to_rest([(0, 0, 1), (0.5, 0, 1.25)], [2.0])
    coefficients = line.coefficients.copy()
    coefficients[:, 3] = line.coefficients[:, 0] * (end - begin) / 0.5
    coefficients[:, 3, 0] = begin
    return Trajectory(line.durations, coefficients.astype(np.float32).astype(float))


def test_headings_are_rounded_to_tenths_of_a_degree_and_stay_smooth():
    path = turning(0.4, -1.1)
    (made,) = flight.quantised({"q": path}).values()
    times = np.linspace(0, path.duration, 2000)
    assert 1e-6 < np.max(np.abs(made.evaluate(times)[:, 3] - path.evaluate(times)[:, 3])) < np.radians(1.0)
    assert np.rad2deg(made.evaluate([0.0, made.duration])[:, 3]) == pytest.approx([22.9, -63.0], abs=1e-4)
    for order, allowed in enumerate((1e-6, 1e-5, 1e-4, 2e-3)):
        ends = np.array([made.evaluate(made.knots[1:-1] - 1e-12, order), made.evaluate(made.knots[1:-1] + 1e-12, order)])
        assert np.max(np.abs(ends[0] - ends[1])) < allowed
    assert compressed_trajectory(compressed_bytes("q", made)[0]) == made


@pytest.mark.parametrize(("begin", "end"), [(0.0, 0.0), (0.4, -1.1)])
def test_compressed_bytes_are_what_cflib_packs(begin, end):
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    path = flight.quantised({"q": turning(begin, end)})["q"]
    data, _ = compressed_bytes("q", path)
    packed = bytearray(memory.CompressedStart(0.0, 0.0, 1.0, begin + 1e-6).pack())
    place = 8
    for duration in np.rint(path.durations * 1000).astype(int).tolist():
        kinds = data[place]
        counts = [(0, 1, 3, 7)[kinds >> (2 * axis) & 3] for axis in range(4)]
        values = np.frombuffer(data, dtype="<i2", count=sum(counts), offset=place + 3).tolist()
        axes = [[values.pop(0) for _ in range(count)] for count in counts]
        # cflib truncates: half a millimetre more keeps the integers that it is given.
        units = (1000, 1000, 1000, 1800 / np.pi)
        nudged = [
            [(value + (0.5 if value > 0 else -0.5 if value < 0 else 0)) / unit for value in axis]
            for axis, unit in zip(axes, units, strict=True)
        ]
        packed += memory.CompressedSegment((duration + 0.5) / 1000, *nudged).pack()
        place += 3 + 2 * sum(counts)
    packed += memory.CompressedSegment(0.0, [], [], [], []).pack()
    assert bytes(packed) == data


def test_a_certified_quantised_team_is_exported(certified, tmp_path):
    plan, team = made_flight()
    rounded = flight.quantised(team)
    flight.export(rounded, stand_in(plan, rounded), tmp_path, format="crazyflie-compressed", force=True)
    for name, path in rounded.items():
        assert compressed_trajectory((tmp_path / f"{name}.bin").read_bytes()) == path
    assert json.loads((tmp_path / "upload.json").read_text())["robots"]["quad0"]["type"] == "poly4d_compressed"


def test_mavlink_setpoints_read_back_by_pymavlink_are_the_path_in_ned(certified, tmp_path, monkeypatch):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    team, cert = certified
    flight.export(team, cert, tmp_path, format="px4", rate=25.0, origin=(0.1, 0.2, 0.3), force=True)
    for system, (name, path) in enumerate(team.items(), start=1):
        log = mavutil.mavlink_connection(str(tmp_path / f"{name}.tlog"), dialect="common")
        texts, setpoints = "", []
        while (message := log.recv_msg()) is not None:
            if message.get_type() == "STATUSTEXT":
                texts += message.text
            else:
                setpoints.append(message)
        log.close()
        assert cert.digest() in texts
        assert len(setpoints) == 126
        assert {(m.target_system, m.coordinate_frame, m.type_mask) for m in setpoints} == {(system, 1, 0)}
        times = np.array([m.time_boot_ms for m in setpoints]) / 1000
        assert np.allclose(times, np.arange(126) / 25)
        place, speed, push = (path.evaluate(times, order)[:, :3] for order in range(3))
        assert np.allclose([[m.y + 0.1, m.x + 0.2, -m.z + 0.3] for m in setpoints], place, atol=1e-6)
        assert np.allclose([[m.vy, m.vx, -m.vz] for m in setpoints], speed, atol=1e-6)
        assert np.allclose([[m.afy, m.afx, -m.afz] for m in setpoints], push, atol=1e-6)
        assert np.allclose([m.yaw for m in setpoints], np.pi / 2)


def test_headings_turn_the_other_way_in_ned():
    flat = np.zeros((3, 4, 4))
    flat[0, :, 3] = [0.0, np.pi / 2, np.pi, -np.pi / 2]
    flat[1, :, 3] = 0.3
    *_, heading, rate = to_ned(flat, np.zeros(3))
    assert np.allclose(np.exp(1j * heading), np.exp(1j * np.array([np.pi / 2, 0.0, -np.pi / 2, np.pi])))
    assert np.allclose(rate, -0.3)


def test_a_ros_bag_read_back_by_rosbags_is_the_path(certified, tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    team, cert = certified
    flight.export(team, cert, tmp_path, format="ros2", rate=20.0, force=True)
    store = get_typestore(Stores.ROS2_JAZZY)
    seen = {}
    about = YAML(typ="safe", pure=True).load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert about["custom_data"] == {"certificate": cert.digest(), "mission": "two-tasks"}
    assert (about["version"], about["storage_identifier"]) == (8, "sqlite3")
    profiles = [topic["topic_metadata"]["offered_qos_profiles"] for topic in about["topics_with_message_count"]]
    assert all(isinstance(text, str) for text in profiles), "Humble reads text there, not a list"
    commands = {name: [] for name in team}
    with Reader(tmp_path / "bag") as reader:
        for connection, stamp, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            if connection.topic.endswith("/command/trajectory"):
                commands[connection.topic.split("/")[1]].append((stamp, message))
            else:
                assert stamp == 0
                seen[connection.topic] = message
    for name, path in team.items():
        message = seen[f"/{name}/trajectory"]
        assert message.joint_names == [name]
        assert message.header.frame_id == "world"
        times = np.array([p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in message.points])
        assert np.allclose(times, np.arange(101) / 20)
        for order, part in enumerate(("transforms", "velocities", "accelerations")):
            rows = [getattr(point, part)[0] for point in message.points]
            vectors = [row.translation if order == 0 else row.linear for row in rows]
            assert np.allclose([[v.x, v.y, v.z] for v in vectors], path.evaluate(times, order)[:, :3], atol=1e-9)
        assert np.allclose([stamp * 1e-9 for stamp, _ in commands[name]], times)
        for stamp, command in commands[name]:
            assert command.header.stamp.sec * 10**9 + command.header.stamp.nanosec == stamp
            (point,) = command.points
            assert (point.time_from_start.sec, point.time_from_start.nanosec) == (0, 0)
            place = point.transforms[0].translation
            assert np.allclose([place.x, place.y, place.z], path.evaluate(1e-9 * stamp)[:3], atol=1e-9)


def test_the_same_export_twice_gives_the_same_bytes(certified, tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    for name in ("crazyswarm2", "crazyflie", "ros2"):
        first, again = (flight.export(*certified, tmp_path / f"{name}{k}", format=name, force=True) for k in range(2))
        assert [path.read_bytes() for path in first.files] == [path.read_bytes() for path in again.files]
