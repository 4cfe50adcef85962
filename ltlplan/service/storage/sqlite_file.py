"""SQLite files of the service: opened alike, brought to the newest format, and changed all or nothing."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from verify.data.errors import BadInput

PATIENCE = 5.0
"""s that a file that others hold is waited for."""


def connected(path: Path) -> sqlite3.Connection:
    """Open a file, and make it where there is none; any thread may use it, and transactions are begun by name.

    Args:
        path: The file.
    """
    return sqlite3.connect(path, timeout=PATIENCE, isolation_level=None, check_same_thread=False)


@contextmanager
def transaction(connection: sqlite3.Connection) -> Generator[sqlite3.Cursor]:
    """Make changes, all or none.

    Args:
        connection: Nobody else writes by it meanwhile.

    Raises:
        sqlite3.DatabaseError: The file cannot be written.
    """
    with closing(connection.cursor()) as run:
        run.execute("BEGIN IMMEDIATE")
        try:
            yield run
        except BaseException:
            run.execute("ROLLBACK")
            raise
        run.execute("COMMIT")


def upgrade(
    connection: sqlite3.Connection, path: Path, steps: Sequence[str], fill: Callable[[sqlite3.Cursor], None] | None = None
) -> None:
    """Bring the tables of a file to the newest format, all or nothing; one that has it is only looked at.

    Args:
        connection: To the file.
        path: The file's.
        steps: SQL of each format: what it has more than the one before.
        fill: Takes over into a new file what an earlier version had elsewhere.

    Raises:
        BadInput: A newer version wrote it.
        sqlite3.DatabaseError: The file cannot be written.
    """
    (found,) = connection.execute("PRAGMA user_version").fetchone()
    if found > len(steps):
        raise BadInput(f"{path} was written by a newer ltlplan: start that version, or take another data folder.")
    if found == len(steps):
        return
    with transaction(connection) as run:
        (found,) = run.execute("PRAGMA user_version").fetchone()
        for step in steps[found:]:  # another process may have been first
            for statement in filter(str.strip, step.split(";")):
                run.execute(statement)
        if found == 0 and fill is not None:
            fill(run)
        run.execute(f"PRAGMA user_version = {len(steps)}")
