"""The processes below one, for tests that kill some of them."""

from __future__ import annotations

import contextlib
import os
import signal
from pathlib import Path

FORK_SERVER = "multiprocessing.forkserver"
"""Stands in the command line of a fork server, and of all that were forked from it."""


def children(pid: int) -> list[int]:
    """Return the numbers of the processes that a process has started, in any of its threads."""
    with contextlib.suppress(OSError):
        tasks = Path(f"/proc/{pid}/task").iterdir()
        return [int(child) for task in tasks for child in (task / "children").read_text(encoding="ascii").split()]
    return []


def tree(pid: int) -> list[int]:
    """Return the numbers of a process and of all below it, parents first."""
    return [pid, *(each for child in children(pid) for each in tree(child))]


def command_line(pid: int) -> str:
    """Return how a process was started; empty where it has gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def environment_of(pid: int) -> str:
    """Return the environment that a process was started with; empty where it has gone."""
    try:
        return Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
    except OSError:
        return ""


def fork_servers(pid: int) -> list[int]:
    """Return the numbers of the fork servers that a process has started."""
    return [child for child in children(pid) if FORK_SERVER in command_line(child)]


def kill(pid: int) -> bool:
    """End a process from outside; return whether it was there."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True
