"""Recordings of other programs: the same flight read from each of them is the same, to the digits that they keep."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import flight
from flight import RecordingOptions
from tests.helpers.few import few_of
from tests.helpers.live import foreign_logs
from verify.data import BadInput

TIMES = np.arange(0, 200) * 0.01
ROBOTS = ("quad0", "quad1")


def places() -> dict[str, np.ndarray]:
    """Two robots on curves; one of them is not seen for a while."""
    found = {name: np.stack([np.sin(TIMES + k), 0.4 * TIMES - k, 1.0 + 0.1 * TIMES], axis=1) for k, name in enumerate(ROBOTS)}
    found["quad1"][50:60] = np.nan
    return found


def _vicon(path: Path) -> RecordingOptions:
    (path / "log.csv").write_text(foreign_logs.vicon(TIMES, places(), frame=301))
    return RecordingOptions(start=3.01)


def _motive(path: Path, unit: str = "Meters") -> RecordingOptions:
    (path / "log.csv").write_text(foreign_logs.motive(TIMES, places(), unit=unit))
    return RecordingOptions(axes="x,-z,y")


def _qualisys(path: Path) -> RecordingOptions:
    (path / "log.csv").write_text(foreign_logs.qualisys(TIMES, places()))
    return RecordingOptions()


def _crazyflies(path: Path) -> RecordingOptions:
    (path / "log.csv").mkdir()
    for k, (name, row) in enumerate(places().items()):
        (path / "log.csv" / f"{name}.csv").write_text(foreign_logs.crazyflie(TIMES, row, booted=100.0 + 7 * k))
    return RecordingOptions(start={"quad0": 100.0, "quad1": 107.0})


def _ulogs(path: Path) -> RecordingOptions:
    pytest.importorskip("pyulog", reason="pyulog is not installed")
    (path / "log.csv").mkdir()
    for k, (name, row) in enumerate(places().items()):
        seen = ~np.isnan(row).any(axis=1)
        data = foreign_logs.ulog(TIMES, np.nan_to_num(row), booted=30.0 + k, valid=seen)
        (path / "log.csv" / f"{name}.ulg").write_bytes(data)
    return RecordingOptions(start={"quad0": 30.0, "quad1": 31.0})


def _bag(kind: str, *, mcap: bool) -> Callable[[Path], RecordingOptions]:
    def write(path: Path) -> RecordingOptions:
        pytest.importorskip("rosbags", reason="rosbags is not installed")
        foreign_logs.bag(path / "log.csv", TIMES, places(), kind=kind, mcap=mcap)
        return RecordingOptions()

    return write


FORMATS = {
    "vicon": _vicon,
    "motive": _motive,
    "motive in mm": lambda path: _motive(path, "Millimeters"),
    "qualisys": _qualisys,
    "crazyflies": _crazyflies,
    "px4": _ulogs,
    "poses, sqlite3": _bag("PoseStamped", mcap=False),
    "named poses, mcap": _bag("NamedPoseArray", mcap=True),
    "odometry, mcap": _bag("Odometry", mcap=True),
}


@few_of(4, "kind", FORMATS)
def test_a_flight_is_the_same_in_every_format(tmp_path, kind):
    told = FORMATS[kind](tmp_path)
    found = flight.read_flown(tmp_path / "log.csv", ROBOTS, told)
    late, off = found.rounding
    assert late <= 0.0011
    assert off <= 2e-6
    for j, name in enumerate(ROBOTS):
        seen = ~np.isnan(found.position[:, j]).any(axis=1)
        whole = ~np.isnan(places()[name]).any(axis=1)
        assert found.times[seen] == pytest.approx(TIMES[whole], abs=late + 1e-9)
        assert found.position[seen, j] == pytest.approx(places()[name][whole], abs=off + 1e-9)


def test_one_clock_is_never_taken_for_granted(tmp_path):
    told = _crazyflies(tmp_path)
    with pytest.raises(BadInput, match=r"clocks may have begun at different times.*--start quad0=12.3,quad1=12.3"):
        flight.read_flown(tmp_path / "log.csv", ROBOTS, RecordingOptions())
    with pytest.raises(BadInput, match="but not for quad1"):
        flight.read_flown(tmp_path / "log.csv", ROBOTS, RecordingOptions(start={"quad0": 100.0}))
    with pytest.raises(BadInput, match="Did you mean 'quad1'"):
        flight.read_flown(tmp_path / "log.csv", ROBOTS, RecordingOptions(start={"quad0": 100.0, "quad2": 107.0}))
    found = flight.read_flown(tmp_path / "log.csv", ROBOTS, told)
    assert any("clocks of their own" in note for note in found.notes)
    off = flight.read_flown(tmp_path / "log.csv", ROBOTS, RecordingOptions(start=told.start, start_error=0.02))
    assert off.rounding[0] == pytest.approx(found.rounding[0] + 0.02)
    (tmp_path / "table.csv").write_text("t,robot,x,y,z\n0,quad0,0,0,0\n0,quad1,1,0,0\n1,quad0,0,0,0\n1,quad1,1,0,0\n")
    with pytest.raises(BadInput, match="one clock for all robots"):
        flight.read_flown(tmp_path / "table.csv", ROBOTS, RecordingOptions(start={"quad0": 0.0, "quad1": 0.5}))


def test_what_is_called_otherwise_is_found_when_it_is_told(tmp_path):
    text = foreign_logs.vicon(TIMES, {"cf1": places()["quad0"], "cf2": places()["quad1"]})
    (tmp_path / "vicon.csv").write_text(text)
    with pytest.raises(BadInput, match=r"no body 'quad0'.*Bodies: cf1, cf2.*--rename quad0=NAME"):
        flight.read_flown(tmp_path / "vicon.csv", ROBOTS, RecordingOptions())
    found = flight.read_flown(tmp_path / "vicon.csv", ROBOTS, RecordingOptions(rename={"quad0": "cf2", "quad1": "cf1"}))
    assert found.robots == ROBOTS
    assert found.position[0, 0] == pytest.approx(places()["quad1"][0], abs=1e-6)
    with pytest.raises(BadInput, match="both called 'cf1'"):
        flight.read_flown(tmp_path / "vicon.csv", ROBOTS, RecordingOptions(rename={"quad0": "cf1", "quad1": "cf1"}))
    with pytest.raises(BadInput, match="nothing that a recording holds"):
        flight.read_flown(tmp_path / "vicon.csv", ("cf1",), RecordingOptions(rename={"speed": "Frame"}))


def test_axes_and_origins(tmp_path):
    (tmp_path / "motive.csv").write_text(foreign_logs.motive(TIMES, places()))
    with pytest.raises(BadInput, match="which of its axes points up"):
        flight.read_flown(tmp_path / "motive.csv", ROBOTS, RecordingOptions())
    with pytest.raises(BadInput, match="mirror the world"):
        flight.read_flown(tmp_path / "motive.csv", ROBOTS, RecordingOptions(axes="x,z,y"))
    with pytest.raises(BadInput, match="axes are the mission's"):
        flight.read_flown(tmp_path / "motive.csv", ROBOTS, RecordingOptions(axes="x,y,up"))
    told = RecordingOptions(axes="x,-z,y", origin={"": (1.0, 0.0, 0.0), "quad1": (0.0, 0.0, -0.5)})
    found = flight.read_flown(tmp_path / "motive.csv", ROBOTS, told)
    assert found.position[0, 0] == pytest.approx(places()["quad0"][0] + [1, 0, 0], abs=1e-6)
    assert found.position[0, 1] == pytest.approx(places()["quad1"][0] - [0, 0, 0.5], abs=1e-6)
    with pytest.raises(BadInput, match="origin of 'quad7'"):
        flight.read_flown(tmp_path / "motive.csv", ROBOTS, RecordingOptions(axes="x,-z,y", origin={"quad7": (0.0, 0.0, 0.0)}))


def test_our_own_log_as_mcap_is_read_back(tmp_path, flown):
    pytest.importorskip("mcap", reason="mcap is not installed")
    _, _, log = flown
    flight.write_log(log, tmp_path / "flight.mcap")
    found = flight.read_flown(tmp_path / "flight.mcap", log.robots, RecordingOptions())
    assert found.times == pytest.approx(log.times, abs=1e-9)
    assert np.array_equal(found.position, log.position)
    with pytest.raises(BadInput, match="no pose of other"):
        flight.read_flown(tmp_path / "flight.mcap", ("other",), RecordingOptions())


def test_a_folder_says_what_it_left_aside_and_refuses_what_it_does_not_hold(tmp_path):
    told = _crazyflies(tmp_path)
    folder = tmp_path / "log.csv"
    with pytest.raises(BadInput, match=r"no file with a column 'kalman.stateX' \(given for x\)"):
        flight.read_flown(folder, ROBOTS, RecordingOptions(start=told.start, rename={"x": "kalman.stateX"}))
    (folder / "old.csv").write_text("t,x,y,z\n0,0,0,0\n1,0,0,0\n")
    found = flight.read_flown(folder, ROBOTS, told)
    assert any("left aside: old.csv" in note for note in found.notes)
    with pytest.raises(BadInput, match=r"no file for 'quad2'.*Files: old, quad0, quad1"):
        flight.read_flown(folder, (*ROBOTS, "quad2"), told)
    (folder / "quad0.ulg").write_bytes(b"")
    with pytest.raises(BadInput, match=r"quad0.csv and quad0.ulg; say which"):
        flight.read_flown(folder, ROBOTS, told)
    with pytest.raises(BadInput, match="start_error"):
        flight.read_flown(folder, ROBOTS, RecordingOptions(start=told.start, start_error=-1.0, rename={"quad0": "quad0.csv"}))


@pytest.mark.parametrize("start", [None, 0.0])
def test_files_of_no_robot_count_for_what_a_folder_covers(tmp_path, start):
    (tmp_path / "quad0.csv").write_text("t,x,y,z\n0.0,0,0,1\n0.5,0,0,1\n1.0,0,0,1\n")
    (tmp_path / "notes.csv").write_text("a,b\nno,recording\n")
    alone = flight.read_flown(tmp_path, ("quad0",), RecordingOptions(start=start))
    assert alone.covers == (0.0, 1.0)
    assert any("left aside: notes.csv" in note for note in alone.notes)
    (tmp_path / "human.csv").write_text("t,x,y,z\n0.0,5,0,1\n20.0,5,0,1\n")
    (tmp_path / "Quad0.csv").write_text("t,x,y,z\n-2.0,5,0,1\n3.0,5,0,1\n")
    found = flight.read_flown(tmp_path, ("quad0",), RecordingOptions(start=start))
    assert found.covers == (-2.0, 20.0)
    assert any("count for what it covers: Quad0.csv, human.csv" in note for note in found.notes)


def test_topics_and_frames_of_a_bag_are_not_chosen_between(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    bodies = {"quad0/raw": places()["quad0"], "quad0": places()["quad0"], "quad1": places()["quad1"]}
    foreign_logs.bag(tmp_path / "bag", TIMES, bodies, kind="PoseStamped", mcap=False)
    with pytest.raises(
        BadInput, match=r"several topics that could be quad0's pose: /quad0/pose, /quad0/raw/pose.*--rename quad0=/quad0/pose"
    ):
        flight.read_flown(tmp_path / "bag", ROBOTS, RecordingOptions())
    found = flight.read_flown(tmp_path / "bag", ROBOTS, RecordingOptions(rename={"quad0": "/quad0/raw/pose"}))
    assert any("quad0 from /quad0/raw/pose" in note for note in found.notes)
    with pytest.raises(BadInput, match="no topic of quad5's pose"):
        flight.read_flown(tmp_path / "bag", ("quad5",), RecordingOptions())
    with pytest.raises(BadInput, match="is not there"):
        flight.read_flown(tmp_path / "bag", ("quad1",), RecordingOptions(rename={"quad1": "/quad1/odom"}))
    foreign_logs.bag(tmp_path / "array", TIMES[:9], {"cf1": places()["quad1"][:9]}, kind="NamedPoseArray", mcap=False)
    with pytest.raises(BadInput, match="/poses holds poses with names; say what quad1 is called there"):
        flight.read_flown(tmp_path / "array", ("quad1",), RecordingOptions(rename={"quad1": "/poses"}))
    assert len(flight.read_flown(tmp_path / "array", ("quad1",), RecordingOptions(rename={"quad1": "cf1"})).times) == 9
    with pytest.raises(BadInput, match="a bag has no columns"):
        flight.read_flown(tmp_path / "bag", ("quad1",), RecordingOptions(rename={"t": "stamp"}))


def test_an_index_that_leads_beyond_the_chunks_is_refused(tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    foreign_logs.bag(tmp_path / "bag", TIMES[:20], {"quad0": places()["quad0"][:20]}, kind="PoseStamped", mcap=True)
    (file,) = (tmp_path / "bag").glob("*.mcap")
    data = bytearray(file.read_bytes())
    at = 8
    while data[at] != 8:  # to the first entry of the index
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    data[at + 9 + 16] ^= 4
    (tmp_path / "wrong.mcap").write_bytes(data)
    with pytest.raises(BadInput, match="chunks that are not there"):
        flight.read_flown(tmp_path / "wrong.mcap", ("quad0",), RecordingOptions())
