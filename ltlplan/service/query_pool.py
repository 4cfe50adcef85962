"""Pool that answers queries: a process of their own, with seconds and megabytes counted, apart from all jobs.

There are two lanes, so that what is typed is checked at once whatever recordings are checked; in each, users take turns, and of one user one
question is answered at a time.
"""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.service.execution.turns import SharedPool
from ltlplan.service.problems import Busy, TooManyRequests

if TYPE_CHECKING:
    from concurrent.futures import Future


class _Lane:
    """One of the lanes."""

    def __init__(self, shared: SharedPool, most: int, each: int) -> None:
        self.pool, self._turns = shared.pool, shared.turns
        self._most, self._each = most, each
        self._open: Counter[str] = Counter()
        self._one: dict[str, asyncio.Lock] = {}

    @property
    def open(self) -> int:
        """Number of questions that wait or are being answered."""
        return self._open.total()

    async def ask(self, work: Callable[..., Any], arguments: tuple[Any, ...], who: str) -> Any:
        if self._open[who] >= self._each + self.pool.count:
            raise TooManyRequests(
                f"{self._open[who]} of your questions are waiting already; try again when they are answered.", 2.0
            )
        if self._open.total() >= self._most + self.pool.count:
            raise Busy(f"{self._open.total()} questions are waiting already; try again soon.")
        self._open[who] += 1
        try:
            if not who:  # the service itself
                return await self._answer(work, arguments, who)
            async with self._one.setdefault(who, asyncio.Lock()):
                return await self._answer(work, arguments, who)
        finally:
            self._open[who] -= 1
            if not self._open[who]:
                del self._open[who]
                self._one.pop(who, None)

    async def _answer(self, work: Callable[..., Any], arguments: tuple[Any, ...], who: str) -> Any:
        rank = self._turns.rank(who)
        try:
            loop = asyncio.get_running_loop()
            future: Future[Any] = await loop.run_in_executor(None, lambda: self.pool.submit(work, *arguments, rank=float(rank)))
            return await asyncio.wrap_future(future)
        finally:
            self._turns.ended(rank)


class Questions:
    """Pool that answers queries.

    Attributes:
        scratch: Folder for what an answer needs on disk meanwhile; emptied at the start.
    """

    def __init__(self, short: SharedPool, errands: SharedPool, scratch: Path, *, most: int, each: int) -> None:
        """Prepare the lanes.

        Args:
            short: Who answers short questions.
            errands: Who does what can take long.
            scratch: Folder for what an answer needs on disk meanwhile.
            most: How many may wait in each lane.
            each: How many of one user may.
        """
        self._short, self._errands, self.scratch = _Lane(short, most, each), _Lane(errands, most, each), scratch
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(mode=0o700, parents=True, exist_ok=True)

    async def ask(
        self, work: Callable[..., Any], /, *arguments: Any, who: str = ""
    ) -> Any:  # work has its own arguments and answer
        """Return what a function of a module returns, computed in a process: a short question, which waits behind no errand.

        Args:
            work: It is given the arguments and, last, whom to tell its progress.
            arguments: What it is given; must be picklable.
            who: Who asks: a token's name, or an address; the service itself by default.

        Raises:
            Busy: Too many questions wait.
            TooManyRequests: Too many of this user wait.
            LtlplanError: What the function raised, or that it took more time or memory than a question may.
        """
        return await self._short.ask(work, arguments, who)

    @property
    def open(self) -> dict[str, int]:
        """Number of questions that wait or are being answered, by lane."""
        return {"short": self._short.open, "errands": self._errands.open}

    @property
    def trouble(self) -> str | None:
        """Reason why nothing is answered at the moment; None while something is."""
        return self._short.pool.trouble or self._errands.pool.trouble

    @contextmanager
    def folder(self) -> Generator[Path]:
        """Lend a folder that is gone afterwards, whatever happened in it."""
        path = Path(tempfile.mkdtemp(dir=self.scratch))
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)

    async def ask_in_folder(self, work: Callable[..., Any], /, *arguments: Any, who: str = "") -> Any:  # as `ask`
        """As `ask`, for an errand: what needs files, and can take long.

        Args:
            work: It is given a folder, the arguments and, last, whom to tell its progress.
            arguments: What it is given.
            who: Who asks.
        """
        with self.folder() as path:
            return await self._errands.ask(work, (path, *arguments), who)

    def close(self) -> None:
        """End all that is being answered."""
        self._short.pool.close()
        self._errands.pool.close()
