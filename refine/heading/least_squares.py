"""Least-squares fits of yaw by pieces, to headings that are wanted at samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from refine.spline.basis import HERMITE, ORDER, power_rows
from refine.spline.spline import Spline

Floats = NDArray[np.float64]


def bases(path: Spline, at: Floats) -> tuple[Floats, Floats, Floats]:
    """Return yaw, its rate and its acceleration at samples as linear maps of the node states.

    Args:
        path: Gives the durations.
        at: Shares of each piece. Shape (samples,).

    Returns:
        Three matrices of shape (pieces * samples, 4 nodes).
    """
    count, pieces = len(at), len(path)
    result = []
    for derivative in (0, 1, 2):
        powers = power_rows(at, derivative)
        matrix = np.zeros((pieces * count, ORDER * (pieces + 1)))
        for piece, duration in enumerate(path.durations):
            scale = np.tile(duration ** np.arange(ORDER), 2) / duration**derivative
            matrix[piece * count : (piece + 1) * count, ORDER * piece : ORDER * (piece + 2)] = (powers @ HERMITE) * scale
        result.append(matrix)
    return result[0], result[1], result[2]


def fitted(path: Spline, values: Floats, wanted: Floats, free: NDArray[np.bool_], weights: Floats) -> Floats:
    """Return node states whose yaw is nearest to wanted samples. Shape (4 nodes,).

    Args:
        path: Gives the durations.
        values: Maps node states to samples (see `bases`). Shape (samples, 4 nodes).
        wanted: The samples, rad. Shape (samples,).
        free: States that are looked for; the others are 0. Shape (nodes, 4).
        weights: Of the samples. Shape (samples,).
    """
    scale = np.tile(path.durations.mean() ** -np.arange(ORDER), len(path) + 1)
    matrix = (values * scale)[:, free.ravel()] * weights[:, None]
    solution = np.linalg.solve(matrix.T @ matrix + 1e-4 * np.eye(matrix.shape[1]), matrix.T @ (weights * wanted))
    states = np.zeros(len(scale))
    states[free.ravel()] = solution * scale[free.ravel()]
    return states
