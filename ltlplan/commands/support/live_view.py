"""A live flight in the terminal: where it is, how far each robot is from its plan, and what was said."""

from __future__ import annotations

import math
import shutil
import signal
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from types import FrameType

    from flight.link.live_executive import LiveFlight
    from flight.link.tracking_monitor import Look

_EVERY = 1.0
"""s of flight between two lines where nobody watches a terminal."""
_AT_ONCE = 0.2
"""s within which signals are one command: shells and wrappers pass on what the terminal has sent, too."""
_PARTS = 3
"""Of a formula, that are named at once."""


class View:
    """Shows looks at a flight: one line that is written anew in a terminal, a line a second elsewhere."""

    def __init__(self, *, quiet: bool) -> None:
        """Begin.

        Args:
            quiet: Show nothing.
        """
        self._quiet, self._terminal = quiet, typer.get_text_stream("stdout").isatty()
        self._last, self._stage = -math.inf, ""

    def show(self, look: Look) -> None:
        """Show a look."""
        if self._quiet:
            return
        for event in look.events:
            self._line(f"{look.stage} {event.time:8.2f} s  {event.sentence}", stays=True)
        if look.stage != self._stage:
            self._stage, self._last = look.stage, -math.inf
        if self._terminal or look.time - self._last >= _EVERY:
            self._last = look.time
            off = ", ".join(f"{name} {'unseen' if math.isnan(e) else f'{1000 * e:.0f} mm'}" for name, e in look.errors.items())
            left = max(look.duration - look.time, 0.0)
            line = f"{look.stage} {look.time:6.1f} s, {left:.1f} s to go, of {1000 * look.margin:.0f} mm: {off}{_to_do(look)}"
            self._line(line, stays=not self._terminal)

    def end(self) -> None:
        """Leave the line that is written anew."""
        if self._terminal and not self._quiet:
            self._line("", stays=False)

    def _line(self, text: str, *, stays: bool) -> None:
        erased = "\r\x1b[2K" if self._terminal else ""
        kept = (
            text if stays else text[: shutil.get_terminal_size().columns - 1]
        )  # what runs over a line's end cannot be written anew
        typer.echo(f"{erased}{kept}", nl=stays)


def _to_do(look: Look) -> str:
    """Return which parts of the formula are still to be done, a few of many."""
    if not look.to_do:
        return ""
    more = f" and {len(look.to_do) - _PARTS} more" if len(look.to_do) > _PARTS else ""
    return "; still to do: " + ", ".join(map(_named, look.to_do[:_PARTS])) + more


def _named(part: str) -> str:
    """Return a part that is still to do, its formula set apart from the time until which it is open."""
    formula, until, end = part.partition(" until ")
    return f"`{formula}`{until}{end}"


@dataclass
class Interrupts:
    """Interrupts from outside that end a flight.

    Attributes:
        first: The first signal; None where there was none.
    """

    first: int | None = None

    def code(self, done: LiveFlight) -> int | None:
        """Return what a command ends with whose flight a signal ended, by the shell's custom; None where none did.

        Args:
            done: How the flight ended.
        """
        from flight.link.live_executive import INTERRUPTED

        return None if self.first is None or done.reason != INTERRUPTED else 128 + self.first


@contextmanager
def interrupts_land() -> Generator[Interrupts]:
    """Have Ctrl-C and SIGTERM raise KeyboardInterrupt once each time: the first lands the team, the next stops motors.

    Signals that come at once are one.

    The command line raises one that was caught again, which would stop motors in the air.
    """
    heard, last = Interrupts(), -math.inf

    def interrupt(number: int, _frame: FrameType | None) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < _AT_ONCE:
            return
        heard.first, last = heard.first or number, now
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield heard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
