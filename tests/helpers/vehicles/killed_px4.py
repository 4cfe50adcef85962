"""A process that flies a PX4 vehicle by the command line, and is killed, frozen or interrupted: each by its number."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from flight.link.live_executive import INTERRUPTED
from tests.helpers.commands import ROOT
from tests.helpers.live.failed_flights import FASTEST, NEAR, Ended
from tests.helpers.live.failure_draws import BEFORE, Draw, drawn
from tests.helpers.vehicles.failing_px4 import fastest_asked, settle, state_of
from tests.helpers.vehicles.px4_peer import OFFBOARD, Manner, Px4Peer, free_port

KINDS = ("killed", "frozen", "frozen and killed", "terminated", "interrupted", "interrupted twice")
SIGNALS = {
    "killed": signal.SIGKILL,
    "terminated": signal.SIGTERM,
    "interrupted": signal.SIGINT,
    "interrupted twice": signal.SIGINT,
}
PHASES: tuple[Callable[[Px4Peer], bool], ...] = (
    lambda peer: True,  # it is loaded, and what is flown is proved
    lambda peer: peer.before > 5,
    lambda peer: len(peer.flown) > 0,
    lambda peer: peer.place[0] > -0.4,
)
LENGTHS = (3.0, 2.5, 3.0, 6.0)
"""s within which it fails after a phase has begun."""
LATE, NOTICED = 0.3, 1.0
"""s: what is frozen for less is not noticed, and for more it is."""
_PROGRAM = "from tests.helpers.live.patience import be_patient; be_patient(); from ltlplan.start import main; main()"


@dataclass(frozen=True)
class Happened:
    """What was so when it happened.

    Attributes:
        over: Whether the process had ended.
        before: Whether no set-point had been flown.
        flying: Whether the vehicle followed set-points.
        turning: Whether motors turned when the process had ended.
    """

    over: bool
    before: bool
    flying: bool
    turning: bool


def fly_killed(number: int, folder: str) -> Ended:
    """Fly a run's folder in a process of its own to which something happens.

    Args:
        number: Of the draw.
        folder: The run of `HOP`.
    """
    draw, port = drawn(4, number, KINDS, ("one",)), free_port()
    peer = Px4Peer(1, port, (-0.5, 0.0, 0.0), Manner(armed=False))
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "live"
        host = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, "fly", folder, "--link", "mavlink", "--unchecked", "battery", "--address", f"one=udpin:127.0.0.1:{port}", "--out", str(out)],
            cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        peer.start()
        try:
            wait = Waiting(host)
            wait.until(lambda: PHASES[draw.phase + 1](peer))
            wait.seconds(draw.share * LENGTHS[draw.phase + 1])
            over, before, flying = host.poll() is not None, not peer.flown, peer.mode == OFFBOARD and peer.armed
            if not over:
                happen(draw, host)
            said, _ = host.communicate(timeout=60)
            happened = Happened(over, before, flying, peer.armed)
            settle([peer])
            faults = _faults(draw, host.returncode, peer, out, said, happened=happened)
        finally:
            host.kill()
            host.communicate()
            peer.ended.set()
            peer.join()
    outcome = {0: "flown", 5: "ended"}.get(host.returncode, f"exit code {host.returncode}")
    return Ended(
        draw,
        outcome,
        (state_of(peer, 0.0),),
        (),
        tuple(f"{fault}; {said[-300:]}" for fault in faults),
        happened.over and host.returncode != 0,
    )


class Waiting:
    """Waits while a process runs."""

    def __init__(self, host: subprocess.Popen[str]) -> None:
        self._host, self._end = host, time.monotonic() + 60.0

    def until(self, condition: Callable[[], bool]) -> None:
        while not condition() and self._host.poll() is None and time.monotonic() < self._end:
            time.sleep(0.005)

    def seconds(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end)


def happen(draw: Draw, host: subprocess.Popen[str]) -> None:
    """Send what a draw says."""
    if draw.kind in SIGNALS:
        host.send_signal(SIGNALS[draw.kind])
        if draw.kind == "interrupted twice":
            time.sleep(draw.lasts / 2)
            host.send_signal(signal.SIGTERM)
        return
    host.send_signal(signal.SIGSTOP)
    time.sleep(draw.lasts)
    host.send_signal(signal.SIGKILL if draw.kind == "frozen and killed" else signal.SIGCONT)


def codes(draw: Draw, *, over: bool, before: bool, flew: bool) -> set[int]:
    """Return what the process may end with.

    Args:
        draw: What happened.
        over: Whether it had ended before that.
        before: Whether it happened before a set-point was flown.
        flew: Whether one was flown at all.
    """
    if over:
        return {0}
    if draw.kind in ("killed", "frozen and killed"):
        return {-signal.SIGKILL}
    if draw.kind in SIGNALS:
        number = SIGNALS[draw.kind]
        return {
            128 + number,
            *({-number} if draw.phase == BEFORE else ()),
            *({0} if flew else ()),
        }  # not begun yet; over already
    return {0, 2, 5} if before or LATE < draw.lasts < NOTICED else {0} if draw.lasts <= LATE else {0, 5}


def _faults(draw: Draw, code: int, peer: Px4Peer, out: Path, said: str, *, happened: Happened) -> list[str]:
    """Return what must not be."""
    found, state, flew = list[str](), state_of(peer, 0.0), bool(peer.flown)
    if state not in ("ground", "landed"):
        found.append(f"the vehicle is {state}")
    if code not in (allowed := codes(draw, over=happened.over, before=happened.before, flew=flew)):
        found.append(f"exit code {code}, not {allowed}")
    if happened.turning and code >= 0 and "has not acknowledged" not in said:
        found.append("it is said to be safe, and its motors turn")
    if (jump := fastest_asked(peer)) > FASTEST:
        found.append(f"it was asked to fly {jump:.1f} m/s")
    told = draw.kind in SIGNALS and draw.kind != "killed"
    if told and peer.failsafes:
        found.append("it had to find out by itself")
    if happened.flying and not told and (draw.kind != "frozen" or draw.lasts > 1.3) and peer.failsafes != 1:
        found.append(f"its failsafe acted {peer.failsafes} times")
    if code >= 0 and (flew or code == 0):
        found += _faults_of_files(out, code, landed=state == "landed" and not happened.turning)
    return found


def _faults_of_files(out: Path, code: int, *, landed: bool) -> list[str]:
    """Return what is missing or wrong in the files of a flight that has ended."""
    data = json.loads((out / "live.json").read_text())
    sentences = [event["sentence"] for event in data["events"]]
    found = [] if (INTERRUPTED in sentences) is (code > 128) else [f"exit code {code}, and events {sentences}"]
    head, *rows = (out / "poses.csv").read_text().splitlines()
    times = [float(row.split(",")[0]) for row in rows]
    if head != "t,robot,x,y,z" or times != sorted(times) or any(len(row.split(",")) != 5 for row in rows):
        found.append("poses.csv cannot be read")
    if landed and data["starts"] and not float(rows[-1].split(",")[4]) < NEAR:
        found.append(f"it was recorded last at {rows[-1]}")
    if ("flight" in data["starts"]) is not (out / "live.csv").exists():
        found.append("live.csv")
    return found
