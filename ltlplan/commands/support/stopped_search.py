"""Ctrl-Backslash at a terminal, or SIGQUIT: the search of a command ends with the best plan so far. Ctrl-C ends the command, as everywhere."""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ltlplan.logic.budget import Budget


@contextmanager
def stoppable_search() -> Generator[Budget]:
    """Give a budget whose searches SIGQUIT ends with the best plan that they have.

    Raises:
        StoppedEarly: It came before there was any plan.
    """
    from ltlplan.logic.budget import Budget, watched

    asked = False

    def hear(_number: int, _frame: object) -> None:
        nonlocal asked
        asked = True

    quit_signal = getattr(signal, "SIGQUIT", None)  # Windows has none
    before = None if quit_signal is None else signal.signal(quit_signal, hear)
    try:
        with watched(lambda: asked) as watch:
            yield Budget(watch=watch)
    finally:
        if quit_signal is not None:
            signal.signal(quit_signal, before)
