"""Names that become file names: which of them no file system confuses, shortens, refuses or already uses."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from typing import Annotated

from pydantic import AfterValidator, Field

MAX_LENGTH = 100

_DEVICES = frozenset({"con", "prn", "aux", "nul"} | {f"{port}{digit}" for port in ("com", "lpt") for digit in range(10)})
_TAKEN = {"flight": "its trajectory would be flight.csv, which is the flight's log"}
"""Stems of tables beside `<robot>.csv`, in lower case, and why each cannot name a robot."""


def folded(path: str) -> str:
    """Return what two names share that some file system holds for the same."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def name_fault(name: str) -> str | None:
    """Say why a name cannot be a file's or a folder's on every file system; None where it can."""
    if len(name) > MAX_LENGTH:
        return f"'{name[:20]}...' has {len(name)} characters; names of files are made from it, so at most {MAX_LENGTH} are possible."
    if name.endswith((".", " ")):
        return f"'{name}' ends with a dot or a space, which Windows drops from names of files; leave it out."
    if name.partition(".")[0].rstrip().lower() in _DEVICES:
        return f"'{name}' is a device on Windows and cannot name a file there; choose another name."
    return None


def _name_of_files(value: str) -> str:
    """Reject a mission's name that folders and pages could not have."""
    if (fault := name_fault(value)) is not None:
        raise ValueError(fault)
    return value


MissionName = Annotated[
    str,
    Field(min_length=1, max_length=MAX_LENGTH, pattern=r"^[A-Za-z0-9][A-Za-z0-9_. -]*$"),
    AfterValidator(_name_of_files),
]


def robot_name_fault(name: str, earlier: Iterable[str]) -> str | None:
    """Say why a name cannot be a robot's, whose trajectory is `<robot>.csv`; None where it can.

    Args:
        name: The name.
        earlier: The names of the robots before it.
    """
    if (why := _TAKEN.get(folded(name))) is not None:
        return f"'{name}' cannot name a robot: {why}. Choose another name, such as '{name}0'."
    twin = next((other for other in earlier if folded(other) == folded(name)), None)
    if twin is not None:
        return f"'{name}' and '{twin}' differ only in case, so that their files would be one on some file systems; rename one."
    return name_fault(name)
