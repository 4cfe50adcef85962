"""Flights side by side in a vehicle's trajectory memory, as the exports write them.

What does not fit beside the others is kept here, and written while its robot is held by a go-to: at the end of a trajectory the
firmware still reads the memory.
"""

from __future__ import annotations

from flight.exports.crazyflies.compressed import compressed_bytes
from flight.exports.crazyflies.memory import ALIGNMENT, IDS, MEMORY, PIECE, Entry, poly4d_bytes
from verify.data import DoesNotFit, Trajectory

_POLY4D, _COMPRESSED = 0, 1


class Memory:
    """One vehicle's memory."""

    def __init__(self, size: int = MEMORY) -> None:
        """Begin with an empty one.

        Args:
            size: Bytes.
        """
        self._size, self._used = size, 0
        self._kept: dict[int, tuple[bytes, int, int]] = {}
        self._there: set[int] = set()

    def take(self, number: int, name: str, path: Trajectory) -> Entry | None:
        """Take a flight; return what is to be written at once, None where it does not fit beside the others.

        Args:
            number: Its id on board.
            name: The robot's, for messages.
            path: Finite, as it is flown.

        Raises:
            DoesNotFit: It does not fit at all.
        """
        if not 0 <= number < IDS:
            raise DoesNotFit(f"{name}: flight {number} has no id on board; a Crazyflie knows 0 to {IDS - 1}.")
        kept = self._kept[number] = encoded(name, path, self._size)
        begin = -(-self._used // ALIGNMENT) * ALIGNMENT
        return self._laid(number, begin) if begin + len(kept[0]) <= self._size else None

    def missing(self, number: int) -> Entry | None:
        """Return what has to be written before a flight can begin, over all others; None where it is on board.

        Args:
            number: Its id.
        """
        if number in self._there:
            return None
        self._there.clear()
        return self._laid(number, 0)

    def _laid(self, number: int, offset: int) -> Entry:
        data, pieces, kind = self._kept[number]
        self._used = offset + len(data)
        self._there.add(number)
        return Entry(number, offset, pieces, kind, data)


def encoded(name: str, path: Trajectory, size: int) -> tuple[bytes, int, int]:
    """Return bytes, number of pieces and kind: uncompressed, or compressed where only that fits and loses nothing.

    Args:
        name: The robot's, for messages.
        path: Finite, as it is flown.
        size: Bytes of its memory.

    Raises:
        DoesNotFit: Neither does.
    """
    if PIECE * len(path) <= size:
        return poly4d_bytes(name, path), len(path), _POLY4D
    try:
        data, pieces = compressed_bytes(name, path)
    except DoesNotFit:
        data, pieces = b"", 0
    if not data or len(data) > size or pieces > 255:
        raise DoesNotFit(
            f"{name}'s flight has {len(path)} pieces, and its trajectory memory of {size} bytes holds {size // PIECE}. Rounded to millimetres it may fit: "
            "`ltlplan export RUN --format crazyflie-compressed --out FOLDER` certifies it so, or says that it does not fit, and FOLDER is flown in "
            f"RUN's place. Else plan it in parts (`limits: {{pieces: {size // PIECE}}}`) or with fewer pieces."
        )
    return data, pieces, _COMPRESSED
