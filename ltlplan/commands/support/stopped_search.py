"""Ctrl-Backslash at a terminal, or SIGQUIT: the search of a command ends with the best plan so far. Ctrl-C ends the command, as everywhere."""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import contextmanager


@contextmanager
def stoppable_search() -> Generator[None]:
    """Have SIGQUIT end the search with the best plan that it has.

    Raises:
        StoppedEarly: It came before there was any plan.
    """
    from ltlplan.search.watching import watched

    asked = False

    def hear(_number: int, _frame: object) -> None:
        nonlocal asked
        asked = True

    quit_signal = getattr(signal, "SIGQUIT", None)  # Windows has none
    before = None if quit_signal is None else signal.signal(quit_signal, hear)
    try:
        with watched(lambda: asked):
            yield
    finally:
        if quit_signal is not None:
            signal.signal(quit_signal, before)
