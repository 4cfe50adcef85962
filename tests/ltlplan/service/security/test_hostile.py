"""Requests of somebody who means harm: whatever they send, the service goes on to serve, and does not grow."""

from __future__ import annotations

import contextlib
import random
import socket
from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

import h11
import httpx
import pytest

from tests.helpers.serving.services import Served, resident_megabytes

GROWTH = 150.0
"""MB that the service may hold more after any number of hostile requests: what was read last, and parsers that are loaded by now."""

PATHS = (
    "/api/jobs/../../../etc/passwd",
    "/api/jobs/%2e%2e%2f%2e%2e%2fetc%2fpasswd/files/x",
    "/api/jobs/x/files//etc/passwd",
    "/api/jobs/x/files/..%5c..%5cboot.ini",
    "/api/jobs/%00/events",
    "/docs/../tokens.json",
    "/docs/%2e%2e/tokens.json",
    "/_nicegui/../../x",
    "/" + "a" * 5000,
    "/api/" + "%ff" * 200,
    "/api/jobs?limit=" + "9" * 4000,
    "/api/jobs?before=" + "x" * 3000,
    "/api/jobs/" + "x" * 3000,
    "/problems/${jndi:ldap://x}",
    "/health?" + "a=b&" * 2000,
)
BODIES = (
    b"",
    b"\x00" * 1000,
    b"\xff\xfe" * 1000,
    b"[" * 100_000,
    b"{" * 100_000,
    b"a: &a [*a]\n" * 100,
    b"&a [x,x,x,x,x,x,x,x]: {<<: *a}\n",
    b"!!python/object/apply:os.system ['touch /tmp/owned']",
    b"!include /etc/passwd",
    b"x: " + b"9" * 900_000,
    b'{"formula": "' + b"(" * 50_000 + b"a" + b")" * 50_000 + b'", "words": ["a"]}',
    b'{"formula": "' + b"F(a & " * 5_000 + b"a" + b")" * 5_000 + b'", "words": ["a"]}',
    b'{"formula": "F a", "words": ["' + b"a;" * 40_000 + b'a"]}',
    b'{"formula": "F a", "words": {"\\ud800": "a"}}',
    b'{"formula": 1e999, "words": [NaN]}',
    b"a: 1\n" * 200_000,
    b"x" * 3_000_000,
    b'--b\r\nContent-Disposition: form-data; name="recording"; filename="../../x"\r\n\r\n1\r\n--b--\r\n',
    b"--b\r\n" * 5000,
    b'--b\r\nContent-Disposition: form-data; name="' + b"x" * 200_000,
)
KINDS = (
    "application/json",
    "application/yaml",
    "text/plain",
    "multipart/form-data; boundary=b",
    "multipart/form-data",
    "application/x-www-form-urlencoded",
    "text/html; charset=nonsense",
    "\x7f",
)
TARGETS = (
    "/api/jobs",
    "/api/missions/check",
    "/api/words/check",
    "/api/flights/judge",
    "/login",
    "/api/jobs/x/cancel",
    "/api/jobs/x/campaigns",
    "/api/jobs/x/recordings",
    "/api/stored",
    "/api/stored/x",
    "/api/studies",
    "/api/projects",
    "/api/accounts",
    "/api/accounts/x/password",
    "/account/password",
    "/api/webhooks",
    "/api/drafts",
    "/api/live/x",
    "/api/live/x/events",
    "/api/live/x/stop?run=0",
    "/api/live/x/control",
    "/api/nothing",
)
HEADERS = (
    {"host": "evil.example"},
    {"origin": "http://evil.example"},
    {"sec-fetch-site": "cross-site"},
    {"authorization": "Bearer " + "x" * 5000},
    {"authorization": "Basic Og=="},
    {"cookie": "ltlplan_session=" + ";" * 100},
    {"cookie": "ltlplan_session=a:9999999999:b"},
    {"content-length": "-1"},
    {"content-length": "99999999999999999999"},
    {"transfer-encoding": "chunked, chunked"},
    {"last-event-id": "-1"},
    {"range": "bytes=" + "0-0," * 2000},
    {"accept-encoding": "gzip;q=" + "1" * 1000},
    {"x-forwarded-for": "8.8.8.8"},
    {"expect": "100-continue"},
)
HALVES = (
    b"",
    b"GET",
    b"GET / HTTP/1.1\r\nHost: localhost\r\n",
    b"POST /api/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nname: half",
    b"POST /api/jobs HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n",
    b"POST /api/flights/judge HTTP/1.1\r\nHost: localhost\r\nContent-Type: multipart/form-data; boundary=b\r\nContent-Length: 9999\r\n\r\n--b",
    b"\x16\x03\x01\x02\x00\x01\x00",
    b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X-Filler: " + b"a" * 70_000,
    b"GET / HTTP/9.9\r\n\r\n",
    b"GET /api/jobs/x/events HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: x3JJHMbDL1EzLkh9GBhXDw==\r\n\r\n",
)
ALLOWED = {200, 201, 204, 303, 307, 400, 401, 403, 404, 405, 408, 413, 415, 416, 421, 422, 429, 431, 501, 503}
"""What a hostile request may be answered with; never 500, for that is a bug."""


def _attacks(served: Served, rng: random.Random) -> Iterator[Callable[[httpx.Client], int | None]]:
    """Yield attacks without end: each returns the status of its answer, or None where it waited for none."""
    open_sockets: list[socket.socket] = []

    def get(client: httpx.Client) -> int:
        return client.get(rng.choice(PATHS), headers=rng.choice(({}, *HEADERS[:7]))).status_code

    def send(client: httpx.Client) -> int:
        method = rng.choice(("POST", "POST", "POST", "PUT", "DELETE", "PATCH", "TRACE"))
        headers = {"content-type": rng.choice(KINDS), **rng.choice(({}, {}, *HEADERS[:7]))}
        return client.request(method, rng.choice(TARGETS), content=rng.choice(BODIES), headers=headers).status_code

    def lie(client: httpx.Client) -> int:
        return client.post(rng.choice(TARGETS), content=b"a: 1", headers=rng.choice(HEADERS)).status_code

    def half(_: httpx.Client) -> None:
        where = urlsplit(served.url)
        connection = socket.create_connection((where.hostname or "", where.port or 0), timeout=10)
        connection.sendall(rng.choice(HALVES))
        open_sockets.append(connection)  # held open, as somebody who waits for the service to tire would
        if len(open_sockets) > 40:
            open_sockets.pop(0).close()

    try:
        while True:
            yield rng.choice((get, send, send, lie, half))
    finally:
        for connection in open_sockets:
            connection.close()


def _unexpected(served: Served, count: int) -> dict[int, int]:
    """Attack a service so often; return the statuses that no attack may be answered with, by their number."""
    wrong: dict[int, int] = {}
    before = resident_megabytes(served.pid)
    attacks = _attacks(served, random.Random(0))
    with httpx.Client(base_url=served.url, timeout=60) as client:
        for number in range(count):
            try:
                status = next(attacks)(client)
            except (httpx.TransportError, h11.LocalProtocolError, OSError):  # it was shown the door
                continue
            if status is not None and status not in ALLOWED:
                wrong[number] = status
        attacks.close()  # type: ignore[attr-defined]  # a generator's
        assert client.get("/health").json()["ok"]
        assert client.post("/api/words/check", json={"formula": "F a", "words": ["1; a"]}).json()["word"]["outcome"] == "holds"
    assert resident_megabytes(served.pid) - before < GROWTH
    return wrong


@pytest.mark.slow
def test_a_hundred_hostile_requests(served: Served) -> None:
    assert _unexpected(served, 100) == {}


@pytest.mark.slow
def test_a_thousand_hostile_requests(served: Served) -> None:
    assert _unexpected(served, 1000) == {}


def test_what_is_half_sent_is_not_waited_for(served: Served) -> None:
    where = urlsplit(served.url)
    with contextlib.ExitStack() as held:
        waiting: dict[bytes, socket.socket] = {}
        for half in HALVES[:6]:  # all at once, for each waits as long as the service does
            connection = socket.create_connection((where.hostname or "", where.port or 0), timeout=12)  # less than it is kept
            waiting[half] = held.enter_context(connection)
            connection.sendall(half)
        for half, connection in waiting.items():
            answer = b""
            while part := connection.recv(65536):  # until the service closes it
                answer += part
            assert answer == b"" or b" 408 " in answer.splitlines()[0], (half, answer[:200])
