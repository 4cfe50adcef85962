"""Services without a network, for tests of jobs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

from ltlplan.service.execution.workers import LocalWorkers
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import Event, Job
from ltlplan.service.settings import Settings
from tests.helpers.motion.flights import small_mission

Answer = TypeVar("Answer")
SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
"""A mission that is planned, proved and flown within a second."""


@asynccontextmanager
async def service(folder: Path, **changes: Any) -> AsyncIterator[Jobs]:
    """Keep jobs in a folder; `changes` are `workers` and what else the settings have."""
    workers = LocalWorkers(changes.pop("workers", 2))
    folder.mkdir(exist_ok=True)
    jobs = Jobs(Settings(data=folder, **changes), workers)
    try:
        await jobs.start()
        yield jobs
    finally:
        await jobs.stop()


def run(coroutine: Coroutine[Any, Any, Answer], limit: float = 300) -> Answer:
    """Run it; `limit`, in s, is many times what an idle machine needs."""
    return asyncio.run(asyncio.wait_for(coroutine, limit))


async def ended(jobs: Jobs, job: Job) -> Job:
    """Return a job when it has ended."""
    async for _event in jobs.events(job.id):
        pass
    return await jobs.job(job.id)


async def heard(jobs: Jobs, job: Job, *, after: int = 0) -> list[Event]:
    """Return all events of a job, when it has ended."""
    return [event async for event in jobs.events(job.id, after=after)]


async def begun(jobs: Jobs, job: Job, stage: str = "plan") -> None:
    """Wait until a stage of a job has begun."""
    async for event in jobs.events(job.id):
        if event.kind == "stage" and event.stage == stage:
            return
