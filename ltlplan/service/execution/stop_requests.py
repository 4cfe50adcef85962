"""Requests to end a search with the best plan so far, as the process that searches hears them."""

from __future__ import annotations

from collections.abc import Callable


def _never() -> bool:
    return False


_asked: Callable[[], bool] = _never


def listen(asked: Callable[[], bool]) -> None:
    """Hear requests; once in each process that works for others.

    Args:
        asked: Tells whether one has come.
    """
    global _asked
    _asked = asked


def is_asked() -> bool:
    """Return whether the search of this process is to end."""
    return _asked()
