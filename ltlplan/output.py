"""The folder that a run writes: whole or not at all.

Files are written into a folder beside the target and renamed into place at the end, so that a kill in the middle
leaves the target as it was.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from verify.data import BadInput, Plan, Trajectory, mission_to_yaml
from verify.data.trajectory_csv import write_csv

if TYPE_CHECKING:
    from ltlplan.pipeline import Result

_MARK = "mission.yaml"


def check_target(out: str | Path) -> Path:
    """Return the folder to write, refusing one that holds somebody's other files.

    Raises:
        BadInput: The target is a file, or a folder with files that no run of ours wrote.
    """
    target = Path(out)
    if target.is_file():
        raise BadInput(f"{target} is a file; name a folder to write.")
    if target.is_dir() and any(target.iterdir()) and not (target / _MARK).exists():
        raise BadInput(f"{target} is not empty and was not written by ltlplan; name another folder with --out.")
    parent = target.absolute().parent
    nearest = next(folder for folder in (parent, *parent.parents) if folder.exists())
    if not os.access(nearest, os.W_OK):
        raise BadInput(f"{nearest} cannot be written to; name another folder with --out.")
    return target


def write_folder(target: Path, write: Callable[[Path], None]) -> tuple[Path, ...]:
    """Let `write` fill a fresh folder, then put it in the target's place.

    Returns:
        The files, sorted by name, at their final places.
    """
    target = check_target(target)
    target.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    old: Path | None = None
    try:
        write(aside)
        aside.chmod(0o755)
        if target.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{target.name}-old-", dir=target.parent))
            target.rename(old / target.name)
        aside.rename(target)
    except BaseException:
        if old is not None and not target.exists():
            (old / target.name).rename(target)
        shutil.rmtree(aside, ignore_errors=True)
        raise
    finally:
        if old is not None:
            shutil.rmtree(old, ignore_errors=True)
    return tuple(sorted(path for path in target.rglob("*") if path.is_file()))


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
        (folder / "certificate.json").write_text(result.certificate.to_json(), encoding="utf-8")
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
    """Write a file beside its place and rename it there, so that it is never half-written."""
    aside = path.with_name(f".{path.name}.new")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise BadInput(f"{path} cannot be written: {error.strerror}.") from None
