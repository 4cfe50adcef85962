"""The page's socket: pages of other sites have none, and what is said over one as fast as it takes it stops nobody."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus, WebSocketException
from websockets.sync.client import connect

from tests.helpers.serving.services import Served, resident_megabytes, serving

pytest.importorskip("nicegui", reason="needs the service's extra")
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("service")]

SAID = (
    '42["event",{"id":1,"client_id":"x","listener_id":"y","args":[]}]',
    "x" * 100,
    '42["event","' + "x" * 900_000 + '"]',
    "42" + "[" * 50_000,
    '451-["event",{"_placeholder":true,"num":0}]',
)
"""Messages that no page sends."""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """Have a service with its page."""
    with serving(tmp_path_factory.mktemp("service") / "data", page=True) as made:
        yield made


def _socket(served: Served) -> str:
    return f"ws{served.url.removeprefix('http')}/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


@pytest.mark.parametrize("origin", ["null", "http://evil.example", "http://127.0.0.1.evil.example", "file://"])
def test_pages_from_elsewhere_have_no_socket(served: Served, origin: str) -> None:
    with pytest.raises(InvalidStatus) as refused, connect(_socket(served), origin=origin, proxy=None):  # type: ignore[arg-type]  # any text
        pass
    assert refused.value.response.status_code == 403
    polled = httpx.post(
        f"{served.url}/_nicegui_ws/socket.io/?EIO=4&transport=polling", headers={"origin": origin}, content="40"
    )
    assert polled.status_code == 403


def test_a_socket_that_is_flooded_stops_nobody_and_fills_no_disk(served: Served) -> None:
    log, before = served.data.parent / f"{served.data.name}.log", resident_megabytes(served.pid)
    over, sent = threading.Event(), [0]

    def flood(said: str) -> None:
        while not over.is_set():
            with (
                suppress(WebSocketException, TimeoutError, OSError),
                connect(_socket(served), proxy=None, ping_interval=None) as line,
            ):
                line.recv(timeout=5)
                line.send("40")
                while not over.is_set():
                    line.send(said)
                    sent[0] += 1

    floods = [threading.Thread(target=flood, args=(said,)) for said in SAID]
    for each in floods:
        each.start()
    began = time.monotonic()
    while time.monotonic() - began < 10.0:
        assert httpx.get(f"{served.url}/health", timeout=10).json()["ok"]
    over.set()
    for each in floods:
        each.join(60)
    assert sent[0] > 1000
    assert resident_megabytes(served.pid) - before < 300.0
    tracebacks = [line for line in log.read_text().splitlines() if "Traceback" in line]
    assert len(tracebacks) < 20
    assert Path(log).stat().st_size < 1_000_000
