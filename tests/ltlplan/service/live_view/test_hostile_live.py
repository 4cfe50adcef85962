"""Somebody who means harm to flights in the air: names, bodies and sockets of theirs stop no flight, and the service goes on."""

from __future__ import annotations

import json
import socket
import time
import uuid
from contextlib import suppress
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from flight.link.stop_orders import Level
from tests.helpers.live.live_feeds import fed, watching
from tests.helpers.serving.services import Served, resident_megabytes

NAMES = (
    "x",
    "%00",
    "..",
    "%2e%2e%2f..%2fetc",
    "a" * 4000,
    "%ff%fe",
    "lab%0d%0aX: 1",
    "<script>",
    "${jndi:ldap:x}",
    "%F0%9F%9A%81",
)
"""Names of flights in paths."""
QUERIES = (
    "",
    "run=",
    "run=1e9",
    "run=-1",
    "run=" + "9" * 400,
    "run=0&level=",
    "run=0&level=all",
    "run=0&level=motors&level=hold",
    "run=0&level=MOTORS",
    "run=0;level=motors",
    "run[]=0",
    "run=0&motors=true",
    "level=motors",
)
BODIES = (b"", b"\x00" * 1000, b"[" * 50_000, b"one fails\n" * 5_000, b"\xff\xfe", b"x" * 300_000, b'{"level": "motors"}')
SAID: tuple[str | bytes, ...] = (
    b"\x00\xff" * 1000,
    "",
    "null",
    "[" * 50_000,
    '{"frame": ' * 5_000,
    '{"shown": {"number": 1, "mission": "!!python/object/apply:os.system [x]", "tracks": {}}}',
    '{"shown":' + "9" * 150_000 + "}",
    json.dumps({"frame": {"number": 1, "sent": 1.0, "robots": {"x" * 5000: {}}}}),
    json.dumps({"frame": {"number": 10**400, "sent": 0.0, "robots": {}}}),
    '{"frame": {"number": 1, "sent": NaN, "robots": {}}}',
    json.dumps({"order": "x", "flight": "0" * 32, "level": "motors", "who": "eve", "after": 0.0, "since": 0.0}),
)
"""Messages over sockets."""


def _works(served: Served) -> bool:
    return httpx.get(f"{served.url}/health", timeout=30).json()["ok"]


def test_hostile_names_queries_and_bodies_stop_nothing(served: Served) -> None:
    name = f"lab-{uuid.uuid4().hex[:12]}"
    with fed(f"{served.url}/live/{name}") as flight, httpx.Client(base_url=served.url, timeout=30) as http:
        found: set[int] = set()
        for query in QUERIES:
            found.add(http.post(f"/api/live/{name}/stop?{query}").status_code)
        for other in NAMES:
            with suppress(httpx.InvalidURL):
                found |= {http.post(f"/api/live/{other}/{what}?run=0&act=take").status_code for what in ("stop", "control")}
        for body in BODIES:
            for what in ("events", "foretell", "answers", "end", "control"):
                found.add(
                    http.post(f"/api/live/{name}/{what}", content=body, headers={"content-type": "text/plain"}).status_code
                )
            found.add(http.put(f"/api/live/{name}", content=body, headers={"content-type": "application/json"}).status_code)
        assert found <= {200, 202, 400, 404, 405, 409, 413, 415, 422, 429}, found
        assert flight.orders.level is Level.NONE
    assert _works(served)


def _say(line: ClientConnection, said: Any) -> None:
    with suppress(ConnectionClosed, TimeoutError):
        line.send(said)
        line.recv(timeout=0.3)


@pytest.mark.slow
def test_what_is_said_over_sockets_stops_nothing_and_is_no_bug(served: Served) -> None:
    name = f"lab-{uuid.uuid4().hex[:12]}"
    log = served.data.parent / f"{served.data.name}.log"
    before = resident_megabytes(served.pid)
    with fed(f"{served.url}/live/{name}") as flight:
        for path in (f"{name}/watch", f"{name}/feed?flight={flight.listener.flight}"):
            for said in SAID:
                with connect(f"ws{served.url.removeprefix('http')}/api/live/{path}", proxy=None, ping_interval=None) as line:
                    _say(line, said)
        with connect(f"ws{served.url.removeprefix('http')}/api/live/{name}/watch", proxy=None, ping_interval=None) as line:
            for _ in range(3000):
                with suppress(ConnectionClosed):
                    line.ping()
        now = time.monotonic()
        with watching(served.url, name) as viewer:
            viewer.frame(lambda frame: frame["sent"] > now and bool(frame["robots"]), 30.0)
        assert flight.orders.level is Level.NONE
    assert _works(served)
    bugs = [line for line in log.read_text().splitlines() if "Traceback" in line]
    assert bugs == [], bugs
    assert resident_megabytes(served.pid) - before < 150.0


@pytest.mark.parametrize(
    "origin", ["null", "http://evil.example", "http://127.0.0.1.evil.example", "file://", "http://[::1", "x" * 5000]
)
def test_pages_from_elsewhere_have_no_socket_and_stop_nothing(served: Served, origin: str) -> None:
    headers = {"origin": origin}
    for path in ("x/watch", f"x/feed?flight={'0' * 32}"):
        with socket.create_connection(("127.0.0.1", int(served.url.rpartition(":")[2])), timeout=10) as line:
            line.sendall(
                f"GET /api/live/{path} HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: {origin}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: x3JJHMbDL1EzLkh9GBhXDw==\r\n\r\n".encode()
            )
            assert line.recv(100).split()[1] in (b"400", b"403", b"404")
    assert httpx.post(f"{served.url}/api/live/x/stop?run=0", headers=headers).status_code == 403
