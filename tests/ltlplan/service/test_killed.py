"""A service of which every process is killed at random while it works: nothing accepted is lost, computed wrong, or left half-written, and every job ends.

The service, what computes for it and the database's connections are killed, `LTLPLAN_KILLS` times, while missions, studies, campaigns and rehearsals come in.
"""

from __future__ import annotations

import os
import random
import sqlite3
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from ltlplan import Client
from ltlplan.service.client_parts.job_handle import Submitted
from ltlplan.service.job_queue.store import Store
from ltlplan.service.models import Job
from tests.helpers.serving.postgres import Server, postgres_server
from tests.helpers.serving.process_trees import kill, tree
from tests.helpers.serving.services import ONE_HOOP, serving, start
from tests.helpers.serving.waiting import until
from verify.data import LtlplanError

pytestmark = pytest.mark.xdist_group("service")

KILLS = int(os.environ.get("LTLPLAN_KILLS", "12"))
DIED = "/problems/worker-died"
"""Of a job whose worker was killed three times in one life of the service: it says so, and may be submitted again."""
READS = {"reads": (1000.0, 100_000)}
"""Of who looks at every file of every job that many kills leave."""
MOST = 40
"""Jobs that wait for others at most: more only makes the end later."""


class Killed:
    """A service that is killed, and begun again where it was.

    Attributes:
        accepted: Jobs that it has accepted, by id, each with how the same is asked of another service.
        studies: Studies that it has accepted, by id, with their sizes.
        counts: How often what was killed.
    """

    def __init__(self, data: Path, draw: random.Random, database: Server | None) -> None:
        self.data, self.draw, self.database = data, draw, database
        self.more: dict[str, Any] = {} if database is None else {"database": database.create("killed")}
        self.process, served = start(data, workers=2, limits=READS, **self.more)
        self.port, self.url = int(served.url.rpartition(":")[2]), served.url
        self.accepted: dict[str, tuple[str, Any]] = {}
        self.studies: dict[int, int] = {}
        self.counts = dict.fromkeys(("service", "worker", "connection"), 0)
        self.seen: set[int] = set()
        self._next = 0

    def submit(self, client: Client) -> None:
        """Submit something; what is answered is accepted."""
        self._next += 1
        match self.draw.choice(("mission", "mission", "study", "campaign", "rehearsal")):
            case "study":
                values = [self._next, self._next + 1000]
                made = client.study(client.check_mission(ONE_HOOP), "seed", values)
                self.studies[made.id] = made.size
                self.accepted |= {each.figures.job: ("mission", each.value) for each in made.members}
            case ("campaign" | "rehearsal") as kind if (flown := self._flown(client)) is not None:
                asked = (self.accepted[flown][1], self._next)
                work = client.campaign if kind == "campaign" else client.rehearse
                self.accepted[work(flown, runs=2, seed=self._next).id] = (kind, asked)
            case _:
                self.accepted[client.submit_text(ONE_HOOP, seed=self._next).id] = ("mission", self._next)

    def _flown(self, client: Client) -> str | None:
        missions = [job for job, (kind, _) in self.accepted.items() if kind == "mission"]
        return next((job for job in reversed(missions) if client.job(job).state == "done"), None)

    def kill(self) -> None:
        """Kill something, and begin the service again where it was that."""
        below = tree(self.process.pid)[1:]
        self.seen |= set(below)
        what = self.draw.choice(("service", "worker", "worker", "connection"))
        if what == "connection" and self.database is not None and (backends := self.database.backends()):
            self.counts[what] += kill(self.draw.choice(backends))
        elif what == "worker" and below:
            self.counts[what] += kill(self.draw.choice(below))
        else:
            self.process.kill()
            self.process.wait()
            self.counts["service"] += 1
            time.sleep(self.draw.random())
            self.begin()

    def begin(self) -> None:
        """Start it where it was."""
        self.process, _ = start(self.data, workers=2, port=self.port, limits=READS, **self.more)

    def end(self) -> None:
        """Stop it as a service is stopped, and see that nothing of it is left."""
        self.seen |= set(tree(self.process.pid))
        self.process.terminate()
        self.process.wait(60)
        assert until(lambda: not [pid for pid in self.seen if _runs(pid)], 30.0), "processes are left"


def _runs(pid: int) -> bool:
    """Return whether a process is there; one that has ended and waits for its parent is not."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@contextmanager
def killed(data: Path, kills: int, seed: int, database: Server | None) -> Iterator[Killed]:
    """Have a service that was killed so often while it was asked for things, and runs again."""
    made = Killed(data, random.Random(seed), database)
    try:
        while sum(made.counts.values()) < kills:
            with suppress(LtlplanError, ConnectionError), Client(made.url, timeout=20.0) as client:
                waiting = sum(job.state in ("queued", "running") for job in client.jobs(limit=500))
                for _ in range(made.draw.randrange(1, 4) if waiting < MOST else 0):
                    made.submit(client)
            time.sleep(2.0 * made.draw.random() ** 2)
            made.kill()
        if made.process.poll() is not None:  # a service whose database went away for good ends, and says so
            made.begin()
        yield made
    finally:
        made.process.kill()
        made.process.wait()


def ended(client: Client, job_id: str) -> Job:
    """Wait until a job has ended, and return it; one whose worker was killed three times is submitted again as people would."""
    job = client.job(job_id)
    for _ in job.events():
        pass
    return job.job


def files_of(client: Client, job_id: str) -> dict[str, bytes]:
    job = client.job(job_id)
    return {file.name: job.file(file.name) for file in job.files}


def same_elsewhere(client: Client, kind: str, asked: Any) -> Submitted:
    """Ask another service for the same."""
    if kind == "mission":
        return client.submit_text(ONE_HOOP, seed=asked).wait()
    flown = client.submit_text(ONE_HOOP, seed=asked[0]).wait()
    return (client.campaign if kind == "campaign" else client.rehearse)(flown, runs=2, seed=asked[1]).wait()


def assert_whole(made: Killed, tmp_path: Path) -> None:
    """Assert that all that was accepted has ended, as a service computes it that nobody kills, and that nothing is left half-written."""
    with Client(made.url, timeout=60.0) as client:
        found = {job: ended(client, job) for job in made.accepted}
        failed = {id_: job for id_, job in found.items() if job.state != "done"}
        assert {job.problem.type for job in failed.values() if job.problem is not None} <= {DIED}, failed
        assert len(failed) <= made.counts["worker"] / 3
        for study, size in made.studies.items():
            assert len(client.studied(study).members) == size
        chosen = {kind: id_ for id_, (kind, _) in made.accepted.items() if id_ not in failed}
        print(f"{made.counts}, {len(found)} jobs, {len(failed)} of them died with their workers; compared: {sorted(chosen)}")
        whole = {id_: files_of(client, id_) for id_ in found if id_ not in failed}
        assert all(whole.values())
    made.end()
    with serving(tmp_path / "other") as served, Client(served.url, timeout=60.0) as other:
        for kind, id_ in chosen.items():
            again = same_elsewhere(other, kind, made.accepted[id_][1])
            assert files_of(other, again.id) == whole[id_], kind
    store = Store(made.data / "values")
    for digest in store.digests():
        store.get(digest)
    assert not list((made.data / "values").glob(".new-*"))
    for base in made.data.glob("*.sqlite"):
        with closing(sqlite3.connect(base)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_whatever_is_killed_nothing_is_lost(tmp_path: Path, kind: str) -> None:
    with ExitStack() as opened:
        database = opened.enter_context(postgres_server()) if kind == "postgres" else None
        made = opened.enter_context(killed(tmp_path / "data", KILLS, 5, database))
        assert_whole(made, tmp_path)
