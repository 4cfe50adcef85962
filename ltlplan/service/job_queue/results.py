"""Requests and results of jobs: bytes in the store, and in memory what was read last."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ltlplan.service.execution.derived import Derived, derived_bytes
from ltlplan.service.execution.stages import PLAN, Outcome, mission_bytes, mission_of, plan_of
from ltlplan.service.job_queue.engine import Data
from ltlplan.service.job_queue.job_records import Entry, a_kind, digests, told_of
from ltlplan.service.job_queue.lru_cache import Recent
from ltlplan.service.job_queue.store import NoRoom, Store
from ltlplan.service.models import FileEntry, Job
from ltlplan.service.problems import Conflict, NotFound
from ltlplan.service.storage.deletion_pause import deleting
from verify.data import Mission, mission_to_yaml

RESERVE = 32_000_000
"""Bytes that stay free on the disk: with less nothing new is accepted, and what runs waits before it writes."""
FOUND_BYTES = 16_000_000
"""Bytes of JSON that stages found, as text, which are kept in memory."""

_MEDIA = {
    ".csv": "text/csv; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".json": "application/json",
    ".yaml": "application/yaml",
    ".md": "text/markdown; charset=utf-8",
    ".py": "text/x-python; charset=utf-8",
    ".zip": "application/zip",
}

_log = logging.getLogger("ltlplan.service")


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file of a job, on disk.

    Attributes:
        path: Where; named by its digest.
        media_type: What kind of content it is.
        sha256: Digest of its bytes, in hexadecimal.
        size: Bytes.
    """

    path: Path
    media_type: str
    sha256: str
    size: int


class Results:
    """Requests and results of jobs. May be used from any thread; what reads or writes waits for the disk.

    Attributes:
        store: Where it is kept.
    """

    def __init__(self, data: Path) -> None:
        """Open nothing yet.

        Args:
            data: The service's data folder.
        """
        self.store = Store(data / "values")
        self._data = data
        self._found: Recent[Data] = Recent(FOUND_BYTES)
        self._keeping = threading.Lock()
        self._leaving: set[str] = set()

    def require_room(self, least: float = RESERVE) -> None:
        """Reject to go on where the disk is full.

        Args:
            least: Bytes that must be free.

        Raises:
            NoRoom: They are not.
        """
        if self.store.free() < least:
            raise NoRoom(f"There is less than {least / 1e6:.0f} MB of room in {self._data}; make room there.")

    def ask(self, mission: Mission) -> str:
        """Keep a mission, and return its digest."""
        return self.store.put(mission_bytes(mission))

    def ask_derived(self, entry: Entry, asked: Derived) -> str:
        """Keep a request about a job's flight, and return its digest."""
        return self.store.put(derived_bytes(asked, {file.name: self.store.get(file.sha256) for file in entry.job.files}))

    def keep(self, entry: Entry, stage: str, outcome: Outcome) -> Data:
        """Keep what a stage made, and return its record.

        Args:
            entry: The job's.
            stage: Its name.
            outcome: What it made.

        Raises:
            NoRoom: The disk is full.
        """
        self.require_room(RESERVE / 2)

        def put(data: bytes) -> str:
            with self._keeping:  # what another job that is being deleted has too stays
                entry.kept.add(digest := self.store.put(data))
            return digest

        record: Data = {
            "stage": stage,
            "following": outcome.following,
            "value": put(outcome.value),
            "found": put(json.dumps(outcome.found).encode()),
            "files": [
                FileEntry(name=file, size=len(data), media_type=_media_type(file), sha256=put(data)).model_dump()
                for file, data in outcome.files
            ],
        }
        if outcome.stopped:
            record["stopped"] = True
        if outcome.summary is not None:
            record["summary"] = put(json.dumps(outcome.summary).encode())
        if outcome.problem is not None:
            record["problem"] = outcome.problem.model_dump(mode="json")
        return record

    def drop(self, entry: Entry, others: Iterable[Entry]) -> None:
        """Remove what a job has in the store and no other has; while a backup is made, that waits."""
        self._leaving |= digests(entry)
        self.drop_leaving(others)

    def drop_leaving(self, others: Iterable[Entry]) -> None:
        """Remove what deleted jobs had in the store and no other has, unless a backup is made at the moment."""
        if not self._leaving:
            return
        with self._keeping, deleting(self._data) as may:
            if may:
                for digest in self._leaving - {digest for other in others for digest in digests(other)}:
                    self.store.drop(digest)
                self._leaving.clear()

    def collect(self, entries: Iterable[Entry]) -> None:
        """Remove values that no job has: a kill came before they were in a record, or before they were removed with their job."""
        try:
            with deleting(self._data) as may:  # else at the next start
                orphans = self.store.keep_only({digest for entry in entries for digest in digests(entry)}) if may else 0
        except OSError as error:  # they are tried again at the next start
            _log.warning("values that no job has cannot be removed: %s", error)
        else:
            _log.info("%d values are removed that no job has", orphans)

    def at_hand(self, entry: Entry) -> bool:
        """Return whether all that is told of a job is in memory, so that telling it waits for no disk."""
        return all(digest in self._found for digest in told_of(entry))

    def whole(self, entry: Entry) -> Job:
        """Return a job with what its stages found."""
        found = {record["stage"]: record["found"] for record in list(entry.records) if "found" in record}
        stages = tuple(
            stage.model_copy(update={"found": self.json(found[stage.name])}) if stage.name in found else stage
            for stage in entry.job.stages
        )
        last = entry.records[-1] if entry.records else {}
        summary = self.json(last["summary"]) if last.get("summary") else None
        return entry.job.model_copy(update={"stages": stages, "summary": summary})

    def json(self, digest: str) -> Data:
        """Return a value that is JSON; not to be changed."""
        known = self._found.get(digest)
        if known is None:
            data = self.store.get(digest)
            known = self._found.put(digest, json.loads(data), len(data))
        return known

    def mission(self, entry: Entry) -> str:
        """Return a job's resolved mission as YAML.

        Raises:
            Conflict: It is what is made of a flight.
        """
        if entry.job.of is not None:
            raise Conflict(f"Job {entry.job.id} is {a_kind(entry.job)}; the mission is that of job {entry.job.of}.")
        return mission_to_yaml(mission_of(self.store.get(entry.asked["mission"])))

    def plan(self, entry: Entry) -> tuple[str, str] | None:
        """Return a job's mission.yaml and plan.json; None before it is planned."""
        planned = next((record for record in list(entry.records) if record["stage"] == PLAN and "value" in record), None)
        if planned is None:
            return None
        plan = plan_of(self.store.get(planned["value"]))
        return mission_to_yaml(plan.mission), plan.to_json()

    def file(self, entry: Entry, name: str) -> StoredFile:
        """Return a file of a job, by its name in the job's own table, after a look at its bytes.

        Raises:
            NotFound: It has no such file.
            Damaged: Its bytes are not those that were kept.
        """
        for file in entry.job.files:
            if file.name == name:
                return StoredFile(self.store.require(file.sha256), file.media_type, file.sha256, file.size)
        have = ", ".join(file.name for file in entry.job.files) or "none yet"
        raise NotFound(f"Job {entry.job.id} has no file '{name[:80]}'; it has {have}.")


def _media_type(name: str) -> str:
    return _MEDIA.get(Path(name).suffix, "application/octet-stream")
