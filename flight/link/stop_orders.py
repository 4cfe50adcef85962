"""Stop orders to a live flight from outside of its program, in three levels: all hold, all land, all motors stop.

Orders only escalate, and are heard by the flight's own thread whenever it lets time go on. Nothing is raised in the middle of what it does. A hold ends
what is flown, and lasts until a higher order, or until it cannot last (`holding`). An order to land ends the flight as an alarm does. Where the team lands
already neither changes anything. The last level stops all motors, as a second Ctrl-C does.
"""

from __future__ import annotations

import threading
from enum import IntEnum


class Level(IntEnum):
    """Levels of an order, each with all that is below it."""

    NONE = 0
    HOLD = 1
    LAND = 2
    MOTORS = 3


class Alarm(Exception):
    """The flight does not go on; the message says why."""


class Ordered(Alarm):
    """The flight does not go on, as it is ordered; the message says by whom."""


class MotorsOrdered(BaseException):
    """All motors are ordered to stop while the team lands."""


class StopOrders:
    """Orders of one flight. Any thread may give one; the flight's own thread heeds them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._level, self._why = Level.NONE, ""
        self._done: Level | None = None  # what is done anyhow; None before anything flies

    @property
    def level(self) -> Level:
        """The highest level that was ordered."""
        return self._level

    @property
    def ending(self) -> bool:
        """True once the flight ends, for whatever reason: all hold, or land."""
        return self._done is not None and self._done >= Level.HOLD

    @property
    def held(self) -> bool:
        """True once the flight was broken off by an order, and no higher one than to hold was given."""
        return self._done is Level.HOLD and self._level is Level.HOLD

    def give(self, level: Level, why: str) -> bool:
        """Order a stop; return whether it is above what was ordered and is done: otherwise it changes nothing.

        Args:
            level: What is ordered.
            why: A sentence on who ordered it.
        """
        with self._lock:
            raises = level > max(self._level, self._done or Level.NONE)
            if level > self._level:
                self._level, self._why = level, self._why or why
            return raises

    def begin_flying(self) -> None:
        """Have the flight begun: before, nothing spins, and an order waits until then, when it keeps all on the ground."""
        self._done = Level.NONE

    def begin_holding(self) -> None:
        """Have the team hold: from now on only higher orders are heeded."""
        self._done = Level.HOLD

    def begin_ending(self) -> None:
        """Have the flight's end begun: from now on only motors are heeded."""
        self._done = Level.LAND

    def heed(self) -> None:
        """Do what is ordered and was not done.

        Raises:
            Ordered: The team is to hold, or to land.
            MotorsOrdered: It lands, and all motors are to stop; once.
        """
        if self._done is None or self._level <= self._done:
            return
        if self._done < Level.LAND:
            raise Ordered(self._why)
        self._done = Level.MOTORS
        raise MotorsOrdered(self._why)
