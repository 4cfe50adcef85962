"""Jobs: accepted once, done whatever happens, found again, cancelled at once, deleted only when asked."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import sqlite3
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import ltlplan
from ltlplan.service.job_queue import database
from ltlplan.service.job_queue.store import Store
from ltlplan.service.models import ENDED
from ltlplan.service.problems import Conflict, NotFound, TooManyRequests
from ltlplan.service.settings import Limits
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import SMALL, begun, ended, heard, run, service
from verify.data import BadInput, Mission

pytestmark = pytest.mark.xdist_group("service")

LARGE = ltlplan.load_mission("hoops-published")


def impossible() -> Mission:
    return small_mission("F a & G !a", margin=0.05)


def test_a_job_is_done_and_its_files_are_those_of_the_command(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await ended(jobs, await jobs.submit(SMALL, seed=7))
            assert job.state == "done"
            assert [stage.name for stage in job.stages] == ["plan", "round 1", "flight", "files"]
            assert {stage.state for stage in job.stages} == {"done"}
            assert job.seed == 7
            assert job.share == 1.0
            assert job.summary is not None
            assert job.summary["holds"]
            for file in written.rglob("*"):
                if file.is_file():
                    stored = await jobs.file(job.id, str(file.relative_to(written)))
                    assert stored.path.read_bytes() == file.read_bytes(), file
                    assert stored.size == file.stat().st_size

    written = tmp_path / "run"
    ltlplan.run(SMALL, written, seed=7)
    run(check())


def test_the_same_mission_seed_and_version_are_found_not_computed(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            first = await jobs.submit(SMALL)
            again = await jobs.submit(SMALL)
            assert (first.id, first.found) == (again.id, not again.found)
            await ended(jobs, first)
            third = await jobs.submit(SMALL)
            assert (third.id, third.found, third.state) == (first.id, True, "done")
            assert (await jobs.submit(SMALL, seed=5)).id != first.id
        async with service(tmp_path / "data") as jobs:
            fourth = await jobs.submit(SMALL)
            assert (fourth.id, fourth.found, fourth.state) == (first.id, True, "done")

    run(check())


def test_a_mission_without_a_plan_fails_in_the_commands_words_and_is_not_tried_again(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await ended(jobs, await jobs.submit(impossible()))
            assert job.state == "failed"
            assert job.problem is not None
            assert (job.problem.detail, job.problem.exit_code) == (str(refused.value), 3)
            assert job.stages[0].state == "failed"
            again = await jobs.submit(impossible())
            assert (again.id, again.found) == (job.id, True)

    with pytest.raises(ltlplan.Unsatisfiable) as refused:
        ltlplan.plan(impossible())
    run(check())


def test_bad_missions_are_not_accepted(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            with pytest.raises(BadInput, match="margin of 0 m"):
                await jobs.submit(small_mission("F a"))
            with pytest.raises(BadInput, match="seed"):
                await jobs.submit(SMALL, seed=-1)
            assert await jobs.jobs() == []

    run(check())


def test_what_is_cancelled_ends_at_once_and_may_be_tried_again(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await jobs.submit(LARGE)
            await begun(jobs, job)
            began = time.monotonic()
            assert (await jobs.cancel(job.id)).state == "cancelled"
            while jobs.workers.alive:
                await asyncio.sleep(0.01)
            assert time.monotonic() - began < 5
            assert (await jobs.cancel(job.id)).state == "cancelled"
            assert (await heard(jobs, job))[-1].data["state"] == "cancelled"
            other = await jobs.submit(LARGE)
            assert other.id != job.id
            await jobs.cancel(other.id)
        async with service(tmp_path / "data") as jobs:
            assert {job.state for job in await jobs.jobs()} == {"cancelled"}

    run(check())


def test_a_done_job_stays_done(data: Path) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            assert (await jobs.cancel(job.id)).state == "done"

    run(check())


def test_events_tell_everything_once_and_again_from_where_a_listener_was(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await jobs.submit(SMALL)
            live = await heard(jobs, job)
            lasting = [event for event in live if event.kind != "progress"]
            again = await heard(jobs, job)
            assert [event.id for event in again] == [event.id for event in lasting]
            middle = lasting[len(lasting) // 2].id
            rest = await heard(jobs, job, after=middle)
            assert [event.id for event in rest] == [event.id for event in lasting if event.id > middle]
        async with service(tmp_path / "data") as jobs:
            later = await heard(jobs, job)
            assert [(event.id, event.kind, event.stage) for event in later] == [
                (event.id, event.kind, event.stage) for event in lasting
            ]
            shares = [event.share for event in later]
            assert (shares[0], shares) == (0.0, sorted(shares))
        ids = [event.id for event in live]
        assert ids == sorted(set(ids))
        assert [event.data["state"] for event in lasting if event.kind == "state"] == ["queued", "running", "done"]
        assert {event.data["outcome"] for event in lasting if event.kind == "claim"} == {"holds"}
        assert live[-1].share == 1.0

    run(check())


def test_the_plan_is_there_as_soon_as_it_is_made(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job, "round 1")
            mission = await jobs.mission(job.id)
            assert ltlplan.parse_mission(mission) == SMALL
            assert await jobs.plan(job.id) == (mission, plan.to_json())

    plan = ltlplan.plan(SMALL)
    run(check())


@pytest.mark.slow
def test_what_goes_on_after_a_stop_does_not_begin_anew(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data", workers=1) as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job, "round 1")
        async with service(tmp_path / "data") as jobs:
            assert (await jobs.job(job.id)).state not in ENDED
            plan = (await jobs.job(job.id)).stages[0]
            later = await ended(jobs, job)
            assert later.state == "done"
            assert later.stages[0] == plan

    run(check())


@pytest.mark.slow
def test_values_that_a_kill_orphaned_are_removed_and_no_others(tmp_path: Path) -> None:
    async def check() -> None:
        store = Store(tmp_path / "data" / "values")
        async with service(tmp_path / "data") as jobs:
            done = await ended(jobs, await jobs.submit(SMALL))
            failed = await ended(jobs, await jobs.submit(impossible()))
            running = await jobs.submit(LARGE)
            await begun(jobs, running)
        kept = store.digests()
        store.put(b"orphan")
        async with service(tmp_path / "data") as jobs:
            assert kept <= store.digests()
            for job in (done, failed):
                assert await jobs.job(job.id) == job
            await jobs.cancel(running.id)
        with contextlib.closing(sqlite3.connect(tmp_path / "data" / "jobs.sqlite")) as connection:
            assert connection.execute("SELECT COUNT(*) FROM ltlplan_service WHERE name = 'database'").fetchone() == (1,)
        orphan = hashlib.sha256(b"orphan").hexdigest()
        assert orphan not in store.digests()
        store.put(b"orphan")
        store.is_owned("another database")
        async with service(tmp_path / "data"):
            assert orphan in store.digests()

    run(check())


def test_jobs_are_listed_newest_first(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            made = [await jobs.submit(SMALL, seed=seed) for seed in range(4)]
            await jobs.cancel(made[1].id)
            listed = [job.id for job in await jobs.jobs()]
            assert listed == [job.id for job in reversed(made)]
            assert [job.id for job in await jobs.jobs(limit=2)] == listed[:2]
            assert [job.id for job in await jobs.jobs(limit=2, before=listed[1])] == listed[2:]
            assert [job.id for job in await jobs.jobs(state="cancelled")] == [made[1].id]
            for job in made:
                await jobs.cancel(job.id)

    run(check())


def test_deleting_is_explicit_and_leaves_nothing(data: Path) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            job = await jobs.submit(SMALL, seed=1)
            with pytest.raises(Conflict, match="cancel it first"):
                await jobs.delete(job.id)
            await ended(jobs, job)
            found = await jobs.submit(SMALL)
            assert found.found
            other = await ended(jobs, found)  # it goes on where the service stopped before its end was written
            assert (other.state, bool(other.files)) == ("done", True)
            await jobs.delete(job.id)
            with pytest.raises(NotFound, match="no job"):
                await jobs.job(job.id)
            for file in other.files:
                assert (await jobs.file(other.id, file.name)).path.exists()
            twice = await asyncio.gather(jobs.delete(other.id), jobs.delete(other.id), return_exceptions=True)
            assert [type(answer) for answer in twice] == [type(None), NotFound]
            assert await jobs.jobs() == []
            assert Store(data / "values").digests() == set()
            assert not (await jobs.submit(SMALL)).found

    run(check())


def test_what_is_not_there_is_not_found(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            for ask in (jobs.job, jobs.cancel, jobs.delete, jobs.plan, jobs.mission):
                with pytest.raises(NotFound, match="no job 'nobody-1'"):
                    await ask("nobody-1")
            job = await jobs.submit(impossible())
            with pytest.raises(NotFound, match=r"no file '\.\./\.\./etc/passwd'"):
                await jobs.file(job.id, "../../etc/passwd")

    run(check())


def test_no_more_wait_than_may(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data", limits=Limits(queued=2), workers=1) as jobs:
            await begun(jobs, await jobs.submit(LARGE, seed=0))
            for seed in (1, 2):
                await jobs.submit(LARGE, seed=seed)
            with pytest.raises(TooManyRequests, match="2 jobs are waiting"):
                await jobs.submit(SMALL)
            for job in await jobs.jobs():
                await jobs.cancel(job.id)

    run(check())


def test_two_services_in_a_process_are_refused(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data"):
            with pytest.raises(BadInput, match="one service in a process"):
                async with service(tmp_path / "other"):
                    pass

    run(check())


def test_the_service_says_how_it_is(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            health = await jobs.health()
            assert health.ok
            assert (health.database, health.workers, health.queued, health.running) == ("answers", 2, 0, 0)
            assert health.versions["ltlplan"] == ltlplan.__version__

    run(check())


@few_of(
    2,
    ("damage", "words"),
    [
        (lambda path: path.write_bytes(b"This is no database." * 1000), "damaged"),
        (lambda path: _sql(path, "UPDATE dbos_migrations SET version = 10000"), "newer ltlplan"),
        (lambda path: _sql(path, "UPDATE ltlplan_service SET value = '99' WHERE name = 'format'"), "newer ltlplan"),
        (lambda path: _sql(path, "UPDATE ltlplan_service SET value = 'x' WHERE name = 'folder'"), "another data folder"),
    ],
)
def test_a_database_that_is_not_ours_is_refused_and_left_as_it_is(
    tmp_path: Path, damage: Callable[[Path], None], words: str
) -> None:
    async def check() -> None:
        async with service(tmp_path / "data"):
            pass
        place = tmp_path / "data" / "jobs.sqlite"
        damage(place)
        before = place.read_bytes()
        with pytest.raises(BadInput, match=words):
            async with service(tmp_path / "data"):
                pass
        assert place.read_bytes() == before

    run(check())


def test_a_database_that_others_hold_is_refused_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "PATIENCE", 0.3)

    async def check() -> None:
        async with service(tmp_path / "data"):
            pass
        other = sqlite3.connect(tmp_path / "data" / "jobs.sqlite", isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(BadInput, match="another program holds it"):
            async with service(tmp_path / "data"):
                pass
        other.close()

    run(check())


@pytest.mark.slow
def test_a_database_that_is_held_for_a_while_delays_jobs_and_loses_none(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            first = await jobs.submit(SMALL)
            other = sqlite3.connect(tmp_path / "data" / "jobs.sqlite", isolation_level=None, check_same_thread=False)
            other.execute("BEGIN IMMEDIATE")
            release = threading.Timer(3.0, other.close)
            release.start()
            second = await jobs.submit(SMALL, seed=1)
            assert (await ended(jobs, first)).state == "done"
            assert (await ended(jobs, second)).state == "done"
            release.join()

    run(check())


def _sql(path: Path, statement: str) -> None:
    connection = sqlite3.connect(path)
    connection.execute(statement)
    connection.commit()
    connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
