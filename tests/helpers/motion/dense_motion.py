"""What a flight does at dense samples, from its CSV or from functions of time: numpy alone, nothing of the judge.

Attitude comes from thrust and heading, rates and torques from differences of rotation matrices over a millisecond.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
GRAVITY = 9.80665
H = 1e-3
"""s between the samples that differences are made of."""
_FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
"""Fourth-order central difference, per sample."""


@dataclass(frozen=True, eq=False)
class SampledFlight:
    """Pieces of polynomials, ascending powers of their own time.

    Attributes:
        durations: s. Shape (pieces,).
        coefficients: x, y, z in m and heading in rad. Shape (pieces, 4, 8).
    """

    durations: Floats
    coefficients: Floats

    @classmethod
    def of_csv(cls, file: Path) -> SampledFlight:
        """Read a robot's file, whose numbers are those of single precision."""
        with file.open(newline="", encoding="utf-8") as opened:
            rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(opened))[1:] if row])
        rows = rows.astype(np.float32).astype(np.float64)
        return cls(rows[:, 0], rows[:, 1:].reshape(-1, 4, 8))

    @property
    def knots(self) -> Floats:
        """Starts of the pieces and the end of the last, s."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def at(self, times: Floats, order: int = 0, after: Floats | float = 0.0) -> Floats:
        """Return x, y, z and heading or a derivative, by the piece of each time, so many s later. Shape (n, 4); hovers after the end."""
        knots = self.knots
        piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(self.durations) - 1)
        over = times >= knots[-1]
        local = np.where(over, self.durations[piece], times - knots[piece] + after)
        powers = np.arange(8)
        factors = np.array([math.perm(k, order) if k >= order else 0 for k in powers], dtype=float)
        terms = local[:, None] ** np.maximum(powers - order, 0) * factors
        values = np.einsum("nk,nak->na", terms, self.coefficients[piece])
        return np.where(over[:, None] & (order > 0), 0.0, values)

    def inner_times(self, step: float) -> Floats:
        """Return times at about a step from each other, none within a few differences of a joint."""
        found = []
        for start, length in zip(self.knots[:-1], self.durations, strict=True):
            count = max(int(length / step), 2)
            found.append(start + length * (np.arange(count) + 0.5) / count)
        return np.concatenate(found)


Motion = Callable[[float], tuple[Floats, Floats]]
"""Acceleration, shape (n, 3), and heading, shape (n,), at all samples so many s later."""


def body_rates(motion: Motion, after: float = 0.0) -> Floats:
    """Return the rates about the body's axes, rad/s. Shape (n, 3)."""
    frames = [_frames(*motion(after + k * H)) for k in range(-2, 3)]
    change = sum(weight * frame for weight, frame in zip(_FIRST, frames, strict=True)) / H
    spin = np.swapaxes(frames[2], 1, 2) @ change
    return np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)


def rotor_thrusts(
    motion: Motion, mass: float, arm: float, inertia: tuple[float, float, float], torque_to_thrust: float
) -> Floats:
    """Return each rotor's thrust in N, of the X layout. Shape (n, 4)."""
    rates = [body_rates(motion, k * H) for k in range(-2, 3)]
    growth = sum(weight * rate for weight, rate in zip(_FIRST, rates, strict=True)) / H
    moment = np.array(inertia)
    torque = moment * growth + np.cross(rates[2], moment * rates[2])
    acceleration, _ = motion(0.0)
    total = mass * np.linalg.norm(acceleration + np.array([0.0, 0.0, GRAVITY]), axis=1)
    lever = arm / math.sqrt(2.0)
    roll, pitch, yaw = torque[:, 0] / (4 * lever), torque[:, 1] / (4 * lever), torque[:, 2] / (4 * torque_to_thrust)
    rows = [(1, -1, 1), (1, 1, -1), (-1, -1, -1), (-1, 1, 1)]
    return np.stack([total / 4 + a * roll + b * pitch + c * yaw for a, b, c in rows], axis=1)


def _frames(acceleration: Floats, yaw: Floats) -> Floats:
    up = acceleration + np.array([0.0, 0.0, GRAVITY])
    z = up / np.linalg.norm(up, axis=1, keepdims=True)
    level = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)], axis=1)
    x = np.cross(level, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)
