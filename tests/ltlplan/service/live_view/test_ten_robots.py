"""A simulated team of ten for some minutes: its service frozen, killed and started again, its network paused, and then it is stopped."""

from __future__ import annotations

import os
import signal
import time
from contextlib import closing
from pathlib import Path

import httpx
import pytest

from tests.helpers.live_feeds import Network, watching
from tests.helpers.services import serving
from tests.helpers.ten_robots import TenRobots
from tests.helpers.waiting import until


@pytest.mark.slow
def test_whatever_happens_to_the_service_the_flight_goes_on_and_can_be_stopped(tmp_path: Path) -> None:
    with serving(tmp_path / "data") as served, closing(Network(served.url)) as network:
        port = int(served.url.rpartition(":")[2])
        team = TenRobots(150.0, f"{network.url}/live/hall")
        flying = team.begin()
        try:
            assert until(lambda: bool(team.looks) or not flying.is_alive(), 120.0)
            time.sleep(8.0)
            os.kill(served.pid, signal.SIGSTOP)
            time.sleep(20.0)
            os.kill(served.pid, signal.SIGCONT)
            time.sleep(5.0)
            network.flows.clear()
            time.sleep(10.0)
            network.flows.set()
            time.sleep(5.0)
            os.kill(served.pid, signal.SIGKILL)
            time.sleep(5.0)
            with serving(tmp_path / "data", port=port) as again, watching(again.url, "hall") as viewer:
                if not flying.is_alive() and team.done is not None and "too busy" in team.done.reason:
                    pytest.skip("this machine is too busy to fly ten robots in real time")
                first = viewer.frame(lambda frame: bool(frame["robots"]), 60.0)
                last = viewer.frame(lambda frame: frame["sent"] > first["sent"] + 5.0)
                assert last["number"] - first["number"] >= 40
                run = httpx.get(f"{again.url}/api/live/hall").json()["run"]
                began = time.monotonic()
                httpx.post(f"{again.url}/api/live/hall/stop", params={"run": run}).raise_for_status()
                viewer.frame(lambda frame: all(robot["acknowledged"] for robot in frame["robots"].values()), 2.0)
                assert time.monotonic() - began < 2.0
                flying.join(60.0)
        finally:
            team_ended = not flying.is_alive()
            flying.join(200.0)
        assert team_ended
        assert team.done is not None
        assert team.done.reason == "stopped by 127.0.0.1 through the service."
        assert team.done.unsafe == ()
        assert max(team.shown) < 0.1
