"""`ltlplan certify RUN --flight LOG` as users have their logs: what is read, what is refused, and the page."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ltlplan.cli import app
from tests.helpers.few import few_of
from tests.helpers.live import foreign_logs
from tests.helpers.live.recordings import gates
from tests.ltlplan.commands.test_proofs import write_folder
from verify.data import BadInput

runner = CliRunner()
BEFORE, AFTER = 1.0, 0.5
"""s of climb and of landing."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write_folder(tmp_path_factory.mktemp("gates") / "run", *gates())


def flown() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times, 0 where the flight begins, and where the robot was: a climb, the flight 8 mm aside, a landing."""
    _, team, certificate = gates()
    times = np.arange(-round(100 * BEFORE), round(100 * (certificate.duration + AFTER))) * 0.01
    places = {}
    for name, path in team.items():
        at = path.evaluate(np.clip(times, 0, path.duration))[:, :3] + [0.0, 0.008, 0.0]
        at[:, 2] += 0.9 * np.minimum(times, 0.0) - 0.5 * np.maximum(times - certificate.duration, 0.0)
        places[name] = at
    return times, places


def judge(run: Path, log: Path, *more: str):
    return runner.invoke(app, ["certify", str(run), "--flight", str(log), "--max-speed", "1.2", "--error", "0.001", *more])


def test_a_motion_capture_export_with_climb_and_landing_is_judged_and_shown(run, tmp_path):
    times, places = flown()
    (tmp_path / "vicon.csv").write_text(foreign_logs.vicon(times, places, frame=501))
    page = tmp_path / "flown.html"
    done = judge(run, tmp_path / "vicon.csv", "--start", f"{5.01 + BEFORE:g}", "--start-error", "0.005", "--report", str(page))
    assert done.exit_code == 0, done.output
    assert "Vicon's export: times are frame numbers / 100 Hz." in done.output
    assert "from -0.005 to 0.005 s" in done.output
    text = page.read_text()
    assert "Satisfied: all" in text
    assert "Distance from the plan" in text


def test_without_a_start_a_climb_breaks_nothing_and_proves_nothing(run, tmp_path):
    times, places = flown()
    (tmp_path / "vicon.csv").write_text(foreign_logs.vicon(times, places, frame=501))
    done = judge(run, tmp_path / "vicon.csv")
    assert done.exit_code == 5
    assert done.output.count("cannot tell") > 1
    assert "violated" not in done.output
    proposed = float(done.output.split("(`--start ")[1].split("`")[0])
    assert proposed == pytest.approx(5.01 + BEFORE, abs=0.05)


def test_a_flight_that_left_its_tube_is_told(run, tmp_path):
    times, places = flown()
    away = {name: place + 0.08 * np.exp(-(((times - 2.0) / 0.4) ** 2))[:, None] * [0, 0, 1] for name, place in places.items()}
    (tmp_path / "qtm.tsv").write_text(foreign_logs.qualisys(times, away))
    done = judge(run, tmp_path / "qtm.tsv", "--start", f"{times[0] * -1:g}")
    assert done.exit_code == 5
    assert "Violated, whatever happened between the samples (tube)." in done.output
    assert "from its plan" in done.output


def test_a_log_that_starts_late_proves_nothing_and_says_for_how_long_nobody_was_seen(run, tmp_path):
    times, places = flown()
    late = times > 1.5
    text = foreign_logs.qualisys(times[late], {name: place[late] for name, place in places.items()})
    (tmp_path / "qtm.tsv").write_text(text)
    done = judge(run, tmp_path / "qtm.tsv", "--start", "0")
    assert done.exit_code == 5
    assert "cannot tell" in done.output
    assert "violated" not in done.output
    assert "quad0 was not seen for 1.51 s, from 0.00 s on." in done.output


def _cut(path: Path) -> None:
    times, places = flown()
    data = foreign_logs.ulog(times, places["quad0"], booted=20.0)
    path.write_bytes(data[: len(data) - 7])


def _nothing(path: Path) -> None:
    times, places = flown()
    path.write_bytes(foreign_logs.ulog(times[:0], places["quad0"][:0], booted=20.0))


def _bomb(path: Path) -> None:
    """An MCAP file whose one chunk says that it holds little, and holds a hundred megabytes of zeros."""
    zstandard = pytest.importorskip("zstandard", reason="zstandard is not installed")
    packed = zstandard.ZstdCompressor().compress(bytes(100_000_000))
    chunk = struct.pack("<QQQI", 0, 1, 1000, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x06" + struct.pack("<Q", len(chunk)) + chunk + b"\x89MCAP0\r\n")


def _table(text: str):
    return lambda path: path.write_text(text)


HOSTILE = {
    "empty.csv": (_table(""), "is empty"),
    "late.csv": (_table("t,quad0.x,quad0.y,quad0.z\n1,0,0,1\n2,0,0,1\n"), "before the flight's start"),
    "nan.csv": (_table("t,quad0.x,quad0.y,quad0.z\n9,nan,nan,nan\n10,nan,nan,nan\n"), "no sample"),
    "back.csv": (_table("t,quad0.x,quad0.y,quad0.z\n9,0,0,1\n8,0,0,1\n"), "go forward"),
    "named.csv": (_table("t,Quad0.x,Quad0.y,Quad0.z\n9,0,0,1\n10,0,0,1\n"), "--rename"),
    "mm.csv": (_table("t,quad0.x,quad0.y,quad0.z\n9,-800,0,1000\n10,-790,0,1000\n"), "millimetres"),
    "ms.csv": (_table("t,quad0.x,quad0.y,quad0.z\n9,-0.8,0,1\n19,-0.8,0,1\n29,-0.8,0,1\n"), "--rename time_ms=t"),
    "two.csv": (
        _table("Timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,kalman.stateX\n9000,0,0,1,0\n"),
        "--rename x=",
    ),
    "clock.csv": (
        _table("timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z\n9.5,0,0,1\n9.6,0,0,1\n"),
        "--rename time_s=timestamp",
    ),
    "markers.csv": (_table("Trajectories\n100\n"), "export the objects"),
    "cut.ulg": (_cut, "was cut"),
    "nothing.ulg": (_nothing, "no vehicle_local_position"),
    "other.ulg": (_table("no log"), "does not begin as one"),
    "bomb.mcap": (_bomb, "made to fill the memory"),
    "other.mcap": (_table("no bag"), "does not begin as one"),
    "other.db3": (_table("no bag, but long enough to be taken for one" * 20), "no bag of sqlite3"),
}


@few_of(2, "name", HOSTILE)
def test_a_log_that_is_none_ends_in_one_sentence(run, tmp_path, name):
    write, message = HOSTILE[name]
    if name.endswith(".ulg"):
        pytest.importorskip("pyulog", reason="pyulog is not installed")
    if name.endswith((".mcap", ".db3")):
        pytest.importorskip("rosbags", reason="rosbags is not installed")
    write(tmp_path / name)
    page = tmp_path / "flown.html"
    done = judge(run, tmp_path / name, "--start", "9", "--report", str(page))
    assert isinstance(done.exception, BadInput)
    assert message in str(done.exception)
    assert "\n" not in str(done.exception)
    assert not page.exists()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--start", "soon"], "--start is 'soon'"),
        (["--start", "quad0=1,quad0=2"], "--start is"),
        (["--start-error", "0.1"], "give --start as well"),
        (["--rename", "quad0"], "--rename is 'quad0'"),
        (["--rename", "quad0=a", "--rename", "quad0=b"], "says twice"),
        (["--origin", "1,2"], "--origin is '1,2'"),
        (["--origin", "1,2,3", "--origin", "0,0,0"], "given twice for all robots"),
        (["--start", "1", "--origin", "quad9=1,2,3"], "'quad9'"),
    ],
)
def test_what_is_told_wrongly_is_refused(run, tmp_path, more, message):
    times, places = flown()
    (tmp_path / "vicon.csv").write_text(foreign_logs.vicon(times, places))
    done = judge(run, tmp_path / "vicon.csv", *more)
    assert isinstance(done.exception, BadInput)
    assert message in str(done.exception)
