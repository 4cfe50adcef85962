"""Retention: nothing that a project, a study, a user or running work needs is ever swept, and what was deleted can come back."""

from __future__ import annotations

import os
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ltlplan.service.execution.workers import LocalWorkers
from ltlplan.service.job_queue.job_records import Entry
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.live_view.flight_recorder import FlightRecorder
from ltlplan.service.models import Job
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal, Role
from ltlplan.service.people.user_jobs import UserJobs
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.settings import Limits, Settings
from ltlplan.service.storage.retention import Retention, Swept, before, kept_until
from tests.helpers.serving.job_services import SMALL, ended, run

pytestmark = pytest.mark.xdist_group("service")

ALICE, BOB, ROOT = (
    Principal(name, role) for name, role in (("alice", Role.planner), ("bob", Role.planner), ("root", Role.admin))
)
LATER = datetime.now(UTC) + timedelta(days=31)


@dataclass
class _Live:
    """Flights of which number 2 is in the air."""

    recorder: FlightRecorder

    async def forget_recordings(self, instant: float) -> int:
        return self.recorder.forget_old(instant, {2})


@dataclass
class Lab:
    """A service without a network, of which three people have jobs."""

    jobs: Jobs
    people: People
    retention: Retention
    of: Callable[[Principal], UserJobs] = field(init=False)

    def __post_init__(self) -> None:
        self.of = lambda principal: UserJobs(self.jobs, self.people, principal)


@asynccontextmanager
async def lab(folder: Path, **kept: float) -> AsyncGenerator[Lab]:
    folder.mkdir(exist_ok=True)
    jobs = Jobs(Settings(data=folder, limits=Limits(**kept)), LocalWorkers(1))  # type: ignore[arg-type]  # limits of days are numbers
    people = People(Tokens(folder))
    if not people.accounts.needed:
        people.accounts.add("root", Role.admin)
    people.references.load()
    live: Any = _Live(FlightRecorder(folder))
    await jobs.start()
    try:
        yield Lab(jobs, people, Retention(jobs, people, live))
    finally:
        await jobs.stop()
        people.close()


def test_only_what_nobody_needs_is_let_go_of(data: Path) -> None:
    async def check() -> None:
        async with lab(data, keep_jobs_days=30) as made:
            alice, bob = made.of(ALICE), made.of(BOB)
            old = await ended(made.jobs, await alice.submit(SMALL))
            shared = await ended(made.jobs, await alice.submit(SMALL, seed=2))
            await bob.submit(SMALL, seed=2, project="show")
            studied = await ended(made.jobs, await alice.submit(SMALL, seed=3))
            made.people.studies.add(ALICE, "seeds", "seed", "", [(3, studied.id)])
            assert await made.retention.sweep() == Swept(), "nothing is old"
            waits = await alice.submit(SMALL, seed=4)
            assert await made.retention.sweep(LATER) == Swept(references=2, jobs=0)
            assert made.jobs.register.find(old.id) is None
            assert (await alice.job(studied.id)).state == "done"
            assert {job.id for job in await alice.jobs(whose="mine")} == {studied.id, waits.id}
            assert [job.id for job in await bob.jobs(whose="mine")] == [shared.id]
            file = await made.jobs.file(shared.id, "plan.json")
            assert file.path.stat().st_size == file.size, "bob's is whole"
            said = [(entry.user, entry.object, entry.detail) for entry in made.people.log.entries() if entry.action == "expire"]
            assert sorted(said) == sorted([("(retention)", old.id, "of alice"), ("(retention)", shared.id, "of alice")])
            assert (await ended(made.jobs, waits)).state == "done"

    run(check())


def test_a_job_stays_while_something_is_made_of_its_flight(data: Path) -> None:
    async def check() -> None:
        async with lab(data, keep_jobs_days=30) as made:
            job = await ended(made.jobs, await made.of(ALICE).submit(SMALL))
            made.jobs.register.add(
                export := Entry(Job(id="e-1", kind="export", of=job.id, mission="m", submitted=""), {"mission": "0" * 64})
            )
            assert (await made.retention.sweep(LATER)).references == 0
            export.change(state="done", ended=(LATER - timedelta(days=1)).isoformat(timespec="milliseconds"))
            assert (await made.retention.sweep(LATER)).references == 0, "somebody made it a day ago"
            made.jobs.register.drop(export)
            assert (await made.retention.sweep(LATER)).references == 1

    run(check())


def test_what_was_deleted_comes_back_by_submitting_it_again(data: Path) -> None:
    async def check() -> None:
        async with lab(data, keep_deleted_days=7) as made:
            alice = made.of(ALICE)
            job = await ended(made.jobs, await alice.submit(SMALL))
            await alice.delete(job.id)
            assert await alice.jobs(whose="mine") == []
            again = await alice.submit(SMALL)
            assert (again.id, again.found) == (job.id, True)
            assert made.people.references.leaving() == ()
            await alice.delete(job.id)
        async with lab(data, keep_deleted_days=7) as made:
            made.people.references.adopt([(job.id, "alice")])
            assert made.people.references.users(job.id) == (), "a restart brings nothing back"
            assert await made.retention.delete_left() == 0
            assert (await made.of(ROOT).job(job.id)).state == "done"
            assert await made.retention.delete_left(datetime.now(UTC) + timedelta(days=8)) == 1
            assert made.jobs.register.find(job.id) is None
            assert made.people.references.leaving() == ()
            job = await ended(made.jobs, await made.of(ALICE).submit(SMALL))
            await made.of(ALICE).delete(job.id)
            await made.of(ROOT).delete(job.id)
            assert made.jobs.register.find(job.id) is None, "an admin does not wait for that"

    run(check())


def test_the_log_and_recordings_go_by_their_age(tmp_path: Path) -> None:
    async def check() -> None:
        async with lab(tmp_path / "data", keep_log_days=30, keep_recordings_days=30) as made:
            flights = tmp_path / "data" / "flights"
            flights.mkdir()
            for name in ("1.jsonl.gz", "2.jsonl.gz", "notes.jsonl.gz"):
                (flights / name).write_bytes(b"")
                os.utime(flights / name, (1.0, 1.0))
            (flights / "3.jsonl.gz").write_bytes(b"")
            made.people.log.write(ALICE, "submit")
            assert await made.retention.sweep() == Swept(recordings=1)
            assert sorted(path.name for path in flights.iterdir()) == ["2.jsonl.gz", "3.jsonl.gz", "notes.jsonl.gz"]
            swept = await made.retention.sweep(LATER)
            assert swept.entries >= 1
            assert made.people.log.entries() == ()

    run(check())


def test_by_default_nothing_goes_by_its_age(data: Path) -> None:
    async def check() -> None:
        async with lab(data) as made:
            job = await ended(made.jobs, await made.of(ALICE).submit(SMALL))
            assert await made.retention.sweep(datetime(9000, 1, 1, tzinfo=UTC)) == Swept()
            assert (await made.of(ALICE).job(job.id)).state == "done"

    run(check())


@given(
    st.datetimes(min_value=datetime(2026, 1, 1), max_value=datetime(2200, 1, 1)), st.floats(min_value=0.01, max_value=20_000.0)
)
def test_the_page_says_no_day_too_late(now: datetime, days: float) -> None:
    """What a sweep takes off at an instant was said to be kept until that day, or an earlier one."""
    ended_at = before(now.replace(tzinfo=UTC), days)
    job = Job(id="a", mission="m", submitted="", ended=ended_at)
    until = kept_until(job, Limits(keep_jobs_days=days))
    assert until is not None
    assert until <= now.strftime("%Y-%m-%d")
    assert kept_until(job.model_copy(update={"project": "show"}), Limits(keep_jobs_days=days)) is None
    assert kept_until(job, Limits()) is None
