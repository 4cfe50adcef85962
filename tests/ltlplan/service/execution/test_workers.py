"""Processes that compute for the service: what they return, what they may take, and that they end when they are told to."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ltlplan.service.execution.resource_limits import LimitReached, OutOfMemory, OutOfTime, WorkerDied
from ltlplan.service.execution.workers import LocalWorkers
from tests.helpers.serving import work_for_workers as work
from tests.helpers.serving.waiting import is_gone, pid_in, until
from verify.data import BadInput, InternalError, MissionError

PATIENCE = 300.0
"""s that an answer may take: many times what an idle machine needs."""


@pytest.fixture(scope="module")
def workers() -> Iterator[LocalWorkers]:
    pool = LocalWorkers(2, seconds=1.0, megabytes=300)
    yield pool
    pool.close()


def test_work_is_done_in_another_process_and_tells_its_progress(workers: LocalWorkers) -> None:
    told: list[tuple[str, float]] = []
    result, pid = workers.submit(work.add, 1, 2, progress=lambda *said: told.append(said)).result(PATIENCE)
    assert result == 3
    assert pid != os.getpid()
    assert told == [("adding", 0.5)]


def test_numerics_of_a_worker_compute_in_one_thread(workers: LocalWorkers) -> None:
    assert workers.submit(work.threads).result(PATIENCE) == "1"


def test_an_error_comes_back_with_its_class_its_words_and_what_it_carries(workers: LocalWorkers) -> None:
    with pytest.raises(MissionError, match="there is no such hoop") as caught:
        workers.submit(work.wrong_mission).result(PATIENCE)
    assert caught.value.faults[0].keys == ("hoops", "a")


def test_what_is_no_error_of_ours_comes_back_as_a_bug(workers: LocalWorkers, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InternalError, match="ZeroDivisionError"):
        workers.submit(work.bug).result(PATIENCE)


def test_too_much_memory_ends_the_work_with_a_sentence(workers: LocalWorkers) -> None:
    with pytest.raises(OutOfMemory, match="300 MB"):
        workers.submit(work.take_memory).result(PATIENCE)


def test_too_much_memory_of_a_process_that_it_started_ends_it_too(workers: LocalWorkers) -> None:
    with pytest.raises(LimitReached):
        workers.submit(work.start_one_that_takes_memory).result(PATIENCE)


def test_too_much_time_ends_the_work_with_a_sentence(workers: LocalWorkers) -> None:
    with pytest.raises(OutOfTime, match="1 s of processor time"):
        workers.submit(work.spin, 60.0).result(PATIENCE)


def test_too_long_on_the_clock_ends_the_work_with_a_sentence() -> None:
    pool = LocalWorkers(1, wall=0.2)
    with pytest.raises(OutOfTime, match=r"0\.2 s"):
        pool.submit(work.sleep, 60.0).result(PATIENCE)
    pool.close()


def test_work_whose_process_is_killed_is_begun_again(workers: LocalWorkers, tmp_path: Path) -> None:
    assert workers.submit(work.die_once, str(tmp_path / "died")).result(PATIENCE) == "lived"


def test_work_whose_processes_all_die_says_so(workers: LocalWorkers) -> None:
    with pytest.raises(WorkerDied, match="signal 9"):
        workers.submit(work.die).result(PATIENCE)


def test_cancelling_ends_the_process_at_once(workers: LocalWorkers, tmp_path: Path) -> None:
    mark = tmp_path / "pid"
    future = workers.submit(work.sleep, 60.0, str(mark))
    pid = pid_in(mark, PATIENCE)
    assert future.cancel()
    assert future.cancelled()
    assert until(lambda: is_gone(pid), 2.0)
    assert until(lambda: workers.alive == 0, 2.0)


def test_temporary_files_of_what_was_ended_are_gone(tmp_path: Path) -> None:
    pool = LocalWorkers(1, scratch=tmp_path)
    mark = tmp_path / "mark"
    future = pool.submit(work.leave_file, str(mark))
    assert until(lambda: mark.exists() and mark.read_text(encoding="utf-8") != "", PATIENCE)
    left = Path(mark.read_text(encoding="utf-8"))
    assert left.exists()
    assert left.parent.parent == tmp_path
    assert future.cancel()
    assert until(lambda: not left.parent.exists(), 10.0)
    pool.close()


def test_work_that_was_cancelled_before_it_began_never_begins(tmp_path: Path) -> None:
    pool = LocalWorkers(1)
    busy = pool.submit(work.sleep, 60.0)
    mark = tmp_path / "pid"
    waiting = pool.submit(work.sleep, 60.0, str(mark))
    assert waiting.cancel()
    assert busy.cancel()
    assert pool.submit(work.add, 1, 1).result(PATIENCE)[0] == 2
    assert not mark.exists()
    pool.close()


def test_lower_ranks_come_first() -> None:
    pool = LocalWorkers(1)
    busy = pool.submit(work.sleep, 0.2)
    ended: list[int] = []
    futures = [pool.submit(work.add, 0, 0, rank=rank) for rank in (3, 1, 2)]
    for rank, future in zip((3, 1, 2), futures, strict=True):
        future.add_done_callback(lambda _future, rank=rank: ended.append(rank))
    for future in (busy, *futures):
        future.result(PATIENCE)
    assert ended == [1, 2, 3]
    pool.close()


def test_a_closed_pool_takes_no_work() -> None:
    pool = LocalWorkers(1)
    left = pool.submit(work.sleep, 60.0)
    pool.close()
    assert left.cancelled()
    with pytest.raises(BadInput, match="closed"):
        pool.submit(work.add, 1, 1)


def test_a_pool_has_at_least_one_worker() -> None:
    with pytest.raises(BadInput, match="at least 1"):
        LocalWorkers(0)


@pytest.mark.slow
def test_nothing_is_left_behind_by_a_process_that_is_killed(tmp_path: Path) -> None:
    mark = tmp_path / "pid"
    script = (
        "from ltlplan.service.execution.workers import LocalWorkers\n"
        "from tests.helpers import work_for_workers as work\n"
        f"LocalWorkers(1).submit(work.sleep, 60.0, {str(mark)!r}).result()\n"
    )
    root = Path(__file__).parents[4]
    parent = subprocess.Popen([sys.executable, "-c", script], cwd=root, env={**os.environ, "PYTHONPATH": str(root)})
    pid = pid_in(mark, 60.0)
    parent.send_signal(signal.SIGKILL)
    parent.wait(PATIENCE)
    assert until(lambda: is_gone(pid), 10.0)
