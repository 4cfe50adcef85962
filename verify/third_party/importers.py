"""Files of other programs, each kind read by its own reader, as one fleet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from verify.data.errors import BadInput
from verify.third_party.crazyswarm_folders import csv_files, read_csv_files
from verify.third_party.fleet import Fleet
from verify.third_party.shows.skybrush_shows import read_show


def read_fleet(files: str | Path | Sequence[str | Path]) -> Fleet:
    """Read what others planned.

    Args:
        files: A folder of CSV files or CSV files, each of one robot, or one show file (`.skyc`).

    Raises:
        BadInput: There is nothing to read, kinds of files are mixed, or a file is at fault.
    """
    try:
        paths = [Path(files)] if isinstance(files, str | Path) else [Path(path) for path in files]
    except TypeError:
        raise BadInput(f"files must be a path or a list of paths, not {files!r:.60}.") from None
    if not paths:
        raise BadInput("There is nothing to audit; name a folder of CSV files, the files, or a show file (.skyc).")
    source = str(paths[0]) if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"
    if shows := [path for path in paths if path.suffix.lower() == ".skyc"]:
        if len(paths) > 1:
            raise BadInput(f"{shows[0]} is a show by itself; audit it alone.")
        return read_show(shows[0])
    csvs = [file for path in paths for file in (csv_files(path) if path.is_dir() else [path])]
    if missing := [path for path in csvs if not path.exists()]:
        raise BadInput(f"There is no file or folder '{missing[0]}'.")
    if odd := [path for path in csvs if path.suffix.lower() != ".csv"]:
        raise BadInput(
            f"{odd[0]} is no kind of file that can be audited; those are folders of CSV files, CSV files and shows (.skyc)."
        )
    return read_csv_files(csvs, source)
