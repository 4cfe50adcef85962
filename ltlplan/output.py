"""The folder that a run writes: whole or not at all.

Files are written into a folder beside the target and renamed into place at the end, so that a kill in the middle
leaves the target as it was. What a killed process left beside the target is cleared up by the next one that writes
there: each holds a lock on its own for as long as it lives.
"""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from verify.data import BadInput, Plan, Trajectory, mission_to_yaml
from verify.data.trajectory_csv import write_csv

try:
    import fcntl
except ImportError:  # not a Unix: nothing can tell a dead process's folder from a living one's, so none is cleared up
    fcntl = None

if TYPE_CHECKING:
    from ltlplan.pipeline import Result

_MARK = "mission.yaml"
_PROOF = "certificate.json"
_OURS = frozenset(
    {_MARK, _PROOF, "plan.json", "report.html", "summary.txt", "campaign.json", "campaign.html"}
    | {"crazyswarm2", "crazyflie", "crazyflie-compressed", "px4", "ros2"}
)
"""What a folder of ours may hold beside tables (`*.csv`); anything else in it is the user's and is kept."""


def check_target(out: str | Path, *, certified: bool = True) -> Path:
    """Return the folder to write, refusing one that holds somebody's other files.

    Args:
        out: The folder.
        certified: Whether a certificate will be among the new files; without one, a certified flight is not replaced.

    Raises:
        BadInput: The target is a file, lies below one, cannot be written or replaced, or holds files that no run of
            ours wrote.
    """
    target = Path(out)
    try:
        if target.exists() and not target.is_dir():
            raise BadInput(f"{target} is a file; name a folder to write.")
        if target.is_dir() and any(target.iterdir()) and not (target / _MARK).exists():
            raise BadInput(f"{target} is not empty and was not written by ltlplan; name another folder with --out.")
        if not certified and (target / _PROOF).exists():
            raise BadInput(f"{target} holds a certified flight, which would be lost; name another folder with --out.")
        place = target.resolve()
        if target.is_dir() and (place.samefile(Path.cwd()) or place.is_mount()):
            here = "the folder you are in" if place.samefile(Path.cwd()) else "a mount point"
            raise BadInput(f"{target} is {here} and cannot be replaced; name a folder inside it, such as {target / 'run'}.")
        nearest = next(folder for folder in place.parents if folder.exists())
    except OSError as error:
        raise BadInput(f"{target} cannot be used: {error.strerror or error}; name another folder with --out.") from None
    if not nearest.is_dir():
        raise BadInput(f"{nearest} is a file, so {target} cannot be a folder; name another folder with --out.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise BadInput(f"{nearest} cannot be written to; name another folder with --out.")
    return target


def write_folder(target: Path, write: Callable[[Path], None]) -> tuple[Path, ...]:
    """Let `write` fill a fresh folder, then put it in the target's place.

    Files of the user's own in the folder that is replaced are taken over into the new one.

    Returns:
        The files that were written, sorted by name, at their final places.

    Raises:
        BadInput: The target cannot be written, or holds a certified flight that the new files would not replace.
    """
    target = check_target(target)
    place = target.resolve()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        _clear_up(place)
        with _aside(place) as aside:
            fresh, old = aside / "new", aside / "old"
            fresh.mkdir()
            write(fresh)
            written = sorted(path.relative_to(fresh) for path in fresh.rglob("*") if path.is_file())
            check_target(target, certified=Path(_PROOF) in written)
            _take_over(place, fresh)
            try:
                if place.exists():
                    place.rename(old)
                fresh.rename(place)
            except BaseException:
                if old.exists() and not place.exists():
                    old.rename(place)
                raise
    except OSError as error:
        raise BadInput(f"{target} cannot be written: {error.strerror or error}; name another folder with --out.") from None
    return tuple(target / path for path in written)


@contextmanager
def _aside(place: Path) -> Iterator[Path]:
    """Yield a folder beside the target that is removed at the end, and locked while this process lives."""
    aside = Path(tempfile.mkdtemp(prefix=f".{place.name}.ltlplan-", dir=place.parent))
    try:
        with (aside / "lock").open("wb") as lock:
            _locked(lock)
            yield aside
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _clear_up(place: Path) -> None:
    """Remove what killed processes left beside the target; put back a folder that one of them had moved away."""
    if fcntl is None:
        return
    for left in sorted(place.parent.glob(f".{glob.escape(place.name)}.ltlplan-*")):
        try:
            with (left / "lock").open("rb") as lock:
                if not _locked(lock):
                    continue
                if (left / "old").exists() and not place.exists():
                    (left / "old").rename(place)
        except FileNotFoundError:
            continue  # made this moment by another process, which has not locked it yet, or removed by it
        shutil.rmtree(left, ignore_errors=True)


def _locked(lock: BinaryIO) -> bool:
    """Take a file's lock, which goes when its process ends, however it ends; tell whether it could be had."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another process has it, or the file system knows no locks
        return False
    return True


def _take_over(place: Path, fresh: Path) -> None:
    """Copy the user's own files and folders of an old folder into the new one."""
    for entry in place.iterdir() if place.is_dir() else ():
        if entry.name in _OURS or entry.suffix == ".csv" or (fresh / entry.name).exists():
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.copytree(entry, fresh / entry.name, symlinks=True)
        else:
            shutil.copy2(entry, fresh / entry.name, follow_symlinks=False)


def write_run(result: Result, target: Path) -> tuple[Path, ...]:
    """Write everything that a run makes.

    Files: `mission.yaml` (resolved), `plan.json`, `<robot>.csv`, `certificate.json`, `flight.csv`, `report.html`, and a
    folder `crazyswarm2` ready for that system.
    """
    import flight
    from ltlplan.report import report_html

    def write(folder: Path) -> None:
        write_plan_files(result.plan, folder)
        write_trajectories(result.plan, result.team, folder)
        flight.export(result.team, result.certificate, folder / "crazyswarm2", format="crazyswarm2")
        (folder / _PROOF).write_text(result.certificate.to_json(), encoding="utf-8")
        (folder / "flight.csv").write_text(result.log.to_csv(), encoding="utf-8")
        (folder / "report.html").write_text(report_html(result), encoding="utf-8")

    return write_folder(target, write)


def write_plan_files(plan: Plan, folder: Path) -> None:
    """Write `mission.yaml` and `plan.json`."""
    (folder / _MARK).write_text(mission_to_yaml(plan.mission), encoding="utf-8")
    (folder / "plan.json").write_text(plan.to_json(), encoding="utf-8")


def write_trajectories(plan: Plan, team: Mapping[str, Trajectory], folder: Path) -> None:
    """Write `<robot>.csv` for each robot; a cycle is written as often as the mission's `repeat` says."""
    for name, trajectory in team.items():
        text = write_csv(trajectory, plan.mission.spec.repeat)
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")


def replace_file(path: Path, text: str) -> None:
    """Write a file beside its place and rename it there, so that it is never half-written.

    Raises:
        BadInput: The file cannot be written.
    """
    aside = path.with_name(f".{path.name}.new")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    except OSError as error:
        with suppress(OSError):  # what could not be written may not be removable either
            aside.unlink()
        raise BadInput(f"{path} cannot be written: {error.strerror}.") from None
