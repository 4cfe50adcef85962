"""Reports of a PX4 vehicle by MAVLink, and requests for them, for the live link and the exported script.

Standard library only; copied into exports.

PX4 takes a ground station to be there while it hears its HEARTBEAT; where its data-link check is on (`NAV_DLL_ACT`), it does not arm without one.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import Any

from .checks import Health, battery_left, no_battery

OFFBOARD, HOLD, LAND = (6, 0), (4, 3), (4, 6)  # PX4's main and sub mode
CUSTOM_MODE, SET_MODE, SET_INTERVAL, ARM, PX4, INT32 = 1, 176, 511, 400, 12, 6
BEAT = 1.0  # s between two heartbeats of a ground station
_ARMED, _ON_GROUND, _PREARM = 128, 1, 1 << 28  # of HEARTBEAT, EXTENDED_SYS_STATE and SYS_STATUS
_SYS_STATUS, _ATTITUDE, _POSITION, _ESTIMATOR, _LANDED = 1, 30, 32, 230, 245
_LEVEL, _PLACED, _LOST = (
    1,
    8 | 16,
    128,
)  # flags of ESTIMATOR_STATUS: attitude; horizontal position; it knows no position any more
_GROUND_STATION, _NO_AUTOPILOT, _ACTIVE = 6, 8, 4


def intervals(rate: float) -> tuple[tuple[int, float], ...]:
    """Return what a vehicle is asked to report: messages, and microseconds between two of each.

    Args:
        rate: Positions and headings a second.
    """
    often = ((_ATTITUDE, rate), (_SYS_STATUS, 2.0), (_ESTIMATOR, 2.0), (_LANDED, 5.0), (_POSITION, rate))
    return tuple((message, 1e6 / each) for message, each in often)


def beat(mavlink: Any) -> None:  # pymavlink's links have no types
    """Send a ground station's heartbeat.

    Args:
        mavlink: pymavlink's `mav` of a link.
    """
    mavlink.heartbeat_send(_GROUND_STATION, _NO_AUTOPILOT, 0, 0, _ACTIVE)


@dataclass
class Reports:
    """Latest reports of one vehicle; None for what it has not reported.

    Attributes:
        beats: When its last heartbeat came, s of the listener's clock.
        mode: PX4's main and sub mode.
        armed: Whether it is armed.
        charge: Share of its battery.
        heading: rad, against the clock from x of the laboratory, whose y is north.
        unrest: Its speed, tilt and rates, as poses have them.
        estimator: Flags of ESTIMATOR_STATUS.
        board: Parameters as they were read back.
    """

    beats: float = -math.inf
    mode: tuple[int, int] | None = None
    armed: bool = False
    charge: float | None = None
    heading: float | None = None
    unrest: dict[str, float] = field(default_factory=dict[str, float])
    estimator: int | None = None
    board: dict[str, float] = field(default_factory=dict[str, float])
    _landed: int = 0
    _checks: tuple[int, int] = (0, 0)

    def take(self, message: Any, now: float) -> None:  # pymavlink's messages have no types
        """Take in a message of the vehicle's.

        Args:
            message: Any.
            now: When it came, s of the listener's clock.
        """
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot == PX4:
            self.mode = (message.custom_mode >> 16 & 255, message.custom_mode >> 24 & 255)
            self.armed, self.beats = bool(message.base_mode & _ARMED), now
        elif kind == "ATTITUDE":
            self.heading = math.remainder(math.pi / 2 - message.yaw, math.tau)
            self.unrest["tilt"] = math.acos(max(-1.0, min(1.0, math.cos(message.roll) * math.cos(message.pitch))))
            self.unrest["turn"] = math.hypot(message.rollspeed, message.pitchspeed, message.yawspeed)
        elif kind == "LOCAL_POSITION_NED":
            self.unrest["speed"] = math.hypot(message.vx, message.vy, message.vz)
        elif kind == "SYS_STATUS":
            self.charge = message.battery_remaining / 100.0 if message.battery_remaining >= 0 else None
            self._checks = message.onboard_control_sensors_present, message.onboard_control_sensors_health
        elif kind == "ESTIMATOR_STATUS":
            self.estimator = message.flags
        elif kind == "EXTENDED_SYS_STATE":
            self._landed = message.landed_state
        elif kind == "PARAM_VALUE":
            value = message.param_value
            if message.param_type == INT32:
                (value,) = struct.unpack("<i", struct.pack("<f", value))
            self.board[message.param_id] = value

    @property
    def settled(self) -> bool | None:
        """True if its estimator knows attitude and horizontal position; None where it does not say."""
        if self.estimator is None:
            return None
        return bool(self.estimator & _LEVEL and self.estimator & _PLACED and not self.estimator & _LOST)

    @property
    def ready(self) -> bool | None:
        """True if it is armed, or its checks before arming pass; None where it does not say, or they do not in the mode that it is in."""
        present, health = self._checks
        return True if self.armed or present & health & _PREARM else None

    @property
    def ready_to_check(self) -> bool:
        """True if all that checks before a flight ask for has been said, and its own checks pass."""
        return self.heading is not None and self.estimator is not None and bool(self.ready) and self._checks != (0, 0)

    def health(self, endurance: float | None) -> Health:
        """Return what it says of itself.

        Args:
            endurance: s that a full battery lasts; None where its profile does not say.
        """
        landed = None if self.mode is None else not self.armed or self._landed == _ON_GROUND
        flying = None if landed is None else False if landed else True if self._landed else None
        fault = "" if self.mode == OFFBOARD else "left offboard flight"
        why = {
            "ready": "it does not report its checks before arming, or they do not pass in the mode that it is in",
            "estimator": "it does not report it (ESTIMATOR_STATUS)",
            "battery": no_battery(self.charge),
        }
        return Health(self.ready, self.settled, battery_left(self.charge, endurance), flying, fault, why)


def encoded(value: float) -> tuple[float, int]:
    """Return a parameter's value as it is sent, and its type.

    Args:
        value: An int for PX4's whole parameters.
    """
    return (struct.unpack("<f", struct.pack("<i", value))[0], INT32) if isinstance(value, int) else (value, 9)
