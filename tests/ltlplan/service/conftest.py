"""One service for all tests that only ask it, in all processes of a run, which ends with the run; and a server of PostgreSQL for those of a module."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.service.client_parts.job_handle import Submitted
from tests.helpers.serving.job_services import SMALL, ended, run, service
from tests.helpers.serving.postgres import Server, postgres_server
from tests.helpers.serving.services import ONE_HOOP, Served, start

Once = Callable[[str, Callable[[Path], Any]], Any]


@pytest.fixture(scope="session")
def served(once: Once) -> Served:
    """Return a service that is running, with limits on time that tests can wait for."""
    guard = os.getppid() if "PYTEST_XDIST_WORKER" in os.environ else os.getpid()

    def made(folder: Path) -> Served:
        folder.mkdir()
        limits = {"body_seconds": 1.5, "head_seconds": 1.5, "reads": [1000.0, 100000], "questions_asked": [1000.0, 100000]}
        process, found = start(folder / "data", limits=limits, guard=guard)
        process.returncode = 0  # it outlives this process
        return found

    return once("service", made)


@pytest.fixture(scope="session")
def _with_a_done_job(once: Once) -> Path:
    def made(folder: Path) -> Path:
        async def done() -> None:
            async with service(folder, workers=1) as jobs:
                assert (await ended(jobs, await jobs.submit(SMALL))).state == "done"

        run(done())
        return folder

    return once("folder of a service", made)


@pytest.fixture
def data(_with_a_done_job: Path, tmp_path: Path) -> Path:
    """Return a data folder of a test's own, in which `SMALL` was planned, proved and flown before: whoever submits it finds it done."""
    return shutil.copytree(_with_a_done_job, tmp_path / "data")


@pytest.fixture(scope="module")
def server() -> Generator[Server]:
    """Yield a server of PostgreSQL."""
    with postgres_server() as started:
        yield started


@pytest.fixture
def http(served: Served) -> Generator[httpx.Client]:
    """Yield a connection to the service."""
    with httpx.Client(base_url=served.url, timeout=60, verify=False) as client:
        yield client


@pytest.fixture
def client(served: Served) -> Generator[Client]:
    """Yield a client of the service."""
    with Client(served.url) as client:
        yield client


@pytest.fixture
def done(client: Client) -> Submitted:
    """Return a job that is done."""
    return client.submit_text(ONE_HOOP).wait()
