"""Many jobs at once: none starves, small ones are not stuck behind large ones, and memory is bounded."""

from __future__ import annotations

import asyncio
import resource
from pathlib import Path
from typing import Any

import pytest

from ltlplan.service.execution import workers as workers_module
from ltlplan.service.execution.stages import run_stage
from ltlplan.service.execution.workers import LocalWorkers, WorkFuture
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.problems import TooManyRequests
from ltlplan.service.settings import Limits, Settings
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import ended, run
from tests.helpers.serving.work_for_workers import stand_in_stage

pytestmark = pytest.mark.xdist_group("service")

LARGE = 200
"""Seed of a job that takes 2 s of processor time; see `stand_in_stage`. Seeds of small ones are multiples of 1000 and take none."""


class StandIns(LocalWorkers):
    """Workers that only stand in for a job's stages, and note how many there were at the same time."""

    most = 0

    def submit(self, work: Any, /, *arguments: Any, **rest: Any) -> WorkFuture:
        future = super().submit(stand_in_stage if work is run_stage else work, *arguments, **rest)
        future.add_done_callback(lambda _future: setattr(self, "most", max(self.most, self.alive)))
        return future


def soon_long(monkeypatch: pytest.MonkeyPatch, after: float = 0.2) -> None:
    """Take work for long after some seconds, and let it compete with the rest of a busy machine."""
    monkeypatch.setattr(workers_module, "SHORT", after)
    monkeypatch.setattr(workers_module, "NICE", 0)


async def many_at_once(folder: Path, small: int, large: int) -> list[str]:
    """Do so many small and large jobs, the large ones first, and return them in the order in which they ended."""
    mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
    workers = StandIns(2)
    folder.mkdir()
    jobs = Jobs(Settings(data=folder), workers)
    await jobs.start()
    try:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        slow = [await jobs.submit(mission, seed=LARGE + 1000 * index) for index in range(large)]
        quick = [await jobs.submit(mission, seed=1000 * index) for index in range(small)]
        order: list[str] = []

        async def follow(job_id: str, kind: str) -> None:
            async for _event in jobs.events(job_id):
                pass
            order.append(kind)

        await asyncio.gather(*(follow(job.id, "large") for job in slow), *(follow(job.id, "small") for job in quick))
        assert {job.state for job in await jobs.jobs(limit=1000)} == {"done"}
        assert workers.most <= 4
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000
        return order
    finally:
        await jobs.stop()


@pytest.mark.slow
def test_small_jobs_are_not_stuck_behind_large_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    soon_long(monkeypatch)
    ended_as = run(many_at_once(tmp_path / "data", 6, 2))
    assert "large" in ended_as[5:], "they all came first, and would all end first"


@pytest.mark.slow
def test_two_hundred_jobs_at_once_are_all_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    soon_long(monkeypatch)
    ended_as = run(many_at_once(tmp_path / "data", 192, 8), 3000)
    assert len(ended_as) == 200
    assert "large" in ended_as[100:], "they all came first, and would all end first"


def test_a_long_piece_of_work_goes_on_where_it_is_when_others_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    soon_long(monkeypatch, after=0.1)
    pool = LocalWorkers(1)
    mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
    from ltlplan.planner import with_seed
    from ltlplan.service.execution.stages import mission_bytes

    began: list[str] = []
    value = mission_bytes(with_seed(mission, 40))
    futures = [pool.submit(stand_in_stage, "plan", value, progress=lambda *_said: began.append("")) for _ in range(2)]
    futures.append(pool.submit(stand_in_stage, "plan", mission_bytes(mission)))
    for future in futures:
        future.result(120)
    assert 2 <= len(began) <= 3  # the second is begun again, once, where the first had the only place for long work
    pool.close()


def test_a_job_that_was_accepted_first_is_begun_first(tmp_path: Path) -> None:
    async def check() -> None:
        workers = StandIns(1)
        (tmp_path / "data").mkdir()
        jobs = Jobs(Settings(data=tmp_path / "data"), workers)
        await jobs.start()
        made = [await jobs.submit(small_mission("F a", margin=0.05), seed=1000 * index) for index in range(6)]
        started = [(await ended(jobs, job)).started for job in made]
        assert started == sorted(started)
        await jobs.stop()

    run(check())


def test_users_take_turns(tmp_path: Path) -> None:
    async def check() -> None:
        data = tmp_path / "data"
        data.mkdir()
        jobs = Jobs(Settings(data=data), StandIns(1))
        await jobs.start()
        mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
        asked = ["a", "a", "a", "a", "b", "b", "c"]
        made = [await jobs.submit(mission, seed=1000 * index + 5, who=who) for index, who in enumerate(asked)]
        found = [await ended(jobs, job) for job in made]
        order = sorted(range(len(asked)), key=lambda index: str(found[index].started))
        assert order[:2] in ([0, 4], [0, 1]), "the first was begun at once, the second perhaps before others came"
        assert [index for index in order if asked[index] == "a"] == [0, 1, 2, 3]
        assert order.index(4) < order.index(2)
        assert order.index(6) < order.index(2)
        assert order.index(5) < order.index(3)
        await jobs.stop()

    run(check())


def test_one_user_s_jobs_do_not_fill_the_queue(tmp_path: Path) -> None:
    async def check() -> None:
        data = tmp_path / "data"
        data.mkdir()
        jobs = Jobs(Settings(data=data, limits=Limits(queued=10, queued_each=2)), StandIns(1))
        await jobs.start()
        mission = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
        begun = await jobs.submit(mission, seed=999, who="a")
        while (await jobs.job(begun.id)).state == "queued":
            await asyncio.sleep(0.01)
        for seed in (1999, 2999):
            await jobs.submit(mission, seed=seed, who="a")
        with pytest.raises(TooManyRequests, match="2 of your jobs"):
            await jobs.submit(mission, seed=3999, who="a")
        await jobs.submit(mission, seed=4999, who="b")
        await jobs.stop()

    run(check())
