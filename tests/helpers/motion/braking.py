"""Where braking leads, by solving for the velocity's polynomial at each instant: independent of the judge's shapes; and random teams that brake."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tests.helpers.motion.stand_ins import minimum_snap
from verify.data import Trajectory

Floats = NDArray[np.float64]


def states(path: Trajectory, times: Floats) -> Floats:
    """Position to jerk at times; at rest after the end. Shape (4, times, 3)."""
    return np.stack([path.evaluate(times, order)[:, :3] for order in range(4)])


def brakes(path: Trajectory, times: Floats, shares: Floats, length: float) -> Floats:
    """Where braking within a length leads that begins at times. Shape (shares, times, 3)."""
    x, v, a, j = states(path, times)
    t = length
    ends = np.array([[t**3, t**4, t**5], [3 * t**2, 4 * t**3, 5 * t**4], [6 * t, 12 * t**2, 20 * t**3]])
    left = -np.stack([v + t * a + 0.5 * t * t * j, a + t * j, j]).reshape(3, -1)
    powers = [v, a, 0.5 * j, *np.linalg.solve(ends, left).reshape(3, *v.shape)]
    return np.stack([x + sum(c * (s * t) ** (k + 1) / (k + 1) for k, c in enumerate(powers)) for s in shares])


def closest(
    team: Mapping[str, Trajectory], length: float, *, error: float = 0.0, instants: int = 1500, shares: int = 60
) -> float:
    """The least distance of two robots that brake at once, over a grid of instants, shares and differences of clocks, m."""
    grid = np.linspace(0.0, max(path.duration for path in team.values()) + error, instants), np.linspace(0.0, 1.0, shares)
    shifts = np.linspace(-error, error, 5) if error else [0.0]
    least = np.inf
    for one, other in itertools.combinations(team.values(), 2):
        here = brakes(one, grid[0], grid[1], length)
        for shift in shifts:
            there = brakes(other, np.maximum(grid[0] + shift, 0.0), grid[1], length)
            least = min(least, float(np.linalg.norm(here - there, axis=2).min()))
    return least


def random_team(rng: np.random.Generator) -> dict[str, Trajectory]:
    """Two to four robots that fly through up to three random places each, in a room of 3 by 3 by 0.7 m."""
    team: dict[str, Trajectory] = {}
    for name in ("one", "two", "three", "four")[: rng.integers(2, 5)]:
        places = rng.uniform((-1.5, -1.5, 0.7), (1.5, 1.5, 1.4), (rng.integers(2, 5), 3))
        team[name] = minimum_snap(places, rng.uniform(1.5, 3.0, len(places) - 1))
    return team
