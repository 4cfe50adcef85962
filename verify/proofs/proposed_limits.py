"""Pieces that surely keep limits, proposed in floats.

The kernel checks each mark. What floats do not show with room to spare is left to the exact search.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

import numpy as np

from verify.kernel.flights import GRAVITY, Path
from verify.kernel.limits import Interval, rates_and_thrusts
from verify.kernel.statement import Robot
from verify.proofs.proposed_roots import ROOM, Flags, Floats, bernstein, powers_of, products


def _square(vector: Floats) -> Floats:
    return products(vector, vector).sum(axis=-2)


def _exceeds(low: Floats, bound: float, size: Floats) -> Flags:
    return low > bound + ROOM * (1 + abs(bound) + size)


@dataclass(slots=True)
class _Ranges:
    """Intervals in arrays, in the stead of the kernel's own; where a divisor may be zero, all numbers."""

    low: Floats
    high: Floats

    @classmethod
    def of(cls, value: Fraction) -> _Ranges:
        return cls(np.array(float(value)), np.array(float(value)))

    def __add__(self, other: _Ranges) -> _Ranges:
        return _Ranges(self.low + other.low, self.high + other.high)

    def __sub__(self, other: _Ranges) -> _Ranges:
        return _Ranges(self.low - other.high, self.high - other.low)

    def __neg__(self) -> _Ranges:
        return _Ranges(-self.high, -self.low)

    def __mul__(self, other: _Ranges) -> _Ranges:
        products = [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high]
        return _Ranges(np.minimum.reduce(products), np.maximum.reduce(products))

    def __truediv__(self, other: _Ranges) -> _Ranges:
        apart = (other.low > 0) | (other.high < 0)
        low, high = np.where(apart, other.low, 1), np.where(apart, other.high, 1)
        found = self * _Ranges(1 / high, 1 / low)
        return _Ranges(np.where(apart, found.low, -1e300), np.where(apart, found.high, 1e300))

    def root(self) -> _Ranges:
        return _Ranges(np.sqrt(np.maximum(self.low, 0)), np.sqrt(np.maximum(self.high, 0)))

    def cosine_and_sine(self) -> tuple[_Ranges, _Ranges]:
        middle, away = (self.low + self.high) / 2, (self.high - self.low) / 2 + 1e-4  # the kernel takes angles on a grid
        cosine, sine = np.cos(middle), np.sin(middle)
        return _Ranges(np.maximum(cosine - away, -1), np.minimum(cosine + away, 1)), _Ranges(
            np.maximum(sine - away, -1), np.minimum(sine + away, 1)
        )


class FlownPieces:
    """All pieces of a team's paths, and which limits they surely keep."""

    def __init__(self, paths: Mapping[str, Path]) -> None:
        pieces = [piece for path in paths.values() for piece in path.pieces]
        ends = np.cumsum([0, *(len(path.pieces) for path in paths.values())])
        self._of = {name: slice(first, last) for name, first, last in zip(paths, ends, ends[1:], strict=False)}
        self._robots, self._turning = {name: path.robot for name, path in paths.items()}, dict[Hashable, list[str]]()
        lengths = np.array([float(piece.length) for piece in pieces])[:, None, None]
        self._derivatives = [powers_of(pieces, 4)]
        for _ in range(4):
            before = self._derivatives[-1]
            self._derivatives.append(before[..., 1:] * np.arange(1, before.shape[-1]) / lengths)
        self._force = self._derivatives[2][:, :3].copy()
        self._force[:, 2, 0] += float(GRAVITY)
        self._size = _square(self._force)

    def roots(self, of: str, name: str, limit: float) -> list[str]:
        """Return `m` for each piece of a robot that surely keeps a limit, else nothing.

        Args:
            of: The robot's name.
            name: The limit's.
            limit: SI.
        """
        robot, own = self._robots[of], self._of[of]
        f, size = self._force[own], self._size[own]
        thrust = size * float(robot.mass) ** 2
        kept = np.ones(len(f), bool)
        if name in ("speed", "acceleration"):
            kept &= self._is_above(-_square(self._derivatives[1 if name == "speed" else 2][own, :3]), -(limit**2))
        if name == "thrust_max":
            kept &= self._is_above(-thrust, -(limit**2))
        if name in ("thrust_min", "tilt", "body_rate"):
            kept &= self._is_above(thrust, float(robot.limits["thrust_min"]) ** 2)
        if name == "tilt":
            upright = products(f[:, 2], f[:, 2]) - size * math.cos(limit) ** 2
            kept &= self._is_above(f[:, 2], 0.0) & self._is_above(upright, 0.0)
        if name == "body_rate":
            j = self._derivatives[3][own]
            rates = [products(j[:, i], f[:, k]) - products(j[:, k], f[:, i]) for i, k in ((1, 2), (2, 0), (0, 1))]
            most, turned = products(size, size) * limit**2, _square(np.stack(rates, axis=1))
            most[:, : turned.shape[1]] -= turned
            kept &= self._is_above(most, 0.0)
        return ["m" if one else "" for one in kept]

    def turning(self, of: str) -> list[str]:
        """Return `m` for each piece of a robot on which yaw rate and rotors surely keep their limits, else nothing."""
        robot = self._robots[of]
        limits = tuple(robot.limits[name] for name in ("rotor_thrust_min", "rotor_thrust_max", "yaw_rate"))
        alike = robot.mass, robot.arm, robot.inertia, robot.torque_to_thrust, limits
        if alike not in self._turning:
            self._turning[alike] = self._turns(robot)
        return self._turning[alike][self._of[of]]

    def _turns(self, robot: Robot) -> list[str]:
        _, _, _, j, s = self._derivatives
        rows = [*(self._force[:, k] for k in range(3)), *(j[:, k] for k in range(3)), *(s[:, k] for k in range(3))]
        rows += [self._derivatives[order][:, 3] for order in range(3)]
        rows += [self._size, np.sum([products(self._force[:, k], j[:, k]) for k in range(3)], axis=0)]
        given = [_Ranges(row.min(axis=-1), row.max(axis=-1)) for row in map(bernstein, rows)]
        with np.errstate(all="ignore"):
            rate, *thrusts = rates_and_thrusts(robot, cast("Sequence[Interval]", given))
        limits, kept = robot.limits, np.ones(len(j), bool)
        for one, low, high in [
            (rate, -limits["yaw_rate"], limits["yaw_rate"]),
            *((one, limits["rotor_thrust_min"], limits["rotor_thrust_max"]) for one in thrusts),
        ]:
            range_: Any = one
            room = ROOM + 1e-6 * (abs(range_.low) + abs(range_.high))
            kept &= (range_.low > float(low) + room) & (range_.high < float(high) - room)
        return ["m" if one else "" for one in kept]

    def _is_above(self, powers: Floats, bound: float) -> Flags:
        rows = bernstein(powers)
        return _exceeds(rows.min(axis=-1), bound, abs(rows).max(axis=-1))
