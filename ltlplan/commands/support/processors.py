"""Number of processors, and of processes for many robots."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flight.processes import Processes
    from verify.data import Mission

MANY = 24
"""Robots from which on their paths are improved side by side: below, processes take longer to begin than they save."""


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def processes_for(mission: Mission) -> Generator[Processes | None]:
    """Give processes, one a processor, for a mission of many robots; None for one of few. What is planned does not depend on it."""
    if len(mission.agents) < MANY or processors() < 2:
        yield None
        return
    from flight.processes import Processes

    with Processes(processors()) as those:
        yield those
