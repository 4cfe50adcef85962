"""The folder that a service keeps everything in: where it is, that nobody else looks into it, and that one service alone has it."""

from __future__ import annotations

import fcntl
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from verify.data.errors import BadInput

_ELSEWHERE = "Name another folder with --data."


def default_data() -> Path:
    """Return the folder of a service that is told no other, as systems have it for what programs keep."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", str(Path.home()))) / "ltlplan"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "ltlplan"
    return Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share") / "ltlplan"


@contextmanager
def own_folder(folder: Path) -> Generator[None]:
    """Have a data folder to ourselves; one service is enough for one folder.

    Raises:
        BadInput: It cannot be made or written, or another service has it.
    """
    make_private(folder)
    path = folder / "lock"
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise BadInput(f"{folder} cannot be written: {(error.strerror or str(error)).lower()}. {_ELSEWHERE}") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            other = os.pread(handle, 20, 0).decode("ascii", "replace").strip()
            who = f" (process {other})" if other.isdigit() else ""
            raise BadInput(f"{folder} is in use by another `ltlplan serve`{who}. {_ELSEWHERE}") from None
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"{os.getpid()}\n".encode(), 0)
        yield
    finally:
        os.close(handle)


def make_private(folder: Path) -> None:
    """Make a data folder that only its owner may look into, where there is none.

    Raises:
        BadInput: It cannot be made, or is no folder.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except FileExistsError:
        raise BadInput(f"{folder} is no folder. {_ELSEWHERE}") from None
    except OSError as error:
        raise BadInput(f"{folder} cannot be made: {(error.strerror or str(error)).lower()}. {_ELSEWHERE}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInput(f"{folder} cannot be written: permission denied. {_ELSEWHERE}")
