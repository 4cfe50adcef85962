"""The other side of a child (`children`): what the process does that was begun for one piece of work, and what it answers."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ltlplan.service.execution.resource_limits import MEGABYTE, Bounds
from ltlplan.service.execution.stop_requests import listen
from verify.data import InternalError, LtlplanError

_PDEATHSIG = 1
_LEAST_BETWEEN = 0.1
"""s between two sentences of progress that are sent."""


def do_and_answer(
    connection: Connection, work: Callable[..., Any], arguments: tuple[Any, ...], bounds: Bounds, scratch: str | None
) -> None:
    """Do a piece of work and send what came of it, and its progress meanwhile.

    Args:
        connection: Where ("progress", sentence, share) is sent, and at the end ("result", what the work returned), ("error",
            `error_data`) or ("memory", None). What comes from there asks a search to end.
        work: It is given the arguments and, last, whom to tell its progress.
        arguments: What it is given.
        bounds: What it may take.
        scratch: Where it may leave temporary files; the system's place for such where there is none.
    """
    os.setsid()
    tempfile.tempdir = scratch
    listen(connection.poll)
    _let_go_of_nursery()
    _die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.nice(bounds.nice)
    _limit(bounds)
    last = 0.0

    def report(sentence: str, share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= _LEAST_BETWEEN:
            last = now
            _send(connection, ("progress", sentence, float(share)))

    try:
        answer: tuple[Any, ...] = ("result", work(*arguments, report))
    except MemoryError:
        answer = ("memory", None)
    except LtlplanError as error:
        answer = ("error", error_data(error))
    except Exception as error:
        traceback.print_exc()
        memory = "bad_alloc" in str(error) or "allocate memory" in str(error)
        told = InternalError(f"{type(error).__name__}: {error}")
        answer = ("memory", None) if memory else ("error", error_data(told))
    _send(connection, answer)
    connection.close()


def _send(connection: Connection, message: tuple[Any, ...]) -> None:
    """Tell the process that waits for this one; where it has gone, nothing is left to do, and nobody to complain to."""
    try:
        connection.send(message)
    except BrokenPipeError:
        os._exit(1)


def _limit(bounds: Bounds) -> None:
    """Let the system refuse memory and time beyond the bounds, should this process outrun those who look at it."""
    import resource

    held = 0
    with contextlib.suppress(OSError, ValueError):
        lines = Path("/proc/self/status").read_text(encoding="ascii", errors="replace").splitlines()
        held = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData"))
    with contextlib.suppress(OSError, ValueError):
        most = held + bounds.megabytes * MEGABYTE
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        seconds = int(bounds.seconds) + 5
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))


def _let_go_of_nursery() -> None:
    """Close this process's end of the pipe whose end tells the nursery that the service is gone; multiprocessing hands it to all."""
    nursery: Any = forkserver._forkserver  # type: ignore[attr-defined]  # private: there is no other way to reach it
    if nursery._forkserver_alive_fd is not None:
        os.close(nursery._forkserver_alive_fd)
        nursery._forkserver_alive_fd = None


def _die_with_parent() -> None:
    if sys.platform != "linux":
        return
    import ctypes

    parent = os.getppid()
    ctypes.CDLL(None, use_errno=True).prctl(_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent or parent == 1:
        os._exit(1)


def error_data(error: LtlplanError) -> tuple[type[LtlplanError], tuple[Any, ...], dict[str, Any]]:
    """Return what an error is made of, to be sent: classes that take other arguments than their message do not survive pickling."""
    return type(error), error.args, dict(error.__dict__)


def error_from(data: tuple[type[LtlplanError], tuple[Any, ...], dict[str, Any]]) -> LtlplanError:
    """Return the error again that `error_data` was given, class, words and all that it carries."""
    kind, arguments, fields = data
    error = kind.__new__(kind, *arguments)
    error.args = arguments
    error.__dict__.update(fields)
    return error
