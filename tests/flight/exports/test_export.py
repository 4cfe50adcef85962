"""Exports: refused unless certified, exact when read back by the targets' own code, and within the firmware's limits."""

from __future__ import annotations

import dataclasses
import importlib.util
import itertools
import json
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import flight
from flight.exports.compressed import compressed_bytes, compressed_trajectory
from flight.exports.crazyflie import write_entry
from flight.exports.memory import MEMORY, Entry, poly4d_bytes, poly4d_trajectory, side_by_side
from flight.exports.px4 import to_ned
from tests.helpers.stand_ins import Claim, float32, hoop6, rest_to_rest, stand_in
from tests.helpers.stand_ins import flight as made_flight
from verify.data import BadInput, DoesNotFit, NotCertified, Trajectory, load_vehicle
from verify.data.trajectory_csv import read_csv


@pytest.fixture(scope="module")
def certified():
    plan, team = made_flight()
    team = flight.with_hovers(team)
    return team, stand_in(plan, team)


def hover(pieces=1, place=(0.0, 0.0, 1.0), duration=1.0):
    coefficients = np.zeros((pieces, 4, 8))
    coefficients[:, :3, 0] = float32(place)
    return Trajectory(np.full(pieces, duration), coefficients)


def test_what_is_not_certified_is_refused(certified, tmp_path):
    team, cert = certified
    out = tmp_path / "out"
    with pytest.raises(NotCertified, match="no certificate"):
        flight.export(team, None, out)
    coefficients = team["quad0"].coefficients.copy()
    coefficients[0, 0, 7] = np.nextafter(np.float32(coefficients[0, 0, 7]), np.float32(1))
    with pytest.raises(NotCertified, match="differ"):
        flight.export({**team, "quad0": Trajectory(team["quad0"].durations, coefficients)}, cert, out)
    with pytest.raises(NotCertified, match=r"airframe 'crazyflie-2\.1', not 'split-s-racer'"):
        flight.export(team, cert, out, vehicle="split-s-racer")
    broken = dataclasses.replace(cert, claims=(Claim("limits.speed", "fails", "too fast."),))
    with pytest.raises(NotCertified, match=r"limits\.speed"):
        flight.export(team, broken, out)
    assert not out.exists()


def test_an_airframe_that_is_no_crazyflie_does_not_fit(certified, tmp_path):
    team, cert = certified
    other = dataclasses.replace(cert, mission=cert.mission.model_copy(update={"vehicle": load_vehicle("split-s-racer")}))
    for name in ("crazyswarm2", "crazyflie"):
        with pytest.raises(DoesNotFit, match="no Crazyflie"):
            flight.export(team, other, tmp_path, format=name)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"format": "crazyswarm"}, "Did you mean 'crazyswarm2'"),
        ({"rate": 3}, "not an option"),
        ({"uris": {"quad9": "x"}}, "quad9"),
        ({"format": "crazyflie", "trajectory_ids": {"quad9": 1}}, "quad9"),
        ({"format": "px4", "rate": 1.0}, "rate"),
        ({"format": "px4", "origin": (1, 2)}, "origin"),
        ({"format": "ros2", "rate": 9999}, "rate"),
    ],
)
def test_unknown_formats_and_options_are_refused(certified, tmp_path, options, message):
    with pytest.raises(BadInput, match=message):
        flight.export(*certified, tmp_path, **options)


def test_nothing_of_somebody_elses_is_overwritten(certified, tmp_path):
    for name in ("README.txt", "quad0.csv"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text("years of work")
        with pytest.raises(BadInput, match=f"ltlplan did not write it .it holds {name}"):
            flight.export(*certified, folder)
        assert [path.name for path in folder.iterdir()] == [name]
        assert (folder / name).read_text() == "years of work"
    for _ in range(3):
        flight.export(*certified, tmp_path / "mine")
        (tmp_path / "mine" / "notes.txt").write_text("kept")
    assert (tmp_path / "mine" / "notes.txt").read_text() == "kept"
    addresses = tmp_path / "mine" / "crazyflies.yaml"
    addresses.write_text(addresses.read_text().replace("E7E7E7E701", "E7E7E7E7AA"))
    with pytest.raises(BadInput, match=r"crazyflies\.yaml is yours, or was changed since ltlplan wrote it"):
        flight.export(*certified, tmp_path / "mine")
    assert "E7E7E7E7AA" in addresses.read_text()


def test_an_export_that_fails_half_way_leaves_nothing(certified, tmp_path):
    out = tmp_path / "out"
    flight.export(*certified, out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}

    def full(_path: Path, _content: bytes) -> int:
        raise OSError(28, "No space left on device")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        with pytest.raises(BadInput, match="cannot be written: No space left"):
            flight.export(*certified, out)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert list(tmp_path.iterdir()) == [out]


def test_every_export_says_what_voids_its_certificate(certified, tmp_path):
    team, cert = certified
    for name in ("crazyswarm2", "crazyflie"):
        done = flight.export(team, cert, tmp_path / name, format=name)
        note = done.files[-1].read_text()
        assert done.digest == cert.digest()
        for word in (cert.digest(), "voids", "climb", "relative", "crazyflie-2.1", "0.05 m"):
            assert word in note


def test_csv_reads_back_exactly_as_crazyswarm2_reads_it(certified, tmp_path):
    team, cert = certified
    flight.export(team, cert, tmp_path)
    for name, path in team.items():
        assert read_csv((tmp_path / f"{name}.csv").read_text()).coefficients[: len(path)].tolist() == path.coefficients.tolist()
        rows = np.loadtxt(tmp_path / f"{name}.csv", delimiter=",", skiprows=1, usecols=range(33))
        assert np.array_equal(rows[: len(path), 0].astype(np.float32), path.durations.astype(np.float32))
        assert np.array_equal(rows[: len(path), 1:].astype(np.float32).reshape(-1, 4, 8), path.coefficients.astype(np.float32))


def test_a_one_piece_flight_is_exported_as_two_that_were_certified(certified, tmp_path):
    plan, team = made_flight()
    assert len(team["quad1"]) == 1
    with pytest.raises(DoesNotFit, match=r"quad1 has one piece.*with_hovers"):
        flight.export(team, stand_in(plan, team), tmp_path / "one")
    longer = certified[0]["quad1"]
    assert len(longer) == 2
    assert np.allclose(longer.evaluate([2.6, 3.5]), team["quad1"].evaluate(2.5), atol=2e-7)
    done = flight.export(*certified, tmp_path / "two")
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
    flight.export(*certified, tmp_path, uris={"quad0": "radio://0/80/2M/E7E7E7E7AA"})
    made = YAML(typ="safe", pure=True).load((tmp_path / "crazyflies.yaml").read_text())
    assert made["robots"]["quad0"]["uri"] == "radio://0/80/2M/E7E7E7E7AA"
    assert made["robots"]["quad1"]["initial_position"] == [1.2, 0.9, 0.0]
    assert set(made["robot_types"]) == {"ltlplan"}


def test_names_of_robots_are_text_to_readers_of_every_version(certified, tmp_path):
    """A YAML 1.1 reader, as ROS has it, takes an unquoted `no` for a Boolean."""
    flight.export(*certified, tmp_path)
    text = (tmp_path / "crazyflies.yaml").read_text()
    for old, new in (("quad0", "no"), ("quad1", "on")):
        assert f'"{old}":' in text
        text = text.replace(old, new)
    reader = YAML(typ="safe", pure=True)
    reader.version = (1, 1)
    assert set(reader.load(text)["robots"]) == {"no", "on"}


class Recorder:
    """Stands in for crazyflie_py: remembers what it was told, and where the robots are."""

    def __init__(self, places):
        self.said, self.places = [], places

    def modules(self):
        said = self.said

        class Robot:
            def __init__(self, name, place):
                self.name, self.place = name, place

            def get_position(self):
                return self.place

            def __getattr__(self, method):
                return lambda *args, **kwargs: said.append((self.name, method, args, kwargs))

        everyone = Robot("all", None)
        everyone.crazyfliesByName = {name: Robot(name, place) for name, place in self.places.items()}

        class Swarm:
            timeHelper = Robot("clock", None)  # noqa: N815
            allcfs = everyone

        class Loaded:
            def loadcsv(self, path):
                self.rows = np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(33))

        package, sub = types.ModuleType("crazyflie_py"), types.ModuleType("crazyflie_py.uav_trajectory")
        package.Crazyswarm, sub.Trajectory = Swarm, Loaded
        return {"crazyflie_py": package, "crazyflie_py.uav_trajectory": sub}


@pytest.mark.parametrize(("off", "starts"), [(0.03, True), (0.06, False)])
def test_the_script_starts_only_if_every_robot_is_within_the_margin(certified, tmp_path, monkeypatch, off, starts, capsys):
    team, cert = certified
    flight.export(team, cert, tmp_path)
    places = {name: path.evaluate(0.0)[:3] + np.array([0.0, off, 0.0]) for name, path in team.items()}
    recorder = Recorder(places)
    for name, module in recorder.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("fly_mission", tmp_path / "fly_mission.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert script.main() == (0 if starts else 1)
    begun = [entry for entry in recorder.said if entry[1] == "startTrajectory"]
    assert [entry[3] for entry in begun] == [{"timescale": 1.0, "reverse": False, "relative": False}] * starts
    assert any(entry[1] == "land" for entry in recorder.said)
    assert ("too far" in capsys.readouterr().out) is not starts


def test_poly4d_bytes_are_what_cflib_packs(certified, tmp_path):
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    team, cert = certified
    flight.export(team, cert, tmp_path, format="crazyflie", trajectory_ids={"quad1": 7}, offset=264)
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


def test_an_upload_that_reaches_nobody_is_told_in_words(certified, tmp_path, capfd):
    pytest.importorskip("cflib", reason="cflib is not installed")
    flight.export(*certified, tmp_path / "out", format="crazyflie")
    uris = {"quad0": "nowhere://0/80/2M/E7E7E7E701", "quad1": "nowhere://0/80/2M/E7E7E7E702"}
    with pytest.raises(
        BadInput, match=r"quad0 at nowhere://.* cannot be sent to: .*; no robot has been sent its trajectory so far"
    ):
        flight.upload(tmp_path / "out", uris)
    assert capfd.readouterr() == ("", "")


def test_an_upload_writes_those_bytes_at_that_offset_through_cflib(certified, tmp_path):
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    flight.export(*certified, tmp_path, format="crazyflie", offset=132)
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


def test_the_firmwares_limits_are_refused_with_their_numbers(certified, tmp_path):
    plan, team = made_flight()
    long = {**team, "quad0": hover(32)}
    for name in ("crazyswarm2", "crazyflie"):
        with pytest.raises(DoesNotFit, match=r"32 pieces.*31"):
            flight.export(long, stand_in(plan, long), tmp_path, format=name)
    full = {**team, "quad0": hover(31)}
    flight.export(full, stand_in(plan, full), tmp_path, format="crazyflie")
    with pytest.raises(DoesNotFit, match="id 31 is out of range"):
        flight.export(*certified, tmp_path, format="crazyflie", trajectory_ids={"quad0": 31})
    with pytest.raises(DoesNotFit, match="multiple of 4"):
        flight.export(*certified, tmp_path, format="crazyflie", offset=130)
    with pytest.raises(DoesNotFit, match="has 96 left"):
        flight.export(*certified, tmp_path, format="crazyflie", offset=4000)
    rough = {**team, "quad0": Trajectory([1 / 3], hover().coefficients)}
    with pytest.raises(DoesNotFit, match="float32"):
        flight.export(rough, stand_in(plan, rough), tmp_path, format="crazyflie")


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


def test_compressed_bytes_are_what_cflib_packs():
    memory = pytest.importorskip("cflib.crazyflie.mem.trajectory_memory", reason="cflib is not installed")
    path = flight.quantised({"q": rest_to_rest([(0, 0, 1), (0.5, 0, 1.25)], [2.0])})["q"]
    data, _ = compressed_bytes("q", path)
    packed = bytearray(memory.CompressedStart(0.0, 0.0, 1.0, 0.0).pack())
    place = 8
    for duration in np.rint(path.durations * 1000).astype(int).tolist():
        kinds = data[place]
        counts = [(0, 1, 3, 7)[kinds >> (2 * axis) & 3] for axis in range(4)]
        values = np.frombuffer(data, dtype="<i2", count=sum(counts), offset=place + 3).tolist()
        axes = [[values.pop(0) for _ in range(count)] for count in counts]
        # cflib truncates: half a millimetre more keeps the integers that it is given.
        nudged = [[(value + (0.5 if value > 0 else -0.5 if value < 0 else 0)) / 1000 for value in axis] for axis in axes]
        packed += memory.CompressedSegment((duration + 0.5) / 1000, *nudged).pack()
        place += 3 + 2 * sum(counts)
    packed += memory.CompressedSegment(0.0, [], [], [], []).pack()
    assert bytes(packed) == data


def test_compressed_limits_are_refused_with_their_numbers(tmp_path):
    with pytest.raises(DoesNotFit, match=r"33 m.*32\.767"):
        flight.quantised({"q": hover(1, (33.0, 0.0, 1.0))})
    with pytest.raises(DoesNotFit, match="heading"):
        flight.quantised({"q": rest_to_rest([(0, 0, 1), (1, 0, 1)], [2.0], yaw=0.5)})
    with pytest.raises(DoesNotFit, match=r"70 s.*65\.535"):
        compressed_bytes("q", hover(1, duration=70.0))
    plan, team = made_flight()
    smooth = {**team, "quad0": hoop6()}
    with pytest.raises(DoesNotFit, match=r"certify `flight\.quantised"):
        flight.export(smooth, stand_in(plan, smooth), tmp_path, format="crazyflie-compressed")
    with pytest.raises(BadInput, match="step"):
        flight.quantised({"q": hover()}, step=0.0)
    for data in (b"", b"\0" * 8, b"\0" * 11, b"\0" * 8 + b"\xff\x01\x00\x02"):
        with pytest.raises(BadInput):
            compressed_trajectory(data)


def test_a_certified_quantised_team_is_exported(certified, tmp_path):
    plan, team = made_flight()
    rounded = flight.quantised(team)
    flight.export(rounded, stand_in(plan, rounded), tmp_path, format="crazyflie-compressed")
    for name, path in rounded.items():
        assert compressed_trajectory((tmp_path / f"{name}.bin").read_bytes()) == path
    assert json.loads((tmp_path / "upload.json").read_text())["robots"]["quad0"]["type"] == "poly4d_compressed"


def test_mavlink_setpoints_read_back_by_pymavlink_are_the_path_in_ned(certified, tmp_path, monkeypatch):
    pytest.importorskip("pymavlink", reason="pymavlink is not installed")
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    team, cert = certified
    flight.export(team, cert, tmp_path, format="px4", rate=25.0, origin=(0.1, 0.2, 0.3))
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
    flight.export(team, cert, tmp_path, format="ros2", rate=20.0)
    store = get_typestore(Stores.ROS2_JAZZY)
    seen = {}
    assert YAML(typ="safe", pure=True).load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"][
        "custom_data"
    ] == {"certificate": cert.digest(), "mission": "two-tasks"}
    with Reader(tmp_path / "bag") as reader:
        for connection, _, data in reader.messages():
            seen[connection.topic] = store.deserialize_cdr(data, connection.msgtype)
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


def test_the_same_export_twice_gives_the_same_bytes(certified, tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    for name in ("crazyswarm2", "crazyflie", "ros2"):
        first, again = (flight.export(*certified, tmp_path / f"{name}{k}", format=name) for k in range(2))
        assert [path.read_bytes() for path in first.files] == [path.read_bytes() for path in again.files]
