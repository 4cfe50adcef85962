"""Degree-7 pieces and the two ways in which we write them.

A piece over a time T is given either by its state at both ends (position, velocity, acceleration, jerk: two times
four numbers for eight coefficients, so neighbours that share a node's state join up to the third derivative by
construction), or by eight coefficients of ascending powers of local time. In *unit time* s = t / T the two are
joined by one constant matrix: a state (p, v, a, j) becomes (p, vT, aT^2, jT^3) and a coefficient c_k becomes c_k T^k.
Bernstein points serve inequalities: a piece lies in the convex hull of its points, so what holds for them holds for all t.
"""

from __future__ import annotations

from math import comb, perm

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

DEGREE = 7
SIZE = DEGREE + 1
ORDER = 4
"""Derivatives in a node's state: position, velocity, acceleration, jerk."""

_POWERS = np.arange(SIZE)
_EXPONENTS = np.array([[max(k - d, 0) for k in range(SIZE)] for d in range(SIZE)])
_WEIGHTS = np.array([[perm(k, d) for k in range(SIZE)] for d in range(SIZE)], dtype=np.float64)
"""k! / (k - d)! for derivatives d (rows) of powers k (columns), zero for k < d. Shape (8, 8)."""


def derivative_weights(derivative: int) -> Floats:
    """Return k! / (k - d)! for k = 0..7 (zero for k < d). Shape (8,)."""
    return _WEIGHTS[derivative]


def power_rows(local: ArrayLike, derivative: int = 0) -> Floats:
    """Return the rows (d/dt)^derivative of (1, t, .., t^7) at local times, in s. Shape (...,) to (..., 8)."""
    times = np.asarray(local, dtype=np.float64)
    rows = np.zeros((*times.shape, SIZE))
    for power in range(derivative, SIZE):
        rows[..., power] = _WEIGHTS[derivative, power] * times ** (power - derivative)
    return rows


def derivative_rows(local: float, count: int) -> Floats:
    """Return the rows of the first derivatives of (1, t, .., t^7), 0 to count - 1, at one local time, in s. Shape (count, 8)."""
    return _WEIGHTS[:count] * local ** _EXPONENTS[:count]


END_STATES = np.concatenate([np.diag(_WEIGHTS.diagonal())[:ORDER], _WEIGHTS[:ORDER]])
"""From ascending coefficients to (state at 0, state at 1) in unit time. Shape (8, 8)."""
HERMITE = np.rint(np.linalg.inv(END_STATES) * 6.0) / 6.0
"""The way back: its entries are sixths of integers, so exact up to one rounding. Shape (8, 8)."""
SNAP_GRAM = np.array([[_WEIGHTS[ORDER, i] * _WEIGHTS[ORDER, j] / max(i + j - 7, 1) for j in range(SIZE)] for i in range(SIZE)])
"""Gram matrix of fourth derivatives of the powers on [0, 1]. Shape (8, 8)."""
SNAP = np.rint(HERMITE.T @ SNAP_GRAM @ HERMITE)
"""Integral of snap squared on [0, 1] as a form in the two end states (unit time). Shape (8, 8)."""


def coefficients_of(states: Floats, durations: Floats) -> Floats:
    """Return ascending coefficients of local time.

    Args:
        states: Position and its first three derivatives at the nodes. Shape (pieces + 1, 4, axes).
        durations: In s. Shape (pieces,).

    Returns:
        Shape (pieces, axes, 8).
    """
    powers = durations[:, None] ** _POWERS
    scale = powers[:, :ORDER, None]
    unit = np.concatenate([states[:-1] * scale, states[1:] * scale], axis=1)
    return np.matmul(HERMITE, unit).transpose(0, 2, 1) / powers[:, None, :]


def values(coefficients: Floats, at: Floats, derivative: int = 0) -> Floats:
    """Evaluate pieces at local times.

    Args:
        coefficients: Shape (pieces, axes, 8).
        at: Local times in s. Shape (pieces, samples).
        derivative: Which derivative.

    Returns:
        Shape (pieces, samples, axes).
    """
    return np.matmul(power_rows(at, derivative), coefficients.transpose(0, 2, 1))


def bernstein_matrix(low: float = 0.0, high: float = 1.0) -> Floats:
    """Return the matrix from unit-time coefficients to Bernstein points of the part [low, high]. Shape (8, 8)."""
    width = high - low
    shift = np.zeros((SIZE, SIZE))
    for k in range(SIZE):
        for i in range(k + 1):
            shift[i, k] = comb(k, i) * low ** (k - i) * width**i
    to_points = np.array([[comb(i, k) / comb(DEGREE, k) if k <= i else 0.0 for k in range(SIZE)] for i in range(SIZE)])
    return to_points @ shift
