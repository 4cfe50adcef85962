"""Recordings of real flights as tables, accepted by the names of their columns.

Two shapes are read: one row a sample and robot, with a column that names the robot; or one row a sample, with columns such as
`quad0.x`, `quad0_y`, `quad0/z` or `quad0 pos_x` for each robot. Every column has one meaning: where two could hold the same thing,
or a robot's name is spelt otherwise, nothing is chosen. Times are brought to zero at the start of the flight, exactly.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np

from flight.logs.import_options import exact_time
from flight.logs.tables import require_forward
from flight.model.attitude import Floats
from verify.data import BadInput
from verify.data.errors import did_you_mean
from verify.data.storage.tables import Decimal, Table, coarse_place, counted, half_place, rounding, since
from verify.recordings.flight_log import DIGITS, LOG_COLUMNS

TIME_NAMES = {
    "t": 0, "time": 0, "timestamp": 0, "seconds": 0, "time_s": 0, "t_s": 0, "time (s)": 0,
    "time (seconds)": 0, "stamp": 0, "time_ms": -3, "t_ms": -3, "timestamp_ms": -3, "time (ms)": -3,
    "time_us": -6, "t_us": -6, "timestamp_us": -6, "time_ns": -9, "t_ns": -9, "timestamp_ns": -9, "stamp_ns": -9,
}  # fmt: skip
"""Columns that hold the time, lower case, and the power of ten of their unit in s."""

_BY_CALL = "--rename, or `columns=` of `flight.read_recording`"
"""How a caller says what columns are called."""

_STILL = 3
"""Different numbers of a column up to which its digits do not say how well they are known: 1.5 may be all that there is to write."""

ROBOT_NAMES = ("robot", "name", "id", "body", "rigid_body", "rigidbody", "agent", "drone", "object")
"""Columns that name the robot, lower case."""

_AXIS = re.compile(
    r"(?:pos(?:ition)?[ ._/]?|p|t|trans(?:lation)?[ ._/]?)?(?P<axis>[xyz])(?P<unit>_m|_cm|_mm| \(c?m\)| \(mm\)| \[c?m\]| \[mm\])?",
    re.IGNORECASE,
)
_SEPARATORS = " ._/:"

_Axes = dict[str, tuple[int, int]]
"""For x, y and z the column and the power of ten of its unit in m."""


Frame = Literal["laboratory", "mission"]


@dataclass(frozen=True, eq=False)
class Recording:
    """Positions of a team as something else measured them.

    Attributes:
        robots: Names, in the order that was asked for.
        times: s, the first at 0 or as recorded. Shape (samples,).
        position: m, NaN where a robot was not seen. Shape (samples, robots, 3).
        rounding: How far times (s) and positions (m) may be off for the digits that they were written with.
        notes: How it was read, in sentences, where its files do not say it.
        zero: The recording's own time where `times` is 0, s.
        covers: From when to when its files hold anything or say that they do, whoever was seen meanwhile, s; it holds all of `times`.
        frame: Whose frame positions are in; the mission's only of logs of ours. `flight.logs.placed.in_mission` turns them.
        begins: From when to when the flight may have begun, s; None where neither the recording says it nor anybody did.
    """

    robots: tuple[str, ...]
    times: Floats
    position: Floats
    rounding: tuple[float, float] = (0.0, 0.0)
    notes: tuple[str, ...] = ()
    zero: float = 0.0
    covers: tuple[float, float] = (math.inf, -math.inf)
    frame: Frame = "laboratory"
    begins: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("times", "position"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        if len(self.times):
            ends = min(self.covers[0], float(self.times[0])), max(self.covers[1], float(self.times[-1]))
            object.__setattr__(self, "covers", ends)

    def noted(self, *notes: str) -> Recording:
        """Return the same with more said of how it was read."""
        return replace(self, notes=(*self.notes, *notes))


def read_table_recording(
    table: Table,
    robots: Sequence[str],
    *,
    start: float | Fraction | None = None,
    columns: Mapping[str, str] | None = None,
    promised: tuple[Fraction, Fraction] | None = None,
) -> Recording:
    """Read a recording from a table.

    Args:
        table: Its cells.
        robots: Whom to look for, as the table calls them.
        start: The table's time, in s, that is to be 0; the first row's by default.
        columns: What the table calls things where the names are not understood, or where several could be meant:
            `{"t": "Frame time", "robot": "Body", "x": "X"}` for tables with a robot column, `{"t": ..., "quad0.x": ...}`
            for wide ones.
        promised: From when to when the table says that it goes, s of its own clock; None where it says nothing.

    Returns:
        All rows, those before `start` too. It covers the rows of all bodies, and what was promised.

    Raises:
        BadInput: Columns are missing, not understood or could be meant in two ways, a robot is missing or stands twice at
            one time, or times do not go forward.
    """
    source = table.source
    if not table.header:
        raise BadInput(f"{source} is empty; that is no recording.")
    if len(table.rows) < 2:
        raise BadInput(f"{source} holds fewer than two samples.")
    names = _Names(table, columns or {})
    clock, unit = names.time()
    times = [number for number in table.numbers(clock) if number is not None]
    counts, power = counted(times, unit)
    own, places = names.layout(tuple(robots))
    rows = _long_rows(table, counts, own, tuple(robots)) if own is not None else _wide_rows(table, counts, len(robots))
    position, off, coarse = _positions(table, rows, places)
    ours = table.header[: len(LOG_COLUMNS)] == LOG_COLUMNS
    zero = Fraction(0) if ours else Fraction(counts[rows[0][0]]) * Fraction(10) ** power
    if start is not None:
        zero = start if isinstance(start, Fraction) else exact_time(start)
    at = np.array(since([counts[row] for row, _ in rows], power, zero))
    require_forward(at, source)
    covers = since([min(counts), max(counts)], power, zero) + [float(end - zero) for end in promised or ()]
    notes = (f"Positions are written to {coarse:g} m: --error has to cover that, too.",) if coarse else ()
    late = half_place(times, unit, digits=DIGITS if ours else None)
    frame: Frame = "mission" if ours else "laboratory"
    return Recording(tuple(robots), at, position, (late, off), notes, float(zero), (min(covers), max(covers)), frame)


class _Names:
    """Names of the columns of a recording, each with one meaning."""

    def __init__(self, table: Table, columns: Mapping[str, str]) -> None:
        self._source, self._header = table.source, table.header
        self._given: dict[str, int] = {}
        for ours, theirs in columns.items():
            if not self._is_ours(ours.strip()):
                raise BadInput(
                    f"'{ours[:40]}' is nothing that a recording holds: say t, robot, x, y, z, or a robot and its axis (quad0.x)."
                )
            if theirs.strip() not in table.header:
                raise BadInput(
                    f"{self._source} has no column '{theirs}' (given for {ours}).{did_you_mean(theirs, table.header)}"
                )
            index = table.column(theirs.strip())
            if index in self._given.values():
                raise BadInput(f"columns gives '{theirs}' two meanings; name each column once.")
            self._given[ours.strip()] = index

    @staticmethod
    def _is_ours(ours: str) -> bool:
        """Return whether a name means a time, a robot's name, or an axis of somebody's position."""
        if ours.lower() in TIME_NAMES or ours.lower() in ROBOT_NAMES:
            return True
        parts = [ours, *(ours[i + 1 :] for i, letter in enumerate(ours) if letter in _SEPARATORS)]
        return any(_AXIS.fullmatch(part) for part in parts)

    def time(self) -> tuple[int, int]:
        """Return the column of times and the power of ten of its unit in s."""
        given = {index: TIME_NAMES[ours.lower()] for ours, index in self._given.items() if ours.lower() in TIME_NAMES}
        free = {i: TIME_NAMES[name.lower()] for i, name in self._free() if name.lower() in TIME_NAMES}
        found = self._one("the time", given or free)
        if found is None:
            other = next((mark for mark in "\t;|" if len(self._header) == 1 and mark in self._header[0]), "")
            parted = f" Its cells are parted by {other!r}; write commas." if other else ""
            raise BadInput(
                f"{self._source} has no column for the time; name it t (in s), or say what it is called ({_BY_CALL}).{parted}"
            )
        return found, (given or free)[found]

    def layout(self, robots: tuple[str, ...]) -> tuple[int | None, list[_Axes]]:
        """Return the column that names the robot (None in wide tables), and each robot's columns of positions."""
        given = [index for ours, index in self._given.items() if ours.lower() in ROBOT_NAMES]
        free = [i for i, name in self._free() if name.lower() in ROBOT_NAMES]
        plain = self._axes(robots, None)
        wide = [self._axes(robots, robot) for robot in robots]
        is_wide, is_plain = any(len(axes) == 3 for axes in wide), len(plain) == 3
        if (given or free) and is_plain:
            own = self._one("the robot's name", given or free)
            if is_wide:
                raise self._twice("positions", [*wide[[len(axes) == 3 for axes in wide].index(True)].values(), *plain.values()])
            return own, [plain] * len(robots)
        if len(robots) == 1 and is_plain:
            if is_wide:
                raise self._twice("positions", [*wide[0].values(), *plain.values()])
            wide = [plain]
        for robot, found in zip(robots, wide, strict=True):
            if len(found) != 3:
                listed = f"{', '.join(self._header[:12])}{', ...' if len(self._header) > 12 else ''}"
                raise BadInput(
                    f"{self._source} has no columns for the position of '{robot}'; name them {robot}.x, {robot}.y, {robot}.z "
                    f"(spelt just so), or say what they are called ({_BY_CALL}). Columns: {listed[:400]}."
                )
        return None, wide

    def _free(self) -> list[tuple[int, str]]:
        """Return the columns to which the caller has given no meaning, by index."""
        return [(i, name) for i, name in enumerate(self._header) if i not in self._given.values()]

    def _axes(self, robots: tuple[str, ...], robot: str | None) -> _Axes:
        """Return for x, y, z the column and its unit, as far as they are there; of a robot, or of nobody named."""
        found: _Axes = {}
        for axis in "xyz":
            given = {i: unit for ours, i in self._given.items() if (unit := _unit(ours, axis, robots, robot)) is not None}
            free = {i: unit for i, name in self._free() if (unit := _unit(name, axis, robots, robot)) is not None}
            what = f"{axis} of the position" if robot is None else f"{axis} of {robot}'s position"
            column = self._one(what, given or free)
            if column is not None:
                found[axis] = (column, (given or free)[column])
        return found

    def _one(self, what: str, found: Sequence[int] | Mapping[int, int]) -> int | None:
        if len(found) > 1:
            raise self._twice(what, [(index, 0) for index in found])
        return next(iter(found), None)

    def _twice(self, what: str, found: Sequence[tuple[int, int]]) -> BadInput:
        listed = ", ".join(f"'{self._header[index][:40]}' (column {index + 1})" for index, _ in found)
        return BadInput(
            f"{self._source} has several columns that could be {what}: {listed}. Leave in one, or say which it is ({_BY_CALL})."
        )


def _unit(name: str, axis: str, robots: tuple[str, ...], robot: str | None) -> int | None:
    """Return the power of ten of a column's unit in m if it is that axis of that robot's (or nobody's) position."""
    rest = name
    if robot is not None:
        if not name.startswith(robot) or name[len(robot) : len(robot) + 1] not in tuple(_SEPARATORS):
            return None
        rest = name[len(robot) + 1 :]
        if any(other != robot and len(other) > len(robot) and _unit(name, axis, (), other) is not None for other in robots):
            return None  # `a_pos_x` is the x of a robot `a_pos`, where there is one, and not of `a`
    match = _AXIS.fullmatch(rest)
    if match is None or match["axis"].lower() != axis:
        return None
    unit = (match["unit"] or "").lower()
    return -3 if "mm" in unit else -2 if "cm" in unit else 0


_Row = tuple[int, list[int | None]]
"""A sample: a row of the table that has its time, and the row of each robot (None where it was not seen)."""


def _wide_rows(table: Table, counts: list[int], robots: int) -> list[_Row]:
    for row in range(1, len(counts)):
        if counts[row] <= counts[row - 1]:
            raise _not_forward(table, counts, row)
    return [(row, [row] * robots) for row in range(len(counts))]


def _long_rows(table: Table, counts: list[int], own: int, robots: tuple[str, ...]) -> list[_Row]:
    """Return the samples at which any of the robots stands; rows of other bodies are none."""
    order = {robot: j for j, robot in enumerate(robots)}
    rows: list[_Row] = []
    seen: set[str] = set()
    for index, row in enumerate(table.rows):
        if index and counts[index] < counts[index - 1]:
            raise _not_forward(table, counts, index)
        name = row[own].strip()
        seen.add(name)
        if name not in order:
            continue
        if not rows or counts[rows[-1][0]] != counts[index]:
            rows.append((index, [None] * len(robots)))
        before = rows[-1][1][order[name]]
        if before is not None:
            raise BadInput(
                f"{table.source}:{table.lines[index]}: '{name}' stands twice at one time, here and on line "
                f"{table.lines[before]}; a robot is in one place."
            )
        rows[-1][1][order[name]] = index
    missing = sorted(set(robots) - seen)
    if missing:
        raise BadInput(f"{table.source} has no rows for '{missing[0]}'.{did_you_mean(missing[0], seen - set(robots))}")
    return rows


def _not_forward(table: Table, counts: list[int], row: int) -> BadInput:
    how = "is the same as" if counts[row] == counts[row - 1] else "lies before"
    return BadInput(
        f"{table.source}:{table.lines[row]}: times must go forward, but this one {how} that of line {table.lines[row - 1]}."
    )


def _positions(table: Table, rows: Sequence[_Row], places: Sequence[_Axes]) -> tuple[Floats, float, float]:
    """Return positions in m, shape (samples, robots, 3), how far they may be off for the digits written, and their last place, m, where it is coarse."""
    read: dict[int, list[Decimal | None]] = {}
    for axes in places:
        for column, _ in axes.values():
            if column not in read:
                read[column] = table.numbers(column, blank=True)
    position = np.full((len(rows), len(places), 3), np.nan)
    for j, axes in enumerate(places):
        for sample, (_, own) in enumerate(rows):
            row = own[j]
            if row is None:
                continue
            cells = [(read[column][row], unit) for column, unit in axes.values()]
            known = [number.float(unit) for number, unit in cells if number is not None]
            if len(known) not in (0, 3):
                raise BadInput(
                    f"{table.source}:{table.lines[row]}: a position has {len(known)} of its three coordinates; a robot that "
                    "was not seen has none."
                )
            if known:
                position[sample, j] = known
    off = max(math.sqrt(sum(rounding(read[column], unit) ** 2 for column, unit in axes.values())) for axes in places)
    moving = [(read[column], unit) for axes in places for column, unit in axes.values() if len(set(read[column])) > _STILL]
    coarse = max((float(coarse_place(numbers, unit)) for numbers, unit in moving), default=0.0)
    return position, off * (1 + 1e-9), coarse
