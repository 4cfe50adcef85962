"""State of each job: made from the database's records, changed while the job goes on, sent as events.

The functions make one value from another; `Entry` is what all jobs are in memory, without what their stages found.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from ltlplan.service.execution.derived import Derived
from ltlplan.service.execution.stages import share_after, share_before
from ltlplan.service.execution.workers import WorkFuture
from ltlplan.service.job_queue.engine import Data, Record
from ltlplan.service.job_queue.events import Feed, claim_events, stage_event, state_event
from ltlplan.service.models import ENDED, Event, FileEntry, Job, Problem, Stage
from ltlplan.service.problems import problem_of
from ltlplan.service.times import utc_now
from verify.data import InternalError, Mission

TITLE = 120
"""The most letters of a title."""


@dataclass(slots=True)
class Entry:
    """Present state of a job. Requests, the engine and workers change it, each in a thread of its own.

    Attributes:
        job: As it is told, without what its stages found.
        asked: What its workflow was begun with.
        records: Of the stages that are done.
        feed: Its events, while it has not ended.
        work: The stage that is being computed.
        cancelled: Whether it is being cancelled.
        stopping: Whether its search was asked to end with the best plan so far.
        damaged: Whether something was found damaged that it made.
        rank: Of its work among all jobs'; the lowest is begun first.
        kept: Digests of what its stages made, before that is in their records.
        lock: Held while the job is changed.
    """

    job: Job
    asked: Data
    records: list[Data] = field(default_factory=list)
    feed: Feed = field(default_factory=Feed)
    work: WorkFuture | None = None
    cancelled: bool = False
    stopping: bool = False
    damaged: bool = False
    rank: float = 0.0
    kept: set[str] = field(default_factory=set)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def change(self, **changes: Any) -> bool:  # of any type: a job's fields
        """Change the job, unless it has ended; return whether it had not."""
        with self.lock:
            if self.job.state in ENDED:
                return False
            self.job = self.job.model_copy(update=changes)
            return True


def entry_of(record: Record) -> Entry:
    """Return what the database knows of a job."""
    result = record.result or {}
    records = list(result.get("stages", record.steps))
    job = with_records(job_of(record.id, record.asked), records)
    ended = datetime.fromtimestamp(record.changed, UTC).isoformat(timespec="milliseconds")
    if record.state == "cancelled":
        job = job.model_copy(update={"state": "cancelled", "ended": ended})
    elif record.state == "broken":
        told = problem_of(InternalError("The database has an error in the place of this job's result; submit it again."))
        job = job.model_copy(update={"state": "failed", "ended": ended, "problem": told})
    elif record.state == "ended":
        problem = result.get("problem")
        told = None if problem is None else Problem.model_validate(problem)
        share = 1.0 if result["state"] == "done" else job.share
        job = job.model_copy(update={"state": result["state"], "ended": result["ended"], "problem": told, "share": share})
    elif records:
        job = job.model_copy(update={"state": "running"})
    entry = Entry(job, record.asked, records)
    if job.state in ENDED:
        entry.feed.close()
    else:
        entry.feed.tell(state_event(job.model_copy(update={"state": "queued"})))
    return entry


def record_of(mission: Mission, value: str, key: str, who: str, lane: str = "") -> Data:
    """Return what a job's workflow is begun with, now: of plain data, as the database keeps it.

    Args:
        mission: What is asked.
        value: Its digest in the store.
        key: What the same mission, seed and versions have in common.
        who: Who asks.
        lane: "study" where a study submits it; empty otherwise.
    """
    return {
        "mission": value,
        "name": mission.name,
        "title": _title(mission),
        "seed": mission.planner.seed,
        "key": key,
        "submitted": utc_now(),
        "who": who,
        **({"lane": lane} if lane else {}),
    }


def derived_record(flown: Job, asked: Derived, value: str, key: str, who: str) -> Data:
    """Return what the workflow of what is made of a flight is begun with, now.

    Args:
        flown: The flight's job.
        asked: What is made of it.
        value: Digest in the store of what is asked.
        key: What the same request about the same files by the same versions has in common.
        who: Who asks.
    """
    record = {"mission": value, "name": flown.mission, "title": asked.title[:TITLE], "seed": flown.seed}
    return {**record, "key": key, "submitted": utc_now(), "who": who, "of": flown.id, "kind": asked.kind}


def a_kind(job: Job) -> str:
    """Return the kind of a job with its article."""
    return f"an {job.kind}" if job.kind == "export" else f"a {job.kind}"


def _title(mission: Mission) -> str:
    text = mission.sequence or mission.spec.formula or ""
    return text if len(text) <= TITLE else text[: TITLE - 1] + "…"


def job_of(job_id: str, asked: Data) -> Job:
    """Return a job that was just accepted.

    Args:
        job_id: Its id.
        asked: What it was begun with.
    """
    return Job(
        id=job_id, kind=asked.get("kind", "export" if asked.get("of") else "mission"), mission=asked["name"], title=asked["title"], of=asked.get("of"), seed=asked["seed"],
        submitted=asked["submitted"], key=asked["key"],
    )  # fmt: skip


def with_records(job: Job, records: list[Data]) -> Job:
    """Return a job with the stages that are done.

    Args:
        job: As it was accepted, or is.
        records: Of those stages.
    """
    if not records:
        return job
    stages = tuple(
        Stage(
            name=record["stage"],
            state="failed" if "problem" in record else "done",
            started=record["started"],
            ended=record["ended"],
        )
        for record in records
    )
    files = [FileEntry.model_validate(file) for record in records for file in record.get("files", ())]
    done = next((share_after(record["stage"]) for record in reversed(records) if "problem" not in record), 0.0)
    stopped = any(record.get("stopped", False) for record in records)
    started = job.started or records[0]["started"]
    return job.model_copy(
        update={"stages": stages, "files": tuple(files), "started": started, "share": done, "stopped": stopped}
    )


def told_again(job: Job, *, ended: bool) -> list[Event]:
    """Return the events that can be told from what is kept of a job.

    Args:
        job: With what its stages found.
        ended: Whether the one that says how it ended is among them.
    """
    events = [state_event(job.model_copy(update={"state": "queued", "share": 0.0}))]
    if job.started is not None:
        events.append(state_event(job.model_copy(update={"state": "running", "share": 0.0})))
    for number, stage in enumerate(job.stages, 1):
        then = job.model_copy(update={"share": share_before(stage.name)})
        events.append(stage_event(then, stage.model_copy(update={"state": "running", "found": {}}), number))
        if stage.state in ENDED:
            if stage.state == "done":
                then = job.model_copy(update={"share": share_after(stage.name)})
            events += claim_events(then, stage, number)
            events.append(stage_event(then, stage, number))
    return [*events, state_event(job)] if ended else events


def told_of(entry: Entry) -> list[str]:
    """Return the digests of what is told of a job: what its stages found, and its summary."""
    return [record[name] for record in list(entry.records) for name in ("found", "summary") if record.get(name)]


def digests(entry: Entry) -> set[str]:
    """Return the digests of all that a job has in the store."""
    found = {entry.asked["mission"], *entry.kept}
    for record in entry.records:
        found |= {record[name] for name in ("value", "found", "summary") if name in record}
        found |= {file["sha256"] for file in record.get("files", ())}
    return found
