"""Jobs that survive: what was accepted is done, once, whatever is killed meanwhile, and what was found is found again.

    submit - (engine: a workflow) - plan - round 1 ... - flight - files
                                     each a step: its value in the store, its record in the database

The truth is in the database and the store. All jobs are also in memory, without what their stages found, so that reading waits for
nobody; this process is the only one that writes (the data folder is locked, and a database belongs to one folder).
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from typing import Any, TypeVar

from ltlplan.service.execution.derived import Derived
from ltlplan.service.execution.turns import SharedPool
from ltlplan.service.job_queue.admission import Admission, derived_key
from ltlplan.service.job_queue.database import folder_name, prepare, url_of, why
from ltlplan.service.job_queue.engine import Data, Engine, Step, tables
from ltlplan.service.job_queue.events import state_event
from ltlplan.service.job_queue.health import health_of
from ltlplan.service.job_queue.job_index import Register
from ltlplan.service.job_queue.job_records import Entry, a_kind, derived_record, entry_of, job_of, record_of, told_again
from ltlplan.service.job_queue.results import Results, StoredFile
from ltlplan.service.job_queue.runner import Pool, Runner, end
from ltlplan.service.job_queue.store import Damaged
from ltlplan.service.models import ENDED, Event, Health, Job, State
from ltlplan.service.problems import Busy, Conflict
from ltlplan.service.settings import Settings
from verify.data import LtlplanError, Mission
from verify.data.errors import InternalError

WATCH = 5.0
"""s between looks for jobs whose work was given up."""
LOOK = 0.5
"""s for which the service's state is not looked for again."""

Found = TypeVar("Found")

_log = logging.getLogger("ltlplan.service")


class Jobs:
    """All jobs of a data folder.

    Attributes:
        settings: Where, and within which limits.
        workers: Who computes missions.
        runner: Does them, and ends their searches.
        register: All jobs in memory.
        admission: Rules of acceptance.
        referring: Held while users' references and the jobs that they keep are changed together.
    """

    def __init__(self, settings: Settings, workers: Pool, errands: SharedPool | None = None) -> None:
        """Open nothing yet.

        Args:
            settings: Where, and within which limits.
            workers: Who computes missions; closed at the end.
            errands: Who computes exports and judges recordings, and is closed by its owner; by default the workers do.
        """
        self.settings = settings
        self.workers = workers
        shared = SharedPool(workers)
        self._results = Results(settings.data)
        self.runner = Runner(self._results, shared, errands or shared)
        self._url = url_of(settings.data, settings.database)
        self._health: Health | None = None
        self.register = Register()
        self.admission = Admission(settings.limits, self.register, self._results)
        self._submitting, self.referring = asyncio.Lock(), asyncio.Lock()
        self._engine: Engine | None = None
        self._watching: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Open the data folder and go on with all that was accepted and has not ended.

        Raises:
            BadInput: Folder or database cannot be used; the message says why.
        """
        await asyncio.to_thread(self._open)
        self._watching = asyncio.create_task(self._watch())

    def _open(self) -> None:
        self._results.store.open()
        sqlite = self.settings.database is None
        database = prepare(self._url, folder_name(self.settings.data), tables=tables(sqlite=sqlite))
        owned = self._results.store.is_owned(database)
        engine = Engine(self._url, self._do)
        records = engine.start()
        for record in sorted(records, key=lambda record: str(record.asked["submitted"])):
            self._add(entry_of(record))
        if owned:
            self._results.collect(self.register)
        self._engine = engine
        engine.open_gate()
        _log.info("%d jobs in %s, %d of them go on", len(records), self.settings.data, len(self.register.going()))

    def _add(self, entry: Entry) -> None:
        self.register.add(entry)
        if entry.job.state not in ENDED:
            self.runner.rank(entry)

    async def stop(self) -> None:
        """Let go of everything, the workers too; jobs that have not ended go on at the next start."""
        if self._watching is not None:
            self._watching.cancel()
        for entry in self.register:
            entry.feed.close()
        if self._engine is not None:
            engine, self._engine = self._engine, None
            await asyncio.to_thread(engine.stop)
        await asyncio.to_thread(self.workers.close)

    # What is asked

    async def submit(self, mission: Mission, *, seed: int | None = None, who: str = "", lane: str = "") -> Job:
        """Accept a mission: when this returns, it will be done, whatever is killed.

        The same mission with the same seed and versions is the same job, unless that was cancelled or ended for a reason that is not
        the mission's own (time, memory, a bug): then it is tried again.

        Args:
            mission: What is asked.
            seed: Source of every draw, instead of the mission's own.
            who: Who asks: a token's name, or an address.
            lane: "study" where a study submits it; plans of all users come before most of these.

        Raises:
            BadInput: The mission is not allowed.
            TooManyRequests: Too many jobs wait.
            Busy: The database does not answer.
            NoRoom: The disk is full.
        """
        key, mission = await self.admission.asked(mission, seed)
        async with self._submitting:
            if (known := self.register.answer(key)) is not None:
                return known
            self.admission.require_room(who)
            value = await asyncio.to_thread(self._results.ask, mission)
            return await self._accept(record_of(mission, value, key, who, lane))

    async def derive(self, job_id: str, asked: Derived, *, who: str = "") -> Job:
        """Accept what is to be made of a job's flight, as `submit` does a mission: when this returns, it will be done.

        Args:
            job_id: The job's.
            asked: What is to be made: an export, a campaign, a rehearsal, a verdict on a recording that is kept.
            who: Who asks.

        Raises:
            NotFound: There is no such job.
            Conflict: It has no files, or is made of a flight itself.
            TooManyRequests: Too many jobs wait.
            Busy: The database does not answer.
            NoRoom: The disk is full.
        """
        flown = self.register.entry(job_id)
        if flown.job.of is not None:
            raise Conflict(f"Job {job_id} is {a_kind(flown.job)}; ask for this of job {flown.job.of}.")
        if not flown.job.files:
            raise Conflict(f"Job {job_id} has no files: it is {flown.job.state}.")
        key = await asyncio.to_thread(derived_key, flown.job, asked)
        async with self._submitting:
            self.register.entry(job_id)  # it may have been deleted while this waited
            if (known := self.register.answer(key)) is not None:
                return known
            self.admission.require_room(who)
            value = await self._read(self._results.ask_derived, job_id, asked)
            return await self._accept(derived_record(flown.job, asked, value, key, who))

    async def _accept(self, asked: Data) -> Job:
        job_id = self.register.new_id(asked["key"])
        entry = Entry(job_of(job_id, asked), asked)
        self._add(entry)
        entry.feed.tell(state_event(entry.job))
        try:
            await self._in_engine(lambda engine: engine.begin(job_id, asked))
        except BaseException:
            self.register.drop(entry)  # it is told of again at the next start, should the database have it after all
            raise
        _log.info("job %s is accepted", job_id)
        return entry.job

    async def jobs(
        self,
        *,
        state: State | None = None,
        limit: int = 50,
        before: str | None = None,
        which: Callable[[Job], bool] | None = None,
    ) -> list[Job]:
        """Return jobs, newest first, without what their stages found; what is made of flights is not listed.

        Args:
            state: Only those.
            limit: At most so many.
            before: Only those that were submitted before the job of this id.
            which: Only those of which this is true.
        """
        return self.register.newest(state=state, limit=limit, before=before, which=which)

    async def job(self, job_id: str) -> Job:
        """Return a job with all that its stages found so far.

        Raises:
            NotFound: There is no such job.
        """
        entry = self.register.entry(job_id)
        if self._results.at_hand(entry):
            return self._results.whole(entry)
        return await self._read(self._results.whole, job_id)

    async def _read(self, read: Callable[..., Found], job_id: str, *arguments: object) -> Found:
        """Read something of a job from the disk; one that is damaged is noted, so that it is made anew when it is asked for again."""
        entry = self.register.entry(job_id)
        try:
            return await asyncio.to_thread(read, entry, *arguments)
        except Damaged as error:
            entry.damaged = True
            _log.error("job %s: %s", job_id, error)
            raise

    async def events(self, job_id: str, *, after: int = 0) -> AsyncIterator[Event]:
        """Yield a job's events, those that were told already first; ends after the one that says how the job ended.

        Args:
            job_id: The job's.
            after: Only events with a greater id.

        Raises:
            NotFound: There is no such job.
        """
        entry = self.register.entry(job_id)
        told = after
        if entry.records:
            for event in told_again(await self.job(job_id), ended=False):
                if event.id > told:
                    told = event.id
                    yield event
        async for event in entry.feed.after(told):
            told = event.id
            yield event
        if entry.job.state in ENDED:
            for event in told_again(await self.job(job_id), ended=True):
                if event.id > told:
                    yield event

    async def waited(self, job_id: str, seconds: float) -> Job:
        """Return a job when it has ended, or as it is after so many seconds.

        Raises:
            NotFound: There is no such job.
        """
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                async for _event in self.events(job_id):
                    pass
        return await self.job(job_id)

    async def cancel(self, job_id: str) -> Job:
        """Cancel a job and end what it computes, at once; one that has ended stays as it is.

        Raises:
            NotFound: There is no such job.
        """
        entry = self.register.entry(job_id)
        if entry.job.state in ENDED:
            return entry.job
        entry.cancelled = True
        try:
            cancelled = await self._in_engine(lambda engine: engine.cancel(job_id))
        except BaseException:
            entry.cancelled = False
            raise
        if cancelled:
            if entry.work is not None:
                entry.work.cancel()
            end(entry, "cancelled")
        else:
            entry.cancelled = False
        return entry.job

    async def delete(self, job_id: str) -> None:
        """Remove a job that has ended, what was made of its flight, and of what was found all that no other job has found too.

        Raises:
            NotFound: There is no such job.
            Conflict: It has not ended.
        """
        entry = self.require_ended(job_id)
        async with self._submitting:
            self.register.entry(job_id)  # it may have been deleted while this waited
            for each in (*self.register.derived(job_id), entry):
                await self.cancel(each.job.id)
                await self._in_engine(lambda engine, each=each: engine.delete(each.job.id))
                self.register.drop(each)
                await asyncio.to_thread(self._results.drop, each, list(self.register))
        _log.info("job %s is deleted", job_id)

    def require_ended(self, job_id: str) -> Entry:
        """Return a job that has ended.

        Raises:
            NotFound: There is no such job.
            Conflict: It has not ended.
        """
        entry = self.register.entry(job_id)
        if entry.job.state not in ENDED:
            raise Conflict(f"Job {job_id} is {entry.job.state}; cancel it first, then delete it.")
        return entry

    async def file(self, job_id: str, name: str) -> StoredFile:
        """Return a file of a job, by its name in the job's own table.

        Raises:
            NotFound: There is no such job, or it has no such file.
            Damaged: Its bytes are not those that were kept; the same mission, submitted again, is another attempt.
        """
        return await self._read(self._results.file, job_id, name)

    async def plan(self, job_id: str) -> tuple[str, str] | None:
        """Return a job's mission.yaml and plan.json as soon as it is planned; None before.

        Raises:
            NotFound: There is no such job.
        """
        return await self._read(self._results.plan, job_id)

    async def mission(self, job_id: str) -> str:
        """Return the resolved mission of a job as YAML, in any of its states.

        Raises:
            NotFound: There is no such job.
        """
        return await self._read(self._results.mission, job_id)

    async def health(self) -> Health:
        """Return whether database and workers answer, and what waits; asked again within `LOOK` s, what was seen then."""
        if self._health is None:
            self._health = await self._looked()
            asyncio.get_running_loop().call_later(LOOK, setattr, self, "_health", None)
        return self._health

    async def _looked(self) -> Health:
        database = "answers"
        try:
            await self._in_engine(lambda engine: engine.answers())
        except LtlplanError as error:
            database = str(error)
        room = await asyncio.to_thread(self._results.store.free)
        interrupted = {} if self._engine is None else self._engine.interrupted
        return health_of(database, interrupted, room, self.workers, self.register)

    async def _in_engine(self, what: Any) -> Any:  # a function of the engine that returns a coroutine
        """Have the engine do something in its own loop, and wait for it here, but not for ever."""
        if self._engine is None:
            raise Busy("The service is not running.")
        try:
            return await asyncio.wait_for(asyncio.wrap_future(self._engine.call(what(self._engine))), 15.0)
        except TimeoutError:
            raise Busy("The database does not answer; another program may hold it. Try again later.", 10.0) from None
        except Exception as error:
            if (reason := why(error)) is not None:
                raise Busy(f"The database cannot be used: {reason}", 10.0) from None
            raise

    async def _do(self, job_id: str, _asked: Data, step: Step) -> Data:
        """Do a job, in the engine's loop."""
        entry = self.register.find(job_id)
        if entry is None:
            raise InternalError(f"The database has a job {job_id} that is not known.")
        return await self.runner.do(entry, step)

    async def _watch(self) -> None:
        """Go on with jobs whose work was given up because their steps could not be written."""
        missed: set[str] = set()
        while True:
            await asyncio.sleep(WATCH)
            engine = self._engine
            if engine is None:
                return
            try:
                await asyncio.to_thread(self._results.drop_leaving, list(self.register))
            except Exception:
                _log.exception("values of deleted jobs cannot be removed yet")
            idle = self.register.going() - engine.running
            for job_id in idle & missed:
                if job_id not in engine.interrupted:
                    engine.interrupt(job_id, "the engine has not begun it")
                try:
                    await self._in_engine(lambda engine, job_id=job_id: engine.resume(job_id))
                except Exception:  # the next look tries again
                    _log.exception("job %s cannot be resumed yet", job_id)
            missed = idle
