"""Recorded flights of identification: a table of places, attitudes and commanded thrusts, on an even clock."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from flight.model.attitude import Floats
from verify.data import BadInput
from verify.data.errors import did_you_mean
from verify.data.storage.safe_reading import read_text
from verify.data.storage.tables import MAX_BYTES, Table, decimal, read_table

RATE = 100
"""Samples a second on which a log is laid."""
NEEDED = ("t", "x", "y", "z", "roll", "pitch", "yaw", "thrust")
"""Columns: s, m as motion capture saw them, rad (Z-Y-X), and the thrust that software commanded, N of all rotors."""
ESTIMATED = ("ex", "ey", "ez")
"""Columns of where the vehicle took itself to be at that instant, m; without them nothing tells the latency."""

_GAP = 0.25
"""s between two samples that are still laid on an even clock."""
_SLOWEST = 40.0
"""Samples a second that a log has at least."""


@dataclass(frozen=True, eq=False, slots=True)
class Recorded:
    """A flight on an even clock.

    Attributes:
        position: m. Shape (n, 3).
        attitude: Roll, pitch, yaw, rad. Shape (n, 3).
        thrust: Commanded, N. Shape (n,).
        estimated: Position on board, m; None where the log has none. Shape (n, 3).
    """

    position: Floats
    attitude: Floats
    thrust: Floats
    estimated: Floats | None

    @property
    def lasts(self) -> float:
        """Length, s."""
        return len(self.thrust) / RATE


def read_recorded(path: str | os.PathLike[str], robot: str | None = None) -> Recorded:
    """Read a table of one robot's flight.

    Args:
        path: CSV with the columns `NEEDED` and perhaps `ESTIMATED` and `robot`; `flight.csv` is one.
        robot: Whose rows, where the table has more than one robot's.

    Raises:
        BadInput: It is no such table, or leaves gaps.
    """
    source = str(path)

    def require_needed(header: tuple[str, ...]) -> None:
        missing = [name for name in NEEDED if name not in header]
        if missing:
            raise BadInput(
                f"{source} cannot be identified from: it lacks the columns {', '.join(missing)} (needed: {', '.join(NEEDED)})."
            )
        if (there := [name in header for name in ESTIMATED]) != [there[0]] * 3:
            raise BadInput(f"{source} has some of the columns {', '.join(ESTIMATED)}, but not all of them.")

    table = read_table(read_text(path, most=MAX_BYTES, what="flight log"), source, check=require_needed)
    rows = _rows_of(table, source, robot)
    names = (*NEEDED, *(ESTIMATED if ESTIMATED[0] in table.header else ()))
    columns = {name: _numbers(table, rows, name, source) for name in names}
    return even(columns, source)


def even(columns: dict[str, Floats], source: str = "the log") -> Recorded:
    """Lay a flight on an even clock.

    Args:
        columns: `NEEDED`, and perhaps `ESTIMATED`. Shape (samples,) each.
        source: Names the log in messages.

    Raises:
        BadInput: Times do not go forward, or leave gaps.
    """
    times = columns["t"]
    if len(times) < 2 or np.any(np.diff(times) <= 0):
        raise BadInput(f"{source}: times must go forward, and there must be at least two.")
    gap = int(np.argmax(np.diff(times)))
    if (wide := float(times[gap + 1] - times[gap])) > _GAP:
        raise BadInput(f"{source} has a gap of {wide:.2f} s at {times[gap]:g} s; at most {_GAP:g} s are bridged.")
    rate = (len(times) - 1) / float(times[-1] - times[0])
    if rate < _SLOWEST:
        raise BadInput(f"{source} has {rate:.0f} samples a second; {_SLOWEST:.0f} are needed.")
    at = np.arange(times[0], times[-1], 1.0 / RATE)

    def laid(names: tuple[str, ...]) -> Floats:
        return np.stack([np.interp(at, times, columns[name]) for name in names], axis=1)

    turned = {name: np.unwrap(columns[name]) for name in ("roll", "pitch", "yaw")}
    attitude = np.stack([np.interp(at, times, turned[name]) for name in ("roll", "pitch", "yaw")], axis=1)
    estimated = laid(ESTIMATED) if ESTIMATED[0] in columns else None
    return Recorded(laid(("x", "y", "z")), attitude, laid(("thrust",))[:, 0], estimated)


def _rows_of(table: Table, source: str, robot: str | None) -> list[int]:
    if not table.rows:
        raise BadInput(f"{source} has no rows.")
    if "robot" not in table.header:
        if robot is not None:
            raise BadInput(f"{source} has no column `robot`: it is one robot's, and --robot names none of it.")
        return list(range(len(table.rows)))
    own: int = table.column("robot")
    robots = tuple(dict.fromkeys(row[own] for row in table.rows))
    if robot is None and len(robots) > 1:
        raise BadInput(f"{source} has {len(robots)} robots; name one with --robot: {', '.join(robots)[:200]}.")
    if robot is not None and robot not in robots:
        raise BadInput(f"{source} has no rows of '{robot}'.{did_you_mean(robot, robots)}")
    return [index for index, row in enumerate(table.rows) if robot is None or row[own] == robot]


def _numbers(table: Table, rows: list[int], name: str, source: str) -> Floats:
    column, found = table.column(name), np.empty(len(rows))
    for place, index in enumerate(rows):
        number = decimal(table.rows[index][column].strip())
        if number is None:
            raise BadInput(
                f"{source}, line {table.lines[index]}: {name} is {table.rows[index][column][:40]!r}; it must be a number."
            )
        found[place] = number.float()
    return found
