"""Rules of the service, each by itself: hosts, pages of other sites, rates and bodies."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from ltlplan.service.problems import (
    BodyTooLarge,
    Busy,
    Forbidden,
    TooManyRequests,
    WrongHost,
)
from ltlplan.service.security.body_limits import Bodies, Body
from ltlplan.service.security.origins import own_names, require_own_host, require_own_page
from ltlplan.service.security.rates import MOST_CLIENTS, Rates
from ltlplan.service.settings import Rate


@pytest.mark.parametrize("host", ["localhost", "localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST.", "127.5.5.5"])
def test_names_of_this_machine(host: str) -> None:
    assert require_own_host(host, own_names("127.0.0.1"), everywhere=False) is None


@pytest.mark.parametrize(
    "host", ["", "evil.example", "localhost.evil.example", "10.0.0.1", "127.0.0.1.evil.example", "[", "a b", "0x7f.1"]
)
def test_names_that_lead_here_but_are_not_ours(host: str) -> None:
    with pytest.raises(WrongHost):
        require_own_host(host, own_names("127.0.0.1"), everywhere=False)


def test_names_on_a_network() -> None:
    names = own_names("0.0.0.0", ("Plan.Lab",))
    for host in ("10.0.0.7:8000", "plan.lab", "localhost"):
        assert require_own_host(host, names, everywhere=True) is None
    with pytest.raises(WrongHost, match=r"--name evil\.example"):
        require_own_host("evil.example", names, everywhere=True)


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://localhost:9000"},
        {"origin": "http://["},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
def test_pages_of_other_sites_change_nothing(headers: dict[str, str]) -> None:
    given = {"host": "localhost:8000", **headers}
    for method in ("POST", "DELETE", "WEBSOCKET", "PUT"):
        with pytest.raises(Forbidden):
            require_own_page(method, given)
    assert require_own_page("GET", given) is None


def test_our_own_pages_and_programs_may_ask() -> None:
    ours = {"host": "localhost:8000", "origin": "http://localhost:8000", "sec-fetch-site": "same-origin"}
    assert require_own_page("POST", {"host": "localhost:8000"}) is None
    assert require_own_page("WEBSOCKET", ours) is None


def test_a_client_that_asks_too_often_waits_and_others_do_not() -> None:
    now = [0.0]
    rates = Rates(Rate(2.0, 3), clock=lambda: now[0])
    for _ in range(3):
        rates.take("a")
    with pytest.raises(TooManyRequests) as found:
        rates.take("a")
    assert found.value.seconds == pytest.approx(0.5)
    rates.take("b")
    now[0] = 0.5
    rates.take("a")
    with pytest.raises(TooManyRequests):
        rates.take("a")


def test_clients_that_never_come_back_are_forgotten() -> None:
    rates = Rates(Rate(1.0, 1), clock=lambda: 0.0)
    for client in range(MOST_CLIENTS + 5):
        rates.take(str(client))
    rates.take("0")  # long forgotten, so its bucket is full again
    with pytest.raises(TooManyRequests):
        rates.take(str(MOST_CLIENTS))


def _receiving(*parts: bytes) -> Any:
    messages = [{"type": "http.request", "body": part, "more_body": i + 1 < len(parts)} for i, part in enumerate(parts)]

    async def receive() -> dict[str, Any]:
        return messages.pop(0)

    return receive


def test_bodies_are_counted_as_they_come() -> None:
    async def read(most: int, held: int, *parts: bytes, announced: str | None = None) -> Bodies:
        bodies = Bodies(held, 1.0)
        body = Body(_receiving(*parts), bodies, most, announced)
        try:
            for _ in parts:
                await body.receive()
        finally:
            body.release()
        return bodies

    assert asyncio.run(read(10, 100, b"12345", b"67890")).held == 0
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"12345", b"67890"))
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"", announced="10"))
    with pytest.raises(BodyTooLarge):
        asyncio.run(read(9, 100, b"", announced="9" * 5000))
    with pytest.raises(Busy):
        asyncio.run(read(100, 9, b"12345", b"67890"))
