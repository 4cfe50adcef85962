#!/usr/bin/env python3
"""Streams a certified flight's setpoints to PX4 vehicles that hover at their starts. Copied into every PX4 export.

    python stream_setpoints.py quad0=udpin:0.0.0.0:14540 quad1=udpin:0.0.0.0:14541

Needs pymavlink. It neither arms, nor takes off, nor lands: bring every robot to its start first (position flight), and
keep the remote control in hand. It streams each robot's first setpoint, asks for offboard flight, begins only if every
robot is within the certificate's margin of its start, and sends the setpoints in real time, all robots by one clock. If a
robot leaves offboard flight, or sending falls behind, all are told to hold.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

CONNECT = 10.0  # s to wait for a robot's first heartbeat and position
LEAD = 1.5  # s of setpoints before offboard flight is asked for; PX4 wants at least one second
ANSWER = 5.0  # s to wait for the change of mode
LATE = 0.1  # s that a setpoint may be late; later ones are another flight than the certified one
OFFBOARD, HOLD = (6, 0), (4, 3)  # PX4's main and sub mode
CUSTOM_MODE, SET_MODE, SET_INTERVAL, PX4, ARMED = 1, 176, 511, 12, 128
LOCAL_POSITION_NED = 32


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


class Robot:
    """One vehicle: its link, its setpoints, and what it last said of itself."""

    def __init__(self, name: str, entry: dict[str, Any], folder: Path, address: str) -> None:  # of any type: JSON
        from pymavlink import mavutil

        self.name, self.system = name, entry["system"]
        self.setpoints = read_setpoints((folder / entry["file"]).read_bytes())
        self.link = mavutil.mavlink_connection(address, source_system=255, source_component=190, dialect="common")
        self.mode = self.armed = self.position = None
        self.autopilot: int | None = None
        self.worst = 0.0

    def listen(self) -> None:
        """Take in what has arrived since."""
        while (message := self.link.recv_msg()) is not None:
            if message.get_srcSystem() != self.system:
                continue
            if message.get_type() == "HEARTBEAT" and message.autopilot == PX4:
                self.autopilot = PX4
                self.mode = (message.custom_mode >> 16 & 255, message.custom_mode >> 24 & 255)
                self.armed = bool(message.base_mode & ARMED)
            elif message.get_type() == "LOCAL_POSITION_NED":
                self.position = (message.x, message.y, message.z)

    def send(self, index: int) -> None:
        """Send a setpoint and note how far the robot is from it."""
        setpoint = self.setpoints[min(index, len(self.setpoints) - 1)]
        self.link.mav.send(setpoint)
        self.worst = max(self.worst, self.distance(index))

    def distance(self, index: int) -> float:
        """Return how far the robot says it is from a setpoint, in m; infinite where it has not said."""
        setpoint = self.setpoints[min(index, len(self.setpoints) - 1)]
        return math.inf if self.position is None else math.dist(self.position, (setpoint.x, setpoint.y, setpoint.z))

    def command(self, number: int, *values: float) -> None:
        """Send a command with up to seven values."""
        self.link.mav.command_long_send(self.system, 1, number, 0, *values, *(0.0 for _ in range(7 - len(values))))

    def ask_mode(self, mode: tuple[int, int]) -> None:
        """Ask for one of PX4's modes."""
        self.command(SET_MODE, CUSTOM_MODE, *mode)


def read_setpoints(log: bytes) -> list[Any]:  # pymavlink's messages have no types
    """Return the setpoints of a telemetry log: eight bytes of time, then a MAVLink 2 frame, and so on."""
    from pymavlink.dialects.v20 import common

    reader, setpoints, at = common.MAVLink(None), [], 0
    while at < len(log):
        struct.unpack_from(">Q", log, at)
        size = 12 + log[at + 9]
        message = reader.decode(bytearray(log[at + 8 : at + 8 + size]))
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            setpoints.append(message)
        at += 8 + size
    return setpoints


def wait(robots: list[Robot], until: float, ready: Callable[[Robot], bool] | None = None, sending: float | None = None) -> bool:
    """Listen until a time (of `time.monotonic`) or until `ready` holds of every robot; send first setpoints at a rate.

    Args:
        robots: All of them.
        until: s, of `time.monotonic`.
        ready: Told a robot; None to listen for the whole time.
        sending: First setpoints a second; None to send nothing.

    Returns:
        Whether all were ready; True where nothing was waited for.
    """
    begin, sent = time.monotonic(), 0
    while time.monotonic() < until:
        for robot in robots:
            robot.listen()
        if ready is not None and all(ready(robot) for robot in robots):
            return True
        if sending is not None and time.monotonic() >= begin + sent / sending:
            sent += 1
            for robot in robots:
                robot.send(0)
        time.sleep(0.002)
    return ready is None


def begin_offboard(robots: list[Robot], rate: float, margin: float) -> None:
    """Bring all robots from hovering at their starts into offboard flight there.

    Args:
        robots: All of them.
        rate: Setpoints a second.
        margin: m that a robot may be away from its start.

    Raises:
        Refused: A robot is silent, on the ground, too far from its start, or does not change to offboard flight.
    """
    for robot in robots:
        robot.command(SET_INTERVAL, LOCAL_POSITION_NED, 1e6 / rate)
    if not wait(robots, time.monotonic() + CONNECT, lambda robot: robot.autopilot == PX4 and robot.position is not None):
        silent = [robot.name for robot in robots if robot.autopilot != PX4 or robot.position is None]
        raise Refused(f"no PX4 heartbeat and position from {', '.join(silent)} within {CONNECT:g} s")
    require_at_starts(robots, margin)
    wait(robots, time.monotonic() + LEAD, sending=rate)
    for robot in robots:
        robot.ask_mode(OFFBOARD)
    if not wait(robots, time.monotonic() + ANSWER, lambda robot: robot.mode == OFFBOARD, sending=rate):
        others = [robot.name for robot in robots if robot.mode != OFFBOARD]
        raise Refused(f"{', '.join(others)} did not change to offboard flight within {ANSWER:g} s")
    require_at_starts(robots, margin)


def require_at_starts(robots: list[Robot], margin: float) -> None:
    """Refuse to begin with a robot on the ground or too far from its start.

    Raises:
        Refused: As said.
    """
    grounded = [robot.name for robot in robots if not robot.armed]
    if grounded:
        raise Refused(f"{', '.join(grounded)} is not armed; bring it to a hover at its start first")
    away = [f"{robot.name} {robot.distance(0):.3f} m" for robot in robots if not robot.distance(0) < margin]
    if away:
        raise Refused(f"too far from the start (the margin is {margin:g} m): {', '.join(away)}")


def stream(robots: list[Robot], rate: float) -> None:
    """Send all setpoints in real time, all robots by one clock.

    Raises:
        Refused: A setpoint was late, or a robot left offboard flight.
    """
    for robot in robots:
        robot.worst = 0.0
    begin = time.monotonic()
    for index in range(max(len(robot.setpoints) for robot in robots)):
        due = begin + index / rate
        wait(robots, due)
        late = time.monotonic() - due
        if late > LATE:
            raise Refused(f"the setpoint of {index / rate:.2f} s was {late:.2f} s late")
        left = [robot.name for robot in robots if robot.mode != OFFBOARD]
        if left:
            raise Refused(f"{', '.join(left)} left offboard flight at {index / rate:.2f} s")
        for robot in robots:
            robot.send(index)


def main(arguments: list[str] | None = None) -> int:
    """Fly; return 0 where all setpoints were sent."""
    parser = argparse.ArgumentParser(
        description="Stream a certified flight's setpoints to PX4 vehicles that hover at their starts."
    )
    parser.add_argument("addresses", nargs="+", metavar="ROBOT=ADDRESS", help="such as quad0=udpin:0.0.0.0:14540")
    given = dict(text.partition("=")[::2] for text in parser.parse_args(arguments).addresses)
    folder = Path(__file__).resolve().parent
    flight = json.loads((folder / "flight.json").read_text(encoding="utf-8"))
    if set(given) != set(flight["robots"]) or not all(given.values()):
        parser.error(f"give an address for each of {', '.join(flight['robots'])}")
    os.environ["MAVLINK20"] = "1"  # before pymavlink is imported: it decides there
    robots = [Robot(name, entry, folder, given[name]) for name, entry in flight["robots"].items()]
    print(f"certificate {flight['certificate']}, margin {flight['margin']:g} m")
    try:
        begin_offboard(robots, flight["rate"], flight["margin"])
        print(f"streaming {flight['duration']:.1f} s")
        stream(robots, flight["rate"])
        reason = None
    except Refused as refused:
        reason = str(refused)
    except KeyboardInterrupt:
        reason = "interrupted"
    for robot in robots:
        if robot.mode == OFFBOARD:
            robot.ask_mode(HOLD)
        print(f"{robot.name}: at most {robot.worst:.3f} m from its setpoint, by its own estimate")
    print(
        "flown; every robot is told to hold"
        if reason is None
        else f"stopped: {reason}; robots in offboard flight are told to hold"
    )
    return 0 if reason is None else 1


if __name__ == "__main__":
    sys.exit(main())
