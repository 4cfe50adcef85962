"""Control of a flight: handed from one pilot to another by both, kept through a restart, and needed for events, never for a stop."""

from __future__ import annotations

import asyncio
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from ltlplan.service.event_inbox import event_store
from ltlplan.service.event_inbox.control import changed
from ltlplan.service.event_inbox.event_store import FILE, Book
from ltlplan.service.event_inbox.flights import LiveFlights
from ltlplan.service.problems import Conflict
from ltlplan.service.settings import Limits
from verify.data import BadInput


def test_control_is_handed_over_by_both() -> None:
    held = changed("lab", (None, None), "take", "alice")
    assert held == ("alice", None)
    offered = changed("lab", held, "offer", "alice", to="bob")
    assert offered == ("alice", "bob")
    assert changed("lab", offered, "accept", "bob") == ("bob", None)
    assert changed("lab", offered, "decline", "bob") == ("alice", None)
    assert changed("lab", offered, "decline", "alice") == ("alice", None)
    assert changed("lab", held, "release", "alice") == (None, None)
    assert changed("lab", held, "release", "root", admin=True) == (None, None)


@pytest.mark.parametrize(
    ("control", "act", "who", "to"),
    [
        (("alice", None), "take", "bob", ""),
        (("alice", None), "accept", "bob", ""),
        (("alice", "carol"), "accept", "bob", ""),
        (("alice", "carol"), "decline", "bob", ""),
        (("alice", None), "offer", "bob", "carol"),
        ((None, None), "offer", "bob", "carol"),
        (("alice", None), "offer", "alice", "alice"),
        (("alice", None), "offer", "alice", ""),
        (("alice", None), "release", "bob", ""),
    ],
)
def test_nobody_takes_control_alone(control, act, who: str, to: str) -> None:
    with pytest.raises(BadInput):
        changed("lab", control, act, who, to=to)


def test_events_need_control_and_it_is_there_after_a_restart(tmp_path: Path) -> None:
    async def tried() -> None:
        live = LiveFlights(tmp_path, Limits())
        live.open()
        await live.begin("lab", "1" * 32, "m")
        await live.tell("lab", "one fails", "alice")
        with pytest.raises(Conflict, match="alice is in control"):
            await live.tell("lab", "two fails", "bob")
        await live.control("lab", "offer", "alice", to="bob")
        live.close()
        again = LiveFlights(tmp_path, Limits())
        again.open()
        assert (await again.flight("lab")).offered == "bob"
        assert (await again.control("lab", "accept", "bob")).pilot == "bob"
        await again.tell("lab", "two fails", "bob")
        with pytest.raises(Conflict, match="bob is in control"):
            await again.tell("lab", "two fails", "alice")
        again.close()

    asyncio.run(tried())


def test_a_file_of_before_there_was_control_is_brought_up_to_date(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / FILE)) as file:
        file.executescript(event_store._TABLES)
        file.execute("INSERT INTO flights (name, flight, mission, opened) VALUES ('lab', ?, 'm', 'now')", ("1" * 32,))
        file.execute("PRAGMA user_version = 1")
        file.commit()
    with closing(Book(tmp_path)) as book:
        (entry,) = book.flights()
        assert (entry.name, entry.pilot, entry.offered) == ("lab", None, None)
