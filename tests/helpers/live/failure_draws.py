"""Random failures of live flights: what fails, whose, and when; and when that instant comes in a flight over a real link.

A flight has phases: `before` anything spins (it is checked, and stored), then one for each stage, from the instant at which it is asked for to the
end of the hover behind it; the last one's ends with motors off. An instant is drawn uniformly within a phase. What is drawn for a number is always the same.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flight.link.live_executive import SETTLE
from flight.link.phases import Stage

BEFORE = -1
HOST = ("interrupted", "terminated", "error", "hangs", "outage", "unplugged")
"""What fails of everybody: the program is interrupted, has an error, or hangs; packets are lost for a while; the radio is gone for good."""


@dataclass(frozen=True)
class Draw:
    """A failure.

    Attributes:
        number: Of the draw.
        kind: What fails.
        robot: Whose; nobody's where it is the host's.
        phase: Number of the stage, or `BEFORE`.
        share: Of the phase's duration, at which it fails.
        lasts: s that what passes by itself lasts.
        again: s after which the program is interrupted once more; None where it is not.
        choice: Drawn for what links differ in.
    """

    number: int
    kind: str
    robot: str
    phase: int
    share: float
    lasts: float
    again: float | None
    choice: int

    @property
    def of_host(self) -> bool:
        """Whether it concerns everybody."""
        return self.kind in HOST


def drawn(family: int, number: int, kinds: Sequence[str], robots: Sequence[str], stages: int = 3) -> Draw:
    """Return the failure of a number.

    Args:
        family: Which link is tried.
        number: From 0.
        kinds: What may fail.
        robots: Names.
        stages: How many are flown.
    """
    rng = np.random.default_rng([191, family, number])
    return Draw(
        number,
        str(rng.choice(list(kinds))),
        str(rng.choice(list(robots))),
        int(rng.integers(BEFORE, stages)),
        float(rng.uniform()),
        float(rng.uniform(0.05, 4.0)),
        float(rng.uniform(0.05, 4.0)) if rng.random() < 0.2 else None,
        int(rng.integers(2)),
    )


class Failing(threading.Thread):
    """Waits for a draw's instant in a flight, and has what fails fail; and once more, where that was drawn.

    Attributes:
        failed_at: When it failed, s of the link's clock; infinite before.
        begun: When each flight was asked to start, s of the link's clock.
        ended: Set where the flight is over: nothing fails any more.
    """

    def __init__(
        self, draw: Draw, link, stages: Sequence[Stage], act: Callable[[], None], *, lead: float, before: float
    ) -> None:
        """Listen to a link's starts.

        Args:
            draw: What fails, and when.
            link: Over which it is flown.
            stages: What is flown.
            act: Has it fail.
            lead: s that the first start takes.
            before: s from when on this runs to the first start.
        """
        super().__init__(daemon=True)
        self.draw, self.link, self.act, self.ended = draw, link, act, threading.Event()
        self.begun: dict[int, float] = {}
        self.failed_at = float("inf")
        self.last = len(stages) - 1
        length = before if draw.phase == BEFORE else stages[draw.phase].duration + SETTLE + lead * (draw.phase == 0)
        self.after = draw.share * length
        start = link.start

        def started(number: int, at: float | None = None) -> float:
            self.begun.setdefault(number, link.now())
            return start(number, at)

        link.start = started

    def run(self) -> None:
        if self.draw.phase == BEFORE:
            self.begun[BEFORE] = self.link.now()
        while self.draw.phase not in self.begun or self.link.now() < self.begun[self.draw.phase] + self.after:
            if self.ended.wait(0.005):
                return
        self.failed_at = self.link.now()
        self.act()
        if self.draw.again is not None and not self.ended.wait(self.draw.again):
            interrupt(signal.SIGINT)


def interrupt(number: int) -> None:
    """Send this process a signal, as a terminal or `kill` does."""
    os.kill(os.getpid(), number)


class Host:
    """What fails in the process that flies: it hangs where a signal finds it, or has an error at the next thing that it does."""

    def __init__(self, link, lasts: float) -> None:
        self._error, slept = False, link.sleep

        def hang(_number, _frame) -> None:
            end = time.monotonic() + lasts
            while (left := end - time.monotonic()) > 0:
                time.sleep(left)

        def sleep(seconds: float) -> None:
            if self._error:
                self._error = False
                raise ZeroDivisionError("nobody thought of this")
            slept(seconds)

        link.sleep = sleep
        signal.signal(signal.SIGUSR1, hang)

    def err(self) -> None:
        self._error = True

    def hang(self) -> None:
        interrupt(signal.SIGUSR1)
