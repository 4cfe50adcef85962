"""Helper processes that are killed: wherever their death is noticed, it is a death, tried again three times and never anything else."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest

from ltlplan.online.live.executors import NoAnswer
from ltlplan.service.execution.background_executor import Beside
from ltlplan.service.execution.resource_limits import WorkerDied
from ltlplan.service.execution.worker_process import warm_up
from ltlplan.service.execution.workers import TRIES, LocalWorkers
from tests.helpers.few import few_of
from tests.helpers.serving import work_for_workers as work
from tests.helpers.serving.process_trees import fork_servers, kill
from tests.helpers.serving.waiting import until

PATIENCE = 300.0
"""s that an answer may take: many times what an idle machine needs."""

DEATHS = [EOFError(), ConnectionRefusedError(111, "refused"), BrokenPipeError(32, "broken"), ConnectionResetError(104, "reset"),
          FileNotFoundError(2, "no socket"), ChildProcessError(10, "reaped")]  # fmt: skip
"""What a start raises whose fork server dies, by the moment at which it does."""

Dying = Callable[[int, Exception], list[int]]


@pytest.fixture
def workers() -> Iterator[LocalWorkers]:
    pool = LocalWorkers(1)
    yield pool
    pool.close()


@pytest.fixture
def dying(monkeypatch: pytest.MonkeyPatch) -> Dying:
    """Return a function that lets so many starts meet a fork server that dies, and returns a list that grows with each start."""
    connect = forkserver.connect_to_new_process

    def prepare(deaths: int, error: Exception) -> list[int]:
        starts: list[int] = []

        def connected(fds: Any) -> Any:
            starts.append(len(starts))
            if len(starts) <= deaths:
                raise error
            return connect(fds)

        monkeypatch.setattr(forkserver, "connect_to_new_process", connected)
        return starts

    return prepare


def name_of(error: Exception) -> str:
    return type(error).__name__


@few_of(2, "error", DEATHS, ids=name_of)
def test_a_start_that_meets_a_dying_fork_server_is_made_again(workers: LocalWorkers, dying: Dying, error: Exception) -> None:
    starts = dying(TRIES - 1, error)
    assert workers.submit(work.add, 1, 2).result(PATIENCE)[0] == 3
    assert len(starts) == TRIES
    assert workers.trouble is None


@few_of(2, "error", DEATHS, ids=name_of)
def test_work_that_no_process_can_be_started_for_is_given_up_in_words(
    workers: LocalWorkers, dying: Dying, error: Exception
) -> None:
    starts = dying(TRIES, error)
    with pytest.raises(WorkerDied, match=f"ended before it began.*{name_of(error)}"):
        workers.submit(work.add, 1, 2).result(PATIENCE)
    assert len(starts) == TRIES
    assert workers.trouble is not None
    assert name_of(error) in workers.trouble
    assert workers.submit(work.add, 1, 2).result(PATIENCE)[0] == 3
    assert until(lambda: workers.trouble is None, PATIENCE)


def test_what_is_asked_beside_a_flight_gets_no_answer_and_the_next_does(dying: Dying) -> None:
    beside = Beside()
    dying(1, EOFError())
    unanswered = beside.ask(work.own_process, None)
    assert unanswered.done()
    with pytest.raises(NoAnswer, match="EOFError"):
        unanswered.result()
    unanswered.drop()
    answer = beside.ask(work.own_process, None)
    assert until(answer.done, PATIENCE)
    assert answer.result() == answer.pid
    answer.drop()


def test_nothing_stays_open_of_a_start_that_failed(workers: LocalWorkers, dying: Dying) -> None:
    workers.submit(work.add, 1, 2).result(PATIENCE)
    assert until(lambda: workers.alive == 0, PATIENCE)
    before = len(list(Path("/proc/self/fd").iterdir()))
    dying(TRIES, EOFError())
    with pytest.raises(WorkerDied):
        workers.submit(work.add, 1, 2).result(PATIENCE)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(6))
def test_a_fork_server_that_is_killed_between_forks_costs_nothing_that_was_asked(workers: LocalWorkers, moment: int) -> None:
    warm_up()
    for killed in fork_servers(os.getpid()):
        assert kill(killed)
    if moment % 2:
        until(lambda: False, 0.002 * moment)
    futures = [workers.submit(work.add, 1, each) for each in range(4)]
    assert [future.result(PATIENCE)[0] for future in futures] == [1, 2, 3, 4]
