"""Paths as the exported CSV files have them, to hold measured places against. Copied into exports.

A line is a piece: its duration, then x, y, z and heading by ascending powers of its own time.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

Row = tuple[float, ...]


class PiecewisePath:
    """One robot's path.

    Attributes:
        duration: s.
    """

    def __init__(self, file: Path) -> None:
        """Read a file; its first line has the columns' names."""
        with file.open(newline="", encoding="utf-8") as opened:
            self._pieces = [tuple(float(cell) for cell in row) for row in list(csv.reader(opened))[1:] if row]
        self.duration = math.fsum(piece[0] for piece in self._pieces)

    def at(self, time: float, order: int = 0) -> Row:
        """Return x, y, z and heading at a time, or one of their derivatives.

        Args:
            time: s; it hovers before the beginning and after the end.
            order: 0 for the place, 1 for its velocity, and so on.
        """
        left = min(max(time, 0.0), self.duration)
        piece = self._pieces[0]
        for piece in self._pieces:  # the last one that was looked at
            if left <= piece[0]:
                break
            left -= piece[0]
        left = min(left, piece[0])
        return tuple(_polynomial(piece[1 + 8 * axis : 9 + 8 * axis], left, order) for axis in range(4))

    def near(self, place: tuple[float, ...], since: float, until: float) -> tuple[float, Row]:
        """Return how far a place is from the nearest one that it can belong to, in m, and that one.

        Args:
            place: x, y, z in m.
            since: s, the earliest time.
            until: s, the latest.
        """
        rows = [self.at(since + (until - since) * share / 4) for share in range(5)]
        return min((math.dist(place[:3], row[:3]), row) for row in rows)

    def rest(self, time: float, length: float, shares: list[float]) -> Row:
        """Return where a robot comes to rest that brakes from a time on: x, y, z in m and heading in rad.

        Args:
            time: s.
            length: s that braking takes.
            shares: What velocity, acceleration and jerk add to the place, of a braking of one second.
        """
        place, *motion = (self.at(time, order) for order in range(4))
        added = [
            sum(share * length**power * flat[axis] for power, (share, flat) in enumerate(zip(shares, motion, strict=True), 1))
            for axis in range(4)
        ]
        return tuple(a + b for a, b in zip(place, added, strict=True))


def _polynomial(coefficients: Row, time: float, order: int) -> float:
    value = 0.0
    for power in range(len(coefficients) - 1, order - 1, -1):
        value = value * time + coefficients[power] * math.perm(power, order)
    return value
