"""Work shared among processes: what whoever runs it must be able to do, the processes of this machine, and sharing parts among either.

`Workers` is the interface, in the manner of `concurrent.futures`: campaigns know no other, so that where they run, here or on other
machines, is their caller's choice.
"""

from __future__ import annotations

import itertools
import multiprocessing
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol, Self, TypeVar

from verify.data import BadInput
from verify.data.progress import Progress

Job = TypeVar("Job")
Part = TypeVar("Part")
Found = TypeVar("Found")

_AHEAD = 2
"""Parts that are handed out for each that is done at a time: none waits for its arguments, and no thousand of them fill a memory."""


class Workers(Protocol):
    """Processes that work can be given to, on this machine or on others."""

    @property
    def count(self) -> int:
        """Number of pieces of work that are done at the same time."""
        ...

    def submit(self, work: Callable[..., Found], /, *arguments: object, progress: Progress | None = None) -> Future[Found]:
        """Have a function called in a process.

        Args:
            work: A function of a module. It is called with the arguments and, last, a `Progress`, which it must tell now and then: that
                may be when it learns that nobody waits for it any more.
            arguments: Values that can be pickled, as what is found must be.
            progress: Told by a thread of this process what the function tells.

        Returns:
            What will be found, or raised; where it is cancelled, the work is ended.
        """
        ...


def count_of(workers: int | Workers) -> int:
    """Return how many pieces of work are done at the same time.

    Args:
        workers: How many processes, or whose.

    Raises:
        BadInput: They are none, or no such thing.
    """
    count = workers if isinstance(workers, int) else getattr(workers, "count", None)  # callers may give anything
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise BadInput(f"workers must be at least 1, a whole number or processes that work can be given to, not {workers!r}.")
    return count


def shared(
    work: Callable[[Job, Part, Progress], Found],
    job: Job,
    parts: Sequence[Part],
    *,
    workers: Workers,
    progress: Callable[[float], None] | None = None,
) -> list[Found]:
    """Do parts of a job in processes and return what each found, in the order of the parts.

    Args:
        work: As for `Workers.submit`; it is told the job, a part, and whom to report to.
        job: What all parts have in common.
        parts: One call each.
        workers: Who does them.
        progress: Receives the share done, 0 to 1.

    Raises:
        BadInput: A process was ended from outside.
    """
    shares = [0.0] * len(parts)
    futures: dict[int, Future[Found]] = {}
    waiting = iter(enumerate(parts))

    def noting(index: int) -> Progress:
        def note(_sentence: str, share: float) -> None:
            shares[index] = share

        return note

    try:
        while True:
            pending = {future for future in futures.values() if not future.done()}
            while len(pending) < _AHEAD * workers.count and (following := next(waiting, None)) is not None:
                index, part = following
                futures[index] = workers.submit(work, job, part, progress=noting(index))
                pending.add(futures[index])
            if not pending:
                return [futures[index].result() for index in range(len(parts))]
            done, _ = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()
            if progress is not None:
                progress(sum(shares) / len(parts))
    except BrokenProcessPool:
        raise BadInput("a process was ended by the system, perhaps for want of memory; take fewer workers.") from None
    finally:
        for future in futures.values():
            future.cancel()


class Processes:
    """Processes of this machine, started when first needed and stopped, whatever they do, at the end of `with`.

    They start afresh, so a script that makes them must be one that may be imported. Work that has begun ends where it next reports.

    Attributes:
        count: Greatest number of processes.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        context = multiprocessing.get_context("spawn")
        self._hearing, saying = context.Pipe(duplex=False)
        self._stopped, self._stop = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(count, mp_context=context, initializer=_begin, initargs=(saying, self._stopped))
        self._numbers = itertools.count()
        self._told: dict[int, Progress] = {}
        self._listener = threading.Thread(target=self._listen, name="progress of processes", daemon=True)

    def __enter__(self) -> Self:
        self._listener.start()
        return self

    def __exit__(self, *_raised: object) -> None:
        self._stop.send(None)  # nobody takes it, so that all see it
        self._pool.shutdown(cancel_futures=True)
        self._listener.join()

    def submit(self, work: Callable[..., Found], /, *arguments: object, progress: Progress | None = None) -> Future[Found]:
        """Have a function called in one of the processes, as `Workers.submit` says.

        Args:
            work: A function of a module.
            arguments: What it is called with.
            progress: Told what the function tells.
        """
        number = next(self._numbers)
        if progress is not None:
            self._told[number] = progress
        with _unheard():
            future = self._pool.submit(_called, work, arguments, number)
        future.add_done_callback(lambda _: self._told.pop(number, None))
        return future

    def _listen(self) -> None:
        while self._stopped not in wait_for([self._hearing, self._stopped]):
            number, sentence, share = self._hearing.recv()
            if (progress := self._told.get(number)) is not None:
                progress(sentence, share)


@contextmanager
def _unheard() -> Generator[None]:
    """Hold Ctrl-C back while processes start: they inherit that, so that it ends this process, which stops them, and not them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _StoppedError(Exception):
    """End of a part that nobody waits for any more."""


_ends: Any = None  # of the pipes of this process: a pool's initializer has no other way to hand them over


def _begin(*ends: Any) -> None:
    global _ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGQUIT"):
        signal.signal(
            signal.SIGQUIT, signal.SIG_IGN
        )  # a terminal sends it to all; it ends the search of the process that plans
    _ends = ends


def _called(work: Callable[..., Found], arguments: tuple[object, ...], number: int) -> Found:
    saying, stopped = _ends

    def report(sentence: str, share: float) -> None:
        if stopped.poll():
            raise _StoppedError
        saying.send(
            (number, sentence, share)
        )  # in one write, for it is short: no lock that a killed process would take with it

    report("", 0.0)
    return work(*arguments, report)
