"""Logs and recordings: round trips, files of others by column names, and what they are compared with."""

from __future__ import annotations

import csv
import dataclasses
import io
import json

import numpy as np
import pytest

import flight
from tests.helpers.motion.stand_ins import changed_log, rest_to_rest, stand_in
from tests.helpers.motion.stand_ins import flight as made_flight
from verify.data import BadInput, Plan, Trajectory
from verify.recordings.flight_log import LOG_COLUMNS


def test_a_log_has_the_columns_of_the_contract(flown):
    _, _, log = flown
    header = log.to_csv().splitlines()[0].split(",")
    assert tuple(header[: len(LOG_COLUMNS)]) == LOG_COLUMNS
    assert header[len(LOG_COLUMNS) :] == ["rotor1", "rotor2", "rotor3", "rotor4", "mx", "my", "mz"]
    rows = list(csv.DictReader(io.StringIO(log.to_csv())))
    assert len(rows) == len(log) * 2
    assert {row["robot"] for row in rows} == {"quad0", "quad1"}
    assert "carrying tank" in {row["letter"] for row in rows}


def test_a_log_read_from_csv_writes_the_same_csv(flown, tmp_path):
    _, _, log = flown
    read = flight.read_log(flight.write_log(log, tmp_path / "flight.csv"))
    assert read.to_csv() == log.to_csv()
    assert read.letters == log.letters
    assert np.allclose(read.position, log.position, atol=1e-8)


def test_a_log_read_from_parquet_is_the_same_log(flown, tmp_path):
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    _, _, log = flown
    read = flight.read_log(flight.write_log(log, tmp_path / "flight.parquet"))
    for name in ("times", "position", "velocity", "attitude", "thrust", "rates", "error", "rotors", "peak"):
        assert np.array_equal(getattr(read, name), getattr(log, name)), name
    assert np.array_equal(read.measured, log.measured, equal_nan=True)
    for name in ("mission", "robots", "letters", "margin", "events", "satisfied", "tube", "seed", "certificate", "notes"):
        assert getattr(read, name) == getattr(log, name), name


def test_an_mcap_recording_is_read_back_by_mcap(flown, tmp_path):
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    _, _, log = flown
    path = flight.write_log(log, tmp_path / "flight.mcap")
    with path.open("rb") as file:
        made = reader.make_reader(file)
        messages = [(channel.topic, message) for _, channel, message in made.iter_messages()]
    poses = [json.loads(message.data) for topic, message in messages if topic == "/quad0/pose"]
    assert len(poses) == len(log)
    assert [list(pose["pose"]["position"].values()) for pose in poses] == log.position[:, 0].tolist()
    states = [json.loads(message.data)["letter"] for topic, message in messages if topic == "/quad0/state"]
    assert states == [" ".join(sorted(row[0])) for row in log.letters]


def recorded(log, layout):
    """The log's measured positions as another system would write them."""
    lines = []
    if layout == "long":
        lines.append("Time_ms,Rigid_Body,pos_x,pos_y,pos_z,quality")
        for i, time in enumerate(log.times):
            for j, robot in enumerate(log.robots):
                place = ["" if np.isnan(v) else f"{v:.6f}" for v in log.measured[i, j]]
                lines.append(f"{1000 * (time + 12.5):.3f},{robot},{','.join(place)},1")
    elif layout == "wide":
        lines.append("timestamp," + ",".join(f"{robot}.{axis}" for robot in log.robots for axis in "xyz"))
        for i, time in enumerate(log.times):
            cells = ["" if np.isnan(v) else f"{v:.6f}" for v in log.measured[i].ravel()]
            lines.append(f"{time + 12.5:.4f},{','.join(cells)}")
    else:
        lines.append("Frame time," + ",".join(f"{robot} {axis} (mm)" for robot in log.robots for axis in "XYZ"))
        for i, time in enumerate(log.times):
            cells = ["nan" if np.isnan(v) else f"{1000 * v:.3f}" for v in log.measured[i].ravel()]
            lines.append(f"{time:.4f},{','.join(cells)}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("layout", ["long", "wide", "millimetres"])
def test_recordings_are_read_by_the_names_of_their_columns(flown, tmp_path, layout):
    team, cert, log = flown
    (tmp_path / "mocap.csv").write_text(recorded(log, layout))
    columns, start = ({"t": "Frame time"}, 0.0) if layout == "millimetres" else (None, 12.5)
    found = flight.read_recording(tmp_path / "mocap.csv", log.robots, start=start, columns=columns)
    assert np.allclose(found.times, log.times, atol=1e-4)
    assert np.allclose(found.position, log.measured, atol=1e-5, equal_nan=True)
    result = flight.compare(found, cert, team, measurement=0.007)
    assert result.covered
    assert result.formula == "satisfied"
    with pytest.raises(BadInput, match="pass the team"):
        flight.compare(found, cert)


def test_a_log_compares_with_its_certificate_as_the_monitor_said(flown):
    team, cert, log = flown
    for given in (None, team):
        result = flight.compare(log, cert, given)
        assert result.covered
        assert result.formula == "satisfied"
        assert result.closest[0] > 0.3
        for name in log.robots:
            assert result.worst_error[name] == pytest.approx(np.max(log.error[:, log.robots.index(name)]))
            assert result.worst_error[name] <= result.bound[name] < 0.05
        assert len(result.sentences) >= 4


def test_a_logs_word_and_errors_are_those_of_its_samples(flown):
    _, _, log = flown
    times = [time for time, _ in log.word("quad0")]
    assert times == sorted(times)
    assert log.rms_error("quad0") <= log.worst_error("quad0") <= log.worst_error()
    with pytest.raises(ValueError, match="read-only"):
        log.position[0, 0, 0] = 1.0


def test_comparing_judges_every_claim_of_paths(flown):
    team, cert, log = flown
    result = flight.compare(log, cert, team)
    assert result.judged is not None
    assert {"tube", "formula", "transitions", "actions", "workspace", "separation"} <= {c.name for c in result.judged.claims}
    away = np.array(log.position)
    away[100:110, 1] += (0.0, 0.0, 0.3)
    broken = flight.compare(changed_log(log, position=away), cert, team)
    assert broken.tube == "outside"
    assert not broken.covered
    assert broken.bound["quad1"] >= 0.29


def test_what_a_plan_jumps_where_its_pieces_meet_counts():
    """99.95 mm away at every sample, and maybe 0.1 mm more between two, where the plan jumps towards the robot that follows it."""
    made = made_flight()[0]
    path = rest_to_rest([(0, 0, 1), (0, 0, 1), (0, 0, 1)], [0.505, 0.5])
    coefficients = np.array(path.coefficients)
    coefficients[1, 0, 0] = 1e-4
    team = {"quad0": Trajectory(path.durations, coefficients)}
    one = made.mission.model_copy(
        update={"agents": {"quad0": made.mission.agents["quad0"].model_copy(update={"start": (0.0, 0.0, 1.0)})},
                "spec": made.mission.spec.model_copy(update={"formula": "G !left"})}
    )  # fmt: skip
    cert = stand_in(Plan(mission=one, robots={"quad0": made.robots["quad0"]}), team, margin=0.1, duration=1.005)
    cert = dataclasses.replace(cert, actions=())
    times = np.arange(0, 1.006, 0.001)
    still = np.where(times[:, None] < 0.5045, [[-0.09995, 0.0, 1.0]], [[-0.09985, 0.0, 1.0]])
    seen = np.linalg.norm(still - team["quad0"].evaluate(np.minimum(times, 1.005))[:, :3], axis=1)
    assert seen.max() < 0.09996
    result = flight.compare(flight.Recording(("quad0",), times, still[:, None]), cert, team)
    assert result.tube == "unknown"
    assert result.bound["quad0"] > 0.1


def test_one_robot_that_was_seen_late_is_not_taken_to_be_as_slow_as_the_samples_show(flown):
    """Within 0.1 s its rotors can bring it from 0.15 m away, whatever the other robot's samples cover."""
    team, cert, log = flown
    still = np.stack([path.evaluate(np.minimum(log.times, path.duration))[:, :3] for path in team.values()], axis=1)
    late = np.array(still)
    late[log.times < 0.1, 0] = np.nan
    assert flight.compare(flight.Recording(tuple(team), log.times, still), cert, team).tube == "inside"
    result = flight.compare(flight.Recording(tuple(team), log.times, late), cert, team)
    assert result.tube == "unknown"
    assert result.bound["quad0"] > 0.15


@pytest.mark.slow
def test_times_with_few_digits_leave_robots_faster_than_they_seem(flown):
    team, cert, log = flown
    places = np.stack([path.evaluate(np.minimum(log.times, path.duration))[:, :3] for path in team.values()], axis=1)
    speeds = []
    for late in (0.0, 0.004):
        judged = flight.compare(flight.Recording(tuple(team), log.times, places, (late, 0.0)), cert, team).judged
        assert judged is not None
        speeds.append(float(next(s for s in judged.assumptions if "faster than" in s).split()[-2]))
    steps, gaps = np.linalg.norm(np.diff(places, axis=0), axis=2).max(axis=1), np.diff(log.times)
    assert speeds[1] > (steps / (gaps - 0.008)).max() > speeds[0]
    with pytest.raises(BadInput, match="max_speed"):
        flight.compare(flight.Recording(tuple(team), log.times, places, (0.01, 0.0)), cert, team)
