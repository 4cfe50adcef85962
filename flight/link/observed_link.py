"""A link that is observed: what robots do is shown ten times a second, and orders to stop are heard whenever time goes on.

It adds nothing that can wait: what is shown is handed on as a value, in the flight's own thread, and whoever takes it returns at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from flight.link.link import Health, Link, Pose
from flight.link.record import Record
from flight.link.stop_orders import StopOrders
from flight.link.wrapped import WrappedLink
from flight.logs.log import Event
from verify.data import Trajectory

if TYPE_CHECKING:
    from flight.link.tracking_monitor import Look

EVERY = 0.1
"""s between two observations."""
STEP = 0.02
"""s between two looks for orders."""

Command = Literal["hold", "land", "stop"]
_ORDER: tuple[Command | None, ...] = (None, "hold", "land", "stop")


@dataclass(frozen=True, slots=True)
class SeenRobot:
    """State of a robot as it is observed.

    Attributes:
        pose: The last one measured; None before any was.
        health: What it says of itself.
        acknowledged: The highest command of a flight's end that it has acknowledged; None before any.
    """

    pose: Pose | None
    health: Health
    acknowledged: Command | None


@dataclass(frozen=True, slots=True)
class Observation:
    """State of a flight at an instant.

    Attributes:
        time: s of the link's clock.
        robots: By name.
        paths: What is flown, by robot; the same mapping while it does not change.
        began: When that began, s of the link's clock.
        look: The monitor's last look; None before the first.
        said: What was noted since the last observation.
        ending: Whether the flight ends: all hold or land.
        accuracy: Bound on the error of a measured position, m.
    """

    time: float
    robots: Mapping[str, SeenRobot]
    paths: Mapping[str, Trajectory]
    began: float
    look: Look | None
    said: tuple[Event, ...]
    ending: bool
    accuracy: float


class ObservedLink(WrappedLink):
    """Hands everything on to another link, observes what goes through, and heeds orders to stop.

    Attributes:
        orders: Those that are given to this flight.
    """

    def __init__(self, link: Link, orders: StopOrders, record: Record, show: Callable[[Observation], None]) -> None:
        """Take a link.

        Args:
            link: To the vehicles.
            orders: Those that are given to this flight.
            record: What is kept of the flight.
            show: Receives observations; it returns at once.
        """
        super().__init__(link)
        self.orders, self._record, self._show = orders, record, show
        self._stored: dict[int, dict[str, Trajectory]] = {}
        self._flown: Mapping[str, Trajectory] = {}
        self._number, self._began, self._seen, self._said = -1, 0.0, -math.inf, 0
        self._acknowledged: dict[str, Command] = {}
        self._look: Look | None = None

    def see(self, look: Look) -> None:
        """Take in the monitor's last look.

        Args:
            look: The look.
        """
        self._look = look

    def sleep(self, seconds: float) -> None:
        """Let time go on, in steps after each of which orders are heeded.

        Raises:
            Ordered: The team is to hold, or to land.
            MotorsOrdered: All motors are to stop.
        """
        end = self.link.now() + seconds
        while True:
            self.link.sleep(min(max(end - self.link.now(), 0.0), STEP))
            if self.link.now() - self._seen >= EVERY - STEP / 2:
                self.observe()
            self.orders.heed()
            if self.link.now() >= end - 1e-9:
                return

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Store a flight on board.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.
        """
        self.link.upload(robot, number, path)
        self._stored[number] = {**self._stored.get(number, {}), robot: path}
        if number == self._number:  # it goes on changed
            self._flown = self._stored[number]

    def start(self, number: int, at: float | None = None) -> float:
        """Start a stored flight of all robots at once; return when it began."""
        self._began = self.link.start(number, at)
        self._number, self._flown = number, self._stored.get(number, {})
        return self._began

    def hold(self, robot: str) -> bool:
        """Tell a robot to brake to a hover."""
        return self._noted(robot, "hold", self.link.hold(robot))

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        return self._noted(robot, "land", self.link.land(robot, height, seconds))

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors."""
        return self._noted(robot, "stop", self.link.stop(robot))

    def _noted(self, robot: str, command: Command, acknowledged: bool) -> bool:
        before = self._acknowledged.get(robot)
        if acknowledged and _ORDER.index(command) > _ORDER.index(before):
            self._acknowledged[robot] = command
        return acknowledged

    def observe(self) -> None:
        """Show how it is now."""
        now, link = self.link.now(), self.link
        self._seen = now
        robots = {name: SeenRobot(link.pose(name), link.health(name), self._acknowledged.get(name)) for name in link.robots}
        said = tuple(self._record.events[self._said :])
        self._said += len(said)
        with suppress(Exception):  # no flight ends for what is shown of it
            self._show(Observation(now, robots, self._flown, self._began, self._look, said, self.orders.ending, link.accuracy))
