"""Flight logs as evidence: `flight.csv` and tables like it, read exactly or refused."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from verify.data.errors import BadInput, did_you_mean
from verify.data.language.formula import FREE
from verify.data.mission import Mission
from verify.data.storage.safe_reading import read_text
from verify.data.storage.tables import MAX_BYTES, Decimal, Table, counted, decimal, half_place, read_table, rounding, since

LOG_COLUMNS = (
    "t", "robot", "x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw", "thrust", "wx", "wy", "wz", "error", "letter",
)  # fmt: skip
"""Columns with which every log of ours begins: s, name, m, m/s, rad, N (collective), rad/s (body), m from the plan, regions and internal
propositions joined by spaces (empty: free flight)."""

DIGITS = 9
"""Significant digits of the numbers in a log of ours; zeros at their ends are left out."""

_NEEDED = ("t", "robot", "x", "y", "z")


@dataclass(frozen=True, eq=False)
class Samples:
    """Positions of a team at some instants.

    Attributes:
        times: s, increasing, the same for all robots; of a log on its own clock. Shape (n,).
        positions: m, by robot; NaN where one was not seen. Shape (n, 3) each.
        internal: For each robot its letter at each sample, or None where nothing shows them.
        rounding: How far times (s) and positions (m) may be off for the digits that they were written with.
        notes: What was taken for granted when they were read, a sentence each.
        zero: What the recording's own clock showed where `times` is 0, s.
        covers: From when to when the recording's files hold anything, whoever was seen meanwhile, s; None: from the first to the last of `times`.
    """

    times: NDArray[np.float64]
    positions: Mapping[str, NDArray[np.float64]]
    internal: Mapping[str, Sequence[frozenset[str]]] | None = None
    rounding: tuple[float, float] = (0.0, 0.0)
    notes: tuple[str, ...] = ()
    zero: float = 0.0
    covers: tuple[float, float] | None = None

    @property
    def span(self) -> tuple[float, float]:
        """From when to when the recording covers the flight, s: a robot that is not seen in it may be anywhere that its speed allows."""
        first, last = float(self.times[0]), float(self.times[-1])
        return (first, last) if self.covers is None else (min(first, self.covers[0]), max(last, self.covers[1]))

    def checked(self) -> Samples:
        """Return the same as float64, in which everything is checked, whatever the arrays were made of.

        Raises:
            BadInput: They are no arrays of real numbers.
        """
        if not isinstance(self.positions, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(
                f"positions must be a table from each robot's name to an array, not {type(self.positions).__name__}."
            )
        places = {name: _real(table, f"positions of {name}") for name, table in self.positions.items()}
        if self.internal is not None and not isinstance(self.internal, Mapping):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
            raise BadInput(
                f"internal must be a table from each robot's name to sets of names, not {type(self.internal).__name__}."
            )
        for name, row in (self.internal or {}).items():
            for letter in row:
                if isinstance(letter, str) or not isinstance(letter, Iterable):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
                    raise BadInput(f"internal of {name} must be sets of names, one a sample, not {str(letter)[:40]!r}.")
        inner = None if self.internal is None else {name: tuple(map(frozenset, row)) for name, row in self.internal.items()}
        return replace(self, times=_real(self.times, "times"), positions=places, internal=inner, notes=tuple(self.notes))


def _real(values: ArrayLike, name: str) -> NDArray[np.float64]:
    try:
        array = np.asarray(values)
        if array.dtype.kind in "iuf" or (array.dtype.kind == "O" and array.size):
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as problem:
        raise BadInput(f"{name} must be an array of numbers: {problem}.") from None
    raise BadInput(f"{name} must be an array of numbers, not of {array.dtype}.")


def load_flight_log(path: str | os.PathLike[str], mission: Mission) -> Samples:
    """Read a flight log of a mission's team: columns t, robot, x, y, z and, for internal propositions, letter.

    Raises:
        BadInput: The file is no such log, says something twice or in part, or does not fit the mission.
    """
    return read_flight_log(read_text(path, most=MAX_BYTES, what="flight log"), str(path), mission)


def read_flight_log(text: str, source: str, mission: Mission) -> Samples:
    """Read a flight log from its text; `source` names it in messages.

    Args:
        text: The log's text.
        source: Names it in messages.
        mission: Names the robots and the internal propositions.

    Raises:
        BadInput: As `load_flight_log`.
    """

    def require_needed(header: tuple[str, ...]) -> None:
        missing = [name for name in _NEEDED if name not in header]
        if missing:
            raise BadInput(f"{source} is no flight log: column '{missing[0]}' is missing (needed: {', '.join(_NEEDED)}).")

    table = read_table(text, source, check=require_needed)
    if not table.header:
        raise BadInput(f"{source} is empty; that is no flight log.")
    own = table.column("robot")
    agents = tuple(mission.agents)
    rows: dict[str, list[int]] = {name: [] for name in agents}
    for index, row in enumerate(table.rows):
        if row[own] not in rows:
            raise BadInput(
                f"{source}, line {table.lines[index]}: '{row[own][:40]}' is not a robot of this mission ({', '.join(agents)})."
            )
        rows[row[own]].append(index)
    numbers = {name: _numbers(table, name) for name in ("t", "x", "y", "z")}
    for name in agents:
        if not rows[name]:
            raise BadInput(f"{source}: {name} must be sampled at the same times as {agents[0]}, and at least once.")
    counts, power = counted(numbers["t"])
    shared = [counts[index] for index in rows[agents[0]]]
    for name in agents:
        mine = [counts[index] for index in rows[name]]
        for before, after in zip(rows[name], rows[name][1:], strict=False):
            if counts[after] <= counts[before]:
                raise BadInput(
                    f"{source}, line {table.lines[after]}: {name}'s times must go forward, but this one is "
                    f"{'the same as' if counts[after] == counts[before] else 'before'} that of line {table.lines[before]}."
                )
        if mine != shared:
            raise BadInput(f"{source}: {name} must be sampled at the same times as {agents[0]}, and at least once.")
    times = since(shared, power, Fraction(0))
    places = [[numbers[axis][index].float() for axis in "xyz"] for index in range(len(table.rows))]
    off = math.sqrt(sum(rounding(numbers[axis]) ** 2 for axis in "xyz")) * (1 + 1e-9)
    return Samples(
        np.array(times),
        {name: np.array([places[index] for index in rows[name]]) for name in agents},
        _letters(table, rows, mission),
        (half_place(numbers["t"], digits=DIGITS if table.header[: len(LOG_COLUMNS)] == LOG_COLUMNS else None), off),
    )


def _numbers(table: Table, name: str) -> list[Decimal]:
    column = table.column(name)
    table.require_whole(column)
    found: list[Decimal] = []
    for row, line in zip(table.rows, table.lines, strict=True):
        number = decimal(row[column].strip())
        if number is None:
            raise BadInput(f"{table.source}, line {line}: t, x, y and z must be numbers, but {name} is {row[column][:40]!r}.")
        found.append(number)
    return found


def _letters(table: Table, rows: dict[str, list[int]], mission: Mission) -> dict[str, list[frozenset[str]]] | None:
    """Return the letters of the column that holds them, every name of which the mission must know."""
    if "letter" not in table.header:
        return None
    column = table.column("letter")
    known = {*mission.all_regions, *mission.internal_propositions, FREE}
    letters = [frozenset(row[column].split()) for row in table.rows]
    for index, letter in enumerate(letters):
        if not letter <= known:
            name = min(letter - known)
            raise BadInput(
                f"{table.source}, line {table.lines[index]}: '{name[:40]}' is neither a region nor an internal proposition "
                f"of this mission.{did_you_mean(name, known)}"
            )
    return {name: [letters[index] for index in found] for name, found in rows.items()}
