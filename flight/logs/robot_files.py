"""A folder with one file a robot: logs as cflib and its client write them, PX4's, or tables of one robot.

A Crazyflie's log holds where the vehicle believed to be, and its own clock's milliseconds since it was switched on.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from flight.logs.clocks import Seen, on_one_clock, require_common_start
from flight.logs.import_options import RecordingOptions
from flight.logs.recordings import Recording, read_table_recording
from flight.logs.ulog import read_ulog
from verify.data import BadInput
from verify.data.errors import did_you_mean
from verify.data.storage.safe_reading import read_text
from verify.data.storage.tables import MAX_BYTES, Table, counted, decimal, read_table

ENDINGS = (".csv", ".ulg")
"""Of the files that are looked for."""

_TICK = 0.001
"""s; a Crazyflie's clock counts whole milliseconds, which it never rounds up: half of one beyond that of numbers that are rounded."""

_FAMILIES = {
    "the vehicle's estimate (stateEstimate)": ("stateEstimate.x", "stateEstimate.y", "stateEstimate.z"),
    "the vehicle's filter (kalman.state)": ("kalman.stateX", "kalman.stateY", "kalman.stateZ"),
    "what the vehicle was sent (locSrv)": ("locSrv.x", "locSrv.y", "locSrv.z"),
}
"""Variables of the firmware's logs that hold a position in m."""


def read_robot_files(folder: Path, robots: Sequence[str], told: RecordingOptions) -> Recording:
    """Read a folder that holds a file for each robot.

    Args:
        folder: The folder.
        robots: Names in the mission.
        told: What is told of the recording; `rename` gives files' names without their ending, or with it.

    Raises:
        BadInput: A robot has no file or several, a file cannot be understood, or nobody says how clocks lie to each other.
    """
    source = str(folder)
    files = {robot: _file_of(folder, name, robot) for robot, name in zip(robots, told.names(robots), strict=True)}
    require_common_start(told, robots, source)
    said_of: dict[str, list[str]] = {}
    headers: set[str] = set()
    seen: dict[str, Seen] = {}
    for robot, path in files.items():
        seen[robot], said, header = _read(path, robot, told)
        headers.update(header)
        for sentence in said:
            said_of.setdefault(sentence, []).append(path.name)
    for ours, theirs in told.columns(robots).items():
        if theirs not in headers:
            raise BadInput(
                f"{source} has no file with a column '{theirs[:40]}' (given for {ours[:40]}).{did_you_mean(theirs, headers)}"
            )
    notes = [f"{', '.join(names)}: {sentence}" for sentence, names in said_of.items()]
    others = sorted(path for path in folder.iterdir() if path.suffix in ENDINGS and path not in files.values())
    beside = {} if isinstance(told.start, Mapping) else _readable(others)
    if beside:
        notes.append(f"Files of the folder that belong to no robot count for what it covers: {', '.join(beside)[:200]}.")
    if aside := [path.name for path in others if path.name not in beside]:
        notes.append(f"Files of the folder that belong to no robot were left aside: {', '.join(aside)[:200]}.")
    if len(robots) > 1 and not isinstance(told.start, Mapping):
        notes.append("The robots' files share one clock, as was told by naming one start for all.")
    recording = on_one_clock(seen, told, source, shared=False, beside=tuple(beside.values()))
    return recording.noted(*notes)


def _read(path: Path, robot: str, told: RecordingOptions) -> tuple[Seen, tuple[str, ...], Sequence[str]]:
    """Read the file of one robot; return what it saw, how it was read, and its columns."""
    if path.suffix == ".ulg":
        return *read_ulog(path), ()
    table = read_table(read_text(path, most=MAX_BYTES, what="recording"), str(path), comments=True)
    return *_one_robot(table, robot, told), table.header


def _readable(paths: Sequence[Path]) -> dict[str, Seen]:
    """Return what files of no robot saw on the clock that all share, where they can be read as recordings."""
    found: dict[str, Seen] = {}
    for path in paths:
        with contextlib.suppress(BadInput):
            found[path.name] = _read(path, path.stem, RecordingOptions())[0]
    return found


def is_crazyflie_log(table: Table) -> bool:
    """Return whether a table holds a position of a Crazyflie's own log."""
    return any(axis in table.header for axes in _FAMILIES.values() for axis in axes)


def crazyflie_table(table: Table, called: Sequence[str]) -> tuple[Table, float, tuple[str, ...]]:
    """Return a Crazyflie's log as a plain table of one robot.

    Args:
        table: Its cells.
        called: What of it the caller names already, in lower case.

    Returns:
        The table, how far its times may be off (s), and how it was read.

    Raises:
        BadInput: It holds several positions, part of one, or a time whose unit cannot be told.
    """
    found = {what: axes for what, axes in _FAMILIES.items() if any(axis in table.header for axis in axes)}
    header, notes, late = list(table.header), list[str](), 0.0
    if not {"x", "y", "z"} & set(called):
        if len(found) > 1:
            raise BadInput(
                f"{table.source} holds {' and '.join(found)}: say which of them is the position, such as "
                f"--rename x={next(iter(found.values()))[0]} (and y, z)."
            )
        ((what, axes),) = found.items()
        for axis, name in zip("xyz", axes, strict=True):
            header[table.column(name)] = axis
        notes.append(f"positions are {what}, not a measurement from outside: --error has to cover how far that may be off.")
    clock = [k for k, name in enumerate(table.header) if name.lower() == "timestamp"]
    if len(clock) == 1 and not any(name.startswith(("t", "stamp", "seconds")) for name in called):
        cells = [row[clock[0]].strip() for row in table.rows]
        odd = next((k for k, cell in enumerate(cells) if (number := decimal(cell)) is None or number.exponent < 0), None)
        if odd is not None:
            raise BadInput(
                f"{table.source}:{table.lines[odd]}: {table.header[clock[0]]} is {cells[odd][:40]!r}, where a Crazyflie counts whole "
                f"milliseconds; say its unit: --rename time_s={table.header[clock[0]]} or --rename time_ms={table.header[clock[0]]}."
            )
        header[clock[0]], late = "timestamp_ms", _TICK / 2
        notes.append("its clock counts whole milliseconds, so that times are known to 1 ms.")
    return Table(table.source, tuple(header), table.rows, table.lines, table.whole), late, tuple(notes)


def _one_robot(table: Table, robot: str, told: RecordingOptions) -> tuple[Seen, tuple[str, ...]]:
    """Read the table of one robot."""
    columns, notes, late = told.columns([robot]), tuple[str, ...](), 0.0
    columns = {ours: theirs for ours, theirs in columns.items() if theirs in table.header}
    if is_crazyflie_log(table):
        table, late, notes = crazyflie_table(table, [ours.lower() for ours in columns])
    name = told.rename.get(robot, robot).removesuffix(".csv")
    found = read_table_recording(table, (name,), start=0, columns=columns)
    if found.frame == "mission":
        raise BadInput(f"{table.source} is a log of ours, which holds the whole team: give it alone.")
    (first, last, *counts), power = _counts([*found.covers, *found.times.tolist()])
    late += found.rounding[0] + float(np.spacing(np.max(np.abs(found.times))))
    return Seen(counts, power, found.position[:, 0], (late, found.rounding[1]), (first, last)), notes


def _counts(times: Sequence[float]) -> tuple[list[int], int]:
    """Return times, which are floats counted from 0, as the decimals that they print as."""
    numbers = [decimal(repr(time)) for time in times]
    return counted([number for number in numbers if number is not None])


def _file_of(folder: Path, name: str, robot: str) -> Path:
    """Return the one file of a robot."""
    exact = folder / name
    if exact.suffix in ENDINGS and exact.is_file():
        return exact
    found = [folder / f"{name}{ending}" for ending in ENDINGS if (folder / f"{name}{ending}").is_file()]
    if len(found) > 1:
        raise BadInput(
            f"{folder} holds {' and '.join(path.name for path in found)}; say which is {robot}'s: --rename {robot}={found[0].name}."
        )
    if not found:
        there = sorted(path.stem for path in folder.iterdir() if path.suffix in ENDINGS)
        listed = f" Files: {', '.join(there)[:200]}." if there else " It holds no .csv and no .ulg."
        raise BadInput(
            f"{folder} has no file for '{robot}' ({name}.csv or {name}.ulg).{did_you_mean(name, there)}{listed} Say which it is: "
            f"--rename {robot}=NAME."
        )
    return found[0]
