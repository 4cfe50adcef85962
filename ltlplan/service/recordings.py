"""Recordings as they were sent: one file, known by how it begins, or a folder of files in a ZIP archive.

Nothing is named as a request says: one file is named by what it is, and of an archive only plain names with known endings are put down.
"""

from __future__ import annotations

import io
import posixpath
import re
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from verify.data import BadInput
from verify.data.storage.archives import ArchiveBounds, checked_members

ENDINGS = (".csv", ".tsv", ".ulg", ".mcap", ".db3", ".yaml")
"""Of the files in an archive: tables, PX4's logs, and bags with their metadata."""
BOUNDS = ArchiveBounds("recording", 300, 400_000_000)
"""Of an archive: a file a robot, and what is read into memory in seconds."""

_ZIP = b"PK\x03\x04"
_BEGINNINGS = ((b"ULog\x01\x12\x35", ".ulg"), (b"\x89MCAP0\r\n", ".mcap"), (b"SQLite format 3\0", ".db3"))
_NAME = re.compile(r"[^\W.][\w .+-]{0,100}")


@dataclass(frozen=True, slots=True)
class RecordingAsked:
    """Options of a recording, as those of `ltlplan certify --flight`.

    Attributes:
        max_speed: Bound on every robot's speed, m/s.
        error: Bound on a position's error, m.
        start: When the flight began, s, or s of each robot's clock; None where it is to be found.
        start_error: How far that may be off, s.
        called: Pairs of what we call something and what the recording calls it.
        axes: The mission's x, y, z in the recording's axes; None as the recording says.
        origin: Where the recording's origin lies, m, or that of robots.
        pauses: How long the team hovered between parts, s each.
    """

    max_speed: float | None = None
    error: float = 0.0
    start: str | None = None
    start_error: float = 0.0
    called: tuple[str, ...] = ()
    axes: str | None = None
    origin: tuple[str, ...] = ()
    pauses: tuple[float, ...] = ()


def kept_name(name: str, data: bytes) -> str:
    """Return the name under which a recording is kept: its own where it is a plain one with a known ending, else one by what it is.

    Args:
        name: As it was sent.
        data: The recording.
    """
    ending = ".zip" if data.startswith(_ZIP) else _ending(data)
    leaf = name.replace("\\", "/").rpartition("/")[2]
    fits = leaf.lower().endswith((".csv", ".tsv") if ending == ".csv" else ending)
    return leaf if fits and _NAME.fullmatch(leaf) else f"recording{ending}"


def put_recording(folder: Path, data: bytes) -> Path:
    """Put a recording into a folder as `flight.read_flown` reads it.

    Args:
        folder: Empty, for use meanwhile.
        data: What was sent.

    Returns:
        The recording: a file, or a folder with a file for each robot or a bag.

    Raises:
        BadInput: It is an archive that is damaged, too large, or holds what no recording holds.
    """
    if not data.startswith(_ZIP):
        return _put(folder, data)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = _files(archive)
            if len(files) == 1:
                return _put(folder, _unpacked(archive, *files.values()))
            place = folder / "recording"
            place.mkdir()
            for name, member in files.items():
                (place / name).write_bytes(_unpacked(archive, member))
            return place
    except zipfile.BadZipFile as error:
        raise BadInput(f"The recording is a damaged ZIP archive: {error}.") from None


def _put(folder: Path, data: bytes) -> Path:
    path = folder / f"recording{_ending(data)}"
    path.write_bytes(data)
    return path


def _ending(data: bytes) -> str:
    return next((ending for beginning, ending in _BEGINNINGS if data.startswith(beginning)), ".csv")


def _files(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Return an archive's files by their names; they lie side by side, or together in one folder."""
    members = checked_members("The recording", archive.infolist(), BOUNDS)
    files = {path: member for path, member in members.items() if not member.is_dir()}
    if not files:
        raise BadInput("The recording is an empty ZIP archive.")
    if len(folders := sorted({posixpath.dirname(path) for path in files})) > 1:
        raise BadInput(
            f"The recording's files lie in several folders ({', '.join(folders)[:100]}); send those of one flight, side by side."
        )
    found = {posixpath.basename(path): member for path, member in files.items()}
    for name in found:
        if not _NAME.fullmatch(name) or not name.lower().endswith(ENDINGS):
            raise BadInput(
                f"The recording holds {name[:100]!r}; of an archive these are read: {', '.join(ENDINGS)}, a file a robot (quad0.csv) or a bag."
            )
    return found


def _unpacked(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    """Return a member's bytes: as many as it says, which were counted."""
    try:
        with archive.open(member) as stream:
            data = stream.read(member.file_size + 1)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, OSError) as error:
        raise BadInput(f"The recording's {member.filename[:100]!r} is damaged: {error}.") from None
    if len(data) != member.file_size:
        raise BadInput(f"The recording's {member.filename[:100]!r} is damaged: it does not hold the bytes that it says.")
    return data
