"""Our own logs as recordings: in the mission's frame, on the flight's clock, 0 where it began. MCAP files hold the poses that `mcap_file` wrote."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from flight.logs.chunks import require_small
from flight.logs.clocks import Seen, on_one_clock
from flight.logs.import_options import RecordingOptions
from flight.logs.log import FlightLog
from flight.logs.recordings import Recording
from flight.logs.tables import read_log
from verify.data import BadInput, MissingEngine
from verify.data.errors import did_you_mean
from verify.data.storage.safe_reading import parse_json

_ROUNDED = 0.5e-4 * 3**0.5 * (1 + 1e-9)
"""m; how far positions may be off that `large_logs` keeps to 0.1 mm."""


def is_ours(path: Path) -> bool:
    """Tell an MCAP file that `mcap_bytes` made from one of ROS 2."""
    with path.open("rb") as stream:
        return b"ltlplan" in stream.read(200)


def as_recording(log: FlightLog) -> Recording:
    """Return a log's positions as a recording.

    Args:
        log: Any log.
    """
    return Recording(log.robots, log.times, log.position, frame="mission", begins=(0.0, 0.0))


def read_parquet(path: Path, robots: Sequence[str], told: RecordingOptions) -> Recording:
    """Read the positions of a log of ours that was written as Parquet.

    Args:
        path: The file.
        robots: Names in the mission.
        told: What is told of the recording.

    Raises:
        BadInput: It is no such file, or lacks a robot.
        MissingEngine: pyarrow is not installed.
    """
    told.no_columns(robots, "a Parquet file")
    log = read_log(path)
    columns: list[int] = []
    for robot, name in zip(robots, told.names(robots), strict=True):
        if name not in log.robots:
            raise BadInput(f"{path} has no rows for '{name}' ({robot}).{did_you_mean(name, log.robots)}")
        columns.append(log.robots.index(name))
    zero = (told.begins(robots) or {}).get(robots[0], Fraction(0))
    times = np.array([float(Fraction(time) - zero) for time in log.times.tolist()])
    return Recording(tuple(robots), times, log.position[:, columns], zero=float(zero), frame="mission")


def read_mcap(path: Path, robots: Sequence[str], told: RecordingOptions) -> Recording:
    """Read the poses of a log of ours.

    Args:
        path: The file.
        robots: Names in the mission.
        told: What is told of the recording; its clock is the flight's, 0 where it began.

    Raises:
        BadInput: It is no such file, is damaged, or lacks a robot.
        MissingEngine: mcap is not installed.
    """
    source = str(path)
    told.no_columns(robots, "an MCAP file")
    require_small(path)
    try:
        from mcap.exceptions import McapError
        from mcap.reader import make_reader
    except ImportError:
        raise MissingEngine("MCAP needs mcap: pip install 'ltlplan[mcap]'.") from None
    topics = {f"/{name}/pose": robot for robot, name in zip(robots, told.names(robots), strict=True)}
    counts: dict[str, list[int]] = {robot: [] for robot in robots}
    places: dict[str, list[list[float]]] = {robot: [] for robot in robots}
    ends = (1 << 64, 0)
    try:
        with path.open("rb") as stream:
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
                ends = min(ends[0], message.log_time), max(ends[1], message.log_time)
                if channel.topic not in topics:
                    continue
                position = parse_json(message.data, source)["pose"]["position"]
                counts[topics[channel.topic]].append(message.log_time)
                places[topics[channel.topic]].append([float(position[axis]) for axis in "xyz"])
    except (McapError, KeyError, TypeError, ValueError, OSError) as error:
        raise BadInput(f"{source} is no log of ours that can be read: {str(error)[:160] or type(error).__name__}.") from None
    for robot, found in counts.items():
        if not found:
            raise BadInput(f"{source} holds no pose of {robot} (/{told.rename.get(robot, robot)}/pose).")
    started = told if told.start is not None else replace(told, start=0)
    seen: dict[str, Seen] = {}
    for robot in robots:
        at = np.array(places[robot])
        off = _ROUNDED if np.array_equal(at, np.round(at, 4)) else 0.0
        seen[robot] = Seen(counts[robot], -9, at, (5e-10, off), ends)
    return replace(on_one_clock(seen, started, source, shared=True), frame="mission")
