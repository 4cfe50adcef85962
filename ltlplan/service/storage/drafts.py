"""Missions as they are being written, kept for each user until they are done with them: what a browser would lose with its computer."""

from __future__ import annotations

import sqlite3
import threading
from dataclasses import dataclass
from pathlib import Path

from verify.data.errors import BadInput

FILE = "drafts.sqlite"
MOST = 40
"""Drafts of one user, and as many texts that jobs were made of; of more, those that were changed longest ago go."""
OF_JOB = "job-"
"""Begins the ids of texts that jobs were made of."""
LONGEST = 1_200_000
"""Letters of a draft."""

_LONGEST_ID = 100
_TABLE = """CREATE TABLE IF NOT EXISTS drafts (
    user TEXT NOT NULL, id TEXT NOT NULL, text TEXT NOT NULL, changed REAL NOT NULL, PRIMARY KEY (user, id))"""


@dataclass(frozen=True, slots=True)
class Draft:
    """A mission's text as it was left.

    Attributes:
        text: YAML, with its faults.
        changed: When that was, ms since 1970 by the clock of the browser.
    """

    text: str
    changed: float


class Drafts:
    """The drafts of all users of a data folder.

    Args:
        folder: The data folder.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._lock = threading.Lock()
        self._open: sqlite3.Connection | None = None

    def of(self, user: str) -> dict[str, Draft]:
        """Return a user's drafts by their ids.

        Raises:
            BadInput: The file cannot be read.
        """
        rows = self._do("SELECT id, text, changed FROM drafts WHERE user = ?", (user,))
        return {str(draft): Draft(str(text), float(str(changed))) for draft, text, changed in rows}

    def keep(self, user: str, draft: str, kept: Draft) -> None:
        """Keep a draft, unless it is kept as it was later.

        Args:
            user: Whose it is.
            draft: Its id.
            kept: Its text.

        Raises:
            BadInput: It is too long, or the file cannot be written.
        """
        if len(kept.text) > LONGEST or not 0 < len(draft) <= _LONGEST_ID:
            raise BadInput(f"A draft of {len(kept.text)} letters is not kept; {LONGEST} are the most.")
        self._do(
            "INSERT INTO drafts VALUES (?, ?, ?, ?) ON CONFLICT (user, id) DO UPDATE SET text = excluded.text, changed = excluded.changed"
            " WHERE excluded.changed >= changed",
            (user, draft, kept.text, kept.changed),
        )
        self._do(
            "DELETE FROM drafts WHERE user = ?1 AND (id LIKE 'job-%') = ?2 AND id NOT IN"
            " (SELECT id FROM drafts WHERE user = ?1 AND (id LIKE 'job-%') = ?2 ORDER BY changed DESC LIMIT ?3)",
            (user, draft.startswith(OF_JOB), MOST),
        )

    def close(self) -> None:
        """Let go of the file."""
        with self._lock:
            if self._open is not None:
                self._open.close()
                self._open = None

    def _do(self, statement: str, values: tuple[object, ...]) -> list[tuple[object, ...]]:
        with self._lock:
            try:
                if self._open is None:
                    self._open = sqlite3.connect(self._path, timeout=3.0, check_same_thread=False, isolation_level=None)
                    self._path.chmod(0o600)
                    self._open.execute("PRAGMA journal_mode=WAL")
                    self._open.execute(_TABLE)
                return self._open.execute(statement, values).fetchall()
            except sqlite3.Error as error:
                raise BadInput(f"{self._path.name} cannot be used: {error}.") from None
