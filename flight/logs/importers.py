"""The door to recordings of others: whatever a path holds is known by its content, and read exactly or refused."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from flight.logs.bags import is_bag, read_bag
from flight.logs.clocks import on_one_clock
from flight.logs.import_options import SAME, Axes, RecordingOptions
from flight.logs.motion_capture import export_table
from flight.logs.own_logs import is_ours, read_mcap, read_parquet
from flight.logs.recordings import Recording, read_table_recording
from flight.logs.robot_files import crazyflie_table, is_crazyflie_log, read_robot_files
from flight.logs.ulog import read_ulog
from verify.data import BadInput
from verify.data.storage.safe_reading import read_text
from verify.data.storage.tables import MAX_BYTES, read_table


def read_recording(
    path: str | os.PathLike[str],
    robots: Sequence[str],
    *,
    start: float | Mapping[str, float] | None = None,
    columns: Mapping[str, str] | None = None,
) -> Recording:
    """Read a recording of a flight from its start on; `read_flown` says of what kinds.

    Args:
        path: A file, a bag, or a folder with a file for each robot.
        robots: Whom to look for.
        start: The recording's time, in s, at which the flight began (by robot where each has a clock of its own); the first
            sample's by default.
        columns: What the recording calls things where the names are not understood, or where several could be meant:
            `{"t": "Frame time", "robot": "Body", "x": "X"}` for tables with a robot column, `{"t": ..., "quad0.x": ...}`
            for wide ones, `{"quad0": "cf231"}` for a robot.

    Raises:
        BadInput: It cannot be understood, could be meant in two ways, lacks a robot, or its times do not go forward.
        MissingEngine: What reads it is not installed.
    """
    whole = read_flown(path, robots, RecordingOptions(start=start, rename=columns or {}))
    later = whole.times >= 0
    covers = max(whole.covers[0], 0.0), whole.covers[1]
    return replace(whole, times=whole.times[later], position=whole.position[later], covers=covers)


def read_flown(path: str | os.PathLike[str], robots: Sequence[str], told: RecordingOptions) -> Recording:
    """Read a recording of a flight, with all that came before and after it.

    These are read: tables with one row a sample, or one a sample and robot; what Vicon, Motive and Qualisys export of bodies; a
    Crazyflie's own log; PX4's (`.ulg`); ROS 2 bags; our own logs (`.csv`, `.parquet`, `.mcap`); and folders with a file for each robot.

    Args:
        path: A file, a bag, or a folder with a file for each robot.
        robots: Whom to look for, as the mission calls them.
        told: What is told of the recording that its files do not say.

    Returns:
        m, in the laboratory's frame, of logs of ours in the mission's; times are 0 where the flight began, as was told, or at the first sample.

    Raises:
        BadInput: It cannot be understood, could be meant in two ways, lacks a robot, or its times do not go forward.
        MissingEngine: What reads it is not installed.
    """
    path = Path(path)
    found, axes = _read(path, tuple(robots), told)
    begins = told.began
    if found.frame == "mission":
        told.require_start_only(str(path))
        begins = begins or (0.0, 0.0)
    position, notes = told.in_mission(found.position, tuple(robots), axes)
    if not np.any(found.times >= 0):
        raise BadInput(f"{path} ends {-float(found.times[-1]):g} s before the flight's start.")
    return replace(found, robots=tuple(robots), position=position, begins=begins).noted(*notes)


def _read(path: Path, robots: tuple[str, ...], told: RecordingOptions) -> tuple[Recording, Axes]:
    """Return a recording in its own frame, and its axes."""
    if path.suffix == ".mcap" and path.is_file() and is_ours(path):
        return read_mcap(path, robots, told), SAME
    if path.suffix == ".parquet" and path.is_file():
        return read_parquet(path, robots, told), SAME
    if is_bag(path):
        return read_bag(path, robots, told), SAME
    if path.is_dir():
        return read_robot_files(path, robots, told), SAME
    if path.suffix == ".ulg":
        return _one_vehicle(path, robots, told), SAME
    return _table(path, robots, told)


def _one_vehicle(path: Path, robots: tuple[str, ...], told: RecordingOptions) -> Recording:
    """Read PX4's log of the only robot."""
    robot, *others = robots
    if others:
        raise BadInput(
            f"{path} is the log of one vehicle, and the mission has {len(robots)}; put one for each into a folder, named after it."
        )
    told.no_columns(robots, "PX4's log")
    seen, notes = read_ulog(path)
    return on_one_clock({robot: seen}, told, str(path), shared=True).noted(*notes)


def _table(path: Path, robots: tuple[str, ...], told: RecordingOptions) -> tuple[Recording, Axes]:
    """Read a table of the whole team, or of its only robot."""
    text, source = read_text(path, most=MAX_BYTES, what="recording"), str(path)
    names, columns, late, axes = told.names(robots), told.columns(robots), 0.0, SAME
    export = export_table(text, source, names)
    notes: tuple[str, ...] = ()
    promised = None
    if export is not None:
        table, notes, promised = export.table, export.notes, export.promised
        if export.axes is None and not told.axes:
            raise BadInput(
                f"{source} does not say which of its axes points up: say it with --axes x,-z,y (its y, as the program has it unless it was "
                "set otherwise) or --axes x,y,z (its z)."
            )
    else:
        table = read_table(text, source, comments=True)
        if is_crazyflie_log(table):
            if len(robots) > 1:
                raise BadInput(
                    f"{source} is the log of one vehicle, and the mission has {len(robots)}; put one for each into a folder, named after it."
                )
            table, late, notes = crazyflie_table(table, [ours.lower() for ours in columns])
    begins = told.begins(robots)
    if isinstance(told.start, Mapping) and begins is not None and len(set(begins.values())) > 1:
        raise BadInput(
            f"{source} has one clock for all robots, on which the flight began once: give one start, not one a robot."
        )
    start = None if begins is None else next(iter(begins.values()))
    found = read_table_recording(table, names, start=start, columns=columns, promised=promised)
    return replace(found, rounding=(found.rounding[0] + late, found.rounding[1])).noted(*notes), axes
