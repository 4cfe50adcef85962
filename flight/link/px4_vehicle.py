"""One PX4 vehicle as its link sees it, and the heartbeat of a ground station that every vehicle hears."""

from __future__ import annotations

import contextlib
import math
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from flight.exports.scripts.flying.reports import BEAT, Reports, beat
from flight.link.link import Pose
from flight.link.streaming import RATE

AGAIN = 0.3
"""s after which what was not confirmed is asked for again."""
SURE = 1.0
"""s after it was asked to arm from which on a vehicle's word that it is not armed counts: what it said before may have crossed that."""


@dataclass(slots=True)
class Vehicle:
    """One robot: how it is reached, and what it last said."""

    name: str
    system: int
    link: Any  # pymavlink's links have no types
    says: Reports = field(default_factory=Reports)
    poses: deque[Pose] = field(default_factory=lambda: deque(maxlen=50))
    asked: dict[str, float] = field(default_factory=dict[str, float])
    turn: threading.Lock = field(default_factory=threading.Lock)  # of those who send

    @property
    def speaks(self) -> bool:
        """True once it is known, seen, and reports often."""
        often = sum(pose.time > self.poses[-1].time - 0.5 for pose in self.poses) >= 0.25 * RATE
        return self.says.mode is not None and often

    @property
    def off(self) -> bool:
        """True where its motors are known to stand still."""
        return not self.says.armed and self.says.beats > self.asked.get("arm", -math.inf) + SURE

    def command(self, number: int, *values: float) -> None:
        """Send a command with up to seven values."""
        with self.turn:
            self.link.mav.command_long_send(self.system, 1, number, 0, *values, *(0.0 for _ in range(7 - len(values))))

    def beat(self) -> None:
        """Say that a ground station is here."""
        with self.turn:
            beat(self.link.mav)

    def ask(self, what: str, now: float, number: int, *values: float) -> None:
        """Send a command unless it was sent a moment ago.

        Args:
            what: Name of what is asked for.
            now: s of the link's clock.
            number: Of the command.
            values: Its first values; the others are 0.
        """
        if now - self.asked.get(what, -math.inf) >= AGAIN:
            self.asked[what] = now
            self.command(number, *values)


class Heartbeats(threading.Thread):
    """Tells vehicles once a second that a ground station is here, also while this program computes and sends nothing else."""

    def __init__(self, vehicles: tuple[Vehicle, ...]) -> None:
        super().__init__(name="heartbeats of a ground station", daemon=True)
        self._vehicles, self.ended = vehicles, threading.Event()
        self.start()

    def run(self) -> None:
        """Send them until it is ended, or the link is closed."""
        while not self.ended.wait(BEAT):
            for vehicle in self._vehicles:
                with contextlib.suppress(Exception):  # pymavlink raises what its drivers do; what is lost is seen otherwise
                    vehicle.beat()
