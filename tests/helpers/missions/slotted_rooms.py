"""Rooms cut by walls with one slot each, and beams at random, with a second opinion on ways: connected cells of a fine grid in space."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from verify.data import Mission

Floats = NDArray[np.float64]

LENGTH, WIDTH, LOW, HIGH = 4.0, 2.4, 0.1, 2.1
START, GOAL = (0.4, 1.2, 1.1), (3.6, 1.2, 1.1)
NEED, MARGIN = 0.12, 0.05
"""m that a vehicle's centre keeps from what is solid (radius and margin), and from the workspace's walls."""


@dataclass(frozen=True)
class Slotted:
    """A room from x = 0 to LENGTH with solid boxes in it.

    Attributes:
        centers: m. Shape (n, 3).
        sizes: Full lengths, m. Shape (n, 3).
    """

    centers: Floats
    sizes: Floats

    @classmethod
    def random(cls, rng: np.random.Generator, narrowest: float, widest: float, beams: int) -> Slotted:
        """Draw one to three walls, each with a slot whose sides are between two lengths, and beams.

        Args:
            rng: Source of the draws.
            narrowest: m.
            widest: m.
            beams: How many.
        """
        lows: list[tuple[float, float, float]] = []
        highs: list[tuple[float, float, float]] = []
        for x in np.linspace(1.0, 3.0, int(rng.integers(1, 4))):
            thick = float(rng.uniform(0.04, 0.3))
            width, height = rng.uniform(narrowest, widest, 2)
            y, z = rng.uniform(0.1, WIDTH - width - 0.1), rng.uniform(LOW + 0.1, HIGH - height - 0.1)
            one, other = x - thick / 2, x + thick / 2
            lows += [(one, -0.2, -0.2), (one, y + width, -0.2), (one, y, -0.2), (one, y, z + height)]
            highs += [(other, y, 2.4), (other, WIDTH + 0.2, 2.4), (other, y + width, z), (other, y + width, 2.4)]
        for _ in range(beams):
            middle, half = rng.uniform([0.9, 0.0, LOW], [3.1, WIDTH, HIGH]), rng.uniform(0.03, [0.2, 0.8, 0.5]) / 2
            lows.append(tuple(middle - half))
            highs.append(tuple(middle + half))
        low, high = np.round(lows, 4), np.round(highs, 4)
        return cls((low + high) / 2, high - low)

    def mission(self) -> Mission:
        """Return the mission to fly from one end of the room to the other."""
        shapes = {
            f"box{k}": {"center": c, "size": s}
            for k, (c, s) in enumerate(zip(self.centers.tolist(), self.sizes.tolist(), strict=True))
        }
        return Mission.model_validate(
            {
                "name": "slots",
                "spec": {"formula": "F goal"},
                "regions": {"goal": {"center": GOAL, "radii": (0.2, 0.2, 0.2)}},
                "obstacles": shapes,
                "agents": {"quad0": {"start": START}},
                "vehicle": "crazyflie-2.1",
                "margin": MARGIN,
                "workspace": {"min": (0.0, 0.0, LOW), "max": (LENGTH, WIDTH, HIGH)},
            }
        )

    def connected(self, clearance: float, step: float) -> bool:
        """Tell whether cells of a grid that keep a clearance join start and goal.

        Args:
            clearance: m from every box.
            step: Of the grid, m.
        """
        low = np.array([MARGIN, MARGIN, LOW + MARGIN])
        high = np.array([LENGTH - MARGIN, WIDTH - MARGIN, HIGH - MARGIN])
        axes = [np.arange(a, b + 1e-9, step) for a, b in zip(low, high, strict=True)]
        free = np.ones([len(axis) for axis in axes], dtype=bool)
        for center, size in zip(self.centers, self.sizes, strict=True):
            beside = [np.maximum(np.abs(axis - c) - s / 2, 0.0) ** 2 for axis, c, s in zip(axes, center, size, strict=True)]
            free &= beside[0][:, None, None] + beside[1][None, :, None] + beside[2][None, None, :] > clearance**2
        cells = np.zeros(free.shape, dtype=np.int32)
        label(free, structure=np.ones((3, 3, 3)), output=cells)
        one, other = (
            cells[tuple(int(np.argmin(np.abs(axis - x))) for axis, x in zip(axes, point, strict=True))]
            for point in (START, GOAL)
        )
        return bool(one == other and one > 0)

    def distance(self, way: Floats) -> float:
        """Return how near straight lines between points come to a box, by dense samples, m. Shape (n, 3)."""
        dense = np.concatenate([np.linspace(a, b, 200) for a, b in itertools.pairwise(way)])
        beside = np.maximum(np.abs(dense[:, None] - self.centers) - self.sizes / 2, 0.0)
        return float(np.linalg.norm(beside, axis=2).min())
