"""Recordings of real flights: motion-capture tables, accepted by the names of their columns.

Two shapes are read: one row a sample and robot, with a column that names the robot; or one row a sample, with columns such as
`quad0.x`, `quad0_y`, `quad0/z` or `quad0 pos_x` for each robot. Times are brought to zero at the start of the flight.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flight.attitude import Floats
from flight.tables import MAX_BYTES, require_forward
from verify.data import BadInput
from verify.data.errors import did_you_mean

TIME_NAMES = {
    "t": 1.0, "time": 1.0, "timestamp": 1.0, "seconds": 1.0, "time_s": 1.0, "t_s": 1.0, "time (s)": 1.0,
    "time (seconds)": 1.0, "stamp": 1.0, "time_ms": 1e-3, "t_ms": 1e-3, "timestamp_ms": 1e-3, "time (ms)": 1e-3,
    "time_us": 1e-6, "timestamp_us": 1e-6, "time_ns": 1e-9, "timestamp_ns": 1e-9, "stamp_ns": 1e-9,
}  # fmt: skip
"""Columns that hold the time, lower case, and their unit in s."""

ROBOT_NAMES = ("robot", "name", "id", "body", "rigid_body", "rigidbody", "agent", "drone", "object")
"""Columns that name the robot, lower case."""

_AXIS = r"(?:pos(?:ition)?[ ._/]?|p|t|trans(?:lation)?[ ._/]?)?(?P<axis>[xyz])(?P<unit>_m|_mm| \(m\)| \(mm\)| \[m\]| \[mm\])?"
_LONG = re.compile(_AXIS, re.IGNORECASE)
_WIDE = re.compile(r"(?P<robot>.+?)[ ._/:]" + _AXIS, re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Recording:
    """Positions of a team as something else measured them.

    Attributes:
        robots: Names, in the order that was asked for.
        times: s, the first at 0 or as recorded. Shape (samples,).
        position: m, NaN where a robot was not seen. Shape (samples, robots, 3).
    """

    robots: tuple[str, ...]
    times: Floats
    position: Floats

    def __post_init__(self) -> None:
        for name in ("times", "position"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, name, values)


def read_recording(
    path: str | os.PathLike[str],
    robots: Sequence[str],
    *,
    start: float | None = None,
    columns: Mapping[str, str] | None = None,
) -> Recording:
    """Read a motion-capture recording from a CSV table.

    Args:
        path: The file.
        robots: Whom to look for.
        start: The table's time, in s, at which the flight began; the first row's by default.
        columns: What the recording calls things where the names are not understood: `{"t": "Frame time", "robot":
            "Body", "x": "X"}` for tables with a robot column, `{"t": ..., "quad0.x": ...}` for wide ones.

    Raises:
        BadInput: Columns are missing or not understood, a robot is missing, or times do not go forward.
    """
    header, rows = _table(Path(path))
    renamed = _renamed(header, columns or {}, str(path))
    clock, unit = _time_column(renamed, str(path))
    own = next((i for i, name in enumerate(renamed) if name.strip().lower() in ROBOT_NAMES), None)
    if own is not None and len(_axes(renamed, _LONG, None)) == 3:
        times, position = _from_long(rows, clock, own, _axes(renamed, _LONG, None), tuple(robots), str(path))
    else:
        places = {robot: _axes(renamed, _WIDE, robot) for robot in robots}
        if len(robots) == 1 and len(_axes(renamed, _LONG, None)) == 3:
            places = {robots[0]: _axes(renamed, _LONG, None)}
        for robot, found in places.items():
            if len(found) != 3:
                raise BadInput(
                    f"{path} has no columns for the position of '{robot}'; name them {robot}.x, {robot}.y, {robot}.z, or say "
                    f"what they are called (`columns`). Columns: {', '.join(header[:12])}{', ...' if len(header) > 12 else ''}."
                )
        times = np.array([_number(row[clock], i, str(path), header[clock]) for i, row in enumerate(rows)])
        position = np.array(
            [
                [
                    [scale * _number(row[i], n, str(path), header[i], blank=True) for i, scale in places[r].values()]
                    for r in robots
                ]
                for n, row in enumerate(rows)
            ]
        )
    times = times * unit
    require_forward(times, str(path))
    zero = float(times[0]) if start is None else start
    kept = times >= zero - 1e-9
    if not np.any(kept):
        raise BadInput(f"{path} ends at {times[-1]:g} s, before the flight's start at {zero:g} s.")
    return Recording(tuple(robots), np.maximum(times[kept] - zero, 0.0), position[kept])


def _table(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise BadInput(f"{path} is larger than {MAX_BYTES // 1_000_000} MB; cut the recording.")
        text = path.read_text(encoding="utf-8-sig")
        rows = [row for row in csv.reader(io.StringIO(text)) if row and not row[0].startswith("#")]
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror or error}.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{path} is no CSV table: {error}.") from None
    if len(rows) < 3:
        raise BadInput(f"{path} holds fewer than two samples.")
    header = [name.strip() for name in rows[0]]
    short = next((i for i, row in enumerate(rows) if len(row) != len(header)), None)
    if short is not None:
        raise BadInput(f"{path}:{short + 1}: {len(rows[short])} cells under {len(header)} columns.")
    return header, rows[1:]


def _renamed(header: list[str], columns: Mapping[str, str], source: str) -> list[str]:
    for ours, theirs in columns.items():
        if theirs not in header:
            raise BadInput(f"{source} has no column '{theirs}' (given for {ours}).{did_you_mean(theirs, header)}")
    ours_of = {theirs: ours for ours, theirs in columns.items()}
    return [ours_of.get(name, name) for name in header]


def _time_column(names: list[str], source: str) -> tuple[int, float]:
    for i, name in enumerate(names):
        if name.strip().lower() in TIME_NAMES:
            return i, TIME_NAMES[name.strip().lower()]
    raise BadInput(f"{source} has no column for the time; name it t (in s), or say what it is called (`columns`).")


def _axes(names: list[str], pattern: re.Pattern[str], robot: str | None) -> dict[str, tuple[int, float]]:
    """Return for x, y, z the column and its unit in m, as far as they are there."""
    found: dict[str, tuple[int, float]] = {}
    for i, name in enumerate(names):
        match = pattern.fullmatch(name.strip())
        if match is None or (robot is not None and match["robot"].strip().lower() != robot.lower()):
            continue
        found.setdefault(match["axis"].lower(), (i, 1e-3 if "mm" in (match["unit"] or "") else 1.0))
    return {axis: found[axis] for axis in "xyz" if axis in found}


def _from_long(
    rows: list[list[str]], clock: int, own: int, axes: Mapping[str, tuple[int, float]], robots: tuple[str, ...], source: str
) -> tuple[Floats, Floats]:
    order = {robot: j for j, robot in enumerate(robots)}
    index: dict[float, int] = {}
    entries: list[tuple[int, int, list[float]]] = []
    last = -math.inf
    for n, row in enumerate(rows):
        time = _number(row[clock], n, source, "time")
        if time < last:
            raise BadInput(f"{source}:{n + 2}: times must go forward, but {time:g} follows {last:g}.")
        last = time
        place = index.setdefault(time, len(index))
        if row[own].strip() in order:
            values = [scale * _number(row[i], n, source, axis, blank=True) for axis, (i, scale) in axes.items()]
            entries.append((place, order[row[own].strip()], values))
    missing = sorted(set(robots) - {robots[j] for _, j, _ in entries})
    if missing:
        raise BadInput(f"{source} has no rows for '{missing[0]}'.")
    position = np.full((len(index), len(robots), 3), np.nan)
    for place, robot, values in entries:
        position[place, robot] = values
    return np.array(list(index)), position


def _number(cell: str, row: int, source: str, name: str, *, blank: bool = False) -> float:
    text = cell.strip()
    if blank and text.lower() in ("", "nan"):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise BadInput(f"{source}:{row + 2}: {name} is {cell!r}; it must be a finite number.")
    return value
