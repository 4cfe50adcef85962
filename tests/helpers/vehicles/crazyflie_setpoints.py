"""Set-points as a Crazyflie's commander takes them: streamed ones before its own, until they are said to have ended, or get old."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field

import numpy as np

from flight.control.onboard_controller import axes_towards
from verify.data import GRAVITY

LEVEL, SHUT = 0.5, 2.0
"""s after the last set-point, where a vehicle levels out, and where its motors stop until it was switched off and on."""


@dataclass
class Streamed:
    """What was streamed last.

    Attributes:
        first: Whether it goes before the high-level commander.
        flat: What it asks for, x, y, z, heading and four derivatives; None where motors are to stand still. Shape (5, 4).
        stamp: When it came, s.
        kept: All of them, with when they came.
    """

    first: bool = False
    flat: np.ndarray | None = None
    stamp: float = -math.inf
    kept: list[tuple[float, np.ndarray | None]] = field(default_factory=list)

    def take(self, data: bytes, now: float) -> None:
        """Take a packet of the generic set-point port: no thrust (0), or a full state (6)."""
        assert data[0] in (0, 6), "nothing else is sent"
        self.first, self.stamp = True, now
        self.flat = None if data[0] == 0 else full_state(data)
        self.kept.append((now, self.flat))

    def age(self, now: float) -> float:
        """Return s since the last one."""
        return now - self.stamp

    def wanted(self, now: float, place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return what it asks for now: the same until the next one; level, at its height, once it is old. Shape (5, 4)."""
        assert self.flat is not None
        if self.age(now) <= LEVEL:
            return self.flat
        level = np.zeros((5, 4))
        level[0], level[1, 2] = (place[0], place[1], self.flat[0, 2], place[3]), self.flat[1, 2]
        level[1, :2] = velocity[:2]
        return level


def full_state(data: bytes) -> np.ndarray:
    """Return what a full-state packet asks for. Shape (5, 4)."""
    _, *whole = struct.unpack("<B9hI3h", data)
    numbers, flat = np.array(whole, dtype=float) / 1000.0, np.zeros((5, 4))
    flat[0, :3], flat[1, :3], flat[2, :3] = numbers[:3], numbers[3:6], numbers[6:9]
    x, y, z, w = decompressed(whole[9])
    flat[0, 3] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    force = flat[2, :3, None] + np.array([[0.0], [0.0], [GRAVITY]])
    heading = flat[0, 3:]
    axes, thrust = axes_towards(force, np.cos(heading), np.sin(heading))
    roll, pitch, yaw = numbers[10:]
    flat[3, :3] = thrust * (pitch * axes[0, :, 0] - roll * axes[1, :, 0])
    flat[1, 3] = yaw / axes[2, 2, 0]
    return flat


def decompressed(packed: int) -> list[float]:
    """Return x, y, z, w of a quaternion: which one is largest, then sign and nine bits of each other one."""
    largest, found = packed >> 30, [0.0] * 4
    for index in (3, 2, 1, 0):
        if index != largest:
            found[index] = (-1.0 if packed & 512 else 1.0) * (packed & 511) / 511.0 * math.sqrt(0.5)
            packed >>= 10
    found[largest] = math.sqrt(1.0 - sum(part * part for part in found))
    return found
