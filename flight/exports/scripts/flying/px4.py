"""PX4 vehicles over MAVLink: what they said last, and what they are told."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flying.checks import Health, Place, Pose
from flying.reports import BEAT, CUSTOM_MODE, OFFBOARD, PX4, SET_INTERVAL, SET_MODE, Reports, beat, encoded, intervals
from flying.watch import Refused

AGAIN = 0.3  # s after which what was not confirmed is asked for again
AGE = 0.05  # s that a position may have been on its way: it is held against the setpoints of that time


class Vehicle:
    """One vehicle: its link, its setpoints, and what it last said of itself.

    Attributes:
        name: The robot's.
        says: What it last said of itself.
        poses: What it said of where it is, in the laboratory, in the last half second.
        worst: m that it was away from its setpoints at the most, since `fly`.
    """

    def __init__(self, name: str, entry: dict[str, Any], folder: Path, address: str, origin: Place) -> None:
        """Reach it.

        Args:
            name: The robot's.
            entry: Its `system`, `file` and `endurance`, as `flight.json` has them.
            folder: Where its setpoints lie.
            address: As pymavlink takes it.
            origin: Where its local frame has its origin in the laboratory, m.

        Raises:
            Refused: It cannot be reached.
        """
        try:
            from pymavlink import mavutil
        except ImportError:
            raise Refused("pymavlink is not installed here: pip install pymavlink") from None
        self.name, self.system, self._origin = name, entry["system"], origin
        self.setpoints = read_setpoints((folder / entry["file"]).read_bytes())
        try:
            self.link: Any = mavutil.mavlink_connection(address, source_system=255, source_component=190, dialect="common")
        except Exception as error:  # pymavlink raises what its drivers do
            raise Refused(f"{name} cannot be reached at {address}: {error}") from None
        self._endurance: float | None = entry["endurance"]
        self.says, self.autopilot = Reports(), 0
        self.others: set[int] = set()  # systems that were heard instead
        self.poses: deque[Pose] = deque(maxlen=50)
        self.asked_offboard = False
        self.worst = 0.0
        self._beaten = -math.inf
        self._sent: deque[tuple[float, int]] = deque()  # when which setpoint was sent, as long ago as a position may be

    def listen(self, seen: Callable[[Vehicle, Pose], object] | None = None) -> None:
        """Take in what has arrived since.

        Args:
            seen: Told each pose.
        """
        while (message := self.link.recv_msg()) is not None:
            kind = message.get_type()
            if message.get_srcSystem() != self.system:
                self.others.add(message.get_srcSystem())
                continue
            now = time.monotonic()
            self.says.take(message, now)
            if kind == "HEARTBEAT" and message.autopilot == PX4:
                self.autopilot = PX4
            elif kind == "LOCAL_POSITION_NED":
                self.poses.append(Pose(now, self.in_laboratory(message), self.says.heading, dict(self.says.unrest)))
                self.worst = max(self.worst, self.off())
                if seen is not None:
                    seen(self, self.poses[-1])

    def beat(self) -> None:
        """Say once a second that a ground station is here."""
        if (now := time.monotonic()) >= self._beaten + BEAT:
            self._beaten = now
            beat(self.link.mav)

    def since(self, time_: float) -> list[Pose]:
        """Return its poses since a time, s of `time.monotonic`."""
        return [pose for pose in self.poses if pose.time >= time_]

    def in_laboratory(self, ned: Any) -> Place:
        """Return where a message's local x, y, z are in the laboratory."""
        x, y, z = self._origin
        return x + ned.y, y + ned.x, z - ned.z

    @property
    def health(self) -> Health:
        """Health that the vehicle last reported."""
        return self.says.health(self._endurance)

    @property
    def heard(self) -> float:
        """Time of arrival of its last position, s of `time.monotonic`."""
        return self.poses[-1].time if self.poses else -math.inf

    def fly(self) -> None:
        """Count how far it is away from its setpoints from now on."""
        self.worst = 0.0

    def send(self, index: int | None = None) -> None:
        """Send a setpoint.

        Args:
            index: Which; None for the last one again, the first before any.
        """
        now = time.monotonic()
        if index is None:
            index = self._sent[-1][1] if self._sent else 0
        self._sent.append((now, min(index, len(self.setpoints) - 1)))
        while len(self._sent) > 1 and self._sent[1][0] < now - AGE:
            self._sent.popleft()
        self.link.mav.send(self.setpoints[self._sent[-1][1]])

    def off(self) -> float:
        """Return how far the last position is from the nearest setpoint that it can belong to, in m; 0 before any was sent."""
        return min((self.distance(index) for _, index in self._sent), default=0.0)

    def distance(self, index: int) -> float:
        """Return how far the vehicle says it is from a setpoint, in m; infinite where it has not said."""
        return math.dist(self.poses[-1].position, self.wanted(index)) if self.poses else math.inf

    def wanted(self, index: int | None = None) -> Place:
        """Return where a setpoint is in the laboratory.

        Args:
            index: Which; None for the last that was sent, the first before any.
        """
        if index is None:
            index = self._sent[-1][1] if self._sent else 0
        return self.in_laboratory(self.setpoints[min(index, len(self.setpoints) - 1)])

    def command(self, number: int, *values: float) -> None:
        """Send a command with up to seven values."""
        self.link.mav.command_long_send(self.system, 1, number, 0, *values, *(0.0 for _ in range(7 - len(values))))

    def ask_mode(self, mode: tuple[int, int]) -> None:
        """Ask for one of PX4's modes."""
        self.asked_offboard |= mode == OFFBOARD
        self.command(SET_MODE, CUSTOM_MODE, *mode)

    def ask_reports(self, rate: float) -> None:
        """Ask for positions and headings often, and for battery, estimator and landing less often.

        Args:
            rate: How often a second.
        """
        if self.autopilot != PX4:  # before it was heard, a link that listens knows nobody to send to
            return
        for message, microseconds in intervals(rate):
            self.command(SET_INTERVAL, message, microseconds)

    def read_parameter(self, key: str) -> None:
        """Ask for a parameter; PX4 answers with what it has, or not at all where it has none."""
        self.link.mav.param_request_read_send(self.system, 1, key.encode(), -1)

    def set_parameter(self, key: str, value: float) -> None:
        """Set a parameter; PX4 answers with what it has then."""
        self.link.mav.param_set_send(self.system, 1, key.encode(), *encoded(value))


def read_setpoints(log: bytes) -> list[Any]:  # pymavlink's messages have no types
    """Return the setpoints of a telemetry log: eight bytes of time, then a MAVLink 2 frame, and so on."""
    from pymavlink.dialects.v20 import common

    reader, setpoints, at = common.MAVLink(None), [], 0
    while at < len(log):
        size = 12 + log[at + 9]
        message = reader.decode(bytearray(log[at + 8 : at + 8 + size]))
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            setpoints.append(message)
        at += 8 + size
    return setpoints
