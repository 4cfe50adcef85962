"""The rules by which flights listen: limits, silence, and what is kept when the service begins anew."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ltlplan.service.event_inbox import flights as rules
from ltlplan.service.event_inbox.event_store import FILE, Book
from ltlplan.service.event_inbox.flights import LiveFlights
from ltlplan.service.job_queue.store import NoRoom
from ltlplan.service.models import FlightAnswered, LiveEvent
from ltlplan.service.problems import Conflict, NotFound, TooManyRequests
from ltlplan.service.settings import Limits
from verify.data import BadInput

Opened = Callable[..., LiveFlights]
ONE, TWO, THREE = ("1" * 32, "2" * 32, "3" * 32)


@pytest.fixture
def opened() -> Iterator[Opened]:
    """Open a service's flights, as it does when it begins; none is closed before the test has ended."""
    every: list[LiveFlights] = []

    def open_(folder: Path, **limits: Any) -> LiveFlights:
        live = LiveFlights(folder, Limits(**limits))
        live.open()
        every.append(live)
        return live

    yield open_
    for live in every:
        live.close()


async def asked(
    live: LiveFlights, name: str, flight: str | None = None, after: int = 0, wait: float = 0.0
) -> tuple[LiveEvent, ...]:
    return await live.events(name, flight=flight, after=after, wait=wait, stopping=asyncio.Event())


def test_what_is_kept_is_there_after_a_kill_at_any_instant(tmp_path: Path, opened: Opened) -> None:
    async def before(live: LiveFlights) -> None:
        await live.begin("lab", ONE, "firefighting")
        await live.tell("lab", "one fails\ntwo fails\nthree fails", "alice")
        await live.answer("lab", ONE, [FlightAnswered(number=2, heard=False, sentence="it is not in the air.")])

    async def after(live: LiveFlights) -> None:
        assert [event.line for event in await asked(live, "lab", ONE, after=1)] == ["two fails", "three fails"]
        flight, new = await live.begin("lab", ONE, "firefighting")
        assert (flight.events, flight.open, new) == (3, 2, False)
        await live.answer("lab", ONE, [FlightAnswered(number=number, heard=True, sentence="done") for number in (1, 2, 3)])
        assert [(event.heard, event.answer) for event in await asked(live, "lab")] == [
            (True, "done"), (False, "it is not in the air."), (True, "done"),
        ]  # fmt: skip
        assert {event.who for event in await asked(live, "lab")} == {"alice"}

    asyncio.run(before(opened(tmp_path)))
    asyncio.run(after(opened(tmp_path)))


def test_limits(tmp_path: Path, opened: Opened) -> None:
    async def told() -> None:
        live = opened(tmp_path, live_flights=2, live_events=3, live_letters=40)
        await live.begin("one", ONE, "m")
        await live.begin("two", TWO, "m")
        with pytest.raises(TooManyRequests, match="2 flights listen already"):
            await live.begin("three", THREE, "m")
        await live.tell("one", "a fails\nb fails", "x")
        with pytest.raises(TooManyRequests, match="3 events at most; 'one' was told 2"):
            await live.tell("one", "c fails\nd fails", "x")
        with pytest.raises(TooManyRequests, match="40 letters at most"):
            await live.tell("one", "formula F abcdefghijklmnopqrstuvwxyz", "x")
        assert len(await asked(live, "one")) == 2
        for number in range(20):  # they come and go
            await live.end("two", TWO if number == 0 else f"{number:032x}")
            await live.begin("two", f"{number + 1:032x}", "m")
        with sqlite3.connect(tmp_path / FILE) as file:
            assert file.execute("SELECT count(*) FROM flights").fetchone()[0] <= 5
        file.close()

    asyncio.run(told())


def test_a_flight_that_went_away_is_told_no_more_and_gives_up_its_name(
    tmp_path: Path, opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def told() -> None:
        live = opened(tmp_path, live_flights=1)
        await live.begin("lab", ONE, "m")
        await live.tell("lab", "one fails", "x")
        with pytest.raises(Conflict, match="Another flight listens as 'lab'"):
            await live.begin("lab", TWO, "m")
        clock[0] += rules.LOST + 1
        with pytest.raises(Conflict, match="has not asked for 61 s"):
            await live.tell("lab", "two fails", "x")
        assert [event.line for event in await asked(live, "lab", ONE)] == ["one fails"], "it is back"
        await live.tell("lab", "two fails", "x")
        clock[0] += rules.TAKEN + 1
        await live.begin("lab", TWO, "m")
        with pytest.raises(Conflict, match="does not listen as 'lab' any more"):
            await asked(live, "lab", ONE)
        assert await asked(live, "lab", TWO) == ()
        clock[0] += rules.LOST + 1
        await live.begin("other", THREE, "m")  # the only place was one's that went away
        with pytest.raises(Conflict, match="has ended"):
            await live.tell("lab", "one fails", "x")

    clock = [1000.0]
    monkeypatch.setattr(rules.time, "monotonic", lambda: clock[0])
    asyncio.run(told())


def test_who_waits_hears_at_once(tmp_path: Path, opened: Opened) -> None:
    async def told() -> None:
        live = opened(tmp_path)
        await live.begin("lab", ONE, "m")
        waiting = asyncio.create_task(asked(live, "lab", ONE, wait=60.0))
        await asyncio.sleep(0.05)
        assert not waiting.done()
        await live.tell("lab", "one fails", "x")
        assert [event.line for event in await asyncio.wait_for(waiting, 5)] == ["one fails"]
        waiting = asyncio.create_task(asked(live, "lab", after=1, wait=60.0))
        await asyncio.sleep(0.05)
        await live.end("lab", ONE)
        assert await asyncio.wait_for(waiting, 5) == ()

    asyncio.run(told())


def test_a_full_disk_takes_nothing(tmp_path: Path, opened: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    async def told() -> None:
        live = opened(tmp_path)
        await live.begin("lab", ONE, "m")
        monkeypatch.setattr(rules, "RESERVE", 1e18)
        for what in (live.tell("lab", "one fails", "x"), live.begin("other", TWO, "m")):
            with pytest.raises(NoRoom, match="room"):
                await what
        assert await asked(live, "lab") == ()
        with pytest.raises(NotFound):
            await live.flight("other")

    asyncio.run(told())


def test_what_is_no_book_of_ours_is_refused_and_left(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / FILE) as file:
        file.execute("PRAGMA user_version = 99")
    file.close()
    with pytest.raises(BadInput, match="newer ltlplan"):
        Book(tmp_path)
    (tmp_path / FILE).write_bytes(b"no database" * 100)
    with pytest.raises(BadInput, match="cannot be used"):
        Book(tmp_path)
    assert (tmp_path / FILE).read_bytes() == b"no database" * 100
