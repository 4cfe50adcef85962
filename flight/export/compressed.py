"""The Crazyflie's compressed trajectories: millimetres and milliseconds as integers, Bezier control points.

A start of 8 bytes (int16 mm, tenths of a degree), then for each piece one byte of types, uint16 ms, and the control points
without the first one, which is where the piece before ended. A piece of no duration ends it. Rounding moves the
path by up to a millimetre and breaks velocity and higher derivatives at the joints, so it is the *rounded* path
that must be certified: `quantised(team)` gives it, and the export refuses anything that rounding would still change.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from math import comb

import numpy as np
from numpy.typing import NDArray

from flight.export.files import Product, Request
from verify.data import BadInput, DoesNotFit, Trajectory

MILLIMETRES = 32767
"""Most that an int16 holds."""
MILLISECONDS = 65535
"""Most that an uint16 holds."""
_POINTS = (0, 1, 3, 7)
_KIND = 1

Integers = NDArray[np.int64]


def quantised(team: Mapping[str, Trajectory]) -> dict[str, Trajectory]:
    """Return the paths that the vehicle flies when a team is compressed: the ones to certify and export.

    Raises:
        DoesNotFit: A position is beyond 32.767 m, a piece longer than 65.535 s or shorter than 1 ms, or a heading is
            not 0.
    """
    return {name: _decoded(*_encoded(name, path), path.cycle) for name, path in team.items()}


def compressed_bytes(name: str, path: Trajectory) -> tuple[bytes, int]:
    """Return the exact bytes of a finite flight and its number of pieces.

    Raises:
        DoesNotFit: As for `quantised`, or rounding would change the path.
    """
    durations, points = _encoded(name, path)
    if _decoded(durations, points, None) != Trajectory(path.durations, path.coefficients):
        raise DoesNotFit(
            f"{name}'s trajectory does not survive rounding to millimetres and milliseconds; "
            "certify `flight.quantised(team)` and export that."
        )
    data = bytearray(struct.pack("<hhhh", *points[0, :, 0].tolist()))
    for duration, piece in zip(durations.tolist(), points, strict=True):
        kinds, stored = 0, bytearray()
        for axis in range(4):
            kind = 0 if np.all(piece[axis] == piece[axis, 0]) else 3
            kinds |= kind << (2 * axis)
            stored += struct.pack(f"<{_POINTS[kind]}h", *piece[axis, 8 - _POINTS[kind] :].tolist())
        data += struct.pack("<BH", kinds, duration) + stored
    data += struct.pack("<BH", 0, 0)
    return bytes(data), len(durations)


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
                count = _POINTS[kinds >> (2 * axis) & 3]
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
    return _decoded(np.array(durations, dtype=np.int64), np.array(pieces), None)


def product(request: Request) -> Product:
    """Return the files of a compressed Crazyflie upload."""
    from flight.export.crazyflie import upload_files

    return upload_files(request, compressed_bytes, _KIND)


def _raised(points: list[int]) -> list[int]:
    """Return eight control points of the same curve where that is exact in integers."""
    if len(points) != 8:
        raise BadInput("linear and cubic pieces are not written here and cannot be read exactly.")
    return points


def _encoded(name: str, path: Trajectory) -> tuple[Integers, Integers]:
    """Round to ms and to control points in mm. Shapes (pieces,) and (pieces, 4, 8).

    Knots are rounded rather than durations, so that errors in time do not add up.
    """
    heading = path.coefficients[:, 3]
    if np.any(np.abs(heading) > 0.0):
        raise DoesNotFit(
            f"{name} has a heading other than 0; the firmware divides tenths of a degree by 0.1 and takes the result for "
            "radians, so compressed flights keep heading 0."
        )
    knots = np.rint(1000.0 * path.knots).astype(np.int64)
    durations = np.diff(knots)
    for index, duration in enumerate(durations.tolist()):
        if not 1 <= duration <= MILLISECONDS:
            raise DoesNotFit(f"{name}, piece {index}: {duration / 1000:g} s; a compressed piece lasts 0.001 to 65.535 s.")
    scaled = path.coefficients * path.durations[:, None, None] ** np.arange(8)
    to_points = np.array([[comb(i, k) / comb(7, k) if k <= i else 0.0 for k in range(8)] for i in range(8)])
    points = np.rint(1000.0 * np.einsum("ik,pak->pai", to_points, scaled)).astype(np.int64)
    points[1:, :, 0] = points[:-1, :, 7]
    worst = int(np.max(np.abs(points)))
    if worst > MILLIMETRES:
        raise DoesNotFit(f"{name} has a control point {worst / 1000:g} m from the origin; compressed flights reach 32.767 m.")
    return durations, points


def _decoded(durations: Integers, points: Integers, cycle: int | None) -> Trajectory:
    """Return the polynomials of control points in mm over durations in ms, rounded to float32 once."""
    to_powers = np.array(
        [[comb(7, k) * comb(k, j) * (-1) ** (k - j) if j <= k else 0 for j in range(8)] for k in range(8)], dtype=np.int64
    )
    exact = np.einsum("kj,paj->pak", to_powers, points)  # integers below 2^53
    seconds = durations[:, None, None] / 1000.0
    coefficients = exact / 1000.0 / seconds ** np.arange(8)
    return Trajectory(_float32(durations / 1000.0), _float32(coefficients), cycle=cycle)


def _float32(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values.astype(np.float32).astype(np.float64)
