"""A link that hands everything on to another one: base of those that change, or watch, some of what goes through."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from flight.link.link import Health, Link, Pose
from verify.data import Trajectory


class WrappedLink:
    """Hands everything on.

    Attributes:
        link: To the vehicles.
    """

    def __init__(self, link: Link) -> None:
        """Take a link.

        Args:
            link: To the vehicles.
        """
        self.link = link

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the vehicles that answer."""
        return self.link.robots

    @property
    def failsafe(self) -> str:
        """Reaction on board when the link is gone."""
        return self.link.failsafe

    @property
    def accuracy(self) -> float:
        """Bound on the error of a measured position, m."""
        return self.link.accuracy

    @property
    def streams(self) -> bool:
        """True if set-points come from here."""
        return self.link.streams

    def now(self) -> float:
        """Return the link's clock, s."""
        return self.link.now()

    def sleep(self, seconds: float) -> None:
        """Let time go on."""
        self.link.sleep(seconds)

    def pose(self, robot: str) -> Pose | None:
        """Return the last pose that arrived."""
        return self.link.pose(robot)

    def health(self, robot: str) -> Health:
        """Return what a vehicle last said of itself."""
        return self.link.health(robot)

    def parameters(self, robot: str) -> Mapping[str, float]:
        """Return the parameters that were read back."""
        return self.link.parameters(robot)

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a flight on board.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.
        """
        self.link.upload(robot, number, path)

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Have a stored flight on board of all."""
        self.link.bring(number, meanwhile)

    def ready(self, robot: str, number: int) -> bool:
        """Have a robot on the ground ready for a stored flight."""
        return self.link.ready(robot, number)

    def start(self, number: int, at: float | None = None) -> float:
        """Start a stored flight of all robots at once; return when it began."""
        return self.link.start(number, at)

    def hold(self, robot: str) -> bool:
        """Tell a robot to brake to a hover."""
        return self.link.hold(robot)

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        return self.link.land(robot, height, seconds)

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors."""
        return self.link.stop(robot)

    def close(self) -> None:
        """Let go of the link."""
        self.link.close()
