"""Pause of deletions while a backup is made: a lock that the backup has alone, and that the service shares for the instant of a deletion."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from verify.data.errors import BadInput

FILE = "backup.lock"


@contextmanager
def paused(folder: Path) -> Generator[None]:
    """Have nothing deleted from a data folder; waits for a deletion that is going on.

    Raises:
        BadInput: The folder cannot be written.
    """
    with _held(folder, fcntl.LOCK_EX) as held:
        assert held
        yield


@contextmanager
def deleting(folder: Path) -> Generator[bool]:
    """Tell whether something may be deleted now; while this lasts no backup begins."""
    with _held(folder, fcntl.LOCK_SH | fcntl.LOCK_NB) as held:
        yield held


@contextmanager
def _held(folder: Path, how: int) -> Generator[bool]:
    try:
        handle = os.open(folder / FILE, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise BadInput(f"{folder} cannot be written: {(error.strerror or str(error)).lower()}.") from None
    try:
        try:
            fcntl.flock(handle, how)
        except BlockingIOError:
            yield False
            return
        yield True
    finally:
        os.close(handle)
