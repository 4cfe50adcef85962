"""A disk without room, and databases of older versions: refused or waited for in words, never half."""

from __future__ import annotations

import asyncio
import contextlib
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from dbos._migration import sqlite_migrations

from ltlplan.service.job_queue import runner
from ltlplan.service.job_queue.store import NoRoom
from tests.helpers.few import few_of
from tests.helpers.motion.flights import small_mission
from tests.helpers.serving.job_services import begun, ended, run, service
from verify.data import BadInput

pytestmark = pytest.mark.xdist_group("service")

SMALL = small_mission("F a", margin=0.05, extra="planner: {pace: nominal}")
MEGABYTE = 1_000_000


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64M", "tmpfs", str(place)], capture_output=True, check=False)
    if mount.returncode != 0:
        pytest.skip("a small disk cannot be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.slow
def test_a_full_disk_is_refused_and_what_was_accepted_waits_for_room(small_disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "AGAIN", 0.2)

    async def check() -> None:
        filler = small_disk / "filler"
        async with service(small_disk / "data") as jobs:
            job = await jobs.submit(SMALL)
            await begun(jobs, job)
            filler.write_bytes(b"\1" * 52 * MEGABYTE)
            with pytest.raises(NoRoom, match="make room there"):
                await jobs.submit(SMALL, seed=1)
            assert not (await jobs.health()).ok
            async for event in jobs.events(job.id):
                if event.sentence.startswith("waiting: "):
                    break
            filler.unlink()
            assert (await ended(jobs, job)).state == "done"
            assert (await ended(jobs, await jobs.submit(SMALL, seed=1))).state == "done"

    run(check())


def test_a_service_without_any_room_says_so(small_disk: Path) -> None:
    async def check() -> None:
        (small_disk / "data").mkdir()
        with contextlib.suppress(OSError), (small_disk / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(b"\1" * MEGABYTE)
        with pytest.raises(BadInput, match=r"full|room"):
            async with service(small_disk / "data"):
                pass

    run(check())


def older_database(data: Path, version: int) -> None:
    """Make a database as an engine of that version left it."""
    data.mkdir()
    with closing(sqlite3.connect(data / "jobs.sqlite")) as connection:
        for migration in sqlite_migrations[:version]:
            connection.executescript(migration)
        connection.execute("CREATE TABLE dbos_migrations (version INTEGER NOT NULL PRIMARY KEY)")
        connection.execute("INSERT INTO dbos_migrations VALUES (?)", (version,))
        connection.commit()


@few_of(1, "back", [60, 10, 1])
def test_an_older_database_is_brought_to_this_version(tmp_path: Path, back: int) -> None:
    async def check() -> None:
        older_database(tmp_path / "data", len(sqlite_migrations) - back)
        async with service(tmp_path / "data") as jobs:
            assert (await jobs.health()).database == "answers"
            job = await jobs.submit(SMALL)
            assert (await jobs.cancel(job.id)).state == "cancelled"

    run(check())


def test_an_older_database_that_cannot_be_brought_to_this_version_is_left_as_it_is(tmp_path: Path) -> None:
    async def check() -> None:
        with pytest.raises(BadInput, match="cannot be used"):
            async with service(tmp_path / "data"):
                pass

    older_database(tmp_path / "data", len(sqlite_migrations) - 60)
    with closing(sqlite3.connect(tmp_path / "data" / "jobs.sqlite")) as connection:
        connection.execute("DROP TABLE workflow_status")
        connection.commit()
        before = sorted(connection.execute("SELECT sql FROM sqlite_master WHERE name NOT LIKE 'ltlplan%'").fetchall(), key=str)
    run(check())
    with closing(sqlite3.connect(tmp_path / "data" / "jobs.sqlite")) as connection:
        after = connection.execute(
            "SELECT sql FROM sqlite_master WHERE name NOT LIKE 'ltlplan%' AND sql IS NOT NULL"
        ).fetchall()
        assert connection.execute("SELECT version FROM dbos_migrations").fetchone() == (len(sqlite_migrations) - 60,)
    assert sorted([row for row in after if "ltlplan" not in row[0]], key=str) == [row for row in before if row[0] is not None]


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    async def check() -> None:
        (tmp_path / "data").mkdir()
        (tmp_path / "data" / "values").write_text("", encoding="utf-8")
        with pytest.raises(BadInput, match="cannot be written"):
            async with service(tmp_path / "data"):
                pass
        await asyncio.sleep(0)

    run(check())
