"""Files of parts that lie beside a run, compared with the flight that was certified: what is uploaded must be it, piece by piece."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from verify.data.errors import NotCertified
from verify.data.files.trajectory_csv import load_csv
from verify.data.trajectory import Trajectory
from verify.motion.continuity import JUMPS

PARTS_FOLDER = "crazyswarm2"
"""Where a run writes what crazyswarm2 uploads."""


def require_parts(folder: Path, team: Mapping[str, Trajectory]) -> None:
    """Reject files of parts in a run's folder that are not those of its certified flight; no such files are none to refuse.

    Args:
        folder: The run's.
        team: What was certified.

    Raises:
        NotCertified: A part is missing beside others, or holds something else.
        BadInput: A file cannot be read.
    """
    place = folder / PARTS_FOLDER
    for name, path in team.items():
        files = [place / f"{name}-part{number + 1}.csv" for number in range(len(path.parts))] if path.cuts else []
        if not any(file.exists() for file in files):
            continue
        for file, (begin, end) in zip(files, path.parts, strict=True):
            if not file.exists():
                raise NotCertified(f"{file} is missing, and the other parts of {name}'s flight are there.")
            if not _is_part(load_csv(file), path.part(begin, end)):
                raise NotCertified(f"{file} was changed: it is not this part of the flight that was certified.")


def _is_part(found: Trajectory, part: Trajectory) -> bool:
    """Return whether a file holds a part; one of a single piece may be followed by a hover where it ends, which is a pause."""
    if found == part:
        return True
    if len(part) > 1 or len(found) != 2 or found.part(0, 1) != part:
        return False
    off = found.coefficients[1, :, 0] - part.evaluate(part.duration)
    return not found.coefficients[1, :, 1:].any() and float(np.abs(off).max()) <= JUMPS[0] / 2
