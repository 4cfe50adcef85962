"""Everything that is no log, no recording, or no flight of this certificate."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.logs.tables import log_from_csv
from tests.helpers.few import few_of
from tests.helpers.motion.stand_ins import changed_log
from verify.data import BadInput, NotCertified
from verify.recordings.flight_log import LOG_COLUMNS


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda rows: rows[:4] + rows[5:], "gap"),
        (lambda rows: rows[:-1], "gap"),
        (lambda rows: [*rows[:3], *rows[5:7], *rows[3:5], *rows[7:]], "times must go forward"),
        (lambda rows: rows[:1], "no rows"),
        (lambda rows: [",".join(LOG_COLUMNS[1:]), *rows[1:]], "lacks the columns t"),
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,robot,x,y,z\n0,quad0,0,0,0\n1,quad0,0,0,0\n", "no rows for 'quad1'"),
        ("t,quad0.x,quad0.y,quad0.z\n0,0,0,0\n1,0,0,0\n", "position of 'quad1'"),
        ("clock,robot,x,y,z\n0,quad0,0,0,0\n1,quad0,0,0,0\n", "column for the time"),
        ("t;robot;x;y;z\n0;quad0;0;0;0\n1;quad1;0;0;0\n", "parted by ';'; write commas"),
        ("t\trobot\tx\ty\tz\n0\tquad0\t0\t0\t0\n", r"fewer than two|parted by '\\t'"),
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
        flight.compare(changed_log(log, **change(log)), cert)


def test_a_flight_outside_its_tube_is_not_covered(flown):
    _, cert, log = flown
    error = np.array(log.error)
    error[100, 1] = 0.051
    result = flight.compare(changed_log(log, error=error), cert)
    assert result.tube == "outside"
    assert not result.covered
    assert result.worst_time["quad1"] == pytest.approx(1.0)
    nearly = np.array(log.error)
    nearly[100, 1] = 0.0499
    assert flight.compare(changed_log(log, error=nearly), cert, measurement=0.001).tube == "unknown"


def test_comparing_needs_a_certificate_of_this_team(flown):
    team, cert, log = flown
    with pytest.raises(NotCertified, match="no certificate"):
        flight.compare(log, None)
    with pytest.raises(NotCertified, match="does not cover"):
        flight.compare(log, cert, {"quad0": team["quad1"], "quad1": team["quad0"]})
    with pytest.raises(BadInput, match="measurement"):
        flight.compare(log, cert, measurement=-1.0)


@few_of(1, ("first", "last"), [(0.4, 0.0), (0.0, 0.9)])
def test_a_log_that_does_not_cover_the_flight_is_not_covered_by_its_certificate(flown, first, last):
    """Where a robot was before the first sample, or after the last one, nobody knows."""
    team, cert, log = flown
    kept = (log.times >= first) & (log.times <= log.times[-1] - last)
    part = changed_log(
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


@pytest.mark.parametrize(("unit", "power"), [("ms", 3), ("us", 6), ("ns", 9)])
def test_times_in_small_units_are_named_alike(tmp_path, unit, power):
    for name in ("t", "time", "timestamp"):
        step = 10 ** (power - 2)
        rows = "".join(f"{1_700_000_000 * 10**power + k * step},0,0,{k / 10}\n" for k in range(3))
        (tmp_path / "log.csv").write_text(f"{name}_{unit},quad0.x,quad0.y,quad0.z\n{rows}")
        assert flight.read_recording(tmp_path / "log.csv", ("quad0",)).times.tolist() == [0.0, 0.01, 0.02]


def test_positions_of_few_digits_are_said_to_need_an_error(tmp_path):
    for digits, said in (
        (2, ("Positions are written to 0.01 m: --error has to cover that, too.",)),
        (5, ()),
    ):  # heights are whole
        rows = "".join(f"{k / 50},{k / 7:.{digits}f},{k / 3:.{digits}f},1\n" for k in range(5))
        (tmp_path / "log.csv").write_text(f"t,quad0.x,quad0.y,quad0.z\n{rows}")
        assert flight.read_recording(tmp_path / "log.csv", ("quad0",)).notes == said


def test_a_start_beyond_all_clocks_is_none(tmp_path):
    (tmp_path / "log.csv").write_text("t,quad0.x,quad0.y,quad0.z\n0,0,0,1\n1,0,0,1\n")
    with pytest.raises(BadInput, match="within 1e"):
        flight.read_recording(tmp_path / "log.csv", ("quad0",), start=1e300)
