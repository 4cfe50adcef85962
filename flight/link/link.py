"""Protocol of a link to vehicles: poses and health in, trajectories and a few commands out.

A link kind is a module with a class that has these methods. Commands are told to be acknowledged or not, never assumed: who
calls repeats them. All vehicles share one clock, the link's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from flight.exports.scripts.flying.checks import Pose
from verify.data import Trajectory
from verify.data.errors import LtlplanError

__all__ = ["Health", "Link", "LinkLost", "Pose"]


class LinkLost(LtlplanError):
    """A vehicle, or all, cannot be reached; the message says whom, and what acts on board then."""

    exit_code = 2


@dataclass(frozen=True, slots=True)
class Health:
    """Health that a vehicle reports; None for what it does not report.

    Attributes:
        ready: Whether it would take off: armed or needing no arming, no supervisor in the way.
        settled: Whether its estimator has settled.
        endurance: s that its battery lasts in hover.
        flying: Whether it says that it flies: its supervisor, its land detector.
        fault: What blocks it in flight, as of it alone (`has tumbled`); empty where nothing does.
        why: Why something is not known, by the name of its check.
    """

    ready: bool | None = None
    settled: bool | None = None
    endurance: float | None = None
    flying: bool | None = None
    fault: str = ""
    why: Mapping[str, str] = field(default_factory=dict[str, str])


class Link(Protocol):
    """Vehicles as they are reached."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the vehicles that answer."""
        ...

    @property
    def failsafe(self) -> str:
        """Reaction on board when the link is gone, as it was set and read back; a sentence."""
        ...

    @property
    def accuracy(self) -> float:
        """Bound on the error of a measured position, m."""
        ...

    @property
    def streams(self) -> bool:
        """True if set-points come from here: what is flown may then be stored anew, the same up to now, and goes on changed."""
        ...

    def now(self) -> float:
        """Return the link's clock, s; it never goes back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time go on, and take in what arrives."""
        ...

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose that arrived; None before any did."""
        ...

    def health(self, robot: str) -> Health:
        """Return what a vehicle last said of itself."""
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

    def hold(self, robot: str) -> bool:
        """Tell a robot to brake to a hover; return whether it has acknowledged that."""
        ...

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink to a height in m, in so many seconds; return whether it has acknowledged that.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        ...

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors; return whether it has acknowledged that."""
        ...

    def close(self) -> None:
        """Let go of the link."""
        ...
