"""Stop orders to a live flight from outside of its program: a first one lands the team, a second one stops all motors.

Orders only escalate, and are heard by the flight's own thread whenever it lets time go on. Nothing is raised in the middle of what it does. A first
order ends the flight as an alarm does: all hold while all are seen, then land. Where the team lands already it changes nothing. A second one stops
all motors, as a second Ctrl-C does.
"""

from __future__ import annotations

import threading
from enum import IntEnum


class Level(IntEnum):
    """Levels of an order, each with all that is below it."""

    NONE = 0
    LAND = 1
    MOTORS = 2


class Alarm(Exception):
    """The flight does not go on; the message says why."""


class MotorsOrdered(BaseException):
    """All motors are ordered to stop while the team lands."""


class StopOrders:
    """Orders of one flight. Any thread may give one; the flight's own thread heeds them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._level, self._why = Level.NONE, ""
        self._flying, self._ending, self._heeded = False, False, False

    @property
    def level(self) -> Level:
        """The highest level that was ordered."""
        return self._level

    @property
    def ending(self) -> bool:
        """True once the flight ends, for whatever reason."""
        return self._ending

    def give(self, level: Level, why: str) -> None:
        """Order a stop; one that is not above what was ordered changes nothing.

        Args:
            level: What is ordered.
            why: A sentence on who ordered it.
        """
        with self._lock:
            if level > self._level:
                self._level, self._why = level, self._why or why

    def begin_flying(self) -> None:
        """Have the flight begun: before, nothing spins, and an order waits until then, when it keeps all on the ground."""
        self._flying = True

    def begin_ending(self) -> None:
        """Have the flight's end begun: from now on only motors are heeded."""
        self._ending = True

    def heed(self) -> None:
        """Do what is ordered and was not done.

        Raises:
            Alarm: The flight is to end.
            MotorsOrdered: It ends, and all motors are to stop; once.
        """
        if self._level is Level.NONE or not self._flying:
            return
        if not self._ending:
            raise Alarm(self._why)
        if self._level is Level.MOTORS and not self._heeded:
            self._heeded = True
            raise MotorsOrdered(self._why)
