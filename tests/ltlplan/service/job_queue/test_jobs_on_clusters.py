"""Jobs whose stages a Dask cluster does: their files are the command's, and they outlive the scheduler and all of its workers."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

import ltlplan
from ltlplan.service.execution.clusters import Cluster
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import Job
from ltlplan.service.settings import Settings
from tests.helpers.serving.clusters import LocalCluster

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("service")]

MISSION = ltlplan.load_mission("hoops-published")


async def until(jobs: Jobs, job: Job, sentence: str) -> None:
    async with asyncio.timeout(120):
        while sentence not in (await jobs.job(job.id)).sentence:
            await asyncio.sleep(0.05)


async def ended(jobs: Jobs, job: Job) -> Job:
    async with asyncio.timeout(300):
        async for _event in jobs.events(job.id):
            pass
    return await jobs.job(job.id)


def test_a_job_goes_on_when_its_scheduler_is_back(tmp_path: Path) -> None:
    written = tmp_path / "run"
    ltlplan.run(MISSION, written)
    (tmp_path / "data").mkdir()
    machines = [LocalCluster()]
    machines[0].work(2)
    address = machines[0].address

    async def check() -> None:
        cluster = await asyncio.to_thread(Cluster, address, patient=True)
        jobs = Jobs(Settings(data=tmp_path / "data"), cluster)
        await jobs.start()
        try:
            job = await jobs.submit(MISSION)
            await until(jobs, job, "simulating the flight")
            machines[0].kill()
            await until(jobs, job, f"waiting for the Dask scheduler at {address}")
            assert (await jobs.job(job.id)).state == "running"
            machines.append(LocalCluster(int(address.rpartition(":")[2])))
            machines[1].work(1)
            assert (await ended(jobs, job)).state == "done"
            for file in written.rglob("*"):
                if file.is_file():
                    stored = await jobs.file(job.id, str(file.relative_to(written)))
                    assert stored.path.read_bytes() == file.read_bytes(), file
            another = await jobs.submit(MISSION, seed=1)
            await until(jobs, another, "simulating the flight")
            assert (await jobs.cancel(another.id)).state == "cancelled"
        finally:
            await jobs.stop()
            await asyncio.to_thread(cluster.close)

    try:
        asyncio.run(check())
    finally:
        for running in machines:
            running.kill()
