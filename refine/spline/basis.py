"""Degree-7 pieces and the two ways in which we write them.

A piece over a time T is given either by its state at both ends (position, velocity, acceleration, jerk: two times
four numbers for eight coefficients, so neighbours that share a node's state join up to the third derivative by
construction), or by eight coefficients of ascending powers of local time. In *unit time* s = t / T the two are
joined by one constant matrix: a state (p, v, a, j) becomes (p, vT, aT^2, jT^3) and a coefficient c_k becomes c_k T^k.
Bernstein points serve inequalities: a piece lies in the convex hull of its points, so what holds for them holds for all t.
"""

from __future__ import annotations

from functools import cache
from math import comb, factorial

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

DEGREE = 7
SIZE = DEGREE + 1
ORDER = 4
"""Derivatives in a node's state: position, velocity, acceleration, jerk."""

_POWERS = np.arange(SIZE)


def _hermite() -> Floats:
    """Return the matrix from (state at 0, state at 1) in unit time to ascending coefficients. Shape (8, 8)."""
    ends = np.zeros((SIZE, SIZE))
    for derivative in range(ORDER):
        ends[derivative, derivative] = factorial(derivative)
        for power in range(derivative, SIZE):
            ends[ORDER + derivative, power] = factorial(power) / factorial(power - derivative)
    inverse = np.linalg.inv(ends)
    return np.rint(inverse * 6.0) / 6.0  # its entries are sixths of integers: exact up to one rounding


def _snap_gram() -> Floats:
    """Return the Gram matrix of fourth derivatives of the powers on [0, 1]. Shape (8, 8)."""
    gram = np.zeros((SIZE, SIZE))
    for i in range(ORDER, SIZE):
        for j in range(ORDER, SIZE):
            gram[i, j] = factorial(i) / factorial(i - 4) * factorial(j) / factorial(j - 4) / (i + j - 7)
    return gram


HERMITE = _hermite()
SNAP = np.rint(HERMITE.T @ _snap_gram() @ HERMITE)
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
    weights = derivative_weights(derivative)
    powers = at[:, :, None] ** np.maximum(_POWERS - derivative, 0)
    return np.matmul(powers * weights, coefficients.transpose(0, 2, 1))


@cache
def derivative_weights(derivative: int) -> Floats:
    """Return k! / (k - d)! for k = 0..7 (zero for k < d). Shape (8,)."""
    return np.array([factorial(k) / factorial(k - derivative) if k >= derivative else 0.0 for k in range(SIZE)])


def bernstein_matrix(low: float = 0.0, high: float = 1.0) -> Floats:
    """Return the matrix from unit-time coefficients to Bernstein points of the part [low, high]. Shape (8, 8)."""
    width = high - low
    shift = np.zeros((SIZE, SIZE))
    for k in range(SIZE):
        for i in range(k + 1):
            shift[i, k] = comb(k, i) * low ** (k - i) * width**i
    to_points = np.array([[comb(i, k) / comb(DEGREE, k) if k <= i else 0.0 for k in range(SIZE)] for i in range(SIZE)])
    return to_points @ shift
