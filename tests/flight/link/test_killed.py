"""The process that flies PX4 vehicles is frozen, interrupted and killed: vehicles end on the ground, disarmed, in every phase."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import pytest

import ltlplan
from tests.helpers.live.live_missions import HOP
from tests.helpers.vehicles.px4_peer import LAND, OFFBOARD, Manner, Px4Peer, free_port

pytest.importorskip("pymavlink", reason="pymavlink is not installed")

PHASES: dict[str, Callable[[Px4Peer], bool]] = {
    "before offboard flight": lambda peer: peer.before > 5,
    "while it climbs": lambda peer: len(peer.flown) > 60,
    "in flight": lambda peer: peer.place[0] > -0.4,
    "while it lands": lambda peer: peer.place[0] > -0.4 and peer.place[2] > -0.25,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A run's folder."""
    out = tmp_path_factory.mktemp("hop") / "run"
    ltlplan.run(ltlplan.parse_mission(HOP), out)
    return out


@contextmanager
def flying(folder: Path, out: Path) -> Generator[tuple[Px4Peer, subprocess.Popen[str]]]:
    """A vehicle on the ground below its start, and a process that flies it."""
    port = free_port()
    peer = Px4Peer(1, port, (-0.5, 0.0, 0.0), Manner(armed=False))
    arguments = [
        "fly",
        str(folder),
        "--link",
        "mavlink",
        "--unchecked",
        "battery",
        "--address",
        f"one=udpin:127.0.0.1:{port}",
        "--out",
        str(out),
    ]
    root = str(Path(__file__).parents[3])
    host = subprocess.Popen(
        [sys.executable, "-m", "ltlplan", *arguments],
        env={**os.environ, "PYTHONPATH": root}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    peer.start()
    with host:
        try:
            yield peer, host
        finally:
            host.kill()
            peer.ended.set()
            peer.join()


def wait_until(condition: Callable[[], bool], host: subprocess.Popen[str] | None = None) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        assert host is None or host.poll() is None, host.communicate()[0]
        time.sleep(0.005)


@pytest.mark.slow
@pytest.mark.parametrize("phase", PHASES)
def test_a_vehicle_whose_host_is_killed_lands_on_its_own(folder, tmp_path, phase) -> None:
    with flying(folder, tmp_path / "live") as (peer, host):
        wait_until(lambda: PHASES[phase](peer), host)
        host.send_signal(signal.SIGKILL)
        host.wait()
        flew = peer.mode == OFFBOARD
        wait_until(lambda: not peer.armed)
        assert peer.place[2] == pytest.approx(0.0, abs=0.01)
        assert not flew or (peer.mode, peer.failsafes) == (LAND, 1)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "phase"), [*((signal.SIGTERM, phase) for phase in PHASES), (signal.SIGINT, "in flight")])
def test_a_host_that_is_interrupted_lands_its_vehicle_and_says_so(folder, tmp_path, number, phase) -> None:
    with flying(folder, tmp_path / "live") as (peer, host):
        wait_until(lambda: PHASES[phase](peer), host)
        host.send_signal(number)
        said, _ = host.communicate(timeout=60)
        assert not peer.armed, said
        assert peer.failsafes == 0, "it was told, and did not have to find out"
    assert host.returncode == 128 + number, said
    assert "interrupted" in said
    reasons = [event["sentence"] for event in json.loads((tmp_path / "live" / "live.json").read_text())["events"]]
    assert "interrupted" in reasons


@pytest.mark.slow
@pytest.mark.parametrize("phase", ["while it climbs", "in flight"])
@pytest.mark.parametrize("seconds", [0.6, 3.0])
def test_a_host_that_hangs_sends_no_jump_and_lands_its_vehicle(folder, tmp_path, phase, seconds) -> None:
    with flying(folder, tmp_path / "live") as (peer, host):
        wait_until(lambda: PHASES[phase](peer), host)
        host.send_signal(signal.SIGSTOP)
        time.sleep(seconds)
        host.send_signal(signal.SIGCONT)
        said, _ = host.communicate(timeout=60)
        assert not peer.armed, said
        assert peer.failsafes == (seconds > 1.0)
    assert host.returncode == 5, said
    assert "set-points were" in said or "was not seen for" in said
    rows = [row[1:] for row in peer.flown]
    steps = [max(abs(b - a) for a, b in zip(one, then, strict=True)) for one, then in itertools.pairwise(rows)]
    assert max(steps) < 0.05
