"""The processes of this machine that compute for the service, behind the interface of `concurrent.futures`.

Each piece of work has a process of its own (`children`). What has taken `SHORT` s of processor time moves out of the way: to a second
lane of as many places, which gives way to the first. So what is small is never stuck behind what is large, what is large always goes
on, and there are never more than two processes for each place. Those that were submitted with the lowest `rank` come first.
"""

from __future__ import annotations

import heapq
import itertools
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ltlplan.service.execution.resource_limits import NICE, Bounds, WorkerDied
from ltlplan.service.execution.worker_process import Child
from verify.data import BadInput, LtlplanError
from verify.data.progress import Progress

SHORT = 20.0
"""s of processor time after which work is long."""
TRIES = 3
"""How often work is begun whose process is ended from outside."""
_REMEMBERED = 60.0
"""s after which a death says nothing of how things are."""

Lane = Literal["short", "long"]


class WorkFuture(Future[Any]):  # work has its own result
    """A result to come; cancelling ends the process that computes it, at once."""

    def __init__(self) -> None:
        super().__init__()
        self.child: Child | None = None

    def cancel(self) -> bool:
        """End the work, whether it has begun or not; return whether it had not ended before."""
        cancelled = super().cancel()  # it stays pending until it has ended, so that this is always allowed
        child = self.child
        if cancelled and child is not None:
            child.kill()
        return cancelled

    def end_search(self) -> None:
        """Have the work's search end with the best plan so far; nothing happens where it has not begun."""
        child = self.child
        if child is not None:
            child.end_search()


@dataclass(order=True)
class _Task:
    rank: float
    number: int
    future: WorkFuture = field(compare=False)
    work: Callable[..., Any] = field(compare=False)
    arguments: tuple[Any, ...] = field(compare=False)
    progress: Progress | None = field(compare=False)
    tries: int = field(compare=False, default=0)
    child: Child | None = field(compare=False, default=None)


class LocalWorkers:
    """A pool of processes on this machine.

    Attributes:
        count: How many pieces of work are done at the same time.
        bounds: What one piece of work may take.
    """

    def __init__(
        self,
        count: int,
        *,
        seconds: float = 3600.0,
        megabytes: int = 4096,
        wall: float = 86_400.0,
        scratch: Path | None = None,
    ) -> None:
        """Make a pool.

        Args:
            count: How many pieces of work are done at the same time.
            seconds: s of processor time that one may take.
            megabytes: MB of memory that one may take.
            wall: s on the clock that one may take.
            scratch: Where temporary folders are made; the system's place for such by default.

        Raises:
            BadInput: There is to be no worker.
        """
        if count < 1:
            raise BadInput(f"There must be at least 1 worker, not {count}.")
        self.count = count
        self.bounds = Bounds(seconds=seconds, megabytes=megabytes, wall=wall)
        self._scratch = scratch
        self._numbers = itertools.count()
        self._news = threading.Condition()
        self._waiting: dict[Lane, list[_Task]] = {"short": [], "long": []}
        self._idle: dict[Lane, int] = {"short": 0, "long": 0}
        self._running: set[WorkFuture] = set()
        self._deaths: tuple[tuple[float, str], ...] = ()
        self._closed = False
        self._threads = [
            threading.Thread(target=self._serve, args=(lane,), name=f"{lane} lane {index}", daemon=True)
            for lane in ("short", "long")
            for index in range(count)
        ]
        for thread in self._threads:
            thread.start()

    def submit(
        self, work: Callable[..., Any], /, *arguments: Any, progress: Progress | None = None, rank: float = 0.0
    ) -> WorkFuture:
        """Have work done in a process.

        Args:
            work: A function of a module; it is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.
            progress: Receives a sentence and the share done, 0 to 1, from a thread of the pool.
            rank: Work of a lower rank is begun first.

        Raises:
            BadInput: The pool was closed.
        """
        future = WorkFuture()
        task = _Task(rank, next(self._numbers), future, work, arguments, progress)
        self._queue(task, "short")
        return future

    def end_search(self, work: WorkFuture) -> None:
        """Have the search of work that has begun end with the best plan so far."""
        work.end_search()

    @property
    def alive(self) -> int:
        """Number of processes that are at work."""
        with self._news:
            return len(self._running)

    @property
    def trouble(self) -> str | None:
        """Reason why nothing is computed at the moment: processes die one after the other; None while that is not so."""
        deaths = [said for when, said in self._deaths if when > time.monotonic() - _REMEMBERED]
        return f"worker processes die one after the other: {deaths[-1]}" if len(deaths) >= TRIES else None

    @property
    def waiting(self) -> int:
        """Number of pieces of work that have not begun."""
        with self._news:
            return sum(len(tasks) for tasks in self._waiting.values())

    def close(self) -> None:
        """End all work and all processes."""
        with self._news:
            self._closed = True
            left = [task.future for tasks in self._waiting.values() for task in tasks] + list(self._running)
            self._news.notify_all()
        for future in left:
            future.cancel()
        for thread in self._threads:
            thread.join(timeout=10)

    def _queue(self, task: _Task, lane: Lane) -> None:
        with self._news:
            if self._closed:
                raise BadInput("The workers were closed.")
            heapq.heappush(self._waiting[lane], task)
            self._news.notify_all()

    def _serve(self, lane: Lane) -> None:
        """Do one piece of work after the other; what a thread of the pool does."""
        while (task := self._next(lane)) is not None:
            future, following = task.future, None
            try:
                with self._news:
                    self._running.add(future)
                following = self._done(task, lane)
            except BaseException as error:  # a future without an answer would be waited for for ever
                _settle(future, error=error)
            if following is None:
                self._free(task)
            if task.child is None:
                with self._news:
                    self._running.discard(future)
            if following is not None:
                with suppress(BadInput):
                    self._queue(task, following)

    def _next(self, lane: Lane) -> _Task | None:
        with self._news:
            self._idle[lane] += 1
            while not self._closed:
                while self._waiting[lane]:
                    task = heapq.heappop(self._waiting[lane])
                    if not task.future.cancelled() or task.child is not None:
                        self._idle[lane] -= 1
                        return task
                self._news.wait()
            return None

    def _done(self, task: _Task, lane: Lane) -> Lane | None:
        """Work until it has ended (None), or return the lane in which it has to go on or to begin once more.

        Raises:
            WorkerDied: Its process was ended from outside, so often that it is given up.
            LtlplanError: What the work raised, or that it took more than it may.
        """
        try:
            if not self._has_ended(task, lane):
                return "long"
            if task.child is not None and not task.future.cancelled():
                _settle(task.future, result=task.child.result())
            self._deaths = ()
        except WorkerDied as error:
            self._deaths = (*self._deaths[-TRIES:], (time.monotonic(), str(error)))
            task.tries += 1
            if task.tries == TRIES or task.future.cancelled():
                raise
            self._free(task)
            return lane
        except LtlplanError:
            self._deaths = ()
            raise
        return None

    def _has_ended(self, task: _Task, lane: Lane) -> bool:
        """Work until it has ended (true), or has to give way to others: it then keeps its process where there is a place for it."""
        child = task.child
        if child is None:
            child = task.child = task.future.child = Child(task.work, task.arguments, self.bounds, self._scratch)
        child.give_way(NICE if lane == "short" else 2 * NICE)
        while not child.look(task.progress) and not task.future.cancelled():
            if lane == "short" and child.seconds > SHORT and self._others_wait():
                if not self._has_place("long"):
                    self._free(task)
                return False
        return True

    def _free(self, task: _Task) -> None:
        child, task.child, task.future.child = task.child, None, None
        if child is not None:
            child.kill()
            child.close()

    def _others_wait(self) -> bool:
        with self._news:
            return bool(self._waiting["short"])

    def _has_place(self, lane: Lane) -> bool:
        with self._news:
            return self._idle[lane] > len(self._waiting[lane])


def _settle(future: Future[Any], *, result: Any = None, error: BaseException | None = None) -> None:
    """Give a future its answer, unless it was cancelled meanwhile."""
    with suppress(Exception):
        if error is None:
            future.set_result(result)
        else:
            future.set_exception(error)
