"""Stored values that are damaged: none is served, all that stages take is made once more, and asking again mends the rest."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from ltlplan.service.execution.exporting import ExportAsked
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.job_queue.store import Damaged, Store
from ltlplan.service.models import Job
from ltlplan.service.service import places
from tests.helpers.few import few_of
from tests.helpers.serving.job_services import SMALL, begun, ended, run, service

pytestmark = pytest.mark.xdist_group("service")


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes() or b"x")  # what the last stage leaves for the next is empty
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1] or b"x")


DAMAGES = [flipped, cut, Path.unlink]
Damage = Callable[[Path], None]


async def contents(jobs: Jobs, job: Job) -> dict[str, bytes]:
    return {file.name: (await jobs.file(job.id, file.name)).path.read_bytes() for file in job.files}


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda each: each.__name__)
def test_a_value_that_is_kept_once_more_is_whole_again(tmp_path: Path, damage: Damage) -> None:
    store = Store(tmp_path)
    digest = store.put(b"value")
    damage(store.path(digest))
    assert not store.is_sound(digest)
    for read in (store.get, store.require):
        with pytest.raises(Damaged, match=digest[:12]) as caught:
            read(digest)
        assert caught.value.digest == digest
    assert store.put(b"value") == digest
    assert store.get(digest) == b"value"
    assert store.require(digest).read_bytes() == b"value"


@few_of(1, "damage", DAMAGES, ids=lambda each: each.__name__)
def test_nothing_damaged_is_served_and_asking_again_mends_it(data: Path, damage: Damage) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            sound = await contents(jobs, job)
            store = Store(data / "values")
            for digest in store.digests():
                damage(store.path(digest))
            for name in sound:
                with pytest.raises(Damaged, match="submit the same mission again"):
                    await jobs.file(job.id, name)
            for asked in (
                places(jobs, job.id),
                jobs.plan(job.id),
                jobs.mission(job.id),
                jobs.derive(job.id, ExportAsked("px4")),
            ):
                with pytest.raises(Damaged):
                    await asked
            again = await jobs.submit(SMALL)
            assert (again.found, again.id != job.id) == (False, True)
            again = await ended(jobs, again)
            assert again.state == "done"
            assert await contents(jobs, again) == sound == await contents(jobs, job)
            assert (await jobs.submit(SMALL)).id == again.id

    run(check())


@pytest.mark.slow
@few_of(1, "damage", DAMAGES, ids=lambda each: each.__name__)
def test_what_a_stage_takes_is_made_once_more(data: Path, tmp_path: Path, damage: Damage) -> None:
    async def check() -> None:
        async with service(stopped, workers=1) as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job, "flight")
        store = Store(stopped / "values")
        async with service(data) as jobs:
            undisturbed = await contents(jobs, await ended(jobs, await jobs.submit(SMALL)))
        with closing(sqlite3.connect(stopped / "jobs.sqlite")) as connection:
            records = [json.loads(output) for (output,) in connection.execute("SELECT output FROM operation_outputs")]
        assert [record["stage"] for record in records] == ["plan", "round 1"]
        for record in records:
            damage(store.path(record["value"]))
        async with service(stopped) as jobs:
            job = await ended(jobs, job)
            assert (job.state, job.problem) == ("done", None)
            assert await contents(jobs, job) == undisturbed

    stopped = tmp_path / "stopped"
    run(check())


def test_a_mission_that_is_damaged_fails_in_words_and_may_be_submitted_again(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data", workers=1) as jobs:
            job = await jobs.submit(SMALL, seed=1)
            store = Store(tmp_path / "data" / "values")
        for digest in store.digests():
            flipped(store.path(digest))
        async with service(tmp_path / "data") as jobs:
            job = await ended(jobs, job)
            assert job.problem is not None
            assert (job.state, job.problem.type) == ("failed", "/problems/damaged")
            assert (await ended(jobs, await jobs.submit(SMALL, seed=1))).state == "done"

    run(check())
