"""The Crazyflie's trajectory memory: 4096 bytes, trajectories side by side, each with an id and an offset.

An uncompressed piece (Poly4D) is 132 bytes: x0..x7, y0..y7, z0..z7, yaw0..yaw7 and the duration, little-endian float32.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flight.exports.crazyflies.fits import require_float32
from verify.data import DoesNotFit, Trajectory

MEMORY = 4096
"""Bytes of trajectory memory."""
PIECE = 132
"""Bytes of one Poly4D piece."""
IDS = 31
"""Trajectory ids are 0 to 30."""
ALIGNMENT = 4
"""Offsets are multiples of this many bytes."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One trajectory in the memory: what `define_trajectory` is told.

    Attributes:
        trajectory_id: 0 to 30.
        offset: Bytes from the memory's start.
        pieces: How many.
        kind: 0 for Poly4D, 1 for compressed, as cflib counts them.
        data: The exact bytes.
    """

    trajectory_id: int
    offset: int
    pieces: int
    kind: int
    data: bytes


def poly4d_bytes(name: str, path: Trajectory) -> bytes:
    """Return the exact bytes of an uncompressed trajectory.

    Raises:
        DoesNotFit: Its numbers are not float32.
    """
    require_float32(name, path)
    table = np.concatenate([path.coefficients.reshape(len(path), 32), path.durations[:, None]], axis=1)
    return table.astype("<f4").tobytes()


def side_by_side(
    parts: Mapping[int, tuple[str, bytes, int]], kind: int, begin: int = 0, size: int = MEMORY
) -> tuple[Entry, ...]:
    """Lay trajectories one behind the other, each at an offset that the firmware takes.

    Args:
        parts: Trajectory id to (name for messages, bytes, pieces), in the order in which they are laid.
        kind: 0 for Poly4D, 1 for compressed.
        begin: Offset of the first, so that what lies before it is not overwritten.
        size: Bytes of the memory.

    Raises:
        DoesNotFit: An id or offset is out of range, or the memory is too small.
    """
    if begin < 0 or begin % ALIGNMENT:
        raise DoesNotFit(f"offset {begin} is not a multiple of {ALIGNMENT} bytes, as the firmware asks.")
    entries: list[Entry] = []
    offset = begin
    for trajectory_id, (name, data, pieces) in parts.items():
        if not 0 <= trajectory_id < IDS:
            raise DoesNotFit(f"{name}: trajectory id {trajectory_id} is out of range; the vehicle knows 0 to {IDS - 1}.")
        if offset + len(data) > size:
            room = max(size - offset, 0)
            hint = f" ({room // PIECE} pieces)" if kind == 0 else ""
            raise DoesNotFit(
                f"{name} takes {len(data)} bytes ({pieces} pieces) at offset {offset}; the vehicle's trajectory memory of "
                f"{size} bytes has {room} left{hint}. Fly fewer laps, compress, or stream it."
            )
        if pieces > 255:
            raise DoesNotFit(f"{name} has {pieces} pieces; the vehicle counts them in one byte.")
        entries.append(Entry(trajectory_id, offset, pieces, kind, data))
        offset += -(-len(data) // ALIGNMENT) * ALIGNMENT
    return tuple(entries)
