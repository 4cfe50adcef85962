"""Searches that are stopped at the best plan so far: attempts of their own, which answer nobody else."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from ltlplan.reproduction.published_missions import office_grid
from ltlplan.service.execution.stages import run_stage
from ltlplan.service.execution.workers import LocalWorkers, WorkFuture
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import Job
from ltlplan.service.problems import Conflict
from ltlplan.service.settings import Settings
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import begun, ended, run, service
from tests.helpers.serving.work_for_workers import search_until_ended

pytestmark = pytest.mark.xdist_group("service")

SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")


class Searching(LocalWorkers):
    """Workers whose every stage is a search that goes on until it is asked to end."""

    def submit(self, work: Any, /, *arguments: Any, **rest: Any) -> WorkFuture:
        return super().submit(search_until_ended if work is run_stage else work, *arguments, **rest)


@asynccontextmanager
async def searching(folder: Path) -> AsyncGenerator[Jobs]:
    folder.mkdir(exist_ok=True)
    jobs = Jobs(Settings(data=folder), Searching(1))
    try:
        await jobs.start()
        yield jobs
    finally:
        await jobs.stop()


def end_search(jobs: Jobs, job: Job) -> None:
    jobs.runner.end_search(jobs.register.entry(job.id))


def test_a_stopped_search_is_an_attempt_and_no_answer(tmp_path: Path) -> None:
    async def check() -> None:
        async with searching(tmp_path / "data") as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job)
            assert (await jobs.submit(SMALL)).id == job.id
            end_search(jobs, job)
            while_it_ends = await jobs.submit(SMALL)
            assert (while_it_ends.id, while_it_ends.found) != (job.id, True)  # whoever submits it now has another search
            attempt = await ended(jobs, job)
            assert (attempt.state, attempt.stopped) == ("done", True)
            assert (await jobs.submit(SMALL)).id == while_it_ends.id
            await jobs.cancel(while_it_ends.id)
        async with searching(tmp_path / "data") as jobs:  # after a restart, too
            assert (await jobs.job(job.id)).stopped
            again = await jobs.submit(SMALL)
            assert again.id not in (job.id, while_it_ends.id)
            await jobs.cancel(again.id)

    run(check())


def test_a_search_that_ended_by_itself_is_the_answer_though_it_was_asked_to_end(tmp_path: Path) -> None:
    async def check() -> None:
        async with searching(tmp_path / "data") as jobs:
            job = await jobs.submit(SMALL, seed=1)
            await begun(jobs, job)
            jobs.register.entry(job.id).stopping = True  # as a request that came too late leaves it
            found = await ended(jobs, job)
            assert not found.stopped
            assert (await jobs.submit(SMALL, seed=1)).id == job.id

    run(check())


def test_only_what_searches_can_be_stopped(tmp_path: Path) -> None:
    async def check() -> None:
        async with searching(tmp_path / "data") as jobs:
            job = await jobs.submit(SMALL)
            waits = await jobs.submit(SMALL, seed=2)
            await begun(jobs, job)
            with pytest.raises(Conflict, match="does not search at the moment: it is queued"):
                end_search(jobs, waits)
            end_search(jobs, job)
            await ended(jobs, job)
            with pytest.raises(Conflict, match="it is done"):
                end_search(jobs, job)
            await jobs.cancel(waits.id)

    run(check())


@pytest.mark.slow
def test_the_best_plan_so_far_is_certified_and_states_its_bound(tmp_path: Path) -> None:
    """Six robots among two floors of an office, whose cheapest words are out of reach."""
    asked = ("n0_7", "n5_5", "n9_3", "n13_7", "n3_3", "n12_1", "n6_0", "n10_6")
    formula = " & ".join(f"F({a} & F {b})" for a, b in zip(asked, (*asked[1:], asked[0]), strict=True))
    mission = office_grid(f"{formula} & (!n9_3 U n10_6)")

    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await jobs.submit(mission)
            bound = 0.0
            async for event in jobs.events(job.id):
                if "no words cost less than" in event.sentence:
                    bound = float(event.sentence.rpartition(" ")[2])
                    break
            end_search(jobs, job)
            attempt = await ended(jobs, job)
            assert (attempt.state, attempt.stopped) == ("done", True)
            assert attempt.summary is not None
            assert attempt.summary["holds"]
            found = attempt.stages[0].found
            assert not found["complete"]
            assert found["notes"][0].startswith("The search was stopped on request after ")
            assert bound <= found["cost"]
            (proved,) = [note for note in found["notes"] if "the bound is" in note]
            assert bound <= float(proved.partition("the bound is ")[2].partition(";")[0]) + 1e-3

    run(check())
