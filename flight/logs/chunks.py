"""Bags that are small enough to read: what is compressed is unpacked once under a limit, before a library unpacks it without one."""

from __future__ import annotations

import sqlite3
import struct
from contextlib import closing
from pathlib import Path
from typing import BinaryIO

from verify.data import BadInput, MissingEngine
from verify.data.storage.safe_reading import read_text

MAX_FILES = 4_000_000_000
"""Bytes of a bag on disk."""
MAX_CHUNK = 256_000_000
"""Bytes of a chunk, unpacked; writers make chunks of about 1 MB."""
MAX_UNPACKED = 16_000_000_000
"""Bytes of all chunks, unpacked."""

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK, _INDEX = 6, 8


def require_small(path: Path) -> None:
    """Reject a bag that is larger than any recording of poses, on disk or unpacked.

    Args:
        path: A bag's folder, or one file of it.

    Raises:
        BadInput: It is too large, compressed as a whole, or damaged.
        MissingEngine: It is compressed, and mcap is not installed.
    """
    files = [path]
    if path.is_dir():
        about = read_text(path / "metadata.yaml", most=10_000_000, what="bag's metadata").lower()
        for mode in ("file", "message"):
            if any(f"compression_mode: {quote}{mode}" in about for quote in ("", '"', "'")):
                raise BadInput(
                    f"{path} is compressed {mode} by {mode}; unpack it first (ros2 bag convert), or record MCAP with its own chunks."
                )
        files = sorted(file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
    size = sum(file.stat().st_size for file in files if file.is_file())
    if size > MAX_FILES:
        raise BadInput(
            f"{path} holds {size // 10**9} GB; at most {MAX_FILES // 10**9} GB are read: keep the topics of poses only."
        )
    for file in files:
        if file.suffix == ".db3":
            _require_tables(file)
        else:
            _require_chunks(file)


def _require_tables(file: Path) -> None:
    """Reject a database whose tables are made up as they are read."""
    try:
        with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True)) as base:
            made = base.execute("SELECT name FROM sqlite_master WHERE type IN ('view', 'trigger')").fetchall()
    except sqlite3.Error as error:
        raise BadInput(f"{file} is no bag of sqlite3: {str(error).splitlines()[0]}.") from None
    if made:
        raise BadInput(f"{file} is no bag of sqlite3: it holds the view or trigger {str(made[0][0])[:40]!r}.")


def _require_chunks(file: Path) -> None:
    """Walk over an MCAP file's records, and unpack every chunk under its limit; its index must lead to these chunks."""
    total, size = 0, file.stat().st_size
    chunks, indexed = set[int](), set[int]()
    with file.open("rb") as stream:
        if stream.read(8) != _MAGIC:
            raise BadInput(f"{file} is no MCAP file: it does not begin as one.")
        while True:
            at, head = stream.tell(), stream.read(9)
            if head[:8] == _MAGIC:  # which ends the file, too
                if not indexed <= chunks:
                    raise BadInput(f"{file} is damaged: its index leads to chunks that are not there.")
                return
            length = struct.unpack("<Q", head[1:])[0] if len(head) == 9 else size
            end = at + 9 + length
            if end > size:
                raise BadInput(f"{file} was cut: it ends within the record at byte {at}.")
            if head[0] == _INDEX:
                entry = stream.read(min(length, 24))
                indexed.add(struct.unpack("<Q", entry[16:])[0] if len(entry) == 24 else -1)
            if head[0] == _CHUNK:
                chunks.add(at)
                total += _unpacked(stream, length, f"{file}, the chunk at byte {at}")
                if total > MAX_UNPACKED:
                    raise BadInput(
                        f"{file} holds more than {MAX_UNPACKED // 10**9} GB when it is unpacked; that is no recording of poses."
                    )
            stream.seek(end)


def _unpacked(stream: BinaryIO, length: int, what: str) -> int:
    """Return how many bytes a chunk holds, after it was unpacked under its limit."""
    head = stream.read(min(length, 32))
    if len(head) < 32:
        raise BadInput(f"{what}, is damaged.")
    said, name = struct.unpack("<Q", head[16:24])[0], struct.unpack("<I", head[28:32])[0]
    if said > MAX_CHUNK or length > MAX_CHUNK or name > 100:
        raise BadInput(f"{what}, is said to hold {said} bytes; at most {MAX_CHUNK // 10**6} MB are read.")
    kind, size = stream.read(name).decode("ascii", "replace"), stream.read(8)
    packed = stream.read(min(struct.unpack("<Q", size)[0], length)) if len(size) == 8 else b""
    if kind == "":
        return len(packed)
    found = _size(packed, kind, said)
    if found != said:
        how = "more" if found > said else "less"
        raise BadInput(f"{what}, holds {how} than the {said} bytes that it says: it is damaged, or made to fill the memory.")
    return said


def _size(packed: bytes, kind: str, most: int) -> int:
    """Return how many bytes a compressed chunk holds, or more than `most` where it holds more."""
    try:
        import lz4.frame
        import zstandard
    except ImportError:
        raise MissingEngine("Compressed MCAP files need mcap: pip install 'ltlplan[logs]'.") from None
    try:
        if kind == "zstd":
            return len(zstandard.ZstdDecompressor().stream_reader(packed).read(most + 1))
        if kind == "lz4":
            return len(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=most + 1))
    except (zstandard.ZstdError, RuntimeError, MemoryError):
        return -1
    raise BadInput(f"a chunk is compressed as {kind!r:.20}; lz4 and zstd are read.")
