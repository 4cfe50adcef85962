"""The one door to DBOS, which remembers in a database which steps of which job are done, and goes on with them after any end.

A job is a workflow of DBOS under the job's id; each of its stages is a step, whose result is in the database before the next begins.
DBOS is one for a whole process, so there is one `Engine` at a time. It lives in a thread of its own with a loop of its own: what it
does with its database never makes those wait who only read.

What is written into the database is JSON, never pickled: what is read from it cannot run anything.
"""

from __future__ import annotations

import asyncio
import json
import logging
import threading
from collections.abc import Awaitable, Callable, Coroutine
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from dbos import DBOS, DBOSConfig, SetWorkflowID
from dbos._migration import get_dbos_migrations, sqlite_migrations  # not exported; the only place that says how new they are
from dbos._serialization import Serializer  # not exported, but what the settings ask for

from ltlplan.service.job_queue.database import SCHEMA, why
from verify.data import BadInput, InternalError

VERSION = "ltlplan-1"
"""DBOS goes on only with workflows of the version that is running: ours stays the same, so that jobs survive upgrades. It changes if
the order of a job's steps ever does."""

EXECUTOR = "service"
POLL = 0.05
"""s between looks of DBOS for messages, which we do not send: it is its own 1 s that an engine would wait for when it stops."""

TRIES = 3
"""How often a step is done again for which the database has an error in the place of a result."""

Found = TypeVar("Found")
Data = dict[str, Any]  # of any type: JSON nests
Step = Callable[[str, Callable[[], Coroutine[Any, Any, Data]]], Awaitable[Data]]
Work = Callable[[str, Data, Step], Coroutine[Any, Any, Data]]

_log = logging.getLogger("ltlplan.service")


@dataclass(frozen=True, slots=True)
class Record:
    """A job as the database has it.

    Attributes:
        id: The job's.
        asked: What it was begun with.
        state: "open" (not ended), "ended", "cancelled", or "broken": it has no result, and the engine will not go on with it.
        result: What it ended with.
        steps: Results of the steps that are done, in order; empty for what has ended.
        changed: When that was last written, s since 1970.
    """

    id: str
    asked: Data
    state: str
    result: Data | None
    steps: tuple[Data, ...]
    changed: float


class StoredError(InternalError):
    """Error of a step, as the database has it in the place of a result: versions before this one wrote such."""


class Unwritten(InternalError):
    """A step's record cannot be read or written at the moment; what the step made is made again once it can be."""


@dataclass(frozen=True, slots=True)
class Interruption:
    """A job that does not go on.

    Attributes:
        times: How often its work was given up since it last came a step further.
        why: What it was given up for last.
    """

    times: int
    why: str


def tables(*, sqlite: bool) -> int:
    """Return the version of the engine's tables, up to which it brings older ones when it starts."""
    return len(sqlite_migrations if sqlite else get_dbos_migrations(SCHEMA, False, False))


def make_tables(url: str) -> None:
    """Make the engine's tables in a database that has none, or bring older ones up to date.

    Args:
        url: Of SQLite or PostgreSQL.
    """
    logging.getLogger("dbos").setLevel(logging.ERROR)
    DBOS.migrate(url, schema=SCHEMA)


class Engine:
    """Runs jobs so that they survive.

    Attributes:
        work: What a job does.
        running: The jobs at work.
        interrupted: The jobs whose work was given up, until they come a step further.
    """

    def __init__(self, url: str, work: Work) -> None:
        """Prepare an engine.

        Args:
            url: The database's.
            work: What a job does: given its id, what it was begun with, and how to do a step that is done once. It raises nothing but
                what a step's `Unwritten` says; a failure is a result.
        """
        self.work = work
        self.running: set[str] = set()
        self.interrupted: dict[str, Interruption] = {}
        self._gate = asyncio.Event()
        self._url = url
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="jobs", daemon=True)

    def start(self) -> list[Record]:
        """Start, and return all jobs that the database has; open ones wait for `open_gate` before they go on.

        Raises:
            BadInput: There is one already in this process, or the database cannot be used.
        """
        global _current
        if _current is not None:
            self._loop.close()
            raise BadInput("There is one service in a process; stop the other first.")
        _current = self
        self._thread.start()
        try:
            return self.call(self._launch()).result()
        except BaseException:
            self.stop()
            raise

    async def _launch(self) -> list[Record]:
        config: DBOSConfig = {
            "name": "ltlplan",
            "system_database_url": self._url,
            "application_version": VERSION,
            "executor_id": EXECUTOR,
            "serializer": _Json(),
            "log_level": "ERROR",
            "enable_otlp": False,
            "use_listen_notify": False,
            "notification_listener_polling_interval_sec": POLL,
            "dbos_system_schema": SCHEMA,
        }
        logging.getLogger("dbos").setLevel(logging.ERROR)  # what it warns of is its daily work
        DBOS(config=config)
        try:
            DBOS.launch()
            statuses = await DBOS.list_workflows_async(name=_NAME)
            return [await self._record(status) for status in statuses]
        except Exception as error:
            if (reason := why(error)) is not None:
                raise BadInput(f"The database cannot be used: {reason}") from None
            raise

    async def _record(self, status: Any) -> Record:
        asked = status.input["args"][1]
        state = {"SUCCESS": "ended", "ERROR": "broken", "CANCELLED": "cancelled"}.get(status.status, "open")
        steps: list[Data] = []
        if state != "ended":
            listed = await DBOS.list_workflow_steps_async(status.workflow_id)
            steps = [step["output"] for step in listed if step["output"] is not None]
        return Record(status.workflow_id, asked, state, status.output, tuple(steps), (status.updated_at or 0) / 1000)

    def call(self, coroutine: Coroutine[Any, Any, Found]) -> Future[Found]:
        """Run a coroutine in the engine's own loop."""
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)

    def open_gate(self) -> None:
        """Let jobs go on."""
        self._loop.call_soon_threadsafe(self._gate.set)

    async def passed(self) -> None:
        """Wait until jobs may go on."""
        await self._gate.wait()

    async def begin(self, job: str, asked: Data) -> None:
        """Accept a job: when this returns, it is in the database, and will be done. To be run by `call`."""
        with SetWorkflowID(job):
            await DBOS.start_workflow_async(_job, job, asked)

    async def cancel(self, job: str) -> bool:
        """Cancel a job and return whether it is; one that had ended stays as it is. To be run by `call`."""
        await DBOS.cancel_workflow_async(job)
        self.interrupted.pop(job, None)
        status = await DBOS.get_workflow_status_async(job)
        return status is not None and status.status == "CANCELLED"

    async def delete(self, job: str) -> None:
        """Remove a job from the database. To be run by `call`."""
        await DBOS.delete_workflow_async(job)
        self.interrupted.pop(job, None)

    def interrupt(self, job: str, why: str) -> None:
        """Note that a job does not go on.

        Args:
            job: The job's.
            why: What its work was given up for.
        """
        before = self.interrupted.get(job)
        self.interrupted[job] = Interruption(1 if before is None else before.times + 1, why)

    async def resume(self, job: str) -> None:
        """Go on with an open job whose work was given up, such as for want of room on the disk. To be run by `call`."""
        await DBOS.resume_workflow_async(job)

    async def answers(self) -> None:
        """Ask the database something small. To be run by `call`."""
        await DBOS.list_workflows_async(limit=1, load_input=False, load_output=False)

    def stop(self) -> None:
        """Let go of everything; open jobs go on when an engine starts again."""
        global _current
        if self._thread.is_alive():
            self.call(self._cancel_all()).result(10)
        DBOS.destroy()
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(10)
            self._loop.close()
        if _current is self:
            _current = None

    async def _cancel_all(self) -> None:
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


_current: Engine | None = None

_NAME = "job"


@DBOS.workflow(name=_NAME, max_recovery_attempts=None)
async def _job(job: str, asked: Data) -> Data:
    """Do a job's steps; DBOS calls it, once more for each start of the service until the job has ended."""
    engine = _current
    if engine is None:  # the engine stops: an error would be the job's result for ever
        return await _never()
    await engine.passed()
    engine.running.add(job)

    async def step(name: str, work: Callable[[], Coroutine[Any, Any, Data]]) -> Data:
        record = await _step(name, work)
        engine.interrupted.pop(job, None)
        return record

    try:
        result = await engine.work(job, asked, step)
    except Exception as error:  # not a job's own failure, which is a result, but that its steps cannot be read or written
        _log.exception("job %s is interrupted; it goes on later", job)
        engine.interrupt(job, why(error.__cause__ or error) or str(error))
        engine.running.discard(job)
        return await _never()
    finally:
        engine.running.discard(job)
    engine.interrupted.pop(job, None)
    return result


async def _never() -> Data:
    """Wait until the engine resumes the job in another task, or stops."""
    await asyncio.Event().wait()
    raise AssertionError("nobody sets it")


async def _step(name: str, work: Callable[[], Coroutine[Any, Any, Data]]) -> Data:
    """Do a step once, or return its record.

    Raises:
        StoredError: The database has errors in the place of its result.
        Unwritten: Its record cannot be read or written at the moment.
    """
    for _ in range(TRIES - 1):
        with suppress(StoredError):  # the step that follows has a number of its own
            return await _recorded(name, work)
    return await _recorded(name, work)


async def _recorded(name: str, work: Callable[[], Coroutine[Any, Any, Data]]) -> Data:
    try:
        return await DBOS.run_step_async({"name": name}, work)
    except StoredError:
        raise
    except Exception as error:
        raise Unwritten(f"What {name} made cannot be recorded: {why(error) or error}") from error


class _Json(Serializer):
    """Plain data as JSON; of exceptions, which only DBOS itself raises here, the words."""

    def serialize(self, data: Any) -> str:
        return json.dumps(data, default=_words, separators=(",", ":"))

    def deserialize(self, serialized_data: str) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]  # its base says cls
        return json.loads(serialized_data, object_hook=_error)

    def name(self) -> str:
        return "ltlplan_json"


_ERROR = "$error"


def _words(value: object) -> Data:
    if not isinstance(value, BaseException):
        raise TypeError(f"A {type(value).__name__} is no plain data.")
    return {_ERROR: f"{type(value).__name__}: {value}"}


def _error(data: Data) -> Any:
    return StoredError(data[_ERROR]) if data.keys() == {_ERROR} else data
