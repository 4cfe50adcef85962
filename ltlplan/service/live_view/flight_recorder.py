"""Recordings of flights as they were seen: what a flight sent, a line each, for it to be replayed.

Lines are written once a second, by a thread, each time as one compressed block that is appended: a kill costs the last second. Where the disk is full
or a recording has its most, nothing more of it is kept, and the flight is seen all the same.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import shutil
import zlib
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import Any

from ltlplan.service.job_queue.results import RESERVE
from ltlplan.service.problems import NotFound
from verify.data.progress import Progress

FOLDER = "flights"
"""Its name in the data folder."""
MOST = 50_000_000
"""Bytes of one recording, compressed."""
EVERY = 1.0
"""s between two blocks."""
FRAMES = 6000
"""Frames that are replayed at most; of longer flights every second, third, ... one is."""
_MOST_READ = 500_000_000


class FlightRecorder:
    """Writes recordings."""

    def __init__(self, data: Path) -> None:
        """Write nothing yet.

        Args:
            data: The service's data folder.
        """
        self._folder, self._free = data / FOLDER, data
        self._waiting: dict[int, list[str]] = {}
        self._writing: asyncio.Task[None] | None = None

    def path(self, run: int) -> Path:
        """Return where a flight's recording is.

        Args:
            run: Its number among all flights.
        """
        return self._folder / f"{run}.jsonl.gz"

    def add(self, run: int, line: str) -> None:
        """Keep a line, soon.

        Args:
            run: The flight's number among all flights.
            line: JSON.
        """
        self._waiting.setdefault(run, []).append(line)
        if self._writing is None or self._writing.done():
            self._writing = asyncio.get_running_loop().create_task(self._write())

    def forget(self, kept: Collection[int]) -> None:
        """Delete recordings of flights that are not known any more.

        Args:
            kept: Numbers of those that are.
        """
        for path in self._folder.glob("*.jsonl.gz"):
            number = path.name.partition(".")[0]
            if number.isdigit() and int(number) not in kept:
                path.unlink(missing_ok=True)

    def forget_old(self, before: float, flying: Collection[int]) -> int:
        """Delete recordings that were written last before an instant, and return how many they were.

        Args:
            before: s since 1970.
            flying: Numbers of flights that have not ended.
        """
        gone = 0
        for path in self._folder.glob("*.jsonl.gz"):
            number = path.name.partition(".")[0]
            if number.isdigit() and int(number) not in flying and path.stat().st_mtime < before:
                path.unlink(missing_ok=True)
                gone += 1
        return gone

    def recorded(self, run: int) -> bool:
        """Return whether there is a recording of a flight."""
        return self.path(run).is_file()

    async def _write(self) -> None:
        while self._waiting:
            await asyncio.sleep(EVERY)
            waiting, self._waiting = self._waiting, {}
            await asyncio.to_thread(self._append, waiting)

    def _append(self, waiting: dict[int, list[str]]) -> None:
        with suppress(OSError):  # a disk that is full, or gone: the flight is seen all the same
            self._folder.mkdir(mode=0o700, exist_ok=True)
            for run, lines in waiting.items():
                path = self.path(run)
                size = path.stat().st_size if path.exists() else 0
                if size < MOST and shutil.disk_usage(self._free).free >= RESERVE:
                    with path.open("ab") as file:
                        file.write(gzip.compress("".join(f"{line}\n" for line in lines).encode(), 6))


def replay(path: str, report: Progress) -> bytes:
    """Return a recording as one document: `pictures`, each with when it was drawn, and `frames`; compressed by gzip.

    Args:
        path: Of the recording.
        report: Receives what is done.

    Raises:
        NotFound: There is none.
    """
    report("reading the recording", 0.0)
    pictures: list[Any] = []  # of any type: JSON nests
    frames: list[Any] = []
    for line in _lines(Path(path)):
        entry = json.loads(line)
        if "picture" in entry:
            pictures.append(entry["picture"])
        else:
            frames.append(entry["frame"])
    if not frames:
        raise NotFound("Nothing was recorded of this flight.")
    step = 1 + (len(frames) - 1) // FRAMES
    for start in range(0, len(frames), step):  # what was said between two frames is said with the later one
        group = frames[start : start + step]
        group[-1]["said"] = [said for frame in group for said in frame.get("said", ())]
    thinned = frames[step - 1 :: step]
    if thinned[-1:] != frames[-1:]:
        thinned.append(frames[-1])
    text = json.dumps({"kind": "replay", "pictures": pictures, "frames": thinned}, separators=(",", ":"), allow_nan=False)
    return gzip.compress(text.encode(), 6)


def _lines(path: Path) -> list[str]:
    """Return the lines of a recording that are whole; a block that a kill has cut off is left out."""
    try:
        packed = path.read_bytes()
    except FileNotFoundError:
        raise NotFound("Nothing was recorded of this flight.") from None
    found, size = list[str](), 0
    while packed and size < _MOST_READ:
        block = zlib.decompressobj(zlib.MAX_WBITS | 16)
        try:
            text = block.decompress(packed, _MOST_READ - size)
        except zlib.error:
            break
        if not block.eof:
            break
        size += len(text)
        found += text.decode("utf-8", "replace").splitlines()
        packed = block.unused_data
    return found
