"""How long work tells its caller how far it has come: a function that takes a sentence and the share done, 0 to 1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Told a sentence and the share done, 0 to 1."""


def silent(_sentence: str, _share: float) -> None:
    """Tell nobody."""


def part_of(progress: Progress | None, low: float, high: float) -> Progress:
    """Return a progress whose share 0 to 1 is shown as `low` to `high` of the whole."""
    if progress is None:
        return silent
    return lambda sentence, share: progress(sentence, low + (high - low) * share)
