"""Motion capture by libmotioncapture, which a module in its place stands in for, and what an inventory says of it."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from flight.exports.crazyflies.inventory import read_capture
from flight.link.crazyflie import capture
from verify.data import BadInput, MissingEngine

STAND_IN = """
import time

class Rotation:
    x, y, z, w = 0.0, 0.0, 0.6, 0.8

class Body:
    position, rotation = [1.0, 2.0, 0.5], Rotation

class System:
    rigidBodies = {}

    def waitForNextFrame(self):
        self.rigidBodies = {"quad0": Body}

def connect(kind, settings):
    if kind == "silent":
        time.sleep(60.0)
    if kind != "vicon":
        raise RuntimeError("Unknown motion capture type!")
    assert settings == {"hostname": "10.0.0.2"}
    return System()
"""


@pytest.fixture
def library(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "motioncapture.py").write_text(STAND_IN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(capture, "PATIENCE", 1.0)


@pytest.mark.slow
def test_frames_come_by_the_names_of_bodies(library) -> None:
    frame = capture.connected_to("vicon", {"hostname": "10.0.0.2"})()
    assert frame == {"quad0": capture.Body((1.0, 2.0, 0.5), (0.0, 0.0, 0.6, 0.8))}
    with pytest.raises(BadInput, match=r"'silent' \(hostname 10\.0\.0\.2\) cannot be reached: it does not answer within 1 s\."):
        capture.connected_to("silent", {"hostname": "10.0.0.2"})
    with pytest.raises(BadInput, match=r"'wicon' .no hostname. cannot be reached: Unknown motion capture type"):
        capture.connected_to("wicon", {})


def test_without_the_library_it_is_named(monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "motioncapture", None)
    with pytest.raises(MissingEngine, match=r"pip install 'ltlplan\[crazyflie\]'"):
        capture.connected_to("vicon", {})


def test_a_watch_tells_every_frame_until_the_system_fails() -> None:
    frames = [{"quad0": capture.Body((0.0, 0.0, z), (0.0, 0.0, 0.0, 1.0))} for z in (0.1, 0.2)]
    told, left = [], list(frames)
    watch = capture.Watch(lambda: left.pop(0), told.append)  # an IndexError after the last
    watch.join(timeout=5.0)
    assert not watch.is_alive()
    assert told == frames


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("motion_capture: vicon", "motion_capture must be a table such as"),
        ("motion_capture: {hostname: a}", "motion_capture must be a table such as"),
        ("- 1", None),
        ("robots: {}", None),
    ],
)
def test_what_an_inventory_says_of_motion_capture(tmp_path: Path, text: str, says: str | None) -> None:
    file = tmp_path / "lab.yaml"
    file.write_text(textwrap.dedent(text))
    if says is None:
        assert read_capture(file) is None
        return
    with pytest.raises(BadInput, match=says):
        read_capture(file)


def test_settings_are_read_as_text(tmp_path: Path) -> None:
    file = tmp_path / "lab.yaml"
    file.write_text("robots: {}\nmotion_capture: {type: optitrack, hostname: 192.168.1.2, port: 1511}\n")
    found = read_capture(file)
    assert found is not None
    assert (found.kind, found.settings) == ("optitrack", {"hostname": "192.168.1.2", "port": "1511"})
