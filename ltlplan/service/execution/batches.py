"""Folders of missions: each is run as `ltlplan run` does, into a folder of its own; one that fails does not stop the others.

A mission's folder has what `ltlplan run` writes, and `batch.json`, which says for what it was found: the same mission, seed and versions
are not run again while all that was written is as it was left.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flight.certificate_checks import require_tube
from flight.processes import Workers
from flight.storage.folders import check_folder, put_files, write_folder
from flight.storage.ownership import read_contents
from ltlplan.output import run_files
from ltlplan.planner import checked_pace, with_pace, with_seed
from ltlplan.service.execution.clusters import ClusterError
from ltlplan.service.execution.stages import PLAN, Outcome, mission_bytes, run_stage
from ltlplan.service.models import ONLY_OF_JOBS
from ltlplan.service.problems import error_of
from ltlplan.service.provenance import key_of, software
from verify.data import BadInput, InternalError, LtlplanError, Mission, load_mission_file
from verify.data.files.mission_rooms import MAX_BYTES, included_files
from verify.data.progress import Progress, silent
from verify.data.storage.file_names import folded
from verify.data.storage.safe_reading import read_text

RECORD = "batch.json"


@dataclass(frozen=True, slots=True)
class Entry:
    """Outcome of one mission of a folder.

    Attributes:
        name: Of its file and of its folder.
        exit_code: What `ltlplan run` would have ended with.
        sentence: Why, where that is not 0.
        folder: What was written; None where nothing was.
        cost: Of the plan; None where there is none.
        seconds: How long it took, s.
        found: Whether it had been done before, and was not run again.
        checked: How many claims the kernel checked, of how many, such as "49 of 49"; empty where that is not known.
    """

    name: str
    exit_code: int
    sentence: str = ""
    folder: Path | None = None
    cost: float | None = None
    seconds: float = 0.0
    found: bool = False
    checked: str = ""


@dataclass(slots=True)
class _Running:
    """A mission on its way, and the stage that it is at."""

    name: str
    mission: Mission
    target: Path
    key: str
    began: float = 0.0
    told: tuple[str, float] = field(default=("", 0.0))

    def note(self, sentence: str, share: float) -> None:
        self.told = (sentence, share)


def run_batch(
    folder: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    workers: Workers,
    seed: int | None = None,
    pace: float | str | None = None,
    progress: Progress | None = None,
) -> tuple[Entry, ...]:
    """Run every mission file of a folder and write each one's folder, whole or not at all.

    Args:
        folder: Where the mission files are: all `*.yaml` and `*.yml` in it but the rooms that others of them include.
        out: Where each mission gets a folder of its file's name.
        workers: Who does the work, a stage of a mission at a time.
        seed: Source of every draw, instead of the missions' own.
        pace: Instead of the missions' `planner.pace`.
        progress: Receives a sentence and the share done, 0 to 1.

    Returns:
        What became of each, sorted by name.

    Raises:
        BadInput: There is no such folder, it has no mission files, or two of them would have one folder; or the pace is none.
        ClusterError: The cluster that did the work has gone; what was done by then is kept.
    """
    entries: dict[str, Entry] = {}
    todo: list[_Running] = []
    files = _mission_files(Path(folder))
    pace = None if pace is None else checked_pace(pace)
    for name, file in files.items():
        try:
            begun = _prepared(name, file, Path(out) / name, seed, pace)
        except LtlplanError as error:
            begun = Entry(name, error.exit_code, str(error))
        if isinstance(begun, Entry):
            entries[name] = begun
        else:
            todo.append(begun)
    for entry in _each(todo, workers, progress or silent, len(files)):
        entries[entry.name] = entry
    return tuple(entries[name] for name in files)


def exit_code(entries: Iterable[Entry]) -> int:
    """Return what a command ends with: 0, or the code of the first mission that failed."""
    return next((entry.exit_code for entry in entries if entry.exit_code), 0)


def _mission_files(folder: Path) -> dict[str, Path]:
    """Return the mission files of a folder by the names of their folders, sorted."""
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name one with mission files, or run a single mission with `ltlplan run`.")
    files = sorted(path for path in folder.glob("[!.]*.y*ml") if path.suffix in (".yaml", ".yml") and path.is_file())
    if not files:
        raise BadInput(
            f"{folder} has no mission files (*.yaml, *.yml); start one with `ltlplan missions --new {folder}/mission.yaml`."
        )
    rooms = {os.path.realpath(room) for file in files for room in _rooms_of(file)}
    if not (missions := [path for path in files if os.path.realpath(path) not in rooms]):
        raise BadInput(f"{folder} has no mission files: all of its files are included by each other.")
    named: dict[str, Path] = {}
    for path in missions:
        alike = named.setdefault(folded(path.stem), path)
        if alike != path:
            raise BadInput(f"{alike.name} and {path.name} would have the same folder; rename one of them.")
    return {path.stem: path for path in missions}


def _rooms_of(file: Path) -> tuple[Path, ...]:
    """Return the files that one includes; none where it cannot be read, which is said when it is run."""
    try:
        return included_files(read_text(file, most=MAX_BYTES, what="mission file"), file)
    except BadInput:
        return ()


def _prepared(name: str, file: Path, target: Path, seed: int | None, pace: float | str | None) -> _Running | Entry:
    """Return a mission that is to be run, or what became of it before."""
    mission = with_pace(with_seed(load_mission_file(file), seed), pace)
    require_tube(mission.margin)
    key = key_of(mission)
    before = _done_before(name, target, key)
    if before is not None:
        return before
    return _Running(name, mission, check_folder(target, (*run_files(mission), RECORD)), key)


def _done_before(name: str, target: Path, key: str) -> Entry | None:
    """Return what became of a mission before, where all that was written then is as it was left."""
    try:
        contents = read_contents(target)
        if RECORD not in (contents.listed or ()) or not contents.ours.issuperset(contents.listed or ()):
            return None
        record = json.loads((target / RECORD).read_text(encoding="utf-8"))
    except (OSError, BadInput):
        return None
    return _entry(name, target, record, found=True) if record["key"] == key else None


def _entry(name: str, target: Path, record: dict[str, Any], *, seconds: float = 0.0, found: bool = False) -> Entry:
    checked = record.get("checked", "")  # records of before have none
    return Entry(name, record["exit_code"], record["message"], target, record["cost"], seconds, found, checked)


def _each(todo: list[_Running], workers: Workers, progress: Progress, of: int) -> Iterable[Entry]:
    """Run missions, as many at a time as there are workers, and yield what became of each as it ends."""
    following, ended = iter(todo), of - len(todo)
    at_work: dict[Future[Outcome], _Running] = {}

    def submit(running: _Running, stage: str, value: bytes) -> None:
        at_work[workers.submit(run_stage, stage, value, progress=running.note)] = running

    try:
        while True:
            while len(at_work) < workers.count and (running := next(following, None)) is not None:
                running.began = time.monotonic()
                submit(running, PLAN, mission_bytes(running.mission))
            if not at_work:
                return
            done, _ = wait(at_work, timeout=0.2, return_when=FIRST_COMPLETED)
            for future in sorted(done, key=_is_gone):  # what has been found is written before anything is raised
                running = at_work.pop(future)
                outcome = _outcome(running, future)
                if isinstance(outcome, Outcome):
                    assert outcome.following is not None
                    submit(running, outcome.following, outcome.value)
                else:
                    ended += 1
                    yield outcome
            latest = max(at_work.values(), key=lambda running: running.began, default=None)
            if latest is not None:
                share = (ended + sum(running.told[1] for running in at_work.values())) / of
                progress(f"{latest.name}: {latest.told[0] or 'planning'}", share)
    finally:
        for future in at_work:
            future.cancel()


def _is_gone(future: Future[Outcome]) -> bool:
    """Return whether the cluster went away, rather than that a mission failed."""
    return not future.cancelled() and isinstance(future.exception(), ClusterError)


def _outcome(running: _Running, future: Future[Outcome]) -> Outcome | Entry:
    """Return what a stage made, or what became of its mission: after the last stage its folder is written."""
    try:
        outcome = future.result()
        if outcome.following is not None:
            return outcome
        why = outcome.problem
        if outcome.summary is None:
            raise InternalError("The last stage made no files.") if why is None else error_of(why)
        record = {
            "format": 1,
            "key": running.key,
            "software": software(),
            "cost": outcome.summary["cost"],
            "exit_code": 0 if why is None else why.exit_code,
            "message": "" if why is None else why.detail,
            "checked": "{checked} of {claims}".format(**outcome.found["proof"]),
        }
        made = {name: content for name, content in outcome.files if name not in ONLY_OF_JOBS}
        write_folder(
            running.target, lambda folder: put_files({**made, RECORD: (json.dumps(record, indent=1) + "\n").encode()}, folder)
        )
        return _entry(running.name, running.target, record, seconds=time.monotonic() - running.began)
    except ClusterError:
        raise
    except LtlplanError as error:
        return Entry(running.name, error.exit_code, str(error), seconds=time.monotonic() - running.began)
