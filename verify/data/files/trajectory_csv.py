"""Trajectories as the CSV files of uav_trajectories and crazyswarm2: one polynomial piece a line.

Numbers are float32, as the vehicle stores them, and are written with nine significant digits, which keep every bit
(the usual six decimals have moved paths by metres). A cycle is written as the laps that are flown.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from verify.data.errors import BadInput
from verify.data.storage.safe_reading import read_text
from verify.data.trajectory import AXES, DEGREE, MAX_PIECES, Trajectory

HEADER = ("duration", *(f"{axis}^{power}" for axis in AXES for power in range(DEGREE + 1)))

MAX_BYTES = 4_000_000

_BEYOND = float(np.finfo(np.float32).max) + 2.0**103
"""What rounds to no float32: half a step above the largest one, whose nine digits lie between the two."""


def write_csv(trajectory: Trajectory, laps: int = 1) -> str:
    """Return the CSV text of a trajectory; of a cycle, that many laps.

    Raises:
        BadInput: A number is not a float32, so that the file would not hold what was certified.
    """
    if not trajectory.is_float32:
        raise BadInput(
            "The trajectory's numbers are not float32; round them (`refine.quantise`) before it is certified and written."
        )
    flown = trajectory.flattened(laps)
    lines = [",".join(HEADER)]
    for duration, piece in zip(flown.durations, flown.coefficients, strict=True):
        lines.append(",".join(f"{value:.9g}" for value in (duration, *piece.ravel())))
    return "\n".join(lines) + "\n"


def read_csv(text: str, source: str = "trajectory") -> Trajectory:
    """Read a trajectory from CSV text, as the float32 numbers that the vehicle would hold.

    Args:
        text: The file's text.
        source: Names it in messages.

    Returns:
        The trajectory, without a cycle (the file does not say where one starts).

    Raises:
        BadInput: The header, a line's length or a number is wrong; the message names the line.
    """
    if len(text) > MAX_BYTES:
        raise BadInput(f"{source} is larger than {MAX_BYTES // 1_000_000} MB; that is no trajectory.")
    if "\0" in text:
        raise BadInput(f"{source} holds a NUL byte; it is no CSV text.")
    try:
        rows = list(csv.reader(io.StringIO(text.removeprefix("\ufeff")), strict=True))
    except csv.Error as error:
        raise BadInput(f"{source} is no CSV: {error}.") from None
    if not rows or tuple(name.strip() for name in rows[0]) != HEADER:
        raise BadInput(f"{source}:1: the header must be `{HEADER[0]},{HEADER[1]},...,{HEADER[-1]}` ({len(HEADER)} columns).")
    numbers: list[list[float]] = []
    for line, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        if len(numbers) == MAX_PIECES:
            raise BadInput(f"{source}: more than {MAX_PIECES} pieces; a trajectory has at most that many.")
        if len(row) != len(HEADER):
            raise BadInput(f"{source}:{line}: {len(row)} columns; a piece has {len(HEADER)} (degree at most 7).")
        numbers.append([_number(cell, source, line, column) for column, cell in enumerate(row)])
    if not numbers:
        raise BadInput(f"{source} has no pieces; a trajectory needs at least one.")
    table = np.array(numbers)
    try:
        return Trajectory(table[:, 0], table[:, 1:].reshape(len(table), len(AXES), DEGREE + 1))
    except BadInput as error:
        raise BadInput(f"{source}: {error}") from None


def load_csv(path: str | Path) -> Trajectory:
    """Read a trajectory from a CSV file."""
    return read_csv(read_text(path, most=MAX_BYTES, what="trajectory"), str(path))


def _number(cell: str, source: str, line: int, column: int) -> float:
    text = cell.strip()
    try:
        if not text or not set(text) <= set("0123456789+-.eE"):
            raise ValueError
        value = float(text)
    except ValueError:
        raise BadInput(f"{source}:{line}: {HEADER[column]} is {cell[:40]!r}; it must be a finite number.") from None
    if not abs(value) < _BEYOND:
        raise BadInput(f"{source}:{line}: {HEADER[column]} is {cell[:40]}; float32 cannot hold it.")
    return float(np.float32(value))
