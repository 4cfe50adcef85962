"""An autopilot that keeps PX4's rules of offboard flight, over a local UDP socket with real MAVLink."""

from __future__ import annotations

import math
import socket
import struct
import threading
import time
from dataclasses import dataclass, field

SET_MODE, SET_INTERVAL, ARM = 176, 511, 400
SYS_STATUS, ATTITUDE_REPORT, POSITION_REPORT, ESTIMATOR_STATUS, LANDED_REPORT = 1, 30, 32, 230, 245
OFFBOARD, HOLD, POSITION, LAND, RETURN = 6 << 16, 4 << 16 | 3 << 24, 3 << 16, 4 << 16 | 6 << 24, 4 << 16 | 5 << 24
LEVEL, PLACED = 1, 8 | 16
PREARM = 1 << 28
GROUND_STATION = 6
LINK_LOST = 10.0
"""s without a ground station's heartbeat after which the data link is lost (COM_DL_LOSS_T)."""
LANDED_AFTER, DISARMS_AFTER, WAITS = 1.0, 2.0, 10.0
"""s on the ground until it takes itself to have landed, until it disarms then (COM_DISARM_LAND), and armed without taking off (COM_DISARM_PRFLT)."""
ON_GROUND, IN_AIR = 1, 2


@dataclass
class Manner:
    """How a vehicle behaves; what is not said is as PX4 does it."""

    armed: bool = True
    off: float = 0.0  # m from where it should stand
    drifts: float = 0.0  # m that it stays behind its setpoints in flight, along x
    leaves_after: int | None = None  # setpoints in offboard flight, then its pilot takes over
    falls_silent_after: int | None = None  # setpoints, then it says nothing any more
    loses_commands: int = 0  # the first ones, of each kind
    deaf_to: tuple[int, ...] = ()  # modes that it never takes
    refuses_arming: bool = False
    deaf_to_parameters: tuple[str, ...] = ()
    turned: float = 0.0  # rad, against the clock, from where it should look
    battery: int = -1  # percent; -1 where it does not know
    estimator: int | None = 1 | 8 | 16  # flags of ESTIMATOR_STATUS; None where it does not report it
    reports_heading: bool = True
    reports_checks: bool = True
    needs_ground_station: bool = True  # NAV_DLL_ACT above 0, as PX4's simulated x500 has it
    restless: float = 0.0  # m that its reported place wanders
    other_system: int = 0  # it answers as this one instead
    silent: bool = False  # says nothing, and hears
    unplugged: bool = False  # says and hears nothing
    gains: dict[str, float] = field(default_factory=dict)  # that it answers with when it is asked for them


class Px4Peer(threading.Thread):
    """Hovers where it is until it is in offboard flight, and then is where its setpoints say.

    Offboard flight is taken only after half a second of setpoints above 2 Hz, and left by failsafe where none comes for
    `COM_OF_LOSS_T` seconds: into landing where `COM_OBL_RC_ACT` is 4, else into hold. It arms only while a ground station's heartbeat was heard in the last
    10 s and its estimator knows where it is, returns where that heartbeat is lost in flight, and disarms by command on the ground only. It takes itself to have
    landed a second after it met the ground, and disarms 2 s later, or 10 s after it was armed where it does not take off. Positions are reported once a
    second until an interval is asked for, all else of what is asked for only then. Commands are acknowledged.
    """

    def __init__(self, system: int, port: int, place: tuple[float, ...], manner: Manner | None = None) -> None:
        super().__init__(daemon=True)
        from pymavlink import mavutil

        self.manner = manner or Manner()
        self.link = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}",
            source_system=self.manner.other_system or system,
            source_component=1,
            dialect="common",
        )
        x, y, z = place
        self.place, self.yaw = (x + self.manner.off, y, z), math.pi / 2
        self.mode, self.before, self.failsafes = POSITION, 0, 0
        self.flown: list[tuple[float, ...]] = []
        self.track: list[tuple[float, tuple[float, ...]]] = []  # monotonic s, and where it was
        self.asked: list[int] = []
        self.lost: dict[tuple[int, float, float], int] = {}
        self.arrivals: list[float] = []
        self.intervals, self.touched = {POSITION_REPORT: 1.0}, math.inf if self.place[2] < -0.05 else -math.inf
        self.beats: list[float] = []  # when a ground station's heartbeats came, monotonic s
        self.refusals: list[str] = []  # why it did not arm, or disarm
        self.armed_at = math.inf
        self.began = time.monotonic() if self.manner.armed else -math.inf  # somebody has armed it
        self.armed = self.manner.armed
        self.parameters = {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 0}
        self.ended = threading.Event()

    def run(self) -> None:
        """Report and listen until `ended` is set."""
        mavlink, said, placed, now = self.link.mav, -math.inf, -math.inf, time.monotonic()
        reported: dict[int, float] = {}
        while not self.ended.is_set():
            before, now = now, time.monotonic()
            silent = self.manner.silent or self.manner.unplugged
            silent |= self.manner.falls_silent_after is not None and len(self.flown) > self.manner.falls_silent_after
            self.track.append((now, self.place))
            if now >= said + 0.05 and not silent:
                said = now
                mavlink.heartbeat_send(2, 12, 1 | (128 if self.armed else 0), self.mode, 4)
            if now >= placed + self.intervals[POSITION_REPORT] and not silent:
                placed = now
                shift = self.manner.restless * math.sin(40.0 * now)
                mavlink.local_position_ned_send(0, self.place[0] + shift, *self.place[1:], 0.0, 0.0, 0.0)
            for number, send in ((SYS_STATUS, self.report_battery), (ESTIMATOR_STATUS, self.report_estimator),
                                 (ATTITUDE_REPORT, self.report_attitude), (LANDED_REPORT, self.report_landed)):  # fmt: skip
                if now >= reported.get(number, -math.inf) + self.intervals.get(number, math.inf) and not silent:
                    reported[number] = now
                    send()
            self.come_down(now, min(now - before, 0.1))
            if self.armed and self.mode != RETURN and not self.linked and self.manner.needs_ground_station:
                self.mode, self.failsafes = RETURN, self.failsafes + 1
            if self.mode == OFFBOARD and now - self.arrivals[-1] > self.parameters["COM_OF_LOSS_T"]:
                self.mode, self.failsafes = LAND if self.parameters["COM_OBL_RC_ACT"] == 4 else HOLD, self.failsafes + 1
            message = self.link.recv_match(blocking=True, timeout=0.005)
            if message is not None and not self.manner.unplugged:
                self.take(message)
        self.link.close()

    @property
    def linked(self) -> bool:
        """Whether a ground station is there."""
        return max([self.began, *self.beats[-1:]]) > time.monotonic() - LINK_LOST

    @property
    def landed(self) -> bool:
        """Whether it takes itself to have landed."""
        return time.monotonic() > self.touched + LANDED_AFTER

    def come_down(self, now: float, seconds: float) -> None:
        """Sink where it lands, a metre a second, and disarm where it has landed, or does not take off."""
        x, y, z = self.place
        if self.mode == LAND and self.armed:
            self.place = (x, y, min(z + seconds, 0.0))
        on_ground = self.place[2] >= -0.01 and (self.mode != OFFBOARD or not self.flown)
        self.touched = min(self.touched, now) if on_ground else math.inf
        waits = self.armed_at if self.mode == LAND or self.flown else self.armed_at + WAITS
        if self.armed and on_ground and now > max(self.touched + LANDED_AFTER + DISARMS_AFTER, waits):
            self.armed = False

    def preflight(self) -> str:
        """Return what its checks before arming find; nothing where they pass."""
        if self.manner.needs_ground_station and not self.linked:
            return "no connection to the ground control station"
        flags = self.manner.estimator
        return "" if flags is None or (flags & LEVEL and flags & PLACED) else "no position"

    def report_attitude(self) -> None:
        """Say where it looks."""
        if self.manner.reports_heading:
            self.link.mav.attitude_send(0, 0.0, 0.0, self.yaw - self.manner.turned, 0.0, 0.0, 0.0)

    def report_battery(self) -> None:
        """Say how full the battery is, and whether checks before arming pass."""
        if self.manner.reports_checks:
            healthy = 0 if self.preflight() else PREARM
            self.link.mav.sys_status_send(PREARM, PREARM, healthy, 0, 12000, -1, self.manner.battery, 0, 0, 0, 0, 0, 0)

    def report_estimator(self) -> None:
        """Say how the estimator is."""
        if self.manner.estimator is not None:
            self.link.mav.estimator_status_send(0, self.manner.estimator, *[0.0] * 8)

    def report_landed(self) -> None:
        """Say whether it takes itself to have landed."""
        self.link.mav.extended_sys_state_send(0, ON_GROUND if self.landed else IN_AIR)

    def take(self, message) -> None:
        """Take in one message."""
        if message.get_type() == "COMMAND_LONG":
            key = (message.command, message.param2, message.param3)
            self.lost[key] = self.lost.get(key, 0) + 1
            if self.lost[key] > self.manner.loses_commands:
                self.obey(message)
        elif message.get_type() == "HEARTBEAT" and message.type == GROUND_STATION:
            self.beats.append(time.monotonic())
        elif message.get_type() == "PARAM_SET" and message.param_id not in self.manner.deaf_to_parameters:
            value = message.param_value
            if message.param_type == 6:
                (value,) = struct.unpack("<i", struct.pack("<f", value))
            self.parameters[message.param_id] = value
            self.link.mav.param_value_send(message.param_id.encode(), message.param_value, message.param_type, 2, 0)
        elif message.get_type() == "PARAM_REQUEST_READ" and message.param_id in self.manner.gains:
            self.link.mav.param_value_send(message.param_id.encode(), self.manner.gains[message.param_id], 9, 2, 0)
        elif message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            self.arrivals = [*(t for t in self.arrivals if t > time.monotonic() - 0.6), time.monotonic()]
            if self.mode != OFFBOARD or not self.armed:
                self.before += 1
                return
            self.flown.append((message.time_boot_ms, message.x, message.y, message.z))
            self.place = (message.x - (self.manner.drifts if message.time_boot_ms else 0.0), message.y, message.z)
            if self.manner.leaves_after is not None and len(self.flown) > self.manner.leaves_after:
                self.mode = POSITION

    def obey(self, message) -> None:
        """Do as a command says, and acknowledge it."""
        taken = True
        if message.command == SET_INTERVAL:
            self.intervals[int(message.param1)] = message.param2 / 1e6
        elif message.command == SET_MODE:
            mode = int(message.param2) << 16 | int(message.param3) << 24
            self.asked.append(mode)
            streamed = len(self.arrivals) > 2 and self.arrivals[-1] - self.arrivals[0] > 0.4
            taken = mode not in self.manner.deaf_to and (mode != OFFBOARD or streamed)
            if taken:
                self.mode = mode
        elif message.command == ARM:
            refuses = "it refuses" if self.manner.refuses_arming else self.preflight()
            why = refuses if message.param1 else "" if self.landed else "it has not landed"
            taken = not why
            if taken:
                self.armed = bool(message.param1)
                self.armed_at = time.monotonic()
            else:
                self.refusals.append(why)
        self.link.mav.command_ack_send(message.command, 0 if taken else 1)


def free_port() -> int:
    """Return a UDP port that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        return made.getsockname()[1]
