"""Answers that are computed beside a flight: each in a process of its own, which is looked at without waiting and ended when it is dropped."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ltlplan.online.live.executors import NoAnswer
from ltlplan.service.execution.resource_limits import Bounds, LimitReached, WorkerDied
from ltlplan.service.execution.worker_process import Child, warm_up
from verify.data import LtlplanError
from verify.data.progress import Progress


class Beside:
    """Computes answers beside this process."""

    def __init__(self) -> None:
        """Load what processes are forked from, and wait until one has answered, so that no answer waits for it."""
        warm_up()
        answer = self.ask(_ready, None)
        while not answer.done(wait=1.0):
            pass
        answer.drop()

    def ask(self, work: Callable[..., Any], question: object) -> BesideAnswer:
        """Have a question answered.

        Args:
            work: A function of a module, which is given the question and whom to tell its progress.
            question: Can be pickled, as the answer can.
        """
        try:
            return BesideAnswer(Child(work, (question,), Bounds(nice=0)))
        except WorkerDied as error:
            return BesideAnswer(None, str(error))


class BesideAnswer:
    """An answer to come from a process."""

    def __init__(self, child: Child | None, why: str = "") -> None:
        """Take a process that has begun.

        Args:
            child: The process; None where it was ended before it began.
            why: What it was ended by then.
        """
        self._child, self._why, self._ended = child, why, child is None

    @property
    def pid(self) -> int:
        """Number of the process that computes it; 0 where there is none."""
        return 0 if self._child is None else self._child.pid

    def done(self, wait: float = 0.0) -> bool:
        """Return whether it is there, or will not come.

        Args:
            wait: s to wait for it at most.
        """
        if not self._ended and self._child is not None:
            self._ended = self._child.look(wait=wait)
        return self._ended

    def result(self) -> Any:
        """Return the answer.

        Raises:
            LtlplanError: What was raised in its place.
            NoAnswer: The process was ended.
        """
        why = self._why
        if self._child is not None:
            try:
                return self._child.result()
            except (WorkerDied, LimitReached) as error:
                why = str(error)
        raise NoAnswer(f"who computes what is flown next gives no answer: {why}")

    def drop(self) -> None:
        """End the process."""
        if self._child is None:
            return
        with suppress(LtlplanError, OSError):
            self._child.kill()
            self._child.close()


def _ready(_question: None, _progress: Progress) -> None:
    """Answer that everything is loaded."""
