"""Poses of motion capture, as they come: from any system that libmotioncapture speaks to, or from a function of one's own."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from verify.data import BadInput, MissingEngine

PATIENCE = 5.0
"""s that a system has to answer."""


@dataclass(frozen=True, slots=True)
class Body:
    """One body as motion capture sees it.

    Attributes:
        position: x, y, z in m, of the mission's frame.
        attitude: Quaternion x, y, z, w.
    """

    position: tuple[float, float, float]
    attitude: tuple[float, float, float, float]


class Capture(Protocol):
    """Waits for a frame of motion capture, and says where it sees which body."""

    def __call__(self) -> Mapping[str, Body]:
        """Return the bodies of the next frame, by the robots' names; those that are not seen are left out."""
        ...


def connected_to(kind: str, settings: Mapping[str, str]) -> Capture:
    """Return a motion capture system's frames; its bodies are named as the mission's robots.

    Args:
        kind: One that libmotioncapture speaks to.
        settings: As libmotioncapture has them, such as `hostname`.

    Raises:
        BadInput: It cannot be reached.
        MissingEngine: libmotioncapture's Python package is not installed.
    """
    try:
        library: Any = importlib.import_module("motioncapture")  # it has no types
    except ImportError:
        raise MissingEngine("motion capture needs libmotioncapture: pip install 'ltlplan[crazyflie]'.") from None
    if reason := _unreachable(kind, settings):
        where = ", ".join(f"{key} {value}" for key, value in settings.items()) or "no hostname"
        raise BadInput(f"motion capture '{kind}' ({where}) cannot be reached: {reason}.")
    system = library.connect(kind, dict(settings))

    def frame() -> Mapping[str, Body]:
        system.waitForNextFrame()
        return {name: _body(seen) for name, seen in system.rigidBodies.items()}

    return frame


def _body(seen: Any) -> Body:
    x, y, z = map(float, seen.position)
    turned = seen.rotation
    return Body((x, y, z), (turned.x, turned.y, turned.z, turned.w))


def _unreachable(kind: str, settings: Mapping[str, str]) -> str:
    """Return why a system cannot be reached; empty where it can. Another process tries: for one that is not there the library waits for ever."""
    code = "import sys, json, motioncapture; motioncapture.connect(sys.argv[1], json.loads(sys.argv[2]))"
    try:
        tried = subprocess.run(
            [sys.executable, "-c", code, kind, json.dumps(dict(settings))],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"it does not answer within {PATIENCE:g} s"
    if tried.returncode == 0:
        return ""
    lines = tried.stderr.strip().splitlines() or ["it fails"]
    return lines[-1].partition("Error: ")[2].rstrip(".!") or lines[-1].rstrip(".!")


class Watch(threading.Thread):
    """Tells of every frame until it is ended."""

    def __init__(self, capture: Capture, tell: Callable[[Mapping[str, Body]], None]) -> None:
        """Begin.

        Args:
            capture: Waits for frames.
            tell: Receives each.
        """
        super().__init__(name="motion capture", daemon=True)
        self._capture, self._tell = capture, tell
        self.ended = threading.Event()
        self.start()

    def run(self) -> None:
        """Wait for frames; where the system fails, no pose comes any more, and that is what is seen of it."""
        while not self.ended.is_set():
            try:
                frame = self._capture()
            except Exception:
                return
            self._tell(frame)
