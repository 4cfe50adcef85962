"""One piece of work in one process of its own: with bounds on time and memory, its progress told, ended at once when asked.

The process is forked from one that has loaded everything (`nursery`), leads a group of its own, so that what it starts is ended with it,
and dies with the process it was forked from, which ends when this one does: a kill of the service leaves nothing behind.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator
from multiprocessing import forkserver, resource_tracker
from pathlib import Path
from typing import Any, cast

from ltlplan.service.execution.resource_limits import MEGABYTE, Bounds, OutOfMemory, OutOfTime, WorkerDied
from ltlplan.service.execution.worker_main import do_and_answer, error_from
from verify.data import LtlplanError
from verify.data.progress import Progress

TICK = 0.05
"""s between looks at a process."""


class Stopped(Exception):
    """Work that no caller waits for any more."""


def supervised(
    work: Callable[..., Any],  # work has its own arguments and result
    arguments: tuple[Any, ...],
    *,
    bounds: Bounds,
    progress: Progress | None = None,
    stopped: Callable[[], bool] | None = None,
    enough: Callable[[], bool] | None = None,
) -> Any:
    """Do a piece of work in a process and return its result; may be called from any thread.

    Args:
        work: A function of a module; it is given the arguments and, last, whom to tell its progress.
        arguments: What it is given.
        bounds: What it may take.
        progress: Receives a sentence and the share done, 0 to 1.
        stopped: Asked every 50 ms whether the work is to be ended.
        enough: Asked likewise whether its search is to end with the best plan so far.

    Raises:
        LimitReached: It took more time or memory than it may.
        WorkerDied: The process ended without an answer.
        Stopped: `stopped` said so.
        LtlplanError: What the work raised.
    """
    child = Child(work, arguments, bounds)
    try:
        while not child.look(progress):
            if stopped is not None and stopped():
                raise Stopped
            if enough is not None and enough():
                child.end_search()
        return child.result()
    finally:
        child.kill()
        child.close()


def warm_up() -> None:
    """Begin to load what every piece of work is forked from, so that the first one does not wait for it; returns at once.

    Raises:
        WorkerDied: It was ended before it began.
    """
    with _deaths_told(), _starting():
        multiprocessing.get_context("forkserver").set_forkserver_preload(_PRELOADED)
        forkserver.ensure_running()


class Child:
    """A process at work. What it puts into its temporary folder is gone when it is closed, however it ended.

    Attributes:
        bounds: What it may take.
        seconds: s of processor time that it had taken when it was last looked at.
    """

    def __init__(
        self, work: Callable[..., Any], arguments: tuple[Any, ...], bounds: Bounds, scratch: Path | None = None
    ) -> None:
        """Start a process.

        Args:
            work: A function of a module; it is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.
            bounds: What it may take.
            scratch: Where its temporary folder is made; the system's place for such by default.

        Raises:
            WorkerDied: The process, or the one that it is forked from, was ended before it began.
        """
        self.bounds = bounds
        self.seconds = 0.0
        self._megabytes = 0.0
        self._began = time.monotonic()
        self._answer: tuple[Any, ...] | None = None
        self._fault: LtlplanError | None = None
        self._is_asked = False
        self._scratch: str | None = None
        with contextlib.suppress(OSError):  # without one it may still do, if it writes nothing
            self._scratch = tempfile.mkdtemp(prefix="ltlplan-", dir=scratch)
        try:
            with _deaths_told(), _starting():
                self._begin(work, arguments)
        except BaseException:
            self._drop_scratch()
            raise

    def _begin(self, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(_PRELOADED)
        self._connection, far = context.Pipe()
        with contextlib.ExitStack() as unless_begun:
            unless_begun.callback(self._connection.close)
            with far:
                self._process = context.Process(
                    target=do_and_answer, args=(far, work, arguments, self.bounds, self._scratch), daemon=True
                )
                with _free_to_have_children(), _without_main():
                    self._process.start()
            self._pid = self._process.pid or 0
            unless_begun.pop_all()

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._pid

    @property
    def alive(self) -> bool:
        """True if the process is there."""
        return self._process.is_alive()

    def look(self, progress: Progress | None = None, *, wait: float = TICK) -> bool:
        """Wait for news, pass progress on, hold it to its bounds, and return whether it has ended.

        Args:
            progress: Receives a sentence and the share done, 0 to 1.
            wait: s to wait at most.
        """
        try:
            if self._connection.poll(wait):
                message = self._connection.recv()
                if message[0] != "progress":
                    self._answer = message
                    return True
                if progress is not None:
                    progress(message[1], message[2])
                return False
        except (EOFError, OSError):
            self.kill()
            self._process.join()
            return True
        self._fault = self._beyond()
        if self._fault is not None:
            self.kill()
        return self._fault is not None

    def _beyond(self) -> LtlplanError | None:
        seconds, megabytes = _taken(self._process.pid or 0)
        self.seconds, self._megabytes = max(self.seconds, seconds), max(self._megabytes, megabytes)
        if self.seconds > self.bounds.seconds:
            return OutOfTime.of(f"{self.bounds.seconds:g} s of processor time")
        if time.monotonic() - self._began > self.bounds.wall:
            return OutOfTime.of(f"{self.bounds.wall:g} s")
        return OutOfMemory.of(self.bounds.megabytes) if megabytes > self.bounds.megabytes else None

    def result(self) -> Any:
        """Return what the work returned, once it has ended, or raise what it raised.

        Raises:
            LimitReached: It took more time or memory than it may.
            WorkerDied: The process ended without an answer.
            LtlplanError: What the work raised.
        """
        if self._fault is not None:
            raise self._fault
        if self._answer is None:
            code = self._process.exitcode
            if code == -signal.SIGXCPU:
                raise OutOfTime.of(f"{self.bounds.seconds:g} s of processor time")
            if code in (-signal.SIGABRT, -signal.SIGSEGV) and self._megabytes > self.bounds.megabytes / 2:
                raise OutOfMemory.of(self.bounds.megabytes)
            ended = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
            raise WorkerDied(f"A worker process was ended before it answered ({ended}).")
        kind, value = self._answer
        if kind == "result":
            return value
        if kind == "memory":
            raise OutOfMemory.of(self.bounds.megabytes)
        raise error_from(value)

    def end_search(self) -> None:
        """Have the search of the process end with the best plan so far; nothing happens where it has none, or was asked before."""
        if not self._is_asked:
            self._is_asked = True
            with contextlib.suppress(OSError):
                self._connection.send("end the search")

    def kill(self) -> None:
        """End the process and all that it has started, at once; nothing happens where it has ended."""
        pid = self._process.pid
        with contextlib.suppress(ProcessLookupError, PermissionError, TypeError):  # it leads a group from its first moment on
            os.killpg(cast(int, pid), signal.SIGKILL)
        with contextlib.suppress(OSError, ValueError):
            if self._process.is_alive():
                self._process.kill()

    def close(self) -> None:
        """Wait for a killed process to be gone, and free what was held for it."""
        self._process.join(timeout=10)
        self._connection.close()
        with contextlib.suppress(ValueError):
            self._process.close()
        self._drop_scratch()

    def _drop_scratch(self) -> None:
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)

    def give_way(self, nice: int) -> None:
        """Let others compute first, the more the greater `nice` is: 0 is as this process does."""
        with contextlib.suppress(OSError):
            own = os.getpriority(os.PRIO_PROCESS, 0)
            os.setpriority(os.PRIO_PGRP, cast(int, self._process.pid), min(own + nice, 19))


_STARTING = threading.Lock()
_PRELOADED = ["ltlplan.service.execution.forkserver_preload"]


@contextlib.contextmanager
def _deaths_told() -> Generator[None]:
    """Let whatever a dying fork server makes of a start be told as what it is: the next start has another fork server.

    Raises:
        WorkerDied: In place of what the system said.
    """
    try:
        yield
    except (EOFError, OSError) as error:
        said = f"{type(error).__name__}: {error}".rstrip(": ")
        raise WorkerDied(f"A worker process was ended before it began, or could not be started ({said}).") from None


@contextlib.contextmanager
def _starting() -> Any:
    """Start one process at a time, and none that hears Ctrl-C: whoever hears it ends them."""
    held = hasattr(signal, "pthread_sigmask")
    with _STARTING:
        resource_tracker.ensure_running()  # which lets Ctrl-C be heard again where it has to be started first
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if held else ()
        try:
            yield
        finally:
            if held:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _free_to_have_children() -> Any:
    """Let processes be started from one that multiprocessing calls a daemon; they die with it all the same."""
    settings = multiprocessing.current_process()._config  # type: ignore[attr-defined]  # there is no other way to say so
    before = settings.get("daemon")
    settings["daemon"] = False
    try:
        yield
    finally:
        settings["daemon"] = before


@contextlib.contextmanager
def _without_main() -> Any:
    """Keep workers from importing the script that was started: they have no use for it."""
    main = sys.modules["__main__"]
    kept = {name: main.__dict__[name] for name in ("__file__", "__spec__") if name in main.__dict__}
    try:
        for name in kept:
            main.__dict__[name] = None
        yield
    finally:
        main.__dict__.update(kept)


def _taken(leader: int) -> tuple[float, float]:
    """Return s of processor time and MB of memory that a process and what it has started have taken; 0 where nobody can tell."""
    seconds, pages, pids = 0.0, 0, [leader]
    while pids:
        pid = pids.pop()
        try:
            times = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
            seconds += sum(map(int, times[11:15])) / _TICKS  # its own, and those of what it has started and that has ended
            pages += int(times[21])
            pids += map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split())
        except (OSError, ValueError, IndexError):
            continue
    return seconds, pages * _PAGE / MEGABYTE


_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100
_PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
