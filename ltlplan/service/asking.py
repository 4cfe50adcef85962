"""Where questions are answered at once: in a process of their own, with seconds and megabytes counted, apart from all jobs."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.service.problems import Busy

if TYPE_CHECKING:
    from concurrent.futures import Future


class Questions:
    """Where questions are answered.

    Attributes:
        scratch: Folder for what an answer needs on disk meanwhile; emptied at the start.
    """

    def __init__(self, workers: Any, scratch: Path, *, most_waiting: int) -> None:  # workers: `LocalWorkers`, or like them
        self._workers, self.scratch, self._most = workers, scratch, most_waiting
        self._open = 0
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(mode=0o700, parents=True, exist_ok=True)

    async def ask(self, work: Callable[..., Any], /, *arguments: Any) -> Any:  # work has its own arguments and answer
        """Return what a function of a module returns, computed in a process.

        Args:
            work: It is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.

        Raises:
            Busy: Too many questions wait.
            LtlplanError: What the function raised, or that it took more time or memory than a question may.
        """
        if self._open >= self._most + self._workers.count:
            raise Busy(f"{self._open} questions are waiting already; try again soon.")
        self._open += 1
        try:
            loop = asyncio.get_running_loop()
            future: Future[Any] = await loop.run_in_executor(None, lambda: self._workers.submit(work, *arguments))
            return await asyncio.wrap_future(future)
        finally:
            self._open -= 1

    @contextmanager
    def folder(self) -> Generator[Path]:
        """Lend a folder that is gone afterwards, whatever happened in it."""
        path = Path(tempfile.mkdtemp(dir=self.scratch))
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)

    async def ask_in_folder(self, work: Callable[..., Any], /, *arguments: Any) -> Any:  # as `ask`
        """As `ask`, with a fresh folder as the first argument.

        Args:
            work: It is given a folder, the arguments and, last, whom to tell its progress.
            arguments: What it is given.
        """
        with self.folder() as path:
            return await self.ask(work, path, *arguments)

    def close(self) -> None:
        """End all that is being answered."""
        self._workers.close()
