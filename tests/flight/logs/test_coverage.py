"""What a recording covers: all that its files hold or promise, whoever was seen meanwhile, at both ends and in every format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import flight
from flight import RecordingOptions
from ltlplan import judge_flight
from tests.helpers.few import few_of
from tests.helpers.live import foreign_logs
from tests.helpers.motion.flights import small_mission
from verify.data import BadInput, mission_to_yaml

TIMES = np.arange(0, 201) * 0.01
SEEN = np.arange(50, 150)
"""Frames in which the robot was seen, of the 2 s that were recorded."""
FIRST, LAST = 0.5, 1.49


def _seen(places: np.ndarray, *, other: bool = False) -> np.ndarray:
    shown = np.isin(np.arange(len(TIMES)), SEEN) != other
    return np.where(shown[:, None], places, np.nan)


PATH = np.stack([0.2 * TIMES, 0.1 * TIMES, 1.0 + 0.0 * TIMES], axis=1)
CART = np.tile([2.0, 0.0, 0.5], (len(TIMES), 1))
LOST = {"r0": _seen(PATH), "cart": CART}
RENAMED = {"r0": _seen(PATH), "R0": _seen(PATH, other=True)}


def _long(bodies: dict[str, np.ndarray]) -> str:
    rows = [
        f"{time:.4f},{name},{','.join(f'{x:.6f}' for x in row[k])}\n"
        for k, time in enumerate(TIMES)
        for name, row in bodies.items()
        if not np.isnan(row[k][0])
    ]
    return "t,robot,x,y,z\n" + "".join(rows)


def _wide() -> str:
    cells = ["" if np.isnan(x) else f"{x:.6f}" for x in LOST["r0"].ravel()]
    return "t,r0.x,r0.y,r0.z\n" + "".join(f"{t:.4f},{','.join(cells[3 * k : 3 * k + 3])}\n" for k, t in enumerate(TIMES))


def _text(text: str) -> Callable[[Path], Path]:
    def write(path: Path) -> Path:
        (path / "log.csv").write_text(text)
        return path / "log.csv"

    return write


def _crazyflie(path: Path) -> Path:
    lines = foreign_logs.crazyflie(TIMES, PATH, booted=0.0).splitlines()
    cut = [line if k - 1 in SEEN else f"{line.split(',')[0]},,,,3.9" for k, line in enumerate(lines[1:], 1)]
    return _text("\n".join([lines[0], *cut]) + "\n")(path)


def _ulog(path: Path) -> Path:
    pytest.importorskip("pyulog", reason="pyulog is not installed")
    data = foreign_logs.ulog(TIMES[SEEN], PATH[SEEN], booted=3.0, began=0.0, lost={len(SEEN): 0.51})
    (path / "log.ulg").write_bytes(data)
    return path / "log.ulg"


def _bag(kind: str, bodies: dict[str, np.ndarray], *, mcap: bool) -> Callable[[Path], Path]:
    def write(path: Path) -> Path:
        pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed")
        foreign_logs.bag(path / "bag", TIMES, bodies, kind=kind, mcap=mcap)
        return path / "bag"

    return write


def _mcap(path: Path) -> Path:
    pytest.importorskip("mcap", reason="mcap is not installed")
    foreign_logs.our_mcap(path / "flight.mcap", TIMES, {"r0": LOST["r0"]})
    return path / "flight.mcap"


def _vicon_in_two_parts(sub_frame: str = "0") -> str:
    rows = foreign_logs.vicon(TIMES, LOST).splitlines()
    markers = [
        "",
        "Trajectories",
        "100",
        ",,cart:one,,",
        "Frame,Sub Frame,X,Y,Z",
        ",,mm,mm,mm",
        *(f"{k + 1},{sub_frame},1,2,3" for k in range(201)),
    ]
    return "\n".join([*rows[:5], *(rows[5 + k] for k in SEEN), *markers]) + "\n"


def _vicon_with_empty_ends() -> str:
    rows = foreign_logs.vicon(TIMES, {"r0": LOST["r0"]}).splitlines()
    seen = set(SEEN)
    return "\n".join([*rows[:5], *(row if k in seen else ",,,,,,," for k, row in enumerate(rows[5:]))]) + "\n"


def _vicon_with_a_blank_line() -> str:
    rows = foreign_logs.vicon(TIMES, LOST).splitlines()
    rows[5 + 100] = ""
    return "\n".join(rows) + "\n"


def _promised(written: Callable[..., str], frame: int) -> str:
    return written(TIMES[SEEN], {"r0": PATH[SEEN]}, promised=len(TIMES), frame=frame + int(SEEN[0]))


FORMATS: dict[str, Callable[[Path], Path]] = {
    "long table, another body": _text(_long(LOST)),
    "long table, a name in another case": _text(_long(RENAMED)),
    "wide table": _text(_wide()),
    "Vicon, another body": _text(foreign_logs.vicon(TIMES, LOST)),
    "Vicon, another part": _text(_vicon_in_two_parts()),
    "Vicon, another part without sub frames": _text(_vicon_in_two_parts("")),
    "Vicon, empty lines at its ends": _text(_vicon_with_empty_ends()),
    "Vicon, a blank line": _text(_vicon_with_a_blank_line()),
    "Motive": _text(_promised(foreign_logs.motive, 0)),
    "Qualisys": _text(_promised(foreign_logs.qualisys, 1)),
    "Crazyflie": _crazyflie,
    "PX4": _ulog,
    "poses": _bag("PoseStamped", LOST, mcap=False),
    "named poses": _bag("NamedPoseArray", RENAMED, mcap=True),
    "our log": _mcap,
}


@pytest.mark.parametrize("kind", FORMATS)
def test_a_recording_covers_what_its_files_hold_or_promise(tmp_path: Path, kind: str) -> None:
    path = FORMATS[kind](tmp_path)
    told = RecordingOptions(axes="x,-z,y" if kind == "Motive" else "")
    found = flight.read_flown(path, ("r0",), told)
    seen = found.times[~np.isnan(found.position[:, 0, 0])]
    assert seen[-1] - seen[0] == pytest.approx(LAST - FIRST, abs=2e-3)
    after = FIRST if kind in ("Motive", "Qualisys") else 0.0  # what is lost may be lost at either end
    assert seen[0] - found.covers[0] == pytest.approx(FIRST, abs=3e-3)
    assert found.covers[1] - seen[-1] == pytest.approx(2.0 - LAST + after, abs=3e-3)


@few_of(5, "kind", FORMATS)
def test_nothing_is_satisfied_of_what_was_not_seen(tmp_path: Path, kind: str) -> None:
    """The robot may have flown into `a`, 0.5 m away, before it was seen first or after it was seen last."""
    mission = small_mission("G !a", regions="a: {center: [0.2, 0.6, 1.0], radii: [0.1, 0.1, 0.1]}")
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(mission))
    path = FORMATS[kind](tmp_path)
    axes = "x,-z,y" if kind == "Motive" else ""
    verdict = judge_flight(tmp_path / "mission.yaml", path, max_speed=1.0, error=1e-5, told=RecordingOptions(axes=axes)).verdict
    assert verdict.outcome == "undecided", verdict.sentence
    assert any("r0 was not seen for" in said for said in verdict.assumptions)


def test_a_blank_line_is_a_frame_that_was_not_written(tmp_path: Path) -> None:
    found = flight.read_flown(FORMATS["Vicon, a blank line"](tmp_path), ("r0",), RecordingOptions())
    assert len(found.times) == len(TIMES) - 1
    assert np.isnan(found.position[:, 0, 0]).sum() == len(TIMES) - len(SEEN)
    text = foreign_logs.vicon(TIMES, LOST).splitlines()
    text.insert(100, "lost")
    with pytest.raises(BadInput, match=":101: a row of Vicon's export begins with its frame"):
        flight.read_flown(_text("\n".join(text) + "\n")(tmp_path), ("r0",), RecordingOptions())


def test_an_export_that_lacks_frames_says_so_and_when_it_should_have_ended(tmp_path: Path) -> None:
    text = _promised(foreign_logs.qualisys, 1)
    found = flight.read_flown(_text(text)(tmp_path), ("r0",), RecordingOptions())
    assert any("promises 201 frames, and 100 are there" in note for note in found.notes)
    with pytest.raises(BadInput, match="does not say how many there are a second"):
        flight.read_flown(_text(text.replace("FREQUENCY\t100", "FREQUENCY\t"))(tmp_path), ("r0",), RecordingOptions())


@pytest.mark.parametrize(("digits", "late"), [(6, 5e-7), (4, 5e-5), (2, 5e-3), (1, 5e-2)])
def test_times_are_off_by_half_of_their_last_place(tmp_path: Path, digits: int, late: float) -> None:
    """However coarse they are; and it is said for what that counts."""
    times = np.arange(0, 21) / 10 + 1e-4 * np.arange(21)
    rows = [f"{time:.{digits}f},{0.05 * time:.6f},0.123456,1.000001\n" for time in times.tolist()]
    (tmp_path / "log.csv").write_text("t,r0.x,r0.y,r0.z\n" + "".join(rows))
    (tmp_path / "mission.yaml").write_text(mission_to_yaml(small_mission("true")))
    found = flight.read_flown(tmp_path / "log.csv", ("r0",), RecordingOptions())
    assert found.rounding[0] == pytest.approx(late, rel=1e-6)
    judged = judge_flight(tmp_path / "mission.yaml", tmp_path / "log.csv", max_speed=0.5)
    said = [sentence for sentence in judged.verdict.assumptions if "No time is off by more than" in sentence]
    assert bool(said) == (0.5 * late > 1e-4)
    assert not said or f"{0.5 * late:.4g} m of that" in said[0]
