"""PX4's logs (ULog): where one vehicle believed to be, in its own local frame and on its own clock."""

from __future__ import annotations

import contextlib
import io
import struct
from pathlib import Path
from typing import Any

import numpy as np

from flight.logs.clocks import Seen
from flight.logs.import_options import Axes
from verify.data import BadInput, MissingEngine
from verify.data.storage.safe_reading import read_bytes

MAX_BYTES = 2_000_000_000
ENU: Axes = ((1, 1.0), (0, 1.0), (2, -1.0))
"""PX4's north, east, down as the mission's east (x), north (y) and up (z): those of the exports."""

_TOPIC = "vehicle_local_position"
_HEADER = b"ULog\x01\x12\x35"
_MICROSECONDS = -6


def read_ulog(path: Path) -> tuple[Seen, tuple[str, ...]]:
    """Read a vehicle's log.

    Args:
        path: The file.

    Returns:
        Where the vehicle believed to be, x, y and z being the mission's (east, north, up), and how it was read, in sentences.

    Raises:
        BadInput: It is no such log, was cut, is damaged, or holds no local position.
        MissingEngine: pyulog is not installed.
    """
    data = read_bytes(path, most=MAX_BYTES, what="PX4 log")
    source = str(path)
    began, ended, lost = _lasted(data, source)
    log = _parsed(data, source)
    found = [each for each in log.data_list if each.name == _TOPIC]
    if len(found) != 1:
        logged = sorted({each.name for each in log.data_list})
        what = f"no {_TOPIC}" if not found else f"{len(found)} of {_TOPIC}, one is needed"
        raise BadInput(f"{source} holds {what}. Logged: {', '.join(logged)[:200] or 'nothing'}.")
    values: dict[str, Any] = found[0].data
    missing = [name for name in ("timestamp", "x", "y", "z", "xy_valid", "z_valid") if name not in values]
    if missing:
        raise BadInput(f"{source}: its {_TOPIC} has no {missing[0]}; that is no position that PX4 writes.")
    clock = "timestamp_sample" if "timestamp_sample" in values else "timestamp"
    places = np.stack([values[axis].astype(np.float64) for axis in "xyz"], axis=1)
    valid = (values["xy_valid"] != 0) & (values["z_valid"] != 0)
    places[~valid] = np.nan
    if np.isinf(places).any() or np.isnan(places[valid]).any():
        raise BadInput(f"{source}: a position that is said to be valid is no finite number.")
    notes = [
        f"positions are the vehicle's own estimate ({_TOPIC}), at the times of {clock}: --error has to cover how far it may be off."
    ]
    notes.append(
        "north, east and down are the mission's y, x and -z, and its local origin the mission's, where --origin says no other."
    )
    resets = sum(
        int(np.count_nonzero(np.diff(values[name]))) for name in ("xy_reset_counter", "z_reset_counter") if name in values
    )
    if resets:
        notes.append(f"its estimate was set anew {resets} times, and may jump there.")
    if lost:
        notes.append(f"{len(lost)} stretches were not logged, {sum(lost) / 1000:g} s in all.")
    off = float(np.sqrt(3.0)) * float(np.spacing(np.float32(np.nanmax(np.abs(places), initial=1.0))))
    turned = np.stack([sign * places[:, index] for index, sign in ENU], axis=1)
    counts = [int(time) for time in values[clock]]
    covers = min([began, *counts]), max([ended, *counts])
    return Seen(counts, _MICROSECONDS, turned, (1e-6, off), covers), tuple(notes)


def _parsed(data: bytes, source: str) -> Any:  # pyulog has no types
    """Return pyulog's reading of a log."""
    try:
        from pyulog import ULog
    except ImportError:
        raise MissingEngine("PX4's logs need pyulog: pip install 'ltlplan[logs]'.") from None
    said_aloud = io.StringIO()
    try:
        with contextlib.redirect_stdout(said_aloud):  # where pyulog says of what it passes over
            log = ULog(io.BytesIO(data), [_TOPIC])
    except Exception as error:  # pyulog lets whatever a damaged file leads to pass through
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise BadInput(f"{source} is no log of PX4 that can be read: {said[:160]}.") from None
    if log.file_corruption or said_aloud.getvalue():
        raise BadInput(f"{source} is damaged: parts of it are no messages, so what they held is not known.")
    return log


def _lasted(data: bytes, source: str) -> tuple[int, int, list[int]]:
    """Return when a log began and ended, us, with what it says was lost, and how long each loss took, ms.

    It ends with the last message of any topic, or with a loss after it; messages have their time first.

    Raises:
        BadInput: It is no ULog, or ends within a message.
    """
    if not data.startswith(_HEADER) or len(data) < 16:
        raise BadInput(f"{source} is no log of PX4: it does not begin as one.")
    began = struct.unpack_from("<Q", data, 8)[0]
    at, last, end, lost = 16, began, began, list[int]()
    stamped, topics = set[bytes](), set[int]()
    while at < len(data):
        if at + 3 > len(data) or at + 3 + (size := struct.unpack_from("<H", data, at)[0]) > len(data):
            raise BadInput(
                f"{source} was cut: it ends within the message at byte {at} of {len(data)}, and what was flown after it is not known. "
                "Copy it again from the vehicle."
            )
        kind, body, at = data[at + 2 : at + 3], at + 3, at + 3 + size
        if kind == b"D" and size >= 10:
            topic, time = struct.unpack_from("<HQ", data, body)
            if topic in topics:
                last = max(last, time)
        elif kind == b"O" and size == 2:
            lost.append(struct.unpack_from("<H", data, body)[0])
            end = max(last, end) + 1000 * lost[-1]
        elif kind == b"F":
            name, _, fields = data[body:at].partition(b":")
            if fields.startswith(b"uint64_t timestamp;"):
                stamped.add(name)
        elif kind == b"A" and size > 3 and data[body + 3 : at] in stamped:
            topics.add(struct.unpack_from("<H", data, body + 1)[0])
    return began, max(last, end), lost
