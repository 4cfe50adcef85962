"""Nominal paths as trajectories, for what looks at both."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from verify.data import Trajectory


def nominal_trajectory(points: ArrayLike, times: ArrayLike, *, cycle: int | None = None, yaw: float = 0.0) -> Trajectory:
    """Return the least-snap spline through points, as a trajectory with a fixed heading.

    Args:
        points: m. Shape (points, 3).
        times: s, increasing. Shape (points,).
        cycle: Index of the point where the cycle begins, or None.
        yaw: rad.
    """
    spline = LeastSnapSpline(times, cycle)
    coefficients = np.zeros((len(spline.times) - 1, 4, 8))
    coefficients[:, :3] = spline.through(points)
    coefficients[:, 3, 0] = yaw
    return Trajectory(spline.durations, coefficients, cycle=cycle)
