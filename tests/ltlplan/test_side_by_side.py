"""Paths that are improved side by side are those that are improved one after another."""

from __future__ import annotations

from concurrent.futures import Future

import ltlplan
from verify.data.progress import silent


class Here:
    """Workers that do at once, in this process, what they are given, and note how much that was."""

    count = 2

    def __init__(self) -> None:
        self.parts = 0

    def submit(self, work, /, *arguments, progress=None):
        del progress
        self.parts += 1
        future: Future = Future()
        future.set_result(work(*arguments, silent))
        return future


def test_the_plan_does_not_depend_on_who_improves_it() -> None:
    workers = Here()
    alone = ltlplan.plan("firefighting", seed=3)
    shared = ltlplan.plan("firefighting", seed=3, workers=workers)
    assert workers.parts == 3
    assert shared == alone
    assert shared.digest() == alone.digest()
