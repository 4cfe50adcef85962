"""A service that is running: what stays open ends with its token, and nobody holds all connections."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.sync.client import connect

from ltlplan.service.security.tokens import Tokens
from tests.helpers.serving.services import ONE_HOOP, Served, serving

pytestmark = pytest.mark.slow

ANSWERED = b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n"
HALVES = (b"", b"GET / HTTP/1.1\r\nHost: x\r\n", ANSWERED)
"""Nothing, half a head, and a whole request that is answered and after which nothing follows."""
HALF_A_BODY = b"POST /api/missions/check HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\nContent-Length: 1000\r\n\r\nname: half"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """Start a service with the limits that it has by default."""
    data = tmp_path_factory.mktemp("service") / "data"
    data.mkdir()
    with serving(data, page=True) as found:
        yield found


@contextlib.contextmanager
def _held(served: Served, sent: bytes, count: int, source: str = "127.0.0.1") -> Generator[list[socket.socket]]:
    """Hold connections that sent something and wait, all from one address of this machine."""
    where = urlsplit(served.url)
    with contextlib.ExitStack() as held:
        found: list[socket.socket] = []
        for _ in range(count):
            connection = socket.create_connection((where.hostname or "", where.port or 0), 30, (source, 0))
            held.enter_context(connection)
            with contextlib.suppress(OSError):  # it may have given its place already
                connection.sendall(sent)
                if sent == ANSWERED:
                    assert connection.recv(65536).startswith(b"HTTP/1.1 200")
            found.append(connection)
        yield found


def _statuses(served: Served, source: str) -> list[int]:
    """Return the statuses of requests that come from an address, each over a connection of its own."""
    found: list[int] = []
    for _ in range(57):
        with httpx.Client(base_url=served.url, transport=httpx.HTTPTransport(local_address=source), timeout=60) as client:
            found.append(client.get("/health").status_code)
    return found


@pytest.mark.parametrize("sent", HALVES)
@pytest.mark.parametrize("source", ["127.0.0.1", "127.0.0.9"])
def test_connections_that_wait_hold_nobody_up_from_the_same_address_or_another(
    served: Served, sent: bytes, source: str
) -> None:
    with _held(served, sent, 510):
        assert _statuses(served, source) == [200] * 57


@pytest.mark.parametrize("source", ["127.0.0.1", "127.0.0.9"])
def test_bodies_that_do_not_come_hold_nobody_up(served: Served, source: str) -> None:
    with _held(served, HALF_A_BODY, 510):
        assert _statuses(served, source) == [200] * 57


def test_many_addresses_that_wait_hold_nobody_up(served: Served) -> None:
    with contextlib.ExitStack() as held:
        for address in range(2, 10):
            held.enter_context(_held(served, HALVES[1], 70, f"127.0.0.{address}"))
        assert _statuses(served, "127.0.0.1") == [200] * 57


def test_a_page_s_socket_is_kept_for_longer_than_a_head_may_take(tmp_path: Path) -> None:
    with serving(tmp_path / "data", page=True, limits={"head_seconds": 1.0}) as served:
        address = served.url.replace("http:", "ws:") + "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
        with connect(address) as page:
            assert str(page.recv(60)).startswith("0{")
            assert page.recv(60) == "2", "the service asks from time to time whether somebody is still there"
            page.send("3")


def test_events_end_with_the_token_before_the_job_does(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    tokens = Tokens(data)
    alice, bob = tokens.new("alice"), tokens.new("bob")
    with serving(data) as served, httpx.Client(base_url=served.url, timeout=60) as client:
        allowed = {"authorization": f"Bearer {bob}"}
        jobs = [
            client.post("/api/jobs", content=ONE_HOOP, params={"seed": seed}, headers=allowed).json()["id"]
            for seed in (1, 2, 3)
        ]
        with client.stream("GET", f"/api/jobs/{jobs[-1]}/events", headers={"authorization": f"Bearer {alice}"}) as stream:
            chunks = stream.iter_bytes()
            assert b"retry" in next(chunks)
            tokens.revoke("alice")
            began = time.monotonic()
            rest = b"".join(chunks)
            print(f"ended {time.monotonic() - began:.2f} s after the token was revoked")
        assert b"done" not in rest
        assert client.get(f"/api/jobs/{jobs[-1]}", headers=allowed).json()["ended"] is None
        assert client.get("/api/jobs", headers={"authorization": f"Bearer {alice}"}).status_code == 401
        for job in jobs:
            client.post(f"/api/jobs/{job}/cancel", headers=allowed)
