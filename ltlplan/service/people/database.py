"""The file of people, on disk: one SQLite file in the data folder, each change in a transaction that is synced.

The command line changes accounts while the service runs, so nothing of them is remembered: each look reads the file (some 20 µs). Readers never wait for
who writes: they have a connection of their own.

In `accounts` a password is an Argon2id hash; issuer and subject are those of OpenID Connect. `sessions` are of browsers: of an account, or of a token
(then its digest). `job_references`: a computation is shared by key, a job is somebody's reference to it, private unless its project is shared.
`leaving` has jobs whose last reference went, and when, until they are deleted. `mission_versions` has all versions of `missions`, `study_members` the jobs of
`studies`. `webhook_calls` has jobs whose end is still to be sent to `webhooks`.
"""

from __future__ import annotations

import json
import logging
import sqlite3
import threading
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ltlplan.service.log import note
from ltlplan.service.problems import Busy
from ltlplan.service.storage.sqlite_file import connected, transaction, upgrade
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import parse_json, read_bytes

FILE = "people.sqlite"
EARLIER_SESSIONS = "sessions.json"
"""File of sessions of version 0.2.0, taken over and removed."""

_PEOPLE = """
CREATE TABLE accounts (
    name TEXT PRIMARY KEY COLLATE NOCASE, role TEXT NOT NULL, password TEXT, temporary INTEGER NOT NULL DEFAULT 0, issuer TEXT, subject TEXT,
    made TEXT NOT NULL, disabled TEXT, UNIQUE (issuer, subject)
);
CREATE TABLE sessions (digest TEXT PRIMARY KEY, owner TEXT NOT NULL, token TEXT, began TEXT NOT NULL, ends REAL NOT NULL);
CREATE INDEX sessions_of_owner ON sessions (owner);
CREATE TABLE job_references (job TEXT NOT NULL, user TEXT NOT NULL, project TEXT NOT NULL, made TEXT NOT NULL, PRIMARY KEY (job, user));
CREATE TABLE projects (name TEXT PRIMARY KEY, owner TEXT NOT NULL, shared INTEGER NOT NULL, made TEXT NOT NULL);
CREATE TABLE leaving (job TEXT PRIMARY KEY);
CREATE TABLE log (
    number INTEGER PRIMARY KEY AUTOINCREMENT, time TEXT NOT NULL, user TEXT NOT NULL, role TEXT NOT NULL, action TEXT NOT NULL, object TEXT NOT NULL,
    detail TEXT NOT NULL
);
CREATE TABLE facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);
"""
_MISSIONS = """
CREATE TABLE missions (
    id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL, owner TEXT NOT NULL, project TEXT NOT NULL, tags TEXT NOT NULL, made TEXT NOT NULL,
    UNIQUE (owner, name)
);
CREATE TABLE mission_versions (
    mission INTEGER NOT NULL, number INTEGER NOT NULL, text TEXT NOT NULL, user TEXT NOT NULL, made TEXT NOT NULL, PRIMARY KEY (mission, number)
);
"""
_STUDIES = """
CREATE TABLE studies (
    id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL, owner TEXT NOT NULL, project TEXT NOT NULL, varied TEXT NOT NULL, made TEXT NOT NULL
);
CREATE TABLE study_members (study INTEGER NOT NULL, number INTEGER NOT NULL, value TEXT NOT NULL, job TEXT NOT NULL, PRIMARY KEY (study, number));
"""
_WEBHOOKS = """
CREATE TABLE webhooks (
    id INTEGER PRIMARY KEY AUTOINCREMENT, owner TEXT NOT NULL, url TEXT NOT NULL, made TEXT NOT NULL, said TEXT NOT NULL DEFAULT '', said_at TEXT
);
CREATE TABLE webhook_calls (webhook INTEGER NOT NULL, job TEXT NOT NULL, tries INTEGER NOT NULL, due REAL NOT NULL, PRIMARY KEY (webhook, job));
"""
_LEFT = "ALTER TABLE leaving ADD COLUMN since TEXT NOT NULL DEFAULT ''"
_STEPS = (_PEOPLE, _MISSIONS, _STUDIES, _WEBHOOKS, _LEFT)
"""What each format has more than the one before."""
_MOST_BYTES = 20_000_000


class PeopleDatabase:
    """The file, opened at its first use. Each method may be called from any thread.

    Attributes:
        folder: The service's data folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._opening = threading.Lock()
        self._reading, self._writing = threading.Lock(), threading.Lock()
        self._reader: sqlite3.Connection | None = None
        self._writer: sqlite3.Connection | None = None

    def read(self, asked: str, values: Sequence[object] = ()) -> list[tuple[Any, ...]]:  # of any type: SQLite's values
        """Return rows.

        Args:
            asked: SQL.
            values: For its question marks.

        Raises:
            BadInput: The file cannot be read.
        """
        reader, _ = self._connections()
        with self._reading, _in_words():
            return reader.execute(asked, values).fetchall()

    @contextmanager
    def changing(self) -> Generator[sqlite3.Cursor]:
        """Make changes, all or none; they are on the disk afterwards.

        Raises:
            BadInput: The file cannot be written.
        """
        _, writer = self._connections()
        with self._writing, _in_words(), transaction(writer) as run:
            yield run

    def close(self) -> None:
        """Close the file; the next use opens it again."""
        with self._opening:
            for connection in (self._reader, self._writer):
                if connection is not None:
                    connection.close()
            self._reader = self._writer = None

    def _connections(self) -> tuple[sqlite3.Connection, sqlite3.Connection]:
        if self._reader is None or self._writer is None:
            with self._opening, _in_words():
                if self._reader is None or self._writer is None:
                    self._writer = self._prepared()
                    self._reader = connected(self.folder / FILE)
        return self._reader, self._writer

    def _prepared(self) -> sqlite3.Connection:
        path = self.folder / FILE
        connection = connected(path)
        try:
            path.chmod(0o600)
            for way in ("journal_mode = WAL", "synchronous = FULL"):
                connection.execute(f"PRAGMA {way}")
            upgrade(connection, path, _STEPS, self._take_over)
        except BaseException:
            connection.close()
            raise
        (self.folder / EARLIER_SESSIONS).unlink(missing_ok=True)
        return connection

    def _take_over(self, run: sqlite3.Cursor) -> None:
        insert = "INSERT INTO sessions (digest, owner, token, began, ends) VALUES (?, ?, ?, '', ?)"
        run.executemany(insert, _earlier_sessions(self.folder / EARLIER_SESSIONS))


def _earlier_sessions(path: Path) -> list[tuple[str, str, str, float]]:
    """Return the sessions of version 0.2.0; of a damaged file none, so that browsers log in again."""
    if not path.exists():
        return []
    try:
        data = parse_json(read_bytes(path, most=_MOST_BYTES, what="file of sessions"), str(path))
        if not isinstance(data, dict) or data.get("format") != 1:
            raise ValueError("another format")
        listed: dict[str, dict[str, Any]] = data["sessions"]
        return [(str(key), str(each["owner"]), str(each["token"]), float(each["ends"])) for key, each in listed.items()]
    except (BadInput, AttributeError, KeyError, TypeError, ValueError, json.JSONDecodeError) as error:
        note("sessions are lost", level=logging.WARNING, file=str(path), reason=str(error))
        return []


@contextmanager
def _in_words() -> Generator[None]:
    """Turn errors of the file into sentences."""
    try:
        yield
    except sqlite3.OperationalError as error:
        raise Busy(f"{FILE} cannot be used at the moment: {error}.", 5.0) from None
    except sqlite3.DatabaseError as error:
        raise BadInput(f"{FILE} cannot be used: {error}; put a copy in its place.") from None
