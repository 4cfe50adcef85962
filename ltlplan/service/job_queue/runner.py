"""Run of a job in the engine's loop: its stages one after the other, each computed by a worker, stored, and announced."""

from __future__ import annotations

import asyncio
import itertools
import logging
from typing import Any, Protocol

from ltlplan.service.execution.stages import PLAN, Outcome, run_stage
from ltlplan.service.execution.turns import SharedPool
from ltlplan.service.execution.workers import WorkFuture
from ltlplan.service.job_queue.engine import Data, Step, Unwritten
from ltlplan.service.job_queue.events import claim_events, stage_event, state_event
from ltlplan.service.job_queue.job_records import Entry, with_records
from ltlplan.service.job_queue.results import Results
from ltlplan.service.job_queue.store import Damaged, NoRoom
from ltlplan.service.models import ENDED, Problem, Stage, State
from ltlplan.service.problems import Conflict, problem_of
from ltlplan.service.times import utc_now
from verify.data import LtlplanError
from verify.data.progress import Progress, silent

AGAIN = 2.0
"""s until what had to wait for room is tried again."""

STUDY = "study"
"""Lane of jobs that were submitted by a study."""
STUDY_COST = 4
"""Turns of plans that pass for each of a user's studies: a study of hundreds holds up nobody's plan, and still goes on beside many."""

_STUDIES = ("campaign", "rehearsal")
"""Kinds of jobs in the lane of studies, too: minutes each."""
_ERRANDS = ("export", "recording")
"""Kinds of jobs that errands' processes do."""

_log = logging.getLogger("ltlplan.service")


class Pool(Protocol):
    """Pool of workers: this machine's processes, or a cluster's."""

    count: int

    @property
    def trouble(self) -> str | None:
        """Reason why nothing is computed at the moment; None where something is."""
        ...

    @property
    def alive(self) -> int:
        """Number of processes that are at work."""
        ...

    def submit(self, work: Any, /, *arguments: Any, progress: Progress | None = None, rank: float = 0.0) -> WorkFuture:
        """Have work done somewhere.

        Args:
            work: A function of a module; it is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.
            progress: Receives a sentence and the share done, 0 to 1.
            rank: Work of a lower rank is begun first.
        """
        ...

    def end_search(self, work: WorkFuture) -> None:
        """Have the search of work that has begun end with the best plan so far."""
        ...

    def close(self) -> None:
        """End all work."""
        ...


class Runner:
    """Runner of jobs. Users take turns; of one user, what was accepted first is begun first.

    Attributes:
        results: Where what they make is kept.
        workers: Who computes missions.
        errands: Who computes exports and judges recordings.
    """

    def __init__(self, results: Results, workers: SharedPool, errands: SharedPool) -> None:
        self.results, self.workers, self.errands = results, workers, errands
        self._numbers = itertools.count()

    def shared(self, entry: Entry) -> SharedPool:
        """Return who computes a job."""
        return self.errands if entry.job.kind in _ERRANDS else self.workers

    def rank(self, entry: Entry) -> None:
        """Give a job its turn; those that were accepted first have to come first."""
        who, study = str(entry.asked.get("who", "")), entry.asked.get("lane") == STUDY or entry.job.kind in _STUDIES
        turn = self.shared(entry).turns.rank(f"{who} {STUDY}" if study else who, cost=STUDY_COST if study else 1)
        entry.rank = turn + 1e-9 * next(self._numbers)  # of one turn, in the order in which they came, from stage to stage

    def end_search(self, entry: Entry) -> None:
        """Have a job's search end with the best plan so far, which is refined and certified as any other.

        The job is an attempt of its own then: whoever submits the mission again has it searched to the end. A search that ends by itself first goes on as it is.

        Raises:
            Conflict: It does not search.
        """
        work = entry.work
        if work is None or not entry.job.searches:
            raise Conflict(f"Job {entry.job.id} does not search at the moment: it is {entry.job.state}.")
        entry.stopping = True
        self.shared(entry).pool.end_search(work)
        _log.info("job %s is to take the best plan so far", entry.job.id)

    async def do(self, entry: Entry, step: Step) -> Data:
        """Do a job's stages, each once; what was done before a kill is not done again.

        Args:
            entry: The job's.
            step: Does a stage, or returns the record of it that a database has.

        Returns:
            How it ended, with the records of its stages.

        Raises:
            Unwritten: The database cannot be read or written at the moment.
        """
        records: list[Data] = []
        try:
            return await self._stages(entry, step, records)
        except Unwritten:
            raise
        except Exception as error:  # of whatever else it is, it would be so again for ever
            _log.exception("job %s cannot go on", entry.job.id)
            problem = problem_of(error)
            ended = end(entry, "failed", problem)
            return {"state": "failed", "problem": problem.model_dump(mode="json"), "ended": ended, "stages": records}
        finally:
            self.shared(entry).turns.ended(int(entry.rank))

    async def _stages(self, entry: Entry, step: Step, records: list[Data]) -> Data:
        """Do a job's stages, and add a record of each."""
        value, name = entry.asked["mission"], PLAN if entry.job.kind == "mission" else entry.job.kind
        while True:

            async def stage(name: str = name, value: str = value) -> Data:
                return await self._stage(entry, name, value, records)

            record = await step(name, stage)
            records.append(record)
            self._learn(entry, records)
            entry.stopping = False
            if "problem" in record:
                ended = end(entry, "failed", Problem.model_validate(record["problem"]))
                return {"state": "failed", "problem": record["problem"], "ended": ended, "stages": records}
            if record["following"] is None:
                return {"state": "done", "ended": end(entry, "done"), "stages": records}
            value, name = record["value"], record["following"]

    async def _stage(self, entry: Entry, name: str, value: str, before: list[Data]) -> Data:
        """Do one stage in a worker, keep what it made, and return the record of it.

        Args:
            entry: The job's.
            name: Of the stage.
            value: Digest of what it takes.
            before: Records of the stages before it.
        """
        began: list[str] = []

        def progress(sentence: str, share: float) -> None:
            if not began:
                began.append(utc_now())
                _begin(entry, name, began[0])
                _log.info("job %s: %s begins", entry.job.id, name)
            share = max(share, entry.job.share)  # work that is begun again does not go back
            entry.change(sentence=sentence, share=share)
            entry.feed.progress(entry.job, name, sentence, share)

        try:
            data = await self._value(entry, value, before)
            record = await self._kept(entry, name, await self._computed(entry, name, data, progress))
        except Exception as error:  # none may leave: it would be recorded in the place of a result
            log = _log.info if isinstance(error, LtlplanError) else _log.exception
            log("job %s: %s ends it: %s", entry.job.id, name, type(error).__name__)
            problem = problem_of(error).model_dump(mode="json")
            return {"stage": name, "problem": problem, "started": began[0] if began else utc_now(), "ended": utc_now()}
        return {**record, "started": began[0] if began else utc_now(), "ended": utc_now()}

    async def _computed(self, entry: Entry, name: str, value: bytes, progress: Progress) -> Outcome:
        """Have a worker do a stage."""
        entry.work = work = self.shared(entry).pool.submit(run_stage, name, value, progress=progress, rank=entry.rank)
        try:
            if entry.cancelled:
                work.cancel()
            return await asyncio.wrap_future(work)
        finally:
            entry.work = None

    async def _value(self, entry: Entry, digest: str, before: list[Data]) -> bytes:
        """Return what a stage takes; where it is damaged, the stages before it make it once more.

        Raises:
            Damaged: It is what was submitted, or is made otherwise now.
        """
        try:
            return await asyncio.to_thread(self.results.store.get, digest)
        except Damaged as damaged:
            index = next((i for i, record in enumerate(before) if record.get("value") == digest), None)
            if index is None:
                raise
            _log.warning("job %s: %s", entry.job.id, damaged)
            source = before[index - 1]["value"] if index else entry.asked["mission"]
            value = await self._value(entry, source, before[:index])
            made = await self._computed(entry, before[index]["stage"], value, silent)
            if await asyncio.to_thread(self.results.store.put, made.value) != digest:
                raise
            return made.value

    async def _kept(self, entry: Entry, name: str, outcome: Outcome) -> Data:
        """Keep what a stage made; where there is no room, wait for it."""
        while True:
            try:
                return await asyncio.to_thread(self.results.keep, entry, name, outcome)
            except NoRoom as error:
                entry.feed.progress(entry.job, name, f"waiting: {error}", entry.job.share)
                _log.warning("job %s waits: %s", entry.job.id, error)
                await asyncio.sleep(AGAIN)

    def _learn(self, entry: Entry, records: list[Data]) -> None:
        """Note that a stage is done, and tell what it found, unless that is known already."""
        if len(entry.records) >= len(records):
            return
        record = records[-1]
        entry.records.append(record)
        with entry.lock:
            if entry.job.state not in ENDED:
                entry.job = with_records(entry.job, entry.records)
        found = self.results.json(record["found"]) if "found" in record else {}
        stage = entry.job.stages[-1].model_copy(update={"found": found})
        for event in claim_events(entry.job, stage, len(records)):
            entry.feed.tell(event)
        entry.feed.tell(stage_event(entry.job, stage, len(records)))


def end(entry: Entry, state: State, problem: Problem | None = None) -> str:
    """Note that a job has ended, unless it had, and tell so.

    Args:
        entry: The job's.
        state: How it ended.
        problem: Why it failed, if it did.

    Returns:
        When it ended, UTC, ISO 8601.
    """
    now = utc_now()
    stages = tuple(
        stage if stage.state in ENDED else stage.model_copy(update={"state": "cancelled", "ended": now})
        for stage in entry.job.stages
    )
    share = 1.0 if state == "done" else entry.job.share
    if not entry.change(state=state, ended=now, problem=problem, stages=stages, sentence="", share=share):
        return str(entry.job.ended)
    entry.feed.tell(state_event(entry.job))
    entry.feed.close()
    _log.info("job %s is %s", entry.job.id, state)
    return now


def _begin(entry: Entry, name: str, now: str) -> None:
    """Note that a worker has taken a stage."""
    before = [stage for stage in entry.job.stages if stage.name != name]
    changes: dict[str, Any] = {"stages": (*before, Stage(name=name, state="running", started=now))}
    if entry.job.state == "queued":
        changes |= {"state": "running", "started": entry.job.started or now}
    if not entry.change(**changes):
        return
    if "state" in changes:
        entry.feed.tell(state_event(entry.job))
    entry.feed.tell(stage_event(entry.job, entry.job.stages[-1], len(before) + 1))
