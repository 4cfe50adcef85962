"""Protocol of a link to vehicles: poses and health in, trajectories and a few commands out.

A link kind is a module with a class that has these methods. Commands are told to be acknowledged or not, never assumed: who
calls repeats them. All vehicles share one clock, the link's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from flight.exports.scripts.flying.checks import Health, Pose
from flight.exports.scripts.flying.ending import Robots
from verify.data import Trajectory
from verify.data.errors import LtlplanError

__all__ = ["Health", "Link", "LinkLost", "Pose"]


class LinkLost(LtlplanError):
    """A vehicle, or all, cannot be reached; the message says whom, and what acts on board then."""

    exit_code = 2


class Link(Robots, Protocol):
    """Vehicles as they are reached."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the vehicles that answer."""
        ...

    @property
    def accuracy(self) -> float:
        """Bound on the error of a measured position, m."""
        ...

    @property
    def streams(self) -> bool:
        """True if set-points come from here: what is flown may then be stored anew, the same up to now, and goes on changed."""
        ...

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return the parameters on board that matter, as they were read back."""
        ...

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a finite flight on board under a number.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.

        Raises:
            LinkLost: The vehicle did not confirm it.
            DoesNotFit: Its memory does not hold it.
        """
        ...

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Have a stored flight on board of all, who hover, so that it can be started at once.

        Args:
            number: Of the flight.
            meanwhile: Called again and again while that takes its time.

        Raises:
            LinkLost: A vehicle did not take it.
        """
        ...

    def ready(self, robot: str, number: int) -> bool:
        """Have a robot that stands on the ground ready for a stored flight, so that it begins when that is started next.

        It is called again and again, while others fly; the robot's motors may turn from the first time on.

        Args:
            robot: Name.
            number: Of the flight, which begins where the robot stands.

        Returns:
            Whether it is ready.
        """
        ...

    def start(self, number: int, at: float | None = None) -> float:
        """Start a stored flight of all robots that have it, at once, by one broadcast; return when it began, s of the link's clock.

        Args:
            number: Of the flight.
            at: When it is to begin, s of the link's clock, of links that stream; None for now.
        """
        ...

    def close(self) -> None:
        """Let go of the link."""
        ...
