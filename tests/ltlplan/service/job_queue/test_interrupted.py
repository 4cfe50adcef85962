"""Jobs whose helpers die, whose steps failed in versions before, or cannot be written: each ends, or is told of while it does not go on."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable
from contextlib import closing
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest

from ltlplan.service.execution.workers import TRIES, LocalWorkers, WorkFuture
from ltlplan.service.job_queue import jobs as jobs_module
from ltlplan.service.job_queue.engine import TRIES as LOOPS
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import Health
from ltlplan.service.settings import Settings
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import ended, run, service

pytestmark = pytest.mark.xdist_group("service")

SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")


class Broken:
    """Workers of whom nothing comes: every piece of work waits for ever, or raises at once."""

    count, alive = 1, 0

    def __init__(self, error: Exception | None = None, trouble: str | None = None) -> None:
        self.error, self.trouble = error, trouble

    def submit(self, *_work: Any, **_rest: Any) -> WorkFuture:
        if self.error is not None:
            raise self.error
        return WorkFuture()

    def close(self) -> None:
        """Do nothing."""


def sql(data: Path, statement: str, *values: object) -> None:
    with closing(sqlite3.connect(data / "jobs.sqlite", timeout=30)) as connection, connection:
        connection.execute(statement, values)


async def accepted(data: Path) -> str:
    """Accept a job, do nothing of it, and stop."""
    data.mkdir()
    jobs = Jobs(Settings(data=data), Broken())
    await jobs.start()
    job = await jobs.submit(SMALL)
    await jobs.stop()
    return job.id


async def looked(jobs: Jobs, what: Callable[[Health], bool]) -> Health:
    """Wait until the service says so of itself."""
    async with asyncio.timeout(120):
        while not what(found := await jobs.health()):
            await asyncio.sleep(0.05)
    return found


@few_of(1, ("deaths", "state"), [(TRIES - 1, "done"), (TRIES, "failed")])
def test_a_job_whose_fork_server_dies_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, deaths: int, state: str) -> None:
    connect, starts = forkserver.connect_to_new_process, []

    def connected(fds: Any) -> Any:
        starts.append(fds)
        if len(starts) <= deaths:
            raise EOFError
        return connect(fds)

    async def check() -> None:
        async with service(tmp_path / "data", workers=1) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            assert job.state == state
            if state == "failed":
                assert job.problem is not None
                assert (job.problem.type, "ended before it began" in job.problem.detail) == ("/problems/worker-died", True)
                again = await jobs.submit(SMALL)
                assert (again.found, (await ended(jobs, again)).state) == (False, "done")

    monkeypatch.setattr(forkserver, "connect_to_new_process", connected)
    run(check())


def test_whatever_a_stage_meets_is_its_jobs_result_and_no_error_of_the_database(tmp_path: Path) -> None:
    async def check() -> None:
        (tmp_path / "data").mkdir()
        jobs = Jobs(Settings(data=tmp_path / "data"), Broken(ConnectionRefusedError(111, "refused")))
        await jobs.start()
        job = await ended(jobs, await jobs.submit(SMALL))
        await jobs.stop()
        assert job.problem is not None
        assert (job.state, job.problem.type) == ("failed", "/problems/internal-error")

    run(check())
    with closing(sqlite3.connect(tmp_path / "data" / "jobs.sqlite")) as connection:
        assert connection.execute("SELECT error FROM operation_outputs").fetchall() == [(None,)]


@pytest.mark.slow
def test_an_error_that_a_version_before_stored_in_the_place_of_a_result_is_passed_over(tmp_path: Path) -> None:
    async def check() -> None:
        job_id = await accepted(data)
        row = (job_id, 1, "plan", '{"$error":"EOFError: "}', "ltlplan_json")
        sql(
            data,
            "INSERT INTO operation_outputs (workflow_uuid, function_id, function_name, error, serialization) VALUES (?,?,?,?,?)",
            *row,
        )
        for _start in range(2):
            async with service(data) as jobs:
                job = await ended(jobs, await jobs.job(job_id))
                assert (job.state, [stage.name for stage in job.stages]) == ("done", ["plan", "round 1", "flight", "files"])

    data = tmp_path / "data"
    run(check())


def test_a_job_that_the_engine_gave_up_has_failed_and_may_be_submitted_again(tmp_path: Path) -> None:
    async def check() -> None:
        job_id = await accepted(data)
        sql(
            data,
            "UPDATE workflow_status SET status = 'ERROR', error = ? WHERE workflow_uuid = ?",
            '{"$error":"OSError: "}',
            job_id,
        )
        async with service(data) as jobs:
            job = await jobs.job(job_id)
            assert job.problem is not None
            assert (job.state, "submit it again" in job.problem.detail) == ("failed", True)
            again = await jobs.submit(SMALL)
            assert (again.found, (await ended(jobs, again)).state) == (False, "done")

    data = tmp_path / "data"
    run(check())


REFUSING = "CREATE TRIGGER no BEFORE INSERT ON operation_outputs BEGIN SELECT RAISE(ABORT, 'not now'); END"


def goes_on(health: Health) -> bool:
    return health.ok and not health.interrupted


@pytest.mark.slow
def test_the_service_tells_of_a_job_that_loops_until_it_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            sql(data, REFUSING)
            job = await jobs.submit(SMALL)
            found = await looked(jobs, lambda health: not health.ok)
            assert f"given up {LOOPS} times" in found.interrupted[job.id]
            assert "not now" in found.interrupted[job.id]
            assert (found.database, found.computing) == ("answers", "answers")
            sql(data, "DROP TRIGGER no")
            assert (await ended(jobs, job)).state == "done"
            await looked(jobs, goes_on)

    data = tmp_path / "data"
    monkeypatch.setattr(jobs_module, "WATCH", 0.2)
    run(check())


@pytest.mark.slow
def test_a_job_that_loops_can_be_cancelled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            sql(data, REFUSING)
            job = await jobs.submit(SMALL)
            await looked(jobs, lambda health: not health.ok)
            assert (await jobs.cancel(job.id)).state == "cancelled"
            await looked(jobs, goes_on)

    data = tmp_path / "data"
    monkeypatch.setattr(jobs_module, "WATCH", 0.2)
    run(check())


def test_the_service_tells_that_nothing_is_computed(tmp_path: Path) -> None:
    async def check() -> None:
        (tmp_path / "data").mkdir()
        jobs = Jobs(Settings(data=tmp_path / "data"), Broken(trouble="worker processes die"))
        await jobs.start()
        found = await jobs.health()
        await jobs.stop()
        assert (found.ok, found.computing) == (False, "worker processes die")

    run(check())


def test_local_workers_say_when_their_processes_die(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def connected(_fds: Any) -> Any:
        raise EOFError

    async def check() -> None:
        async with service(tmp_path / "data", workers=1) as jobs:
            assert isinstance(jobs.workers, LocalWorkers)
            await ended(jobs, await jobs.submit(SMALL))
            found = await jobs.health()
            assert (found.ok, "die one after the other" in found.computing) == (False, True)

    monkeypatch.setattr(forkserver, "connect_to_new_process", connected)
    run(check())
