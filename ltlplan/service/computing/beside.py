"""Answers that are computed beside a flight: each in a process of its own, which is looked at without waiting and ended when it is dropped."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ltlplan.online.asking import NoAnswer
from ltlplan.service.computing.bounds import Bounds, LimitReached, WorkerDied
from ltlplan.service.computing.children import Child, warm_up
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
        return BesideAnswer(Child(work, (question,), Bounds(nice=0)))


class BesideAnswer:
    """An answer to come from a process."""

    def __init__(self, child: Child) -> None:
        """Take a process that has begun.

        Args:
            child: The process.
        """
        self._child, self._ended = child, False

    @property
    def child(self) -> Child:
        """The process that computes it."""
        return self._child

    def done(self, wait: float = 0.0) -> bool:
        """Whether it is there, or will not come.

        Args:
            wait: s to wait for it at most.
        """
        self._ended = self._ended or self._child.look(wait=wait)
        return self._ended

    def result(self) -> Any:
        """Return the answer.

        Raises:
            LtlplanError: What was raised in its place.
            NoAnswer: The process was ended.
        """
        try:
            return self._child.result()
        except (WorkerDied, LimitReached) as error:
            raise NoAnswer(f"who computes what is flown next gives no answer: {error}") from None

    def drop(self) -> None:
        """End the process."""
        with suppress(LtlplanError, OSError):
            self._child.kill()
            self._child.close()


def _ready(_question: None, _progress: Progress) -> None:
    """Answer that everything is loaded."""
