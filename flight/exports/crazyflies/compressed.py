"""The Crazyflie's compressed trajectories: millimetres, tenths of a degree and milliseconds as integers, Bezier control points.

A start of 8 bytes (int16 mm, tenths of a degree), then for each piece one byte of types, uint16 ms, and the control points
without the first one, which is where the piece before ended. A piece of no duration ends it. Plain rounding breaks velocity and
higher derivatives where pieces meet; `quantised` therefore fits pieces of one common length, whose control points can be
integers and yet join up to the third derivative. That is another path than the one that was refined, by millimetres, so it
is the quantised path that must be certified; the export refuses anything that rounding would still change.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight.exports.crazyflies.crazyflie import OPTIONS, VOIDS, upload, upload_files
from flight.exports.crazyflies.memory import MEMORY
from flight.exports.crazyflies.parameters import NUMBERS, cannot_fly
from flight.exports.target import ExportTarget, Product, Request
from verify.data import BadInput, DoesNotFit, Trajectory

_MOST = 32767
"""Most that an int16 holds."""
_UNITS = np.array([1000.0, 1000.0, 1000.0, 1800.0 / math.pi])
"""What is stored of a metre and of a radian: millimetres and tenths of a degree."""
MILLISECONDS = 65535
"""Most that an uint16 holds."""
_HEADINGS = (
    "Headings are stored in tenths of a degree, as the firmware of August 2026 reads them; firmware that takes them for radians "
    "(look for STORED_ANGLE_SCALE 0.1 in its sources) must not fly these files."
)
_HEADING = 1e-4
"""rad by which a certified flight may begin beside its robot's heading."""
POINTS = (0, 1, 3, 7)
"""Control points that are stored of an axis of a piece, by its type: constant, linear, cubic, degree 7."""
_KIND = 1

_STEPS = (0.35, 0.45, 0.6, 0.8)
"""s; lengths of pieces that are tried until a flight of many fits whole. Longer ones follow the path less well."""

Integers = NDArray[np.int64]


class _OffGrid(DoesNotFit):
    """A flight that rounding to what is stored would change."""


def quantised(team: Mapping[str, Trajectory], *, step: float = 0.35) -> dict[str, Trajectory]:
    """Return paths near a team's that compressed trajectories hold exactly: the ones to certify and export.

    They keep the team's times at their joints, but for the stretch (well below a piece) that a common length of
    pieces in whole milliseconds needs, and are continuous up to the third derivative.

    Args:
        team: Trajectories.
        step: Length of a piece to aim at, s. Shorter ones follow the path better, but round its speed more.

    Raises:
        BadInput: step is not between 0.05 and 5 s.
        DoesNotFit: A position is beyond 32.767 m, a heading beyond 3276.7 degrees, or a lap turns around.
    """
    if not 0.05 <= step <= 5.0:
        raise BadInput(f"step must be 0.05 to 5 s, not {step}.")
    return {name: _fitted(name, path, step) for name, path in team.items()}


def _fitted(name: str, path: Trajectory, step: float) -> Trajectory:
    """Fit pieces of one length to a path, by its position and three derivatives at their joints."""
    split = 0.0 if path.cycle is None else float(path.knots[path.cycle])
    spans = [(begin, end) for begin, end in ((0.0, split), (split, path.duration)) if end > begin]
    length, counts = _common_length([end - begin for begin, end in spans], step)
    derivatives: list[NDArray[np.float64]] = []
    for (begin, end), count in zip(spans, counts, strict=True):
        times = begin + (end - begin) * np.arange(count) / count
        slower = (end - begin) / (count * length / 1000.0)
        derivatives.append(np.stack([path.evaluate(times, order) * slower**order for order in range(4)]))
    last = np.stack([path.evaluate(path.duration, order) for order in range(4)])[:, None]
    if path.cycle is not None:  # the lap ends as it begins
        if abs(last[0, 0, 3] - derivatives[-1][0, 0, 3]) > math.pi:
            raise DoesNotFit(
                f"{name} turns around once a lap, and headings of compressed flights cannot begin anew with each lap."
            )
        last = derivatives[-1][:, :1]
    at_joints = np.concatenate([*derivatives, last], axis=1)
    points = _points_of(at_joints, length)
    _require_near(name, points)
    cycle = None if path.cycle is None else sum(counts[:-1])
    return decoded(np.full(len(points), length, dtype=np.int64), points.astype(np.int64), cycle)


def _points_of(at_joints: NDArray[np.float64], length: int, begin: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Return whole control points from position and three derivatives at joints. Shape (pieces, 4, 8).

    Args:
        at_joints: Shape (4 orders, joints, 4 axes).
        length: Of each piece, ms.
        begin: What the first joint has in stored units already, shape (4 orders, 4 axes).
    """
    d = length / 1000.0
    # In stored units: position, and the first three differences of control points that the derivatives mean.
    stored = np.rint(_UNITS * at_joints * np.array([1, d / 7, d**2 / 42, d**3 / 210])[:, None, None])
    if begin is not None:
        stored[:, 0] = begin
    place, first, second, third = stored
    p, q = (place[:-1], first[:-1], second[:-1], third[:-1]), (place[1:], first[1:], second[1:], third[1:])
    return np.stack(
        [
            p[0], p[0] + p[1], p[0] + 2 * p[1] + p[2], p[0] + 3 * p[1] + 3 * p[2] + p[3],
            q[0] - 3 * q[1] + 3 * q[2] - q[3], q[0] - 2 * q[1] + q[2], q[0] - q[1], q[0],
        ],
        axis=-1,
    )  # fmt: skip


def _joined(name: str, flown: Trajectory, last: Trajectory) -> Trajectory | None:
    """Put the piece in which a robot brakes behind its flight, on the format's grid; None where the memory has no room for it."""
    durations, points = _encoded(name, flown)
    length = int(durations[-1])
    count = math.ceil(1000.0 * last.duration / length)
    times, slower = last.duration * np.arange(count + 1) / count, 1000.0 * last.duration / (count * length)
    at_joints = np.stack([last.evaluate(times, order) * slower**order for order in range(4)])
    at_joints[1:, -1] = 0.0
    q = points[-1].T.astype(np.float64)
    first = q[7] - q[6]
    second = q[5] - q[7] + 2 * first
    begin = np.stack([q[7], first, second, q[7] - 3 * first + 3 * second - q[4]])
    more = _points_of(at_joints, length, begin)
    _require_near(name, more)
    joined = decoded(
        np.concatenate([durations, np.full(count, length, dtype=np.int64)]),
        np.concatenate([points, more.astype(np.int64)]),
        None,
    )
    return joined if len(compressed_bytes(name, joined)[0]) <= MEMORY else None


def _common_length(spans: list[float], step: float) -> tuple[int, list[int]]:
    """Return a length in ms and a number of pieces for each span, so that they fill the spans with little stretch."""
    best: tuple[float, int, list[int]] | None = None
    shortest = min(spans)
    for count in range(1, max(2, int(2 * shortest / step)) + 1):
        length = math.ceil(round(1000.0 * shortest / count, 6))
        counts = [math.ceil(round(1000.0 * span / length, 6)) for span in spans]
        stretch = max(count * length / (1000.0 * span) for count, span in zip(counts, spans, strict=True))
        price = stretch - 1.0 + 0.02 * abs(math.log(length / (1000.0 * step)))
        if length <= MILLISECONDS and (best is None or price < best[0]):
            best = (price, length, counts)
    if best is None:
        raise DoesNotFit(
            f"a span of {shortest:g} s cannot be cut into pieces of at most {MILLISECONDS / 1000:g} s near {step:g} s."
        )
    return best[1], best[2]


def _require_near(name: str, points: NDArray[Any]) -> None:
    """Reject control points, of shape (pieces, 4, 8), that 16 bits do not hold."""
    place, heading = float(np.max(np.abs(points[:, :3]))), float(np.max(np.abs(points[:, 3])))
    if place > _MOST:
        raise DoesNotFit(f"{name} has a control point {place / 1000:g} m from the origin; compressed flights reach 32.767 m.")
    if heading > _MOST:
        raise DoesNotFit(
            f"{name} has a heading of {heading / 10:g} degrees; compressed flights turn to 3276.7 degrees at most."
        )


def compressed_bytes(name: str, path: Trajectory) -> tuple[bytes, int]:
    """Return the exact bytes of a finite flight and its number of pieces.

    Raises:
        DoesNotFit: A position, duration or heading is out of range, or rounding would change the path.
    """
    durations, points = _encoded(name, path)
    if decoded(durations, points, None) != Trajectory(path.durations, path.coefficients):
        raise _OffGrid(
            f"{name}'s trajectory does not survive rounding to millimetres, tenths of a degree and milliseconds; "
            "certify `flight.quantised(team)` and export that."
        )
    data = bytearray(struct.pack("<hhhh", *points[0, :, 0].tolist()))
    for duration, piece in zip(durations.tolist(), points, strict=True):
        kinds, stored = 0, bytearray()
        for axis in range(4):
            kind = 0 if np.all(piece[axis] == piece[axis, 0]) else 3
            kinds |= kind << (2 * axis)
            stored += struct.pack(f"<{POINTS[kind]}h", *piece[axis, 8 - POINTS[kind] :].tolist())
        data += struct.pack("<BH", kinds, duration) + stored
    data += struct.pack("<BH", 0, 0)
    return bytes(data), len(durations)


def _encoded(name: str, path: Trajectory) -> tuple[Integers, Integers]:
    """Round to ms and to control points in stored units. Shapes (pieces,) and (pieces, 4, 8).

    Raises:
        DoesNotFit: A position, heading or duration is out of range.
    """
    durations = np.rint(1000.0 * path.durations).astype(np.int64)
    for index, duration in enumerate(path.durations.tolist()):
        if not 1 <= round(1000.0 * duration) <= MILLISECONDS:
            raise DoesNotFit(f"{name}, piece {index}: {duration:g} s; a compressed piece lasts 0.001 to 65.535 s.")
    scaled = path.coefficients * path.durations[:, None, None] ** np.arange(8)
    to_points = np.array([[comb(i, k) / comb(7, k) if k <= i else 0.0 for k in range(8)] for i in range(8)])
    rounded = np.rint(_UNITS[:, None] * np.einsum("ik,pak->pai", to_points, scaled))
    _require_near(name, rounded)
    points = rounded.astype(np.int64)
    points[1:, :, 0] = points[:-1, :, 7]
    return durations, points


def decoded(durations: Integers, points: Integers, cycle: int | None) -> Trajectory:
    """Return the polynomials of control points in stored units, rounded to float32 once.

    Args:
        durations: ms. Shape (pieces,).
        points: Control points. Shape (pieces, 4, 8).
        cycle: First piece of the cycle; None for a finite flight.
    """
    to_powers = np.array(
        [[comb(7, k) * comb(k, j) * (-1) ** (k - j) if j <= k else 0 for j in range(8)] for k in range(8)], dtype=np.int64
    )
    exact = np.einsum("kj,paj->pak", to_powers, points)  # integers below 2^53
    seconds = durations[:, None, None] / 1000.0
    coefficients = exact / _UNITS[:, None] / seconds ** np.arange(8)
    return Trajectory(_float32(durations / 1000.0), _float32(coefficients), cycle=cycle)


def _float32(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values.astype(np.float32).astype(np.float64)


def _product(request: Request) -> Product:
    _without_team_laps(request.team)
    try:
        product = upload_files(request, compressed_bytes, _KIND)
    except _OffGrid:
        if request.mission.frame is None:
            raise
        raise DoesNotFit(
            f"compressed flights lie on a grid of millimetres, off which the mission's `frame` leads ({request.mission.frame.sentence}). Use the format "
            "`crazyswarm2` or `crazyflie`, or write the mission in the laboratory's frame."
        ) from None
    if not any(path.coefficients[:, 3].any() for path in request.team.values()):
        return product
    return Product(product.files, (*product.notes, _HEADINGS))


def _without_team_laps(team: Mapping[str, Trajectory]) -> Mapping[str, Trajectory]:
    """Reject laps of several robots: they begin together to the last bit, and sums of whole milliseconds are no sums of float32."""
    if len(team) > 1 and any(path.cycle is not None for path in team.values()):
        raise DoesNotFit(
            "The laps of a team begin together to the last bit, which the compressed format's milliseconds do not keep. Use the format "
            "`crazyflie`, or stream them (`px4`, `ros2`)."
        )
    return team


def _packed(team: Mapping[str, Trajectory], laps: int) -> Mapping[str, Trajectory]:
    """Return paths that fit a vehicle's memory whole, cuts undone, in the shortest pieces that do.

    Raises:
        DoesNotFit: None of the lengths does, headings and places are out of range, or a flight begins between two headings that are stored.
    """
    whole = {name: Trajectory(path.durations, path.coefficients, cycle=path.cycle) for name, path in team.items()}
    for name, path in whole.items():
        _require_heading(name, float(path.coefficients[0, 3, 0]))
    sizes: dict[str, int] = {}
    for step in _STEPS:
        fitted = quantised(_without_team_laps(whole), step=step)
        sizes = {name: len(compressed_bytes(name, path.flattened(laps))[0]) for name, path in fitted.items()}
        if max(sizes.values()) <= MEMORY:
            return fitted
    longest = max(sizes, key=lambda name: sizes[name])
    raise DoesNotFit(
        f"{longest} takes {sizes[longest]} bytes in pieces of {_STEPS[-1]:g} s, and the vehicle's trajectory memory has {MEMORY}. Fly it in "
        "parts (`crazyswarm2`, `crazyflie`), or stream it (`px4`, `ros2`)."
    )


def _require_heading(name: str, heading: float) -> None:
    """Reject a flight, beginning at a heading in rad, where rounding turns it: no certificate is of that."""
    tenths = heading * _UNITS[3]
    if abs(round(tenths) - tenths) > _HEADING * _UNITS[3]:
        raise DoesNotFit(
            f"{name} starts with a heading of {tenths / 10:.4g} degrees, and compressed flights hold tenths: write {round(tenths) / 10:g} in its "
            "`yaw_deg`, or use the format `crazyflie`."
        )


COMPRESSED = ExportTarget(
    name="crazyflie-compressed",
    make=_product,
    options=OPTIONS,
    voids=VOIDS,
    prepare=_packed,
    join=_joined,
    send=upload,
    controllers=tuple(NUMBERS),
    cannot_fly=cannot_fly,
)
