"""Backups of services whose jobs are in PostgreSQL: under load, restored into PostgreSQL or SQLite elsewhere, and nothing lost."""

from __future__ import annotations

import hashlib
import json
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ltlplan import Client
from ltlplan.cli import app
from ltlplan.service.storage.backups import back_up, restore
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import ended, heard, run, service
from tests.helpers.serving.postgres import Server
from tests.helpers.serving.services import ONE_HOOP, serving, submitting
from verify.data import BadInput

pytestmark = pytest.mark.xdist_group("service")

SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")


def test_jobs_go_from_postgresql_to_sqlite_and_to_postgresql(server: Server, tmp_path: Path) -> None:
    async def check() -> None:
        data, url, other = tmp_path / "data", server.create("first"), server.create("second")
        async with service(data, database=url) as jobs:
            done = await ended(jobs, await jobs.submit(SMALL))
            failed = await ended(jobs, await jobs.submit(small_mission("F a & G !a", margin=0.05)))
            cancelled = await jobs.cancel((await jobs.submit(SMALL, seed=1)).id)
            events = await heard(jobs, done)
            told = CliRunner().invoke(app, ["backup", str(tmp_path / "lab.tar"), "--data", str(data), "--db", url, "--json"])
            assert json.loads(told.stdout)["jobs"] == 3, told.stderr
        restore(tmp_path / "lab.tar", tmp_path / "files")
        told = CliRunner().invoke(
            app, ["restore", str(tmp_path / "lab.tar"), "--data", str(tmp_path / "tables"), "--db", other]
        )
        assert told.stdout.startswith("3 jobs and "), told.stderr
        assert (tmp_path / "files" / "jobs.sqlite").exists()
        assert not list((tmp_path / "tables").glob("jobs.sqlite*"))
        for again in (service(tmp_path / "files"), service(tmp_path / "tables", database=other)):
            async with again as jobs:
                for each in (done, failed, cancelled):
                    found = await jobs.job(each.id)
                    assert (found.state, found.files, found.problem) == (each.state, each.files, each.problem)
                assert await heard(jobs, done) == events
                assert (await jobs.submit(SMALL)).found
        async with service(tmp_path / "tables", database=other) as jobs:
            assert (await ended(jobs, await jobs.submit(SMALL, seed=2))).state == "done"

    run(check())


def test_what_is_not_this_folders_or_not_empty_is_refused(server: Server, tmp_path: Path) -> None:
    async def begun(folder: Path, url: str) -> None:
        async with service(folder, database=url):
            pass

    urls = [server.create(f"refused{number}") for number in range(3)]
    for number in range(2):
        run(begun(tmp_path / str(number), urls[number]))
    with pytest.raises(BadInput, match="are in PostgreSQL: name its database"):
        back_up(tmp_path / "0", tmp_path / "lab.tar")
    with pytest.raises(BadInput, match="belongs to another data folder"):
        back_up(tmp_path / "0", tmp_path / "lab.tar", urls[1])
    with pytest.raises(BadInput, match="has no jobs of a service"):
        back_up(tmp_path / "0", tmp_path / "lab.tar", urls[2])
    with pytest.raises(BadInput, match="cannot be used"):
        back_up(tmp_path / "0", tmp_path / "lab.tar", server.url("nowhere"))
    assert not (tmp_path / "lab.tar").exists()
    back_up(tmp_path / "0", tmp_path / "lab.tar", urls[0])
    with pytest.raises(BadInput, match="has jobs already"):
        restore(tmp_path / "lab.tar", tmp_path / "new", urls[1])
    assert not (tmp_path / "new").exists()
    server.sql("refused0", "UPDATE dbos.dbos_migrations SET version = 3")
    with pytest.raises(BadInput, match="another version of ltlplan"):
        back_up(tmp_path / "0", tmp_path / "more.tar", urls[0])


@pytest.mark.slow
def test_a_backup_under_load_has_all_that_was_accepted_before_it(server: Server, tmp_path: Path) -> None:
    data, url, other = tmp_path / "data", server.create("load"), server.create("restored")
    before: list[set[str]] = []
    with serving(data, workers=2, database=url) as served, Client(served.url) as client:
        first = client.submit_text(ONE_HOOP, seed=0).wait()
        with submitting(served.url) as accepted:
            for number in range(3):
                time.sleep(1)
                before.append({first.id, *accepted})
                assert back_up(data, tmp_path / f"lab-{number}.tar", url).damaged == ()
    for number, database in ((0, None), (2, other)):
        again = tmp_path / f"again-{number}"
        restore(tmp_path / f"lab-{number}.tar", again, database)
        with serving(again, workers=2, database=database) as served, Client(served.url) as client:
            jobs = client.jobs(limit=500)
            assert before[number] <= {job.id for job in jobs}
            assert client.recheck(first.id).holds
            for job in jobs:
                if job.state == "done":
                    for file in job.files:
                        assert hashlib.sha256(job.file(file.name)).hexdigest() == file.sha256
