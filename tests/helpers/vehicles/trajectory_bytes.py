"""Readers of a Crazyflie's trajectory memory, as the firmware reads it: what exports and links write is held against them."""

from __future__ import annotations

import struct

import numpy as np

from flight.exports.crazyflies.compressed import POINTS, decoded
from flight.exports.crazyflies.memory import PIECE
from verify.data import BadInput, Trajectory


def compressed_trajectory(data: bytes) -> Trajectory:
    """Read compressed bytes as the firmware does.

    Raises:
        BadInput: They end in the middle of a piece, or hold no piece.
    """
    try:
        last = np.array(struct.unpack_from("<hhhh", data, 0), dtype=np.int64)
        place, durations, pieces = 8, [], []
        while True:
            kinds, duration = struct.unpack_from("<BH", data, place)
            place += 3
            if duration == 0:
                break
            piece = np.empty((4, 8), dtype=np.int64)
            for axis in range(4):
                count = POINTS[kinds >> (2 * axis) & 3]
                own = [int(last[axis]), *struct.unpack_from(f"<{count}h", data, place)]
                place += 2 * count
                piece[axis] = own * 8 if count == 0 else _raised(own)
            durations.append(duration)
            pieces.append(piece)
            last = piece[:, 7]
    except struct.error:
        raise BadInput(f"{len(data)} bytes end in the middle of a compressed trajectory.") from None
    if not pieces:
        raise BadInput("a compressed trajectory needs at least one piece.")
    return decoded(np.array(durations, dtype=np.int64), np.array(pieces), None)


def _raised(points: list[int]) -> list[int]:
    """Return eight control points of the same curve where that is exact in integers."""
    if len(points) != 8:
        raise BadInput("linear and cubic pieces are not written here and cannot be read exactly.")
    return points


def poly4d_trajectory(data: bytes) -> Trajectory:
    """Read the bytes of an uncompressed trajectory again.

    Raises:
        BadInput: They are no whole number of pieces, or hold nonsense.
    """
    if not data or len(data) % PIECE:
        raise BadInput(f"{len(data)} bytes are no Poly4D trajectory; a piece has {PIECE}.")
    table = np.frombuffer(data, dtype="<f4").astype(np.float64).reshape(-1, 33)
    return Trajectory(table[:, 32], table[:, :32].reshape(-1, 4, 8))
