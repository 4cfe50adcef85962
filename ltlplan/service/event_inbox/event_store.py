"""Flights that listen and what they were told, on disk: one SQLite file in the data folder, each change in a transaction that is synced.

    flights(id, name, flight, mission, opened, ended, pilot, offered)  the newest of a name is the one that is meant by it
    events(flight, number, line, who, told, heard, answer)         numbered from 1 for each flight, in the order in which they were told

So what was accepted is there after a kill at any instant. A file that a newer version wrote is rejected.
"""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ltlplan.service.job_queue.store import NoRoom
from ltlplan.service.models import FlightAnswered, LiveEvent
from ltlplan.service.problems import Busy
from ltlplan.service.storage.sqlite_file import connected, transaction, upgrade
from ltlplan.service.times import utc_now
from verify.data import BadInput

FILE = "live.sqlite"

_TABLES = """
CREATE TABLE flights (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, flight TEXT NOT NULL UNIQUE, mission TEXT NOT NULL, opened TEXT NOT NULL, ended TEXT
);
CREATE TABLE events (
    flight INTEGER NOT NULL REFERENCES flights(id) ON DELETE CASCADE, number INTEGER NOT NULL, line TEXT NOT NULL, who TEXT NOT NULL,
    told TEXT NOT NULL, heard INTEGER, answer TEXT NOT NULL DEFAULT '', PRIMARY KEY (flight, number)
);
"""

_CONTROL = "ALTER TABLE flights ADD COLUMN pilot TEXT; ALTER TABLE flights ADD COLUMN offered TEXT;"


@dataclass(frozen=True, slots=True)
class Entry:
    """A flight in the book.

    Attributes:
        id: Names it within the book; grows.
        name: What it listens as.
        flight: Its own name for itself.
        mission: What it flies.
        opened: When it began to listen, UTC.
        ended: When it ended, UTC; None before.
        pilot: Who is in control of it; None while nobody is.
        offered: To whom control was offered; None where it was not.
        events: How many it was told.
        open: How many of them it has not answered.
    """

    id: int
    name: str
    flight: str
    mission: str
    opened: str
    ended: str | None
    pilot: str | None
    offered: str | None
    events: int
    open: int


class Book:
    """The file, while it is open. Each method is one transaction, and may be called from any thread."""

    def __init__(self, folder: Path) -> None:
        """Open the file, and make it where there is none.

        Args:
            folder: The service's data folder.

        Raises:
            BadInput: A newer version wrote it, or it is damaged.
            NoRoom: The disk is full.
        """
        self._lock = threading.Lock()
        path = folder / FILE
        self._file = connected(path)
        try:
            self._prepare(path)
        except sqlite3.DatabaseError as error:
            self._file.close()
            raise BadInput(f"{path} cannot be used: {error}.") from None
        except BadInput:
            self._file.close()
            raise

    def _prepare(self, path: Path) -> None:
        with _in_words():
            upgrade(self._file, path, (_TABLES, _CONTROL))
        for way in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
            self._file.execute(f"PRAGMA {way}")

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._file.close()

    @contextmanager
    def _changing(self) -> Generator[sqlite3.Cursor]:
        """Make changes, all or none."""
        with self._lock, _in_words(), transaction(self._file) as run:
            yield run

    def flights(self, name: str | None = None) -> list[Entry]:
        """Return flights, the newest first.

        Args:
            name: Only those that listened as this.
        """
        where = "" if name is None else "WHERE name = ?"
        counts = "(SELECT count(*) FROM events WHERE flight = f.id), (SELECT count(*) FROM events WHERE flight = f.id AND heard IS NULL)"
        asked = (
            f"SELECT id, name, flight, mission, opened, ended, pilot, offered, {counts} FROM flights f {where} ORDER BY id DESC"
        )
        with self._lock:
            return [Entry(*row) for row in self._file.execute(asked, () if name is None else (name,))]

    def begin(self, name: str, flight: str, mission: str, *, keep: int) -> None:
        """Enter a flight that begins to listen, and forget the oldest that have ended.

        Args:
            name: What it listens as.
            flight: Its own name for itself.
            mission: What it flies.
            keep: Flights that are kept.
        """
        with self._changing() as run:
            run.execute(
                "INSERT INTO flights (name, flight, mission, opened) VALUES (?, ?, ?, ?)", (name, flight, mission, utc_now())
            )
            run.execute(
                "DELETE FROM flights WHERE ended IS NOT NULL AND id NOT IN (SELECT id FROM flights ORDER BY id DESC LIMIT ?)",
                (keep,),
            )

    def control(self, entry: Entry, pilot: str | None, offered: str | None) -> None:
        """Keep who is in control of a flight.

        Args:
            entry: The flight.
            pilot: Who is; None for nobody.
            offered: To whom control is offered; None for nobody.
        """
        with self._changing() as run:
            run.execute("UPDATE flights SET pilot = ?, offered = ? WHERE id = ?", (pilot, offered, entry.id))

    def tell(self, entry: Entry, lines: Iterable[str], who: str) -> list[LiveEvent]:
        """Keep what a flight is told, and return it with its numbers, once it is on the disk.

        Args:
            entry: The flight.
            lines: An event each.
            who: Who told it.
        """
        now = utc_now()
        with self._changing() as run:
            (last,) = run.execute("SELECT coalesce(max(number), 0) FROM events WHERE flight = ?", (entry.id,)).fetchone()
            made = [LiveEvent(number=last + i, line=line, who=who, told=now) for i, line in enumerate(lines, 1)]
            run.executemany(
                "INSERT INTO events (flight, number, line, who, told) VALUES (?, ?, ?, ?, ?)",
                [(entry.id, each.number, each.line, each.who, each.told) for each in made],
            )
        return made

    def letters(self, entry: Entry) -> int:
        """Return how many letters a flight was told."""
        with self._lock:
            asked = "SELECT coalesce(sum(length(line)), 0) FROM events WHERE flight = ?"
            return self._file.execute(asked, (entry.id,)).fetchone()[0]

    def events(self, entry: Entry, after: int, limit: int) -> tuple[LiveEvent, ...]:
        """Return what a flight was told, in order.

        Args:
            entry: The flight.
            after: Only events of greater numbers.
            limit: At most so many.
        """
        asked = (
            "SELECT number, line, who, told, heard, answer FROM events WHERE flight = ? AND number > ? ORDER BY number LIMIT ?"
        )
        with self._lock:
            rows = self._file.execute(asked, (entry.id, after, limit)).fetchall()
        return tuple(
            LiveEvent(number=number, line=line, who=who, told=told, heard=None if heard is None else bool(heard), answer=answer)
            for number, line, who, told, heard, answer in rows
        )

    def answer(self, entry: Entry, answers: Iterable[FlightAnswered]) -> None:
        """Keep what a flight did with events; what was answered before stays.

        Args:
            entry: The flight.
            answers: What it did.
        """
        with self._changing() as run:
            run.executemany(
                "UPDATE events SET heard = ?, answer = ? WHERE flight = ? AND number = ? AND heard IS NULL",
                [(each.heard, each.sentence, entry.id, each.number) for each in answers],
            )

    def end(self, entry: Entry, why: str) -> None:
        """Note that a flight has ended, and answer for it what it did not hear; one that has ended stays as it is.

        Args:
            entry: The flight.
            why: Why it did not hear the rest.
        """
        with self._changing() as run:
            run.execute("UPDATE flights SET ended = ? WHERE id = ? AND ended IS NULL", (utc_now(), entry.id))
            run.execute("UPDATE events SET heard = 0, answer = ? WHERE flight = ? AND heard IS NULL", (why, entry.id))


@contextmanager
def _in_words() -> Generator[None]:
    """Turn errors of the disk into sentences."""
    try:
        yield
    except sqlite3.OperationalError as error:
        if "full" in str(error):
            raise NoRoom("What flights are told cannot be written: the disk is full. Make room there.") from None
        raise Busy(f"What flights are told cannot be written at the moment: {error}.", 5.0) from None
