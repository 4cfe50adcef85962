"""Wait for what other processes do: for a condition, for work to begin, for a process to end."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path


def until(condition: Callable[[], bool], seconds: float) -> bool:
    """Wait until a condition holds; tell whether it came to hold in time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def pid_in(mark: Path, seconds: float) -> int:
    """Wait for work to begin that writes its process into a file, and return that."""
    assert until(lambda: mark.exists() and mark.read_text(encoding="ascii") != "", seconds)
    return int(mark.read_text(encoding="ascii"))


def is_gone(pid: int) -> bool:
    """Tell whether a process is at an end; it may still wait to be noticed by its parent."""
    try:
        return "State:\tZ" in Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    except OSError:
        return True
