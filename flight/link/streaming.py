"""Set-points that a link sends from here: when one is due, what it is, and where robots stay when this computer was late.

All robots of a link are asked by one clock, `RATE` times a second. A computer that was too busy, or was stopped, must not go on where it
should be by now: robots would jump there. They are asked to stay where they last were to be, and the link is lost.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight.link.link import LinkLost
from verify.data import Trajectory

Floats = NDArray[np.float64]

RATE = 50.0
"""Set-points a second for each robot."""
LATE = 0.2
"""s by which a set-point may be late: after more, it would be a jump."""


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Set-point of a robot at an instant.

    Attributes:
        time: s of its flight.
        flat: x, y, z in m and heading in rad, and their derivatives. Shape (orders, 4).
    """

    time: float
    flat: Floats


class SetpointStream:
    """The set-points of one link.

    Attributes:
        begin: When what is flown began, s of the link's clock; infinite before.
    """

    def __init__(self, robots: Iterable[str]) -> None:
        """Fly nothing.

        Args:
            robots: Names.
        """
        self._stored: dict[str, dict[int, Trajectory]] = {name: {} for name in robots}
        self._number, self._sent, self._stays, self._late = -1, -math.inf, math.inf, 0.0
        self.begin = math.inf

    def store(self, robot: str, number: int, path: Trajectory) -> None:
        """Keep a flight; one that is flown goes on changed.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.
        """
        self._stored[robot][number] = path

    def those_in(self, number: int) -> list[str]:
        """Return who flies in a flight.

        Args:
            number: Of the flight.
        """
        return [robot for robot, flights in self._stored.items() if number in flights]

    def fly(self, number: int, begin: float) -> None:
        """Fly a flight of all.

        Args:
            number: Of the flight.
            begin: When, s of the link's clock; until then robots are asked to hover where it begins.
        """
        self._number, self.begin, self._stays, self._late = number, begin, math.inf, 0.0

    def begun(self, robot: str) -> int | None:
        """Return the number of what a robot flies; None where it flies nothing.

        Args:
            robot: Name.
        """
        return self._number if self._number in self._stored[robot] else None

    def first(self, robot: str, number: int, orders: int) -> Setpoint | None:
        """Return what a robot is asked to do just before a flight that is started next; None where it does not fly in it.

        Args:
            robot: Name.
            number: Of the flight.
            orders: As for `of`.
        """
        path = self._stored[robot].get(number)
        if path is None:
            return None
        flat = np.zeros((orders, 4))
        flat[0] = path.evaluate(0.0)
        return Setpoint(0.0, flat)

    @property
    def until(self) -> float:
        """Up to when robots are asked to fly on, s of the link's clock; infinite where this computer was in time."""
        return self.begin + self._stays

    def due(self, now: float) -> bool:
        """Return whether set-points are to be sent, and count them as sent.

        Args:
            now: s of the link's clock.
        """
        late = now - self._sent - 1.0 / RATE
        if late < 0.0:
            return False
        missed = min(late, now - self.begin)  # of a flight whose first set-point this is, since it began
        if missed > LATE and math.isinf(self._stays):
            self._stays, self._late = max(self._sent - self.begin, 0.0), missed
        self._sent = now if late > 1.0 / RATE else self._sent + 1.0 / RATE
        return True

    def of(self, robot: str, at: float, orders: int) -> Setpoint | None:
        """Return what a robot is asked to do at an instant; None where it flies nothing.

        Args:
            robot: Name.
            at: s of the link's clock; the robot hovers before its flight, and from its end on.
            orders: How many: place and heading, and all but one of these of their derivatives.
        """
        path = self._stored[robot].get(self._number)
        if path is None:
            return None
        time = min(max(at - self.begin, 0.0), path.duration, self._stays)
        flat = np.stack([path.evaluate(time, order) for order in range(orders)])
        if time != at - self.begin:
            flat[1:] = 0.0
        return Setpoint(time, flat)

    def require_in_time(self) -> None:
        """Say once that this computer was late, after robots were asked to stay where they last were.

        Raises:
            LinkLost: It was late by more than `LATE`.
        """
        late, self._late = self._late, 0.0
        if late:
            raise LinkLost(f"set-points were {late:.2f} s late: this computer is too busy, or was stopped")
