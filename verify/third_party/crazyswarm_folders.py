"""Folders of trajectories as crazyswarm2 and uav_trajectories have them: one CSV file a robot, named by the robot.

Numbers are the float32 that the vehicle stores, read by the same reader as our own exports. Positions are absolute and all robots start at once, at 0 s: a
start that is `relative`, which crazyswarm2 takes unless told otherwise, moves the paths, and nothing that is said here is true of it then.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import accumulate
from pathlib import Path

import numpy as np

from verify.data.errors import BadInput
from verify.data.files.trajectory_csv import MAX_BYTES, read_csv
from verify.data.storage.safe_reading import read_text
from verify.data.trajectory import Trajectory
from verify.third_party.fleet import Fleet, Flight, assemble, two_floats

_OF_A_RUN = ("mission.yaml", "plan.json", "certificate.json")
"""Files that tell a run's folder from one of trajectories alone: more than trajectories is in it, and more than they can be checked."""


def csv_files(folder: Path) -> list[Path]:
    """Return the CSV files of a folder, by name.

    Raises:
        BadInput: There is none, or the folder is a run's, of which more can be checked.
    """
    try:
        found = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".csv")
    except OSError as error:
        raise BadInput(f"{folder} cannot be read: {error.strerror or error}.") from None
    if not found:
        raise BadInput(f"{folder} holds no .csv file; a folder of trajectories has one for each robot, named ROBOT.csv.")
    if all((folder / name).is_file() for name in _OF_A_RUN):
        inside = folder / "crazyswarm2"
        beside = f", or audit the trajectories that it exports, in {inside}" if inside.is_dir() else ""
        raise BadInput(
            f"{folder} is a folder that `ltlplan run` wrote, with its mission and its own certificate: `ltlplan recheck {folder}` checks it"
            f"{beside}."
        )
    return found


def read_csv_files(files: Sequence[Path], source: str) -> Fleet:
    """Read one trajectory a file.

    Args:
        files: One for each robot, named by it.
        source: Names them all in messages.

    Raises:
        BadInput: A file is no trajectory, or the flights are not allowed together.
    """
    return assemble(source, "power", [flight_of(path.stem, _trajectory(path)) for path in files])


def flight_of(name: str, trajectory: Trajectory) -> Flight:
    """Return a trajectory as a flight to audit.

    Args:
        name: Of the robot.
        trajectory: Without a cycle.

    Raises:
        BadInput: Its durations are too unlike to be added.
    """
    knots = list(accumulate(map(Fraction, trajectory.durations.tolist()), initial=Fraction(0)))
    return Flight(
        name=name, knots=two_floats(knots, name), values=trajectory.coefficients[:, :3],
        degrees=np.full(len(trajectory), trajectory.coefficients.shape[-1] - 1, dtype=np.int8), durations=trajectory.durations,
    )  # fmt: skip


def _trajectory(path: Path) -> Trajectory:
    """Read one file; header names in capitals and a comma at a line's end, as some writers have them, say the same."""
    text = read_text(path, most=MAX_BYTES, what="trajectory")
    lines = [line.rstrip().removesuffix(",") for line in text.splitlines()]
    if lines:
        lines[0] = lines[0].lower()
    return read_csv("\n".join(lines), str(path))
