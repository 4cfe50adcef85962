"""Jobs in PostgreSQL: the same as in SQLite, on a real server."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from ltlplan import Client
from ltlplan.service.problems import Conflict
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import begun, ended, heard, run, service
from tests.helpers.serving.jobs_process import NOTES
from tests.helpers.serving.postgres import USER, Server
from tests.helpers.serving.process_trees import command_line, environment_of, tree
from tests.helpers.serving.services import ONE_HOOP
from tests.helpers.serving.waiting import until
from verify.data import BadInput

pytestmark = pytest.mark.xdist_group("service")

SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")


def test_jobs_are_done_found_cancelled_and_deleted(server: Server, tmp_path: Path) -> None:
    async def check() -> None:
        url = server.create("jobs")
        async with service(tmp_path / "data", database=url) as jobs:
            job = await ended(jobs, await jobs.submit(SMALL))
            assert job.state == "done"
            live = await heard(jobs, job)
            other = await jobs.submit(SMALL, seed=1)
            with pytest.raises(Conflict):
                await jobs.delete(other.id)
            assert (await jobs.cancel(other.id)).state == "cancelled"
            assert (await jobs.health()).database == "answers"
        async with service(tmp_path / "data", database=url) as jobs:
            again = await jobs.submit(SMALL)
            assert (again.id, again.found, again.state) == (job.id, True, "done")
            assert await heard(jobs, job) == live
            assert await jobs.job(job.id) == job
            await jobs.delete(job.id)
            await jobs.delete(other.id)
            assert await jobs.jobs() == []
            assert not (tmp_path / "data" / "jobs.sqlite").exists()

    run(check())


@pytest.mark.slow
def test_a_server_that_goes_away_delays_jobs_and_loses_none(server: Server, tmp_path: Path) -> None:
    def away() -> None:
        server.stop()
        time.sleep(2)
        server.start()

    async def check() -> None:
        async with service(tmp_path / "data", database=server.create("away")) as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job)
            break_of = threading.Thread(target=away)
            break_of.start()
            assert (await ended(jobs, job)).state == "done"
            break_of.join()
            assert (await ended(jobs, await jobs.submit(SMALL, seed=1))).state == "done"

    run(check())


@pytest.mark.slow
def test_a_killed_service_goes_on(server: Server, tmp_path: Path) -> None:
    url = server.create("killed")
    data = tmp_path / "data"
    root = Path(__file__).parents[4]

    def start() -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "tests.helpers.serving.jobs_process", str(data), "2", url]
        return subprocess.Popen(command, cwd=root, env={**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1"})

    def noted() -> str:
        place = data.with_name(f"data.{NOTES}")
        return place.read_text(encoding="utf-8") if place.exists() else ""

    process = start()
    while "round 1 begins" not in noted():
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait(300)
    planned = {line for line in noted().splitlines() if line.endswith("round 1 begins")}
    before = len(noted())
    assert start().wait(300) == 0
    lines = noted()[before:].splitlines()
    ended_as = [json.loads(line.split(maxsplit=2)[2])[0] for line in lines if line.startswith("ended ")]
    assert ended_as == ["done", "done"]
    assert not [line for line in lines if line.replace("plan begins", "round 1 begins") in planned and "plan" in line]


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("UPDATE dbos.dbos_migrations SET version = 10000", "newer ltlplan"),
        ("UPDATE ltlplan_service SET value = 'x' WHERE name = 'folder'", "another data folder"),
    ],
)
def test_a_database_that_is_not_ours_is_refused(server: Server, tmp_path: Path, statement: str, words: str) -> None:
    async def check() -> None:
        name = f"other{len(words)}"
        url = server.create(name)
        async with service(tmp_path / "data", database=url):
            pass
        server.sql(name, statement)
        with pytest.raises(BadInput, match=words):
            async with service(tmp_path / "data", database=url):
                pass

    run(check())


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("postgresql://postgres:secret@127.0.0.1:1/nothing", "cannot be used"),
        ("mysql://root@localhost/jobs", "PostgreSQL URL"),
        ("nonsense", "no URL"),
    ],
)
def test_a_database_that_is_not_there_is_refused_without_its_password(tmp_path: Path, url: str, words: str) -> None:
    async def check() -> None:
        with pytest.raises(BadInput, match=words) as refused:
            async with service(tmp_path / "data", database=url):
                pass
        assert "secret" not in str(refused.value)

    run(check())


@pytest.mark.slow
@pytest.mark.parametrize("way", ["variable", "file", "passfile"])
def test_the_password_is_in_no_command_line_and_no_worker_s_environment(server: Server, tmp_path: Path, way: str) -> None:
    secret = "s3cret-in-nobody-s-sight"  # of a server of this test's own
    user = server.with_password(secret)
    url = server.create(f"secret-{way}").replace(f"//{USER}@", f"//{user}:{secret}@")
    options, environment = [], {}
    if way == "variable":
        environment["LTLPLAN_DB"] = url
    elif way == "file":
        (tmp_path / "url").write_text(url)
        (tmp_path / "url").chmod(0o600)
        options = ["--db-file", str(tmp_path / "url")]
    else:
        (tmp_path / "pass").write_text(f"127.0.0.1:*:*:{user}:{secret}\n")
        (tmp_path / "pass").chmod(0o600)
        environment["PGPASSFILE"] = str(tmp_path / "pass")
        options = ["--db", url.replace(f":{secret}@", "@")]
    log = tmp_path / "log"
    command = [sys.executable, "-m", "ltlplan", "serve", "--no-page", "--port", "0", "--data", str(tmp_path / "data"), *options]
    with log.open("w") as told:
        process = subprocess.Popen(command, stdout=told, stderr=told, env={**os.environ, **environment})
    try:
        assert until(lambda: "serves at" in log.read_text() or process.poll() is not None, 120)
        with Client(log.read_text().split("serves at ")[1].split()[0].rstrip("/")) as client:
            job = client.submit_text(ONE_HOOP)
            for _event in job.events():
                for pid in tree(process.pid):
                    assert secret not in command_line(pid)
                    assert pid == process.pid or secret not in environment_of(pid)
            assert job.state == "done"
    finally:
        process.terminate()
        process.wait(60)
    assert secret not in log.read_text()
