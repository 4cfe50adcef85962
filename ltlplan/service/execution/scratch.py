"""Scratch space of workers: beside other programs' temporary files, and gone after any end.

A worker's own folder goes with the worker. What is left where all were killed at once is found again by a note in the data folder.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from pathlib import Path

PREFIX = "ltlplan-service-"
NOTE = "scratch.txt"
"""File of a data folder that says where its workers' temporary files are."""


def fresh_scratch(data: Path) -> Path | None:
    """Remove what a killed service of this data folder has left, and return an empty folder; None where none can be made or noted.

    Args:
        data: The data folder, which nobody else uses.
    """
    note = data / NOTE
    drop_scratch(data)
    try:
        made = Path(tempfile.mkdtemp(prefix=PREFIX))
    except OSError:
        return None
    try:
        note.write_text(f"{made}\n", encoding="utf-8")
    except OSError:
        made.rmdir()
        return None
    return made


def drop_scratch(data: Path) -> None:
    """Remove the temporary files of a data folder's workers, if there are any and they are ours.

    Args:
        data: The data folder.
    """
    try:
        noted = Path((data / NOTE).read_text(encoding="utf-8").strip())
        seen = os.lstat(noted)  # a link is none of ours
    except (OSError, ValueError):
        return
    ours = noted.name.startswith(PREFIX) and stat.S_ISDIR(seen.st_mode) and seen.st_uid == os.getuid()
    if ours:
        shutil.rmtree(noted, ignore_errors=True)
