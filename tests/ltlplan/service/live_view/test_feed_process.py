"""The process that feeds a service with a flight: killed, frozen, without its flight, and what the flight notices of that."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import httpx
import pytest

from flight.link.stop_orders import Level
from flight.logs.log import Event
from ltlplan.service.client_parts import flight_feed
from tests.helpers.live.live_feeds import FedFlight, watching
from tests.helpers.serving.services import Served
from tests.helpers.serving.waiting import until


def process_of(flight: FedFlight) -> int:
    pid = flight.feed.process
    assert pid is not None
    return pid


def gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def test_a_process_that_is_killed_is_begun_anew_and_orders_are_heard(served: Served, flying: FedFlight, name: str) -> None:
    first = process_of(flying)
    os.kill(first, signal.SIGKILL)
    assert until(lambda: flying.feed.process not in (None, first), 5.0)
    with watching(served.url, name) as viewer:
        now = time.monotonic()
        viewer.frame(lambda frame: frame["sent"] > now and bool(frame["robots"]), 15.0)
        viewer.until(lambda message: message["kind"] == "picture")
        run = httpx.get(f"{served.url}/api/live/{name}").json()["run"]
        httpx.post(f"{served.url}/api/live/{name}/stop", params={"run": run}).raise_for_status()
        assert until(lambda: flying.orders.level is Level.HOLD, 3.0)
        viewer.frame(lambda frame: bool(frame["orders"]), 2.0)
    assert flying.longest < 0.1


@pytest.mark.slow
def test_one_that_hangs_drops_frames_and_is_replaced(
    flying: FedFlight, served: Served, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_feed, "STUCK", 1.0)
    first = process_of(flying)
    os.kill(first, signal.SIGSTOP)
    spoken = tuple(Event(0.0, None, "note", "x" * 2000) for _ in range(40))
    flying.speaks(spoken)
    assert until(lambda: flying.feed.process != first, 20.0)
    flying.speaks(())
    assert gone(first)
    with watching(served.url, name) as viewer:
        now = time.monotonic()
        viewer.frame(lambda frame: frame["sent"] > now and bool(frame["robots"]), 15.0)
    assert flying.longest < 0.1


@pytest.mark.slow
def test_one_that_ends_again_and_again_is_given_up_and_the_flight_hears_so(
    flying: FedFlight, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_feed, "PAUSE", 0.01)
    for _ in range(flight_feed.LIVES):
        assert until(lambda: flying.feed.process is not None, 5.0)
        os.kill(process_of(flying), signal.SIGKILL)
        pid = flying.feed.process
        until(lambda pid=pid: flying.feed.process != pid, 5.0)
    assert until(lambda: any("not seen there any more" in str(said) for said in flying.listener()), 5.0)
    assert flying.feed.process is None
    before = time.monotonic()
    flying.feed.end()
    assert time.monotonic() - before < 1.0


_FLIGHT = """
import sys, time
from tests.helpers.live.live_feeds import fed
with fed(sys.argv[1]) as flight:
    print(flight.feed.process, flush=True)
    time.sleep(60)
"""


@pytest.mark.slow
def test_a_flight_that_hangs_is_not_connected_and_one_that_is_killed_leaves_nothing(served: Served, name: str) -> None:
    flight = subprocess.Popen([sys.executable, "-c", _FLIGHT, f"{served.url}/live/{name}"], stdout=subprocess.PIPE, text=True)
    assert flight.stdout is not None
    try:
        pid = int(flight.stdout.readline())
        assert until(lambda: httpx.get(f"{served.url}/api/live/{name}").json()["connected"], 10.0)
        flight.send_signal(signal.SIGSTOP)
        assert until(lambda: not httpx.get(f"{served.url}/api/live/{name}").json()["connected"], 5.0)
        run = httpx.get(f"{served.url}/api/live/{name}").json()["run"]
        assert httpx.post(f"{served.url}/api/live/{name}/stop", params={"run": run}).status_code == 409
        flight.send_signal(signal.SIGCONT)
        assert until(lambda: httpx.get(f"{served.url}/api/live/{name}").json()["connected"], 5.0)
    finally:
        flight.kill()
        flight.wait()
        flight.stdout.close()
    assert until(lambda: gone(pid), 5.0)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
