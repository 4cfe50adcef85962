"""`kill -9` of the service and of its workers at random instants: nothing accepted is lost, no finished stage is begun again."""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Set
from pathlib import Path

import pytest

import ltlplan
from ltlplan.service.job_queue.store import Store
from tests.helpers.serving.jobs_process import MISSION, NOTES

pytestmark = pytest.mark.xdist_group("service")

ROOT = Path(__file__).parents[4]
Stage = tuple[str, str]


def start(data: Path, seeds: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "tests.helpers.serving.jobs_process", str(data), str(seeds)]
    return subprocess.Popen(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"})


def notes(data: Path) -> list[str]:
    place = data.with_name(f"{data.name}.{NOTES}")
    return place.read_text(encoding="utf-8").splitlines() if place.exists() else []


def wait_for(process: subprocess.Popen[bytes], data: Path, words: str, since: int) -> bool:
    """Wait until a line with these words was noted; return whether the process is still there."""
    while process.poll() is None:
        if any(words in line for line in notes(data)[since:]):
            return True
        time.sleep(0.02)
    return False


def workers_of(process: subprocess.Popen[bytes]) -> list[int]:
    """Return the numbers of the processes that compute for a service."""

    def children(pid: int) -> list[int]:
        with contextlib.suppress(OSError):
            return [
                int(child)
                for task in Path(f"/proc/{pid}/task").iterdir()
                for child in (task / "children").read_text(encoding="ascii").split()
            ]
        return []

    return [worker for child in children(process.pid) for worker in children(child)]


def recorded(data: Path) -> set[Stage]:
    """Return the stages that the database says are done."""
    with contextlib.closing(sqlite3.connect(data / "jobs.sqlite", timeout=30)) as connection:
        found = connection.execute("SELECT workflow_uuid, function_name FROM operation_outputs").fetchall()
    return {(str(job), str(stage)) for job, stage in found}


def begun(lines: list[str]) -> list[Stage]:
    found = (re.fullmatch(r"job (\S+): (.+) begins", line) for line in lines)
    return [(match[1], match[2]) for match in found if match]


def survived(data: Path, kills: int, draw: random.Random) -> tuple[Set[str], Set[str]]:
    """Kill a service, or one of its workers, so often; return the jobs that it accepted and those that ended with all their stages."""
    killed = 0
    while killed < kills:
        since = len(notes(data))
        process = start(data, 1 + (killed + 4) // 4)
        lines = draw.randrange(16)  # of what it notes, so that it gets as far on a slow machine as on a quick one
        while len(notes(data)) < since + lines and process.poll() is None:
            time.sleep(0.01)
        time.sleep(0.5 * draw.random() ** 2)
        for _ in range(draw.randrange(3)):
            for worker in draw.sample(workers := workers_of(process), min(1, len(workers))):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    killed += 1
            time.sleep(0.5 * draw.random())
        process.kill()
        process.wait(30)
        killed += 1
        lines = notes(data)
        done = recorded(data) if (data / "jobs.sqlite").exists() and "ready" in lines else set()
        again = start(data, 1)
        wait_for(again, data, "ready", len(lines))
        time.sleep(draw.random())
        again.kill()
        again.wait(30)
        killed += 1
        assert [stage for stage in begun(notes(data)[len(lines) :]) if stage in done] == []
    last = len(notes(data))
    assert start(data, 1).wait(600) == 0
    lines = notes(data)
    assert lines[-1] == "over"
    accepted = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("accepted ")}
    ended = {line.split()[1]: json.loads(line.split(maxsplit=2)[2]) for line in lines[last:] if line.startswith("ended ")}
    assert len(set(accepted.values())) == len(accepted)
    assert_files_are_the_commands(data, accepted)
    return accepted.keys(), {job for job, told in ended.items() if told[:2] == ["done", ["plan", "round 1", "flight", "files"]]}


def assert_files_are_the_commands(data: Path, accepted: dict[str, int]) -> None:
    store = Store(data / "values")
    kept = store.digests()
    for digest in kept:
        store.get(digest)
    assert not list((data / "values").glob(".new-*"))
    for seed in sorted(accepted.values())[:3]:
        folder = data.with_name(f"run-{seed}")
        ltlplan.run(MISSION, folder, seed=seed)
        written = [path.read_bytes() for path in folder.rglob("*") if path.is_file()]
        store_of = {store.get(digest) for digest in kept}
        assert all(data in store_of for data in written)


@pytest.mark.slow
def test_a_few_kills_lose_nothing(tmp_path: Path) -> None:
    accepted, done = survived(tmp_path / "data", 2, random.Random(3))
    assert accepted <= done


@pytest.mark.slow
def test_a_hundred_kills_lose_nothing(tmp_path: Path) -> None:
    accepted, done = survived(tmp_path / "data", 100, random.Random(11))
    assert accepted <= done


@pytest.mark.slow
@pytest.mark.parametrize("after", ["is accepted", "plan begins", "round 1 begins", "flight begins", "files begins"])
def test_a_kill_at_each_step_loses_nothing(tmp_path: Path, after: str) -> None:
    data = tmp_path / "data"
    process = start(data, 2)
    assert wait_for(process, data, after, 0)
    process.kill()
    process.wait(30)
    done, lines = recorded(data), notes(data)
    assert start(data, 2).wait(300) == 0
    assert [stage for stage in begun(notes(data)[len(lines) :]) if stage in done] == []
    ended = [line for line in notes(data)[len(lines) :] if line.startswith("ended ")]
    assert [json.loads(line.split(maxsplit=2)[2])[0] for line in ended] == ["done", "done"]
