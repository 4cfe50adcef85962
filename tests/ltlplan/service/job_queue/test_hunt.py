"""Kills of any process of a real service at random instants: every accepted job ends, with the bytes of a service that nobody disturbed."""

from __future__ import annotations

import random
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from ltlplan import Client
from ltlplan.missions import shipped_mission_text
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.execution.resource_limits import WorkerDied
from ltlplan.service.models import ENDED, Health
from tests.helpers.serving.postgres import Server, postgres_server
from tests.helpers.serving.process_trees import FORK_SERVER, children, command_line, kill, tree
from tests.helpers.serving.services import ONE_HOOP, Served, start
from tests.helpers.serving.waiting import is_gone, until

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("service")]

PATIENCE = 900.0
"""s that anything may take: many times what an idle machine needs."""

IMPOSSIBLE = ONE_HOOP.replace("F hoop0", "F hoop0 & G !hoop0")
PARTS = shipped_mission_text("door-puzzle")
ASKED = [(PARTS, 0), (ONE_HOOP, 1), (IMPOSSIBLE, 0), (shipped_mission_text("hoops-ltl"), 0), (ONE_HOOP, 2), (PARTS, 1)]
"""Texts and seeds: a flight in parts among them, and one that has no plan."""

Made = dict[str, bytes]


def made_of(job: Submitted) -> Made:
    """Return all that a job has made."""
    return {file.name: job.file(file.name) for file in job.files}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> list[Made]:
    """Return what a service makes that nobody disturbs, in the order of `ASKED`."""
    process, served = start(tmp_path_factory.mktemp("undisturbed") / "data", workers=2)
    try:
        with Client(served.url) as client:
            jobs = [client.submit_text(text, seed=seed) for text, seed in ASKED]
            for job in jobs:
                for _event in job.events():
                    pass
            assert [job.state for job in jobs] == ["failed" if text == IMPOSSIBLE else "done" for text, _ in ASKED]
            return [made_of(job) for job in jobs]
    finally:
        process.terminate()
        process.wait(60)


class Hunted:
    """A service whose processes are killed.

    Attributes:
        killed: How many of each kind.
        seen: All processes that it ever was seen to have.
        accepted: What each job that it accepted was asked, by its id: an index into `ASKED`.
        exports: Ids of the exports that it accepted.
    """

    def __init__(self, data: Path, draw: random.Random, **settings: Any) -> None:
        self.killed: Counter[str] = Counter()
        self.seen: set[int] = set()
        self.accepted: dict[str, int] = {}
        self.exports: set[str] = set()
        self._data, self._draw, self._settings = data, draw, settings
        self._process, self.served = self._start()

    def _start(self) -> tuple[subprocess.Popen[bytes], Served]:
        return start(self._data, workers=2, **self._settings)

    def submit(self, index: int) -> None:
        """Ask for a job; it is accepted, or refused since whoever reads its mission was killed three times."""
        text, seed = ASKED[index]
        with suppress(WorkerDied), Client(self.served.url, timeout=PATIENCE) as client:
            self.accepted[client.submit_text(text, seed=seed).id] = index

    def ask(self) -> None:
        """Ask something short, for the service's own word, and for exports: all are answered, whatever was killed."""
        with httpx.Client(base_url=self.served.url, timeout=PATIENCE) as http:
            checked = http.post("/api/missions/check", content=ONE_HOOP, headers={"content-type": "application/yaml"})
            assert checked.status_code in (200, 500), checked.text
            if checked.status_code == 500:
                assert checked.json()["type"] == "/problems/worker-died"
            told = http.get("/health")
            health = Health.model_validate_json(told.content)
            assert (told.status_code == 200) == health.ok
            assert health.ok or health.computing != "answers", "nothing but workers is disturbed for long"
            jobs = http.get("/api/jobs").json()
            assert health.running + health.queued <= len(jobs) + len(self.exports)
            for job in jobs:
                if job["state"] == "done":
                    accepted = http.post(f"/api/jobs/{job['id']}/exports/crazyflie")
                    assert accepted.status_code in (200, 201), accepted.text
                    self.exports.add(accepted.json()["id"])

    def kill_one(self, others: list[int]) -> None:
        """Kill a process of a kind that is drawn first, so that the rare ones have their share; start the service again where it was that."""
        kinds: dict[str, list[int]] = {"service": [self._process.pid]}
        for pid in tree(self._process.pid)[1:]:
            forked = FORK_SERVER in command_line(pid)
            own = pid in children(self._process.pid)
            kinds.setdefault("fork server" if forked and own else "worker" if forked else "helper", []).append(pid)
        if others:
            kinds["database"] = others
        self.seen.update(pid for pids in kinds.values() for pid in pids if pid not in others)
        kind = self._draw.choice(sorted(kinds))
        victim = self._draw.choice(sorted(kinds[kind]))
        self.killed[kind] += kill(victim)
        if kind == "service":
            self._process.wait(60)
            self._process, self.served = self._start()

    def stop(self) -> None:
        self.seen.update(tree(self._process.pid))
        self._process.terminate()
        assert self._process.wait(120) == 0


def hunt(hunted: Hunted, kills: int, draw: random.Random, victims: Server | None = None) -> None:
    """Submit all jobs while processes are killed."""
    waiting = list(range(len(ASKED)))
    while sum(hunted.killed.values()) < kills or waiting:
        if waiting:
            hunted.submit(waiting.pop(0))
        time.sleep(3.0 * draw.random() ** 2)
        hunted.kill_one([] if victims is None else victims.backends())
        if draw.random() < 0.3:
            hunted.ask()


def assert_all_ended(hunted: Hunted, undisturbed: list[Made]) -> Counter[str]:
    """Wait for all jobs; return how many were given up for their helpers' deaths."""
    given_up: Counter[str] = Counter()
    with Client(hunted.served.url, timeout=PATIENCE) as client:
        listed = {job.id for job in client.jobs(limit=500)}
        assert listed >= hunted.accepted.keys()
        for job_id in sorted(listed | hunted.exports):
            job = client.job(job_id)
            for _event in job.events():
                pass
            assert job.state in ENDED
            if job.job.problem is not None:
                assert job.job.problem.detail
                given_up[job.job.problem.type] += 1
        for index, (text, seed) in enumerate(ASKED):  # what was given up is done when it is asked for again
            again = client.submit_text(text, seed=seed)
            for _event in again.events():
                pass
            assert again.state == ("failed" if text == IMPOSSIBLE else "done"), again.job.problem
            assert made_of(again) == undisturbed[index]
        for job_id, index in hunted.accepted.items():
            job = client.job(job_id)
            assert job.state == "failed" or made_of(job) == undisturbed[index]
    return given_up


def assert_whole(hunted: Hunted) -> None:
    """Hold the service to what it says of itself at the end, and to leaving nothing behind."""
    with httpx.Client(base_url=hunted.served.url, timeout=PATIENCE) as http:
        health = Health.model_validate_json(http.get("/health").content)
    assert (health.ok, health.database, health.computing, health.interrupted) == (True, "answers", "answers", {})
    assert (health.running, health.queued) == (0, 0)
    hunted.stop()
    assert until(lambda: all(is_gone(pid) for pid in hunted.seen), 60.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_is_killed_every_accepted_job_ends(tmp_path: Path, undisturbed: list[Made], seed: int) -> None:
    draw = random.Random(seed)
    hunted = Hunted(tmp_path / "data", draw)
    hunt(hunted, 24, draw)
    given_up = assert_all_ended(hunted, undisturbed)
    assert given_up.keys() <= {"/problems/worker-died", "/problems/unsatisfiable", "/problems/no-plan"}
    assert {"service", "fork server", "worker"} <= hunted.killed.keys()
    assert_whole(hunted)


@pytest.fixture(scope="module")
def database() -> Iterator[Server]:
    with postgres_server() as server:
        yield server


def test_whatever_is_killed_of_the_database_too_every_accepted_job_ends(
    tmp_path: Path, undisturbed: list[Made], database: Server
) -> None:
    draw = random.Random(3)
    hunted = Hunted(tmp_path / "data", draw, database=database.create("hunted"))
    hunt(hunted, 12, draw, database)
    assert_all_ended(hunted, undisturbed)
    assert hunted.killed["database"]
    assert_whole(hunted)
