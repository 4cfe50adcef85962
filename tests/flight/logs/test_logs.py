"""Logs and recordings: round trips, files of others by column names, and everything that is no log."""

from __future__ import annotations

import csv
import dataclasses
import io
import json

import numpy as np
import pytest

import flight
from flight.logs.log import COLUMNS
from flight.logs.tables import log_from_csv
from tests.helpers.stand_ins import flight as made_flight
from tests.helpers.stand_ins import rest_to_rest, stand_in
from verify.data import BadInput, NotCertified, Plan, Trajectory


@pytest.fixture(scope="module")
def flown():
    plan, team = made_flight()
    cert = stand_in(plan, team)
    return team, cert, flight.fly(plan, team, cert, noise=0.001, seed=5)


def test_a_log_has_the_columns_of_the_contract(flown):
    _, _, log = flown
    header = log.to_csv().splitlines()[0].split(",")
    assert tuple(header[: len(COLUMNS)]) == COLUMNS
    assert header[len(COLUMNS) :] == ["rotor1", "rotor2", "rotor3", "rotor4", "mx", "my", "mz"]
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


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda rows: rows[:4] + rows[5:], "gap"),
        (lambda rows: rows[:-1], "gap"),
        (lambda rows: [*rows[:3], *rows[5:7], *rows[3:5], *rows[7:]], "times must go forward"),
        (lambda rows: rows[:1], "no rows"),
        (lambda rows: [",".join(COLUMNS[1:]), *rows[1:]], "lacks the columns t"),
        (lambda rows: [*rows[:2], rows[2].replace(",", ";"), *rows[3:]], "cells under"),
        (lambda rows: [*rows[:2], "x" + rows[2], *rows[3:]], "must be a number"),
        (lambda rows: [*rows[:2], "nan" + rows[2][rows[2].index(",") :], *rows[3:]], "finite"),
    ],
)
def test_damaged_logs_are_refused(flown, damage, message):
    rows = flown[2].to_csv().splitlines()
    with pytest.raises(BadInput, match=message):
        log_from_csv("\n".join(damage(rows)))


def test_other_files_are_refused(flown, tmp_path):
    (tmp_path / "picture.csv").write_bytes(b"\x89PNG\xff\xfe")
    (tmp_path / "flight.parquet").write_bytes(b"PAR1 not really")
    with pytest.raises(BadInput, match="UTF-8"):
        flight.read_log(tmp_path / "picture.csv")
    with pytest.raises(BadInput, match="cannot be read"):
        flight.read_log(tmp_path / "nothing.csv")
    with pytest.raises(BadInput, match=r"\.csv, \.parquet or \.mcap"):
        flight.write_log(flown[2], tmp_path / "flight.xlsx")
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    with pytest.raises(BadInput, match="Parquet"):
        flight.read_log(tmp_path / "flight.parquet")


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
    columns = {"t": "Frame time"} if layout == "millimetres" else None
    found = flight.read_recording(tmp_path / "mocap.csv", log.robots, columns=columns)
    assert np.allclose(found.times, log.times, atol=1e-4)
    assert np.allclose(found.position, log.measured, atol=1e-5, equal_nan=True)
    result = flight.compare(found, cert, team, measurement=0.007)
    assert result.covered
    assert result.formula == "satisfied"
    with pytest.raises(BadInput, match="pass the team"):
        flight.compare(found, cert)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,robot,x,y,z\n0,quad0,0,0,0\n1,quad0,0,0,0\n", "no rows for 'quad1'"),
        ("t,quad0.x,quad0.y,quad0.z\n0,0,0,0\n1,0,0,0\n", "position of 'quad1'"),
        ("clock,robot,x,y,z\n0,quad0,0,0,0\n1,quad0,0,0,0\n", "column for the time"),
        ("t,robot,x,y,z\n1,quad0,0,0,0\n0,quad1,0,0,0\n", "go forward"),
        ("t,robot,x,y,z\n1,quad0,0,here,0\n2,quad1,0,0,0\n", "finite number"),
        ("t,robot,x,y,z\n", "fewer than two"),
        ("t,robot,x,y,z\n1,quad0\n2,quad1,0,0,0\n", "cells under"),
    ],
)
def test_recordings_that_cannot_be_understood_are_refused(tmp_path, text, message):
    (tmp_path / "mocap.csv").write_text(text)
    with pytest.raises(BadInput, match=message):
        flight.read_recording(tmp_path / "mocap.csv", ("quad0", "quad1"))


def test_a_column_that_is_not_there_is_named(tmp_path):
    (tmp_path / "mocap.csv").write_text("Frame time,x,y,z\n0,0,0,0\n1,0,0,0\n")
    with pytest.raises(BadInput, match="Did you mean 'Frame time'"):
        flight.read_recording(tmp_path / "mocap.csv", ("quad0",), columns={"t": "Frame Time"})
    assert len(flight.read_recording(tmp_path / "mocap.csv", ("quad0",), columns={"t": "Frame time"}).times) == 2
    with pytest.raises(BadInput, match="before the flight's start"):
        flight.read_recording(tmp_path / "mocap.csv", ("quad0",), columns={"t": "Frame time"}, start=5.0)


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


def changed(log, **changes):
    values = {
        name: getattr(log, name)
        for name in ("mission", "robots", "times", "position", "velocity", "attitude", "thrust", "rates", "error", "letters")
    }
    return flight.FlightLog(**{**values, **changes})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda log: {"position": 1000 * log.position}, "millimetres"),
        (lambda log: {"times": 1000 * log.times}, "ms or us"),
        (lambda log: {"times": 0.001 * log.times}, "other units"),
        (lambda log: {"times": log.times + 2.0 * (log.times > 2.0)}, "gap of 2.01 s"),
        (lambda log: {"times": log.times + 2.0}, "begins 2 s after"),
        (lambda log: {"times": log.times * 0.5}, "before the flight does"),
        (lambda log: {"robots": ("quad0", "quad7")}, "quad7"),
    ],
)
def test_logs_that_cannot_be_this_flight_are_refused_with_a_hint(flown, change, message):
    _, cert, log = flown
    with pytest.raises(BadInput, match=message):
        flight.compare(changed(log, **change(log)), cert)


def test_a_flight_outside_its_tube_is_not_covered(flown):
    _, cert, log = flown
    error = np.array(log.error)
    error[100, 1] = 0.051
    result = flight.compare(changed(log, error=error), cert)
    assert result.tube == "outside"
    assert not result.covered
    assert result.worst_time["quad1"] == pytest.approx(1.0)
    nearly = np.array(log.error)
    nearly[100, 1] = 0.0499
    assert flight.compare(changed(log, error=nearly), cert, measurement=0.001).tube == "unknown"


def test_comparing_needs_a_certificate_of_this_team(flown):
    team, cert, log = flown
    with pytest.raises(NotCertified, match="no certificate"):
        flight.compare(log, None)
    with pytest.raises(NotCertified, match="does not cover"):
        flight.compare(log, cert, {"quad0": team["quad1"], "quad1": team["quad0"]})
    with pytest.raises(BadInput, match="measurement"):
        flight.compare(log, cert, measurement=-1.0)


def test_a_logs_word_and_errors_are_those_of_its_samples(flown):
    _, _, log = flown
    times = [time for time, _ in log.word("quad0")]
    assert times == sorted(times)
    assert log.rms_error("quad0") <= log.worst_error("quad0") <= log.worst_error()
    with pytest.raises(ValueError, match="read-only"):
        log.position[0, 0, 0] = 1.0


@pytest.mark.parametrize(("first", "last"), [(0.4, 0.0), (0.0, 0.9)])
def test_a_log_that_does_not_cover_the_flight_is_not_covered_by_its_certificate(flown, first, last):
    """Where a robot was before the first sample, or after the last one, nobody knows."""
    team, cert, log = flown
    kept = (log.times >= first) & (log.times <= log.times[-1] - last)
    part = changed(
        log, times=log.times[kept], position=log.position[kept], velocity=log.velocity[kept], attitude=log.attitude[kept],
        thrust=log.thrust[kept], rates=log.rates[kept], error=log.error[kept],
        letters=tuple(letters for letters, keep in zip(log.letters, kept, strict=True) if keep),
    )  # fmt: skip
    for given in (None, team):
        result = flight.compare(part, cert, given)
        assert result.tube == "unknown"
        assert not any("covers this flight" in sentence for sentence in result.sentences)
    recording = flight.Recording(log.robots, part.times, part.position)
    assert flight.compare(recording, cert, team).tube == "unknown"


def test_comparing_judges_every_claim_of_paths(flown):
    team, cert, log = flown
    result = flight.compare(log, cert, team)
    assert result.judged is not None
    assert {"tube", "formula", "transitions", "actions", "workspace", "separation"} <= {c.name for c in result.judged.claims}
    away = np.array(log.position)
    away[100:110, 1] += (0.0, 0.0, 0.3)
    broken = flight.compare(changed(log, position=away), cert, team)
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
