"""A job of a service, from afar: wait for it, follow it, take away what it made."""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.service.client_parts.transport import Wire, job_of, segment, unpacked
from ltlplan.service.models import ENDED, ONLY_OF_JOBS, Event, FileEntry, Job, State
from ltlplan.service.problems import NotFound, Unreachable, error_of
from verify.data import BadInput, Plan, parse_mission
from verify.data.plan import plan_from_json
from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from ltlplan.result import Result

_TRIES = 5
"""How often a stream of events that broke is taken up again before it is given up."""
_PAUSE = 1.0
"""s before that."""


class Submitted:
    """A job of a service.

    Attributes:
        wire: Its service's connection.
        id: Names it.
    """

    def __init__(self, wire: Wire, job: Job) -> None:
        """Hold what was told of a job; nothing is asked yet.

        Args:
            wire: Its service's connection.
            job: As it was last told.
        """
        self.wire, self.id, self._job = wire, job.id, job

    def __repr__(self) -> str:
        return f"Submitted({self.id!r}, {self._job.state!r} when last asked)"

    @property
    def job(self) -> Job:
        """The job as it is now: the service is asked each time, until the job has ended.

        Raises:
            LtlplanError: What the service refused, or that it does not answer.
        """
        if self._job.state not in ENDED:
            self._job = job_of(self.wire.ask("GET", f"/api/jobs/{segment(self.id)}").content)
        return self._job

    @property
    def state(self) -> State:
        """Its present state; as `job`."""
        return self.job.state

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """Files that it has made by now; as `job`."""
        return self.job.files

    def refreshed(self) -> Submitted:
        """Return the same job after asking the service, even where it had ended."""
        return Submitted(self.wire, job_of(self.wire.ask("GET", f"/api/jobs/{segment(self.id)}").content))

    def events(self, *, after: int = 0) -> Generator[Event]:
        """Yield what happens to it, what happened already first, until it has ended. A stream that breaks is taken up again.

        Args:
            after: Only events with a greater id.

        Raises:
            LtlplanError: What the service refused, or that it went away.
        """
        left = _TRIES
        while True:
            try:
                for event in self.wire.events(self.id, after):
                    after, left = event.id, _TRIES
                    yield event
            except (ConnectionError, Unreachable) as error:
                left -= 1
                if left == 0:
                    raise Unreachable(f"{self.wire.url} went away: {error}") from None
                time.sleep(_PAUSE)
                continue
            try:
                if self.state in ENDED:
                    return
            except Unreachable:  # it is being started again
                left -= 1
                if left == 0:
                    raise
            time.sleep(_PAUSE / 10)

    def wait(self, *, progress: Progress | None = None, timeout: float | None = None) -> Submitted:
        """Wait until it has ended, and return it.

        Args:
            progress: Receives a sentence and the share done, 0 to 1.
            timeout: s after which to give up waiting; the job goes on.

        Raises:
            LtlplanError: What it failed of: the library's own error.
            BadInput: It was cancelled.
            TimeoutError: It has not ended in time.
        """
        self._wait(progress or silent, timeout)
        ended = self.job
        if ended.problem is not None:
            raise error_of(ended.problem)
        if ended.state == "cancelled":
            raise BadInput(f"Job {self.id} was cancelled.")
        return self

    def _wait(self, say: Progress, timeout: float | None) -> None:
        end = None if timeout is None else time.monotonic() + timeout
        if self._job.state in ENDED:
            return
        for event in self.events():
            if event.sentence:
                say(event.sentence, event.share)
            if end is not None and time.monotonic() > end:
                raise TimeoutError(f"Job {self.id} has not ended within {timeout:g} s; it goes on.")

    def plan(self, *, progress: Progress | None = None) -> Plan:
        """Return its plan as soon as there is one.

        Args:
            progress: Receives a sentence and the share done, 0 to 1.

        Raises:
            LtlplanError: Why there is no plan.
        """
        say = progress or silent
        with closing(self.events()) as events:
            for event in events:
                if event.sentence:
                    say(event.sentence, event.share)
                if event.kind == "stage" and event.stage == "plan" and event.data.get("state") == "done":
                    break
        planned = any(stage.name == "plan" and stage.state == "done" for stage in self.job.stages)
        if not planned:
            self.wait()
        told = self.wire.ask("GET", f"/api/jobs/{segment(self.id)}/plan").json()
        mission = parse_mission(told["mission"], "mission.yaml", installed=False)
        return plan_from_json(json.dumps(told["plan"]), mission)

    def mission(self) -> str:
        """Return its mission, resolved, as YAML: however far it came, to be changed and submitted."""
        return self.wire.ask("GET", f"/api/jobs/{segment(self.id)}/mission").text

    def file(self, name: str) -> bytes:
        """Return one of its files, of `files`.

        Raises:
            NotFound: It has no such file.
        """
        if any(part in ("", ".", "..") for part in name.split("/")):
            raise NotFound(f"'{name[:80]}' names no file of a job; `files` lists them.")
        path = "/".join(segment(part) for part in name.split("/"))
        return self.wire.ask("GET", f"/api/jobs/{segment(self.id)}/files/{path}").content

    def download(self, out: str | os.PathLike[str]) -> Path:
        """Write all its files into a folder, whole or not at all; `ltlplan recheck` proves it again.

        Args:
            out: The folder; what is yours in it stays, as for `ltlplan.run`.

        Raises:
            BadInput: It has no files, or the folder cannot be written.
        """
        return self._download("archive", out)

    def download_proof(self, out: str | os.PathLike[str]) -> Path:
        """Write its proof into a folder: statement.json, proof.json, the trajectories, and check.pyz, which checks it by itself.

        Args:
            out: The folder; what is yours in it stays, as for `ltlplan.run`.

        Raises:
            NotFound: It has no proof.
            BadInput: It has no files, or the folder cannot be written.
        """
        return self._download("proof", out)

    def _download(self, route: str, out: str | os.PathLike[str]) -> Path:
        from flight.storage.folders import check_folder, put_files, write_folder

        packed = self.wire.ask("GET", f"/api/jobs/{segment(self.id)}/{route}").content
        files = {name: data for name, data in unpacked(packed).items() if name not in ONLY_OF_JOBS}
        target = check_folder(out, tuple(files))
        write_folder(target, lambda folder: put_files(files, folder))
        return Path(out)

    def result(self, out: str | os.PathLike[str] | None = None, *, progress: Progress | None = None) -> Result:
        """Wait for it, and return what it made, proved again here, as `ltlplan.run` does.

        Args:
            out: Folder to write.
            progress: Receives a sentence and the share done, 0 to 1.

        Raises:
            LtlplanError: What it failed of, or that its files do not prove what they should.
        """
        ended = self.wait(progress=progress)
        if out is not None:
            return _result(ended, ended.download(out), kept=True)
        with tempfile.TemporaryDirectory() as scratch:
            return _result(ended, ended.download(Path(scratch) / "run"), kept=False)


def _result(ended: Submitted, folder: Path, *, kept: bool) -> Result:
    """Return what a folder holds, proved again."""
    from flight import read_log
    from ltlplan.result import Result
    from verify.run_folder import proved_run

    run = proved_run(folder)
    rounds = sum(stage.name.startswith("round") for stage in ended.job.stages)
    made = Result(
        run.plan.mission, run.plan, run.team, run.certificate, read_log(folder / "flight.csv"), rounds, proof=run.proof
    )
    return replace(made, files=tuple(sorted(path for path in folder.rglob("*") if path.is_file()))) if kept else made
