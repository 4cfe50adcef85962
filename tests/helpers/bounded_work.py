"""Work within a bound of processor time and memory, in the running process."""

from __future__ import annotations

import resource
import signal
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import TypeVar

_T = TypeVar("_T")


class TooLong(BaseException):
    """A fault keeps something at work for longer than it may take; no handler of errors in what is tried stops this."""


def within(seconds: float, work: Callable[[], _T], *, room: int = 2 << 30) -> _T:
    """Do something within a time and a room.

    Args:
        seconds: Processor time.
        work: What is done.
        room: Bytes more than the process has.

    Raises:
        TooLong: It takes longer.
        MemoryError: It needs more.
    """

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise TooLong

    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limits, old = resource.getrlimit(resource.RLIMIT_AS), signal.signal(signal.SIGVTALRM, stop)
    resource.setrlimit(resource.RLIMIT_AS, (size + room, limits[1]))
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        return work()
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        signal.signal(signal.SIGVTALRM, old)
