"""Flights as they are seen at a service, and orders to stop: what arrives, how soon, and what does not stand in the way."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import time
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from flight.link.stop_orders import Level
from ltlplan.service.live_view.messages import FRESH, StopOrder
from ltlplan.service.security.tokens import Tokens
from tests.helpers.live.live_feeds import FedFlight, Network, fed, watching
from tests.helpers.serving.services import Served, serving
from tests.helpers.serving.waiting import until


def run_of(url: str, name: str) -> int:
    return httpx.get(f"{url}/api/live/{name}").json()["run"]


def test_frames_come_ten_times_a_second_with_a_picture_of_the_world(served: Served, flying: FedFlight, name: str) -> None:
    with watching(served.url, name) as viewer:
        picture = viewer.until(lambda message: message["kind"] == "picture")["picture"]
        first = viewer.frame()
        began = time.monotonic()
        last = viewer.frame(lambda frame: frame["number"] >= first["number"] + 10)
    assert 0.7 < time.monotonic() - began < 2.5
    assert (picture["mission"], picture["robots"]) == ("pair", ["one", "two"])
    assert picture["bodies"]["left"] == {"kind": "regions", "center": [-1.0, 0.4, 1.0]}
    assert last["robots"]["one"]["at"] == [0.0, 0.0, 1.0]
    assert last["robots"]["one"]["battery"] == 300.0
    assert httpx.get(f"{served.url}/api/live/{name}").json()["connected"]


def test_a_stop_is_receipted_heard_and_answered_by_each_vehicle(served: Served, flying: FedFlight, name: str) -> None:
    with watching(served.url, name) as viewer, httpx.Client(base_url=served.url) as http:
        http.get("/health")
        began = time.monotonic()
        receipt = http.post(f"/api/live/{name}/stop", params={"run": run_of(served.url, name)})
        took = time.monotonic() - began
        assert receipt.status_code == 202, receipt.text
        assert until(lambda: flying.orders.level is Level.HOLD, 2.0)
        flying.acknowledged = "hold"
        frame = viewer.frame(lambda frame: bool(frame["orders"]) and frame["robots"]["one"]["acknowledged"] == "hold", 2.0)
    assert frame["orders"][0] == {
        "order": receipt.json()["order"],
        "outcome": "taken",
        "sentence": "all hold, and land after 60 s at most",
    }
    assert took < 0.2 or os.getloadavg()[0] > 2


def test_motors_need_a_stop_of_the_same_pilot_before(served: Served, flying: FedFlight, name: str) -> None:
    run = run_of(served.url, name)
    with watching(served.url, name) as viewer:
        httpx.post(f"{served.url}/api/live/{name}/stop", params={"run": run, "level": "motors"}).raise_for_status()
        outcome = viewer.frame(lambda frame: bool(frame["orders"]))["orders"][0]
        assert outcome["outcome"] == "refused"
        assert "has not ordered a stop before" in outcome["sentence"]
        assert flying.orders.level is Level.NONE
        for level in ("land", "motors"):
            httpx.post(f"{served.url}/api/live/{name}/stop", params={"run": run, "level": level}).raise_for_status()
        viewer.frame(lambda frame: len(frame["orders"]) == 3)
    assert flying.orders.level is Level.MOTORS


def test_a_stop_of_another_flight_or_of_one_that_is_not_connected_is_refused(served: Served, name: str) -> None:
    def stopped(run: int) -> httpx.Response:
        return httpx.post(f"{served.url}/api/live/{name}/stop", params={"run": run})

    assert stopped(1).status_code == 404
    with fed(f"{served.url}/live/{name}") as flight:
        run = run_of(served.url, name)
        assert until(lambda: httpx.get(f"{served.url}/api/live/{name}").json()["connected"], 10.0)
        assert stopped(run + 1).status_code == 409
        assert flight.orders.level is Level.NONE
    answer = stopped(run)
    assert (answer.status_code, "terminal" in answer.json()["detail"]) == (409, True)


def test_old_orders_and_those_of_others_are_not_heeded(served: Served, flying: FedFlight) -> None:
    now, us = time.monotonic(), flying.listener.flight
    take = flying.feed._take  # as its thread does
    take(StopOrder(order="a", flight=us, level="land", who="alice", after=now - FRESH - 0.5, since=0.1))
    take(StopOrder(order="b", flight="0" * 32, level="land", who="alice", after=now, since=0.0))
    assert flying.orders.level is Level.NONE
    take(StopOrder(order="c", flight=us, level="land", who="alice", after=now - 9.0, since=8.0))
    assert flying.orders.level is Level.LAND, "the flight's last frame was old, the order is not"


def test_what_is_no_frame_closes_the_line_and_other_flights_get_none(served: Served, flying: FedFlight, name: str) -> None:
    address = f"ws{served.url.removeprefix('http')}/api/live/{name}/feed?flight="
    for flight in ("x", "0" * 32):
        with pytest.raises(InvalidStatus), connect(address + flight, proxy=None):
            pass
    for text in ("{}", "[]", "nonsense", json.dumps({"frame": {"number": 1, "sent": 1e999}}), "x" * 300_000):
        with connect(address + flying.listener.flight, proxy=None) as line:
            line.send(text)
            with pytest.raises(Exception, match="1008"):
                line.recv(timeout=10)


def test_pages_of_other_sites_see_nothing(served: Served, flying: FedFlight, name: str) -> None:
    headers = {"origin": "https://elsewhere.example"}
    with pytest.raises(InvalidStatus), watching(served.url, name, headers):
        pass


def test_a_flight_is_replayed_as_it_was_seen(served: Served, name: str) -> None:
    with fed(f"{served.url}/live/{name}"), watching(served.url, name) as viewer:
        viewer.until(lambda message: message["kind"] == "picture")
        viewer.frame(lambda frame: frame["number"] > 3 and frame["picture"] > 0)
    run = run_of(served.url, name)
    assert until(lambda: httpx.get(f"{served.url}/api/live/{name}/replays/{run}").status_code == 200, 10.0)
    assert until(lambda: httpx.get(f"{served.url}/api/live/{name}/replays/{run}").json()["frames"][-1]["over"], 10.0)
    found = httpx.get(f"{served.url}/api/live/{name}/replays/{run}").json()
    assert found["pictures"][-1]["mission"] == "pair"
    assert [frame["number"] for frame in found["frames"]] == list(range(1, len(found["frames"]) + 1))
    assert found["frames"][-1]["over"]
    assert httpx.get(f"{served.url}/api/live/{name}/runs").json()[0]["recorded"]
    assert httpx.get(f"{served.url}/api/live/{name}/replays/{run + 1}").status_code == 404


@pytest.mark.slow
def test_a_frozen_service_delays_nothing_and_is_seen_again_when_it_goes_on(tmp_path: Path) -> None:
    with serving(tmp_path / "data") as served, fed(f"{served.url}/live/lab") as flight:
        with watching(served.url, "lab") as viewer:
            viewer.frame(lambda frame: bool(frame["robots"]))
            os.kill(served.pid, signal.SIGSTOP)
            try:
                time.sleep(20.0)  # its buffers fill
            finally:
                os.kill(served.pid, signal.SIGCONT)
            now = time.monotonic()
            viewer.frame(lambda frame: frame["sent"] > now, 15.0)
        assert flight.longest < 0.05


@pytest.mark.slow
def test_an_order_that_a_paused_network_kept_is_not_heeded(tmp_path: Path) -> None:
    with ExitStack() as opened:
        served = opened.enter_context(serving(tmp_path / "data"))
        network = opened.enter_context(closing(Network(served.url)))
        with fed(f"{network.url}/live/lab") as flight, watching(served.url, "lab") as viewer:
            viewer.frame(lambda frame: bool(frame["robots"]))
            run = run_of(served.url, "lab")
            network.flows.clear()
            time.sleep(0.3)
            sent = httpx.post(f"{served.url}/api/live/lab/stop", params={"run": run})
            assert sent.status_code == 202
            time.sleep(3.0)
            late = httpx.post(f"{served.url}/api/live/lab/stop", params={"run": run})
            assert late.status_code == 409
            network.flows.set()
            frame = viewer.frame(lambda frame: bool(frame["orders"]))
            assert frame["orders"][0]["outcome"] == "expired"
            assert flight.orders.level is Level.NONE
            httpx.post(f"{served.url}/api/live/lab/stop", params={"run": run}).raise_for_status()
            assert until(lambda: flight.orders.level is Level.HOLD, 3.0)


@pytest.mark.slow
def test_a_service_that_is_killed_is_fed_again_when_it_is_back(tmp_path: Path) -> None:
    with serving(tmp_path / "data") as served:
        port = int(served.url.rpartition(":")[2])
        with fed(f"{served.url}/live/lab") as flight:
            with watching(served.url, "lab") as viewer:
                before = viewer.frame(lambda frame: bool(frame["robots"]))
            os.kill(served.pid, signal.SIGKILL)
            time.sleep(1.0)
            with serving(tmp_path / "data", port=port) as again, watching(again.url, "lab") as viewer:
                after = viewer.frame(lambda frame: bool(frame["robots"]))
                assert after["number"] > before["number"]
                viewer.until(lambda message: message["kind"] == "picture")
                httpx.post(f"{again.url}/api/live/lab/stop", params={"run": run_of(again.url, "lab")}).raise_for_status()
                assert until(lambda: flight.orders.level is Level.HOLD, 3.0)


@pytest.mark.slow
def test_roles_and_limits_that_are_used_up(tmp_path: Path) -> None:
    """Viewers and planners stop nothing; a pilot does though every limit is used up."""
    (tmp_path / "data").mkdir(mode=0o700)
    tokens = Tokens(tmp_path / "data")
    made = {role: tokens.new(role, role=role) for role in ("viewer", "planner", "pilot")}
    limits = {"questions_asked": [0.001, 40], "connections": 30, "open_of_one": 10}
    with serving(tmp_path / "data", names=["plan.lab.example"], limits=limits) as served:
        headers = {role: {"authorization": f"Bearer {token}"} for role, token in made.items()}
        with fed(f"{served.url}/live/lab", token=made["pilot"]) as flight:
            with watching(served.url, "lab", headers["viewer"]) as viewer:
                viewer.frame(lambda frame: bool(frame["robots"]))
            run = httpx.get(f"{served.url}/api/live/lab", headers=headers["viewer"]).json()["run"]
            stop = f"{served.url}/api/live/lab/stop?run={run}"
            assert [httpx.post(stop, headers=headers[role]).status_code for role in ("viewer", "planner")] == [403, 403]
            assert httpx.post(stop).status_code == 401
            with pytest.raises(InvalidStatus), connect(
                f"ws{served.url.removeprefix('http')}/api/live/lab/feed?flight={flight.listener.flight}",
                additional_headers=headers["planner"], proxy=None,
            ):  # fmt: skip
                pass
            with ExitStack() as opened:
                for _ in range(8):  # with its flight's two, all that this client may have open
                    opened.enter_context(watching(served.url, "lab", headers["pilot"]))
                http = opened.enter_context(httpx.Client(base_url=served.url, headers=headers["pilot"]))
                asked = [http.post("/api/words/check", content=b"{}").status_code for _ in range(45)]
                assert asked[-1] == 429
                assert http.get("/api/live").status_code == 503
                for _ in range(40):
                    opened.enter_context(socket.create_connection(("127.0.0.1", int(served.url.rpartition(":")[2]))))
                assert httpx.get(f"{served.url}/health").status_code == 503
                assert httpx.post(stop, headers=headers["pilot"]).status_code == 202
            assert until(lambda: flight.orders.level is Level.HOLD, 3.0)


def fill(path: Path) -> None:
    """Write a file until the disk is full."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(b"\1" * 4096)


@pytest.mark.slow
def test_a_full_disk_does_not_stand_in_the_way_of_a_stop(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64M", "tmpfs", str(disk)], capture_output=True, check=False
    ).returncode:
        pytest.skip("a small disk cannot be mounted here")
    try:
        with serving(disk / "data") as served, fed(f"{served.url}/live/lab") as flight, watching(served.url, "lab") as viewer:
            viewer.frame(lambda frame: bool(frame["robots"]))
            run = run_of(served.url, "lab")
            fill(disk / "filler")
            told = httpx.post(f"{served.url}/api/live/lab/events", content=b"one fails", headers={"content-type": "text/plain"})
            assert told.status_code in (503, 507), told.text
            began = time.monotonic()
            assert httpx.post(f"{served.url}/api/live/lab/stop", params={"run": run}).status_code == 202
            assert until(lambda: flight.orders.level is Level.HOLD, 2.0)
            assert time.monotonic() - began < 2.0
            viewer.frame(lambda frame: bool(frame["orders"]), 2.0)
            (disk / "filler").unlink()
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
