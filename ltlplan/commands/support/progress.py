"""Progress of a command on standard error: a live bar on a terminal, elsewhere lines that never stop for long."""

from __future__ import annotations

import os
import re
import sys
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import typer

from verify.data.progress import Progress

if TYPE_CHECKING:
    from rich.console import Console

_EVERY = 2.0
"""s after which there is another line at the latest, with how long the work has lasted where nothing else is known."""
_FORCING = {"FORCE_COLOR", "TTY_COMPATIBLE"}
"""Variables by which rich may take for a terminal what is none."""
_APART = 0.2
"""s between lines that differ in names alone."""


@contextmanager
def progress_bar(*, quiet: bool) -> Generator[Progress]:
    """Show progress on standard error: a live bar on a terminal, elsewhere lines.

    Yields the function that moves it (sentence, share done from 0 to 1).
    """
    if quiet:
        yield lambda _sentence, _share: None
        return
    console = _terminal()
    if console is None:
        lines = Lines(lambda line: typer.echo(line, err=True))
        with lines.beating():
            yield lines.move
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), TaskProgressColumn(), TimeElapsedColumn())
    width = max(console.width - 45, 20)
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def move(sentence: str, share: float) -> None:
            shown = sentence if len(sentence) <= width else sentence[: width - 3] + "..."
            bar.update(task, description=f"{shown:<{min(width, 44)}}", completed=min(max(share, 0.0), 1.0))

        yield move


def _terminal() -> Console | None:
    """Return standard error where it is a terminal, or is to be taken for one."""
    if not sys.stderr.isatty() and not os.environ.keys() & _FORCING:
        return None
    from rich.console import Console  # here: it takes long to load, and a log needs none

    console = Console(stderr=True)
    return console if console.is_terminal else None


class Lines:
    """Progress as lines for a log: at once for new work, otherwise now and then, and every two seconds whatever happens.

    Args:
        write: Takes each line.
        clock: Returns a time in s.
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write, self._clock = write, clock
        self._kinds: set[str] = set()
        self._now: tuple[str, float] | None = None
        self._printed: tuple[str, float] | None = None
        self._begun = self._last = clock()
        self._lock = threading.Lock()

    def move(self, sentence: str, share: float) -> None:
        """Say what is being done, and which share of all is done."""
        with self._lock:
            now, kind = self._clock(), re.sub(r"[0-9.]+", "", sentence)  # names of robots often differ in numbers alone
            if self._now is None or sentence != self._now[0]:
                self._begun = now
            self._now = (sentence, share)
            counted = self._printed is not None and _counter(sentence) == _counter(self._printed[0])
            if kind not in self._kinds or now - self._last >= (_EVERY if counted else _APART):
                self._kinds.add(kind)
                self._print(now)

    def beat(self) -> None:
        """Print a line if there was none for two seconds: what came last, and for how long it has been done."""
        with self._lock:
            now = self._clock()
            if self._now is not None and now - self._last >= _EVERY:
                self._print(now)

    @contextmanager
    def beating(self) -> Generator[None]:
        """Call `beat` several times a second, from a thread of its own."""
        ended = threading.Event()

        def run() -> None:
            with suppress(OSError):  # whoever read the lines has gone; the command says so itself
                while not ended.wait(_EVERY / 8):
                    self.beat()

        thread = threading.Thread(target=run, name="progress", daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _print(self, now: float) -> None:
        assert self._now is not None
        sentence, share = self._now
        lasted = f" ({now - self._begun:.0f} s)" if self._now == self._printed else ""
        self._printed, self._last = self._now, now
        self._write(f"[{share:4.0%}] {sentence}{lasted}")


def _counter(sentence: str) -> str:
    """Return a sentence without the numbers that stand alone in it."""
    return re.sub(r"(?<![\w.])[0-9][0-9.]*", "", sentence)
