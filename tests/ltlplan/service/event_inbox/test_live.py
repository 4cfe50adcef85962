"""Events that a service takes for flights: what it takes, whom it tells, what it keeps through kills, and what it refuses."""

from __future__ import annotations

import signal
import threading
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from ltlplan import Client
from ltlplan.commands.support.followed import TOKEN, followed
from ltlplan.online.event_queue import Told
from ltlplan.service.client_parts.long_polling import FollowedService
from ltlplan.service.event_inbox.names import parts_of
from ltlplan.service.problems import NotFound
from ltlplan.service.security.tokens import Tokens
from tests.helpers.few import few_of
from tests.helpers.serving.services import Served, serving, start
from verify.data import BadInput
from verify.data.events import RobotLeaves


@pytest.fixture
def name() -> str:
    """Return a name that no other test's flight has."""
    return f"lab-{uuid.uuid4().hex[:12]}"


@pytest.fixture
def flight(served: Served, name: str) -> Iterator[FollowedService]:
    """Have a flight that listens."""
    listening = FollowedService(f"{served.url}/live/{name}", "firefighting")
    yield listening
    listening.close()


def heard(flight: FollowedService, count: int, seconds: float = 20.0) -> list[Told | str]:
    """Return what a flight hears, once it is so much."""
    found: list[Told | str] = []
    end = time.monotonic() + seconds
    while len(found) < count and time.monotonic() < end:
        found += flight()
        time.sleep(0.01)
    return found


def events(found: list[Told | str]) -> list[str]:
    return [str(told.event) for told in found if isinstance(told, Told)]


def answered(client: Client, name: str, count: int) -> list[tuple[bool | None, str]]:
    """Return a flight's answers, once so many are there."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        told = client.events(name)
        if sum(event.heard is not None for event in told) >= count:
            break
        time.sleep(0.02)
    return [(event.heard, event.answer) for event in client.events(name)]


def test_what_is_told_is_heard_in_order_once_and_answered(client: Client, flight: FollowedService, name: str) -> None:
    told = client.send_events(name, "one fails", "# said", "two leaves")
    assert [(event.number, event.line, event.heard) for event in told.events] == [
        (1, "one fails", None),
        (2, "two leaves", None),
    ]
    assert (told.flight.mission, told.flight.events, told.flight.open) == ("firefighting", 2, 2)
    client.send_events(name, "formula F loc1")
    first, second, third = heard(flight, 3)
    assert isinstance(first, Told)
    assert first.event == RobotLeaves(time=0.0, robot="one")
    assert events([second, third]) == ["two leaves and lands", "the formula is now F loc1"]
    assert flight() == []
    first.answer(True, "one fails\nand lands, from 3.00 s of the flight on.")
    assert answered(client, name, 1)[0] == (True, "one fails and lands, from 3.00 s of the flight on.")
    flight.close()
    assert answered(client, name, 3)[1:] == [(False, "the flight ended without hearing it.")] * 2
    with pytest.raises(BadInput, match="has ended"):
        client.send_events(name, "one fails")


def test_who_tells_what_is_no_event_is_told_so_at_once_and_nothing_is_taken(
    client: Client, flight: FollowedService, name: str
) -> None:
    with pytest.raises(BadInput, match=r"(?s)event 2: 'nonsense' is no event.*event 3: .*at least 0"):
        client.send_events(name, "one fails", "nonsense", "nan two fails")
    for empty in ((), ("# nothing", "")):
        with pytest.raises(BadInput, match="no event in this"):
            client.send_events(name, *empty)
    with pytest.raises(BadInput, match="100 are the most"):
        client.send_events(name, *["one fails"] * 101)
    assert client.events(name) == ()
    assert flight() == []


def test_a_name_that_nobody_listens_as_is_refused_with_those_that_are(
    client: Client, flight: FollowedService, name: str
) -> None:
    with pytest.raises(NotFound, match=f"Did you mean '{name}'"):
        client.send_events(name[:-1], "one fails")
    assert name in {each.name for each in client.flights()}


def test_two_flights_do_not_share_a_name(served: Served, client: Client, flight: FollowedService, name: str) -> None:
    with pytest.raises(BadInput, match="Another flight listens"):
        FollowedService(f"{served.url}/live/{name}", "other")
    flight.close()
    second = FollowedService(f"{served.url}/live/{name}", "other")
    client.send_events(name, "two leaves")
    assert events(heard(second, 1)) == ["two leaves and lands"]
    assert [event.number for event in client.events(name)] == [1], "what the first was told is not the second's"
    second.close()


def test_what_was_fetched_and_not_heard_before_the_end_is_said(client: Client, flight: FollowedService, name: str) -> None:
    client.send_events(name, "one fails")
    time.sleep(0.3)  # it is fetched, and the flight does not look any more
    flight.close()
    ((heard_, answer),) = answered(client, name, 1)
    assert heard_ is False
    assert "ended" in answer


@few_of(
    8,
    ("method", "path", "kind", "body", "status"),
    [
        ("POST", "/api/live/nobody/events", "text/plain", b"one fails", 404),
        ("GET", "/api/live/nobody/events", "text/plain", b"", 404),
        ("POST", "/api/live/{name}/events", "application/x-www-form-urlencoded", b"one fails", 415),
        ("POST", "/api/live/{name}/events", "text/plain", b"\xff\xfe", 422),
        ("POST", "/api/live/{name}/events", "text/plain", b"one \x1b[2J", 422),
        ("POST", "/api/live/{name}/events", "text/plain", b"formula " + b"(" * 100_000, 422),
        ("POST", "/api/live/{name}/events", "text/plain", b"x" * 3_000_000, 413),
        ("POST", "/api/live/..%2f..%2fx/events", "text/plain", b"one fails", 404),
        ("PUT", "/api/live/a b", "application/json", b'{"flight": "' + b"0" * 32 + b'", "mission": "m"}', 422),
        ("PUT", "/api/live/{name}", "application/json", b'{"flight": "x", "mission": "m"}', 422),
        ("PUT", "/api/live/{name}", "application/json", b'{"flight": "' + b"0" * 32 + b'", "mission": "\\ud800"}', 422),
        ("POST", "/api/live/{name}/answers", "application/json", b'{"flight": "' + b"0" * 32 + b'", "answers": []}', 409),
        ("POST", "/api/live/{name}/end", "application/json", b'{"flight": "' + b"0" * 32 + b'"}', 409),
        ("GET", "/api/live/{name}/events?flight=" + "0" * 32, "", b"", 409),
        ("GET", "/api/live/{name}/events?wait=1e9", "", b"", 422),
        ("GET", "/api/live/{name}/events?wait=nan", "", b"", 422),
        ("GET", "/api/live/{name}/events?after=-1", "", b"", 422),
    ],
)
def test_what_is_hostile_is_refused_and_the_flight_goes_on(
    http: httpx.Client, flight: FollowedService, client: Client, name: str, method: str, path: str, kind: str, body: bytes, status: int
) -> None:  # fmt: skip
    answer = http.request(method, path.format(name=name), content=body, headers={"content-type": kind} if kind else {})
    assert answer.status_code == status, answer.text
    assert "detail" in answer.json()
    client.send_events(name, "two leaves")
    assert events(heard(flight, 1)) == ["two leaves and lands"]


def test_pages_of_other_sites_tell_nothing(http: httpx.Client, flight: FollowedService, name: str) -> None:
    headers = {"content-type": "text/plain", "origin": "https://elsewhere.example", "sec-fetch-site": "cross-site"}
    assert http.post(f"/api/live/{name}/events", content=b"one fails", headers=headers).status_code == 403
    assert flight() == []


@pytest.mark.slow
def test_what_was_accepted_is_heard_once_however_often_the_service_is_killed(tmp_path: Path) -> None:
    """It is killed, and started again at the same address, while it is told and asked."""
    process, served = start(tmp_path / "data")
    port = int(served.url.rpartition(":")[2])
    flight = FollowedService(f"{served.url}/live/lab", "firefighting")
    told, found = [], []
    with Client(served.url) as client:
        for number in range(3):
            client.send_events("lab", f"r{number} leaves", f"s{number} fails")
            told += [f"r{number} leaves and lands", f"s{number} fails and lands"]
            if number % 2:
                found += heard(flight, 1)
            process.send_signal(signal.SIGKILL)
            process.wait(30)
            with pytest.raises(BadInput, match="cannot be reached"):
                client.send_events("lab", "never leaves")
            process, served = start(tmp_path / "data", port=port)
        while len(events(found)) < len(told):
            new = heard(flight, 1)
            assert new, found
            found += new
        assert events(found) == told
        found += heard(flight, 1, 1.0)
        assert events(found) == told, "nothing comes twice"
        said = [each for each in found if isinstance(each, str)]
        assert any("cannot be heard" in each for each in said)
        assert any("is heard again" in each for each in said)
        assert [event.number for event in client.events("lab")] == [1, 2, 3, 4, 5, 6]
    flight.close()
    process.send_signal(signal.SIGTERM)
    process.wait(30)


@pytest.mark.slow
def test_where_tokens_are_needed_flights_and_operators_have_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").mkdir(mode=0o700)
    tokens = Tokens(tmp_path / "data")
    robots, alice = tokens.new("robots"), tokens.new("alice")
    with serving(tmp_path / "data", names=["plan.lab.example"]) as served:
        address = f"{served.url}/live/lab"
        monkeypatch.delenv(TOKEN, raising=False)
        with pytest.raises(BadInput, match="tokens only"):
            followed(address, "m")
        monkeypatch.setenv(TOKEN, robots)
        flight = followed(address, "m")
        with Client(served.url) as stranger, pytest.raises(BadInput, match="tokens only"):
            stranger.send_events("lab", "one fails")
        with Client(served.url, token=alice) as client:
            (event,) = client.send_events("lab", "one fails").events
        assert event.who == "alice"
        assert events(heard(flight, 1)) == ["one fails and lands"]
        tokens.revoke("robots")
        (said,) = heard(flight, 1, 30.0)
        assert "or it was revoked" in said
        flight.close()


@pytest.mark.slow
def test_a_stop_does_not_wait_for_those_who_wait(tmp_path: Path) -> None:
    process, served = start(tmp_path / "data")
    flight = FollowedService(f"{served.url}/live/lab", "m")
    asking = threading.Thread(target=lambda: httpx.get(f"{served.url}/api/live/lab/events?wait=25", timeout=30))
    asking.start()
    time.sleep(0.5)
    process.send_signal(signal.SIGTERM)
    assert process.wait(30) == 0
    asking.join(1)
    assert not asking.is_alive()
    flight.close()


@pytest.mark.parametrize(
    ("address", "parts"),
    [
        ("http://127.0.0.1:8000/live/lab", ("http://127.0.0.1:8000", "lab")),
        ("https://plan.lab.example/api/live/a.b-c_1/", ("https://plan.lab.example", "a.b-c_1")),
        ("http://[::1]:8000/behind/proxy/live/x", ("http://[::1]:8000/behind/proxy", "x")),
    ],
)
def test_addresses_of_flights(address: str, parts: tuple[str, str]) -> None:
    assert parts_of(address) == parts


@pytest.mark.parametrize("address", ["http://x", "http://x/live", "http://x/live/", "http://x/live/..", "http://x/live/a b", "ftp://x/live/a", "http://x/live/a?b", "http:///live/a"])  # fmt: skip
def test_what_is_no_address_of_a_flight_is_refused(address: str) -> None:
    with pytest.raises(BadInput, match="is no flight of a service"):
        parts_of(address)
