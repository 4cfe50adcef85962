"""Progress reports of long work: a function that takes a sentence and the share done, 0 to 1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Told a sentence and the share done, 0 to 1."""


def silent(_sentence: str, _share: float) -> None:
    """Tell nobody."""


def part_of(progress: Progress | None, low: float, high: float) -> Progress:
    """Return a progress whose share 0 to 1 is shown as `low` to `high` of the whole.

    Args:
        progress: Told of the whole; None tells nobody.
        low: Share of the whole at which the part begins, 0 to 1.
        high: Share of the whole at which it ends, 0 to 1.
    """
    if progress is None:
        return silent
    return lambda sentence, share: progress(sentence, low + (high - low) * share)
