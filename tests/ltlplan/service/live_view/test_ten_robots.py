"""A simulated team of ten that flies in real time while its service is frozen and killed, its network paused and a browser killed, and that is stopped then.

For a minute, or for `LTLPLAN_LIVE_SECONDS`; it prints what it measured (`pytest -s`).
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from tests.browser.devtools import CHROMIUM
from tests.helpers.live.live_feeds import Network, Watching, watching
from tests.helpers.serving.process_trees import command_line, kill, tree
from tests.helpers.serving.services import Served, serving

SECONDS = float(os.environ.get("LTLPLAN_LIVE_SECONDS", "60"))
"""s that things go wrong for."""
LEVELS = {"hold": ("hold", "land", "stop"), "land": ("land", "stop")}
"""Which acknowledgements confirm an order."""


@contextmanager
def flying(address: str) -> Generator[subprocess.Popen[str]]:
    """Have ten robots in the air, in a process of their own, until they are stopped."""
    command = [sys.executable, "-m", "tests.helpers.live.ten_robots", str(SECONDS + 240.0), address]
    flight = subprocess.Popen(command, cwd=Path(__file__).parents[4], stdout=subprocess.PIPE, text=True)
    assert flight.stdout is not None
    try:
        assert flight.stdout.readline() == "flying\n"
        yield flight
    finally:
        flight.kill()
        flight.wait()
        flight.stdout.close()


class Trouble:
    """Whatever happens to a service."""

    def __init__(self, opened: ExitStack, folder: Path) -> None:
        self.opened, self.folder = opened, folder
        self.served: Served = opened.enter_context(serving(folder, page=True))
        self.port = int(self.served.url.rpartition(":")[2])
        self.network = opened.enter_context(closing(Network(self.served.url)))
        self.counts = dict.fromkeys(("frozen", "paused", "killed", "browsers"), 0)

    def freeze(self) -> None:
        """Freeze the service for 10 s."""
        os.kill(self.served.pid, signal.SIGSTOP)
        time.sleep(10.0)
        os.kill(self.served.pid, signal.SIGCONT)
        self.counts["frozen"] += 1

    def pause(self) -> None:
        """Pause the network for 10 s."""
        self.network.flows.clear()
        time.sleep(10.0)
        self.network.flows.set()
        self.counts["paused"] += 1

    def end(self) -> None:
        """Kill the service, and start it again where it was."""
        os.kill(self.served.pid, signal.SIGKILL)
        time.sleep(2.0)
        self.served = self.opened.enter_context(serving(self.folder, port=self.port, page=True))
        self.counts["killed"] += 1

    def browse(self) -> None:
        """Look at the flight in a browser, and kill that while it draws."""
        if CHROMIUM is None:
            return
        playwright = pytest.importorskip("playwright.sync_api", reason="needs Playwright to drive a browser")
        before = set(tree(os.getpid()))
        with playwright.sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            mine = [pid for pid in tree(os.getpid()) if pid not in before and "--headless" in command_line(pid)]
            for pid in mine:
                os.setpriority(os.PRIO_PROCESS, pid, 19)  # on a machine of its own, as people's are
            page = browser.new_page()
            page.goto(f"{self.served.url}/live/hall", timeout=120_000)
            page.wait_for_function("() => document.querySelectorAll('.live-robots tbody tr').length === 10", timeout=120_000)
            assert [kill(pid) for pid in mine]
            with suppress(playwright.Error):
                browser.close()
        self.counts["browsers"] += 1


def ordered(url: str, viewer: Watching, run: int, level: str) -> tuple[float, float]:
    """Order a stop; return how long its receipt took, and until all had acknowledged it, s."""
    with httpx.Client(base_url=url) as http:
        http.get("/health")
        began = time.monotonic()
        http.post("/api/live/hall/stop", params={"run": run, "level": level}).raise_for_status()
        receipt = time.monotonic() - began
    viewer.frame(lambda frame: all(robot["acknowledged"] in LEVELS[level] for robot in frame["robots"].values()), 2.0)
    return receipt, time.monotonic() - began


@pytest.mark.slow
def test_whatever_happens_to_the_service_the_flight_goes_on_and_can_be_stopped(tmp_path: Path) -> None:
    with ExitStack() as opened:
        trouble = Trouble(opened, tmp_path / "data")
        flight = opened.enter_context(flying(f"{trouble.network.url}/live/hall"))
        ended = time.monotonic() + SECONDS
        what: tuple[Callable[[], None], ...] = (trouble.browse, trouble.freeze, trouble.pause, trouble.end)
        while time.monotonic() < ended and flight.poll() is None:
            for each in what:
                each()
                time.sleep(3.0)
        if flight.poll() is not None:
            said = flight.communicate()[0]
            assert "too busy" in said, said
            pytest.skip("this machine is too busy to fly ten robots in real time")
        url = trouble.served.url
        viewer = opened.enter_context(watching(url, "hall"))
        first = viewer.frame(lambda frame: bool(frame["robots"]), 60.0)
        last = viewer.frame(lambda frame: frame["sent"] > first["sent"] + 5.0)
        assert last["number"] - first["number"] >= 40
        run = httpx.get(f"{url}/api/live/hall").json()["run"]
        took = {"hold": ordered(url, viewer, run, "hold")}
        time.sleep(4.0)
        took["land"] = ordered(url, viewer, run, "land")
        found = json.loads(flight.communicate(timeout=60.0)[0])
        print(f"{trouble.counts}; flight: {found}; receipts and acknowledgements, s: {took}; load {os.getloadavg()[0]:.1f}")
        assert found["reason"] == "stopped by 127.0.0.1 through the service."
        assert found["unsafe"] == []
        assert found["computed"] < 0.05
        assert found["shown"] < 0.1 or os.getloadavg()[0] > 2
        assert all(receipt < 0.2 for receipt, _ in took.values()) or os.getloadavg()[0] > 2
