#!/usr/bin/env python3
"""Streams a certified flight's setpoints to PX4 vehicles that hover at their starts. Copied into every PX4 export.

    python stream_setpoints.py quad0=udpin:0.0.0.0:14540 quad1=udpin:0.0.0.0:14541

Needs pymavlink. It neither arms, nor takes off, nor lands where all goes well: bring every robot to its start first
(position flight), and keep the remote control in hand. It streams each robot's first setpoint, asks for offboard flight,
begins only if every robot is within the certificate's margin of its start, and sends the setpoints in real time, all robots
by one clock. If a robot leaves offboard flight or the margin, goes silent, or sending falls behind, and on Ctrl-C, SIGTERM
or any other error, all robots are told to hold until each has confirmed it; those that do not are told to land, and so are
all on a second Ctrl-C. It says "flown", and ends with 0, only where every robot stayed within the margin.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import struct
import sys
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

CONNECT = 10.0  # s to wait for a robot's first heartbeat and position
LEAD = 1.5  # s of setpoints before offboard flight is asked for; PX4 wants at least one second
ANSWER = 5.0  # s to wait for a change of mode
AGAIN = 0.3  # s after which what was not confirmed is asked for again
LATE = 0.1  # s that a setpoint may be late; later ones are another flight than the certified one
AGE = 0.05  # s that a position may have been on its way: it is held against the setpoints of that time
SILENT = 0.5  # s without a position after which nobody knows where a robot is
OFFBOARD, HOLD, LAND = (6, 0), (4, 3), (4, 6)  # PX4's main and sub mode
CUSTOM_MODE, SET_MODE, SET_INTERVAL, PX4, ARMED = 1, 176, 511, 12, 128
LOCAL_POSITION_NED = 32


class Refused(Exception):
    """The flight is not begun, or not gone on with; the message says why."""


class Robot:
    """One vehicle: its link, its setpoints, and what it last said of itself."""

    def __init__(self, name: str, entry: dict[str, Any], folder: Path, address: str) -> None:  # of any type: JSON
        try:
            from pymavlink import mavutil
        except ImportError:
            raise Refused("pymavlink is not installed here: pip install pymavlink") from None
        self.name, self.system = name, entry["system"]
        self.setpoints = read_setpoints((folder / entry["file"]).read_bytes())
        try:
            self.link = mavutil.mavlink_connection(address, source_system=255, source_component=190, dialect="common")
        except Exception as error:  # pymavlink raises what its drivers do
            raise Refused(f"{name} cannot be reached at {address}: {error}") from None
        self.mode = self.armed = self.position = None
        self.autopilot: int | None = None
        self.reports_often = False
        self.beat = self.heard = -math.inf  # s, of `time.monotonic`: the last heartbeat and position
        self.asked_offboard = False
        self.sent: deque[tuple[float, int]] = deque()  # when which setpoint was sent, as long ago as a position may be
        self.worst = 0.0

    def listen(self) -> None:
        """Take in what has arrived since."""
        while (message := self.link.recv_msg()) is not None:
            if message.get_srcSystem() != self.system:
                continue
            if message.get_type() == "HEARTBEAT" and message.autopilot == PX4:
                self.autopilot, self.beat = PX4, time.monotonic()
                self.mode = (message.custom_mode >> 16 & 255, message.custom_mode >> 24 & 255)
                self.armed = bool(message.base_mode & ARMED)
            elif message.get_type() == "LOCAL_POSITION_NED":
                self.position = (message.x, message.y, message.z)
                self.heard = time.monotonic()
                self.worst = max(self.worst, self.off())
            elif message.get_type() == "COMMAND_ACK" and message.command == SET_INTERVAL:
                self.reports_often |= message.result == 0

    def send(self, index: int) -> None:
        """Send a setpoint."""
        now = time.monotonic()
        self.sent.append((now, min(index, len(self.setpoints) - 1)))
        while len(self.sent) > 1 and self.sent[1][0] < now - AGE:
            self.sent.popleft()
        self.link.mav.send(self.setpoints[self.sent[-1][1]])

    def off(self) -> float:
        """Return how far the last position is from the nearest setpoint that it can belong to, in m; 0 before any was sent."""
        return min((self.distance(index) for _, index in self.sent), default=0.0)

    def distance(self, index: int) -> float:
        """Return how far the robot says it is from a setpoint, in m; infinite where it has not said."""
        setpoint = self.setpoints[min(index, len(self.setpoints) - 1)]
        return math.inf if self.position is None else math.dist(self.position, (setpoint.x, setpoint.y, setpoint.z))

    def command(self, number: int, *values: float) -> None:
        """Send a command with up to seven values."""
        self.link.mav.command_long_send(self.system, 1, number, 0, *values, *(0.0 for _ in range(7 - len(values))))

    def ask_mode(self, mode: tuple[int, int]) -> None:
        """Ask for one of PX4's modes."""
        self.asked_offboard |= mode == OFFBOARD
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


def wait(
    robots: list[Robot],
    until: float,
    ready: Callable[[Robot], bool] | None = None,
    *,
    sending: float | None = None,
    ask: Callable[[Robot], None] | None = None,
) -> bool:
    """Listen until a time (of `time.monotonic`) or until `ready` holds of every robot; meanwhile keep each where it is.

    Args:
        robots: All of them.
        until: s, of `time.monotonic`.
        ready: Told a robot; None to listen for the whole time.
        sending: How often a second the last sent setpoint (the first, before any) is sent again; None to send nothing.
        ask: Told, every `AGAIN` seconds, each robot that is not ready: a command may be lost.

    Returns:
        Whether all were ready; True where nothing was waited for.
    """
    begin, sent, asked = time.monotonic(), 0, -math.inf
    while (now := time.monotonic()) < until:
        for robot in robots:
            robot.listen()
        if ready is not None and all(ready(robot) for robot in robots):
            return True
        if ask is not None and now >= asked + AGAIN:
            asked = now
            for robot in robots:
                if ready is None or not ready(robot):
                    ask(robot)
        if sending is not None and now >= begin + sent / sending:
            sent += 1
            for robot in robots:
                robot.send(robot.sent[-1][1] if robot.sent else 0)
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

    def speaks(robot: Robot) -> bool:
        return robot.autopilot == PX4 and robot.position is not None and robot.reports_often

    def ask_positions(robot: Robot) -> None:
        if robot.autopilot == PX4:  # before it was heard, a link that listens knows nobody to send to
            robot.command(SET_INTERVAL, LOCAL_POSITION_NED, 1e6 / rate)

    if not wait(robots, time.monotonic() + CONNECT, speaks, ask=ask_positions):
        silent = [robot.name for robot in robots if robot.autopilot != PX4 or robot.position is None]
        if silent:
            raise Refused(f"no PX4 heartbeat and position from {', '.join(silent)} within {CONNECT:g} s")
        seldom = [robot.name for robot in robots if not robot.reports_often]
        raise Refused(f"{', '.join(seldom)} did not agree to report its position {rate:g} times a second within {CONNECT:g} s")
    require_at_starts(robots, margin)
    wait(robots, time.monotonic() + LEAD, sending=rate)
    if not wait(
        robots,
        time.monotonic() + ANSWER,
        lambda robot: robot.mode == OFFBOARD,
        sending=rate,
        ask=lambda robot: robot.ask_mode(OFFBOARD),
    ):
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


def stream(robots: list[Robot], rate: float, margin: float) -> None:
    """Send all setpoints in real time, all robots by one clock.

    Args:
        robots: All of them, in offboard flight at their starts.
        rate: Setpoints a second.
        margin: m that a robot may be away from its setpoints.

    Raises:
        Refused: A setpoint was late, or a robot left offboard flight or the margin, or went silent.
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
        require_in_flight(robots, index / rate, margin)
        for robot in robots:
            robot.send(index)
    wait(robots, time.monotonic() + 2 * AGE, sending=rate)
    require_in_flight(robots, time.monotonic() - begin, margin)


def require_in_flight(robots: list[Robot], at: float, margin: float) -> None:
    """Refuse to go on where a robot has left offboard flight or the margin, or is silent.

    Args:
        robots: All of them.
        at: s into the flight.
        margin: m that a robot may be away from its setpoints.

    Raises:
        Refused: As said.
    """
    left = [robot.name for robot in robots if robot.mode != OFFBOARD]
    if left:
        raise Refused(f"{', '.join(left)} left offboard flight at {at:.2f} s")
    away = [f"{robot.name} {robot.worst:.3f} m" for robot in robots if not robot.worst < margin]
    if away:
        raise Refused(f"further from the setpoint than the margin of {margin:g} m at {at:.2f} s: {', '.join(away)}")
    silent = [robot.name for robot in robots if time.monotonic() - robot.heard > SILENT]
    if silent:
        raise Refused(f"no position from {', '.join(silent)} for {SILENT:g} s at {at:.2f} s")


def make_safe(robots: list[Robot], rate: float) -> list[str]:
    """Tell all robots in offboard flight to hold until they confirm it, and those that do not to land.

    Setpoints go on meanwhile, so that none drifts. Whoever was taken over by its pilot is left alone. A second Ctrl-C has all
    others land.

    Args:
        robots: All of them.
        rate: Setpoints a second.

    Returns:
        A sentence on each robot that did not confirm to hold.
    """
    sentences: list[str] = []
    told = [robot for robot in robots if robot.asked_offboard]
    leave = {OFFBOARD}
    for mode, word in ((HOLD, "hold"), (LAND, "land")):
        try:
            told = told_to(told, mode, leave, rate)
        except KeyboardInterrupt:
            print("interrupted again: all robots are told to land")
            told, leave = [robot for robot in robots if robot.asked_offboard], {OFFBOARD, HOLD}
            continue
        if not told:
            return sentences
        sentences += [f"{robot.name} does not answer to {word}" for robot in told]
    return [
        *sentences,
        *(
            f"{robot.name} has confirmed neither hold nor land: its own failsafe acts when setpoints end (COM_OF_LOSS_T); "
            "take the remote control"
            for robot in told
        ),
    ]


def told_to(robots: list[Robot], mode: tuple[int, int], leave: set[tuple[int, int]], rate: float) -> list[Robot]:
    """Ask robots for a mode until heartbeats from now on say that they have left others; return those that do not.

    Args:
        robots: Some of them.
        mode: What is asked for.
        leave: Modes to leave; who is in another is not asked.
        rate: Setpoints a second, meanwhile.
    """
    now = time.monotonic()

    def done(robot: Robot) -> bool:
        return robot.beat > now and robot.mode not in leave

    def ask(robot: Robot) -> None:
        if robot.mode in leave:
            robot.ask_mode(mode)

    wait(robots, now + ANSWER, done, sending=rate, ask=ask)
    return [robot for robot in robots if not done(robot)]


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
    if len(set(given.values())) < len(given):
        parser.error("two robots have one address")
    os.environ["MAVLINK20"] = "1"  # before pymavlink is imported: it decides there
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C
    print(f"certificate {flight['certificate']}, margin {flight['margin']:g} m")
    robots: list[Robot] = []
    try:
        robots += (Robot(name, entry, folder, given[name]) for name, entry in flight["robots"].items())
        begin_offboard(robots, flight["rate"], flight["margin"])
        print(f"streaming {flight['duration']:.1f} s", flush=True)
        stream(robots, flight["rate"], flight["margin"])
        reason = None
    except Refused as refused:
        reason = str(refused)
    except KeyboardInterrupt:
        reason = "interrupted"
    except Exception as error:  # whatever it was: robots are in the air
        reason = f"{type(error).__name__}: {error}"
    unsafe = make_safe(robots, flight["rate"])
    for robot in robots:
        print(f"{robot.name}: at most {robot.worst:.3f} m from its setpoint, by its own estimate")
    for sentence in unsafe:
        print(sentence)
    print("flown; every robot holds" if reason is None and not unsafe else f"stopped: {reason or 'not every robot holds'}")
    return 0 if reason is None and not unsafe else 1


if __name__ == "__main__":
    sys.exit(main())
