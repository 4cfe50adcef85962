"""Exports are jobs: accepted once, done whatever happens, found again, and gone with the job whose flight they write."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

import flight
import ltlplan
from ltlplan.service.execution.exporting import ExportAsked
from ltlplan.service.job_queue.jobs import Jobs
from ltlplan.service.models import Job
from ltlplan.service.problems import Conflict, NotFound
from tests.helpers.serving.job_services import SMALL, ended, run, service

pytestmark = pytest.mark.xdist_group("service")
CSV = ExportAsked("crazyflie")


async def archive(jobs: Jobs, export: Job) -> dict[str, bytes]:
    (file,) = export.files
    packed = (await jobs.file(export.id, file.name)).path.read_bytes()
    with zipfile.ZipFile(io.BytesIO(packed)) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def test_an_export_is_a_job_whose_archive_is_what_the_library_writes(data: Path, tmp_path: Path) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            made = await jobs.derive(job.id, CSV)
            assert (made.of, made.found, made.state, made.mission) == (job.id, False, "queued", job.mission)
            made = await ended(jobs, made)
            assert (made.state, [stage.name for stage in made.stages], made.share) == ("done", ["export"], 1.0)
            written = await archive(jobs, made)
            assert {name for name in written if not name.startswith("proof/")} == expected.keys()
            assert {"proof/check.pyz", "proof/proof.json", "proof/statement.json"} < written.keys()
            count = len(made_here.certificate.claims)
            assert f"{count} of {count} claims checked by the kernel" in written["README.txt"].decode()
            assert [name for name in expected if name.endswith(".csv") and written[name] != expected[name]] == []
            again = await jobs.derive(job.id, CSV)
            assert (again.id, again.found) == (made.id, True)
            assert (await jobs.derive(job.id, ExportAsked("crazyflie", anyway=True))).id != made.id
            assert [each.id for each in await jobs.jobs()] == [job.id], "exports are not listed"
        async with service(data) as jobs:
            assert (await jobs.derive(job.id, CSV)).found
            with pytest.raises(Conflict, match=f"the mission is that of job {job.id}"):
                await jobs.mission(made.id)
            await jobs.delete(job.id)
            with pytest.raises(NotFound):
                await jobs.job(made.id)
            assert list((data / "values").glob("??/*")) == []

    made_here = ltlplan.run(SMALL)
    flight.export(made_here.team, made_here.certificate, tmp_path / "exported", format="crazyflie", flight=made_here.log)
    exported = [path for path in (tmp_path / "exported").rglob("*") if path.is_file() and path.name != "manifest.json"]
    expected = {str(path.relative_to(tmp_path / "exported")): path.read_bytes() for path in exported}
    run(check())


def test_what_cannot_be_exported_fails_in_words_and_is_not_tried_again(data: Path) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            with pytest.raises(NotFound):
                await jobs.derive("nope-1", CSV)
            waits = await jobs.submit(SMALL, seed=1)
            with pytest.raises(Conflict, match="has no files"):
                await jobs.derive(waits.id, CSV)
            await jobs.cancel(waits.id)
            job = await ended(jobs, await jobs.submit(SMALL))
            for asked in (ExportAsked("crazyflies"), ExportAsked("crazyflie", vehicle="other")):
                made = await ended(jobs, await jobs.derive(job.id, asked))
                assert made.problem is not None
                assert (made.state, made.problem.status) == ("failed", 422)
                assert (await jobs.derive(job.id, asked)).id == made.id
            written = await ended(jobs, await jobs.derive(job.id, CSV))
            with pytest.raises(Conflict, match="is an export"):
                await jobs.derive(written.id, CSV)

    run(check())


@pytest.mark.slow  # an export is a job, and jobs go on
def test_an_export_goes_on_after_a_stop(data: Path) -> None:
    async def check() -> None:
        async with service(data) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            made = await jobs.derive(job.id, CSV)
        async with service(data) as jobs:
            assert (await ended(jobs, await jobs.job(made.id))).state == "done"

    run(check())


@pytest.mark.slow
def test_the_largest_shipped_mission_is_exported(tmp_path: Path) -> None:
    async def check() -> None:
        async with service(tmp_path / "data") as jobs:
            job = await ended(jobs, await jobs.submit(ltlplan.load_mission("warehouse")))
            made = await ended(jobs, await jobs.derive(job.id, ExportAsked("crazyswarm2")))
            assert (made.state, made.problem) == ("done", None)
            assert await archive(jobs, made)

    run(check(), 3000)
