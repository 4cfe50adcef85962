"""Work shared among processes: each starts once, with all that the parts have in common, and stops when its caller does."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from verify.data import BadInput

Job = TypeVar("Job")
Part = TypeVar("Part")
Found = TypeVar("Found")
Report = Callable[[float], None]


def shared(
    work: Callable[[Job, Part, Report], Found],
    job: Job,
    parts: Sequence[Part],
    *,
    workers: int,
    progress: Report | None = None,
) -> list[Found]:
    """Do parts of a job in processes and return what each found, in the order of the parts.

    Args:
        work: A function of a module, which is told the job, a part, and whom to report its share done to; it must report now and
            then, for that is when it learns that nobody waits for it any more.
        job: What all parts have in common; it is sent to each process once.
        parts: One call each.
        workers: Greatest number of processes.
        progress: Told the share done, 0 to 1.

    Raises:
        BadInput: A process was ended from outside.
    """
    context = multiprocessing.get_context("spawn")
    shares, stopped = context.Array("d", len(parts)), context.Event()
    pool = ProcessPoolExecutor(
        min(workers, len(parts)), mp_context=context, initializer=_begin, initargs=(work, job, shares, stopped)
    )
    try:
        with _unheard():
            futures = [pool.submit(_one, part, index) for index, part in enumerate(parts)]
        pending = set(futures)
        while pending:
            done, pending = wait(pending, timeout=0.2, return_when=FIRST_EXCEPTION)
            for future in done:
                future.result()
            if progress is not None:
                progress(float(sum(shares[:])) / len(parts))
        return [future.result() for future in futures]
    except BrokenProcessPool:
        raise BadInput("a process was ended by the system, perhaps for want of memory; take fewer workers.") from None
    finally:
        stopped.set()
        pool.shutdown(cancel_futures=True)


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
    """Nobody waits for this part any more."""


_given: Any = None  # what this process was started with: a pool's initializer has no other way to hand it over


def _begin(*given: Any) -> None:
    global _given
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _given = given


def _one(part: Any, index: int) -> Any:
    work, job, shares, stopped = _given

    def report(share: float) -> None:
        shares[index] = share
        if stopped.is_set():
            raise _StoppedError

    report(0.0)
    return work(job, part, report)
