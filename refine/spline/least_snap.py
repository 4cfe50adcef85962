"""Minimum snap through given points at given times: one banded solve, no engine.

The unknowns are velocity, acceleration and jerk at the nodes. The integral of |snap|^2 is a quadratic form in them
that couples neighbours only, so its minimum solves a positive definite system of bandwidth 5, once for all axes: time
and memory grow linearly with the number of points. Positions enter through differences of neighbours only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg.lapack import dpbsv  # pyright: ignore[reportAttributeAccessIssue]  (made at import time)

from refine.spline.basis import ORDER, SNAP
from refine.spline.spline import Spline
from verify.data import BadInput, InternalError

Floats = NDArray[np.float64]

SHORTEST, LONGEST = 1e-4, 1e4
"""Durations of one leg that make sense, in s."""
LARGEST_RATIO = 1e3
"""Longest over shortest leg; powers of it up to the fifth enter the band."""


@dataclass(frozen=True, eq=False)
class BandedProblem:
    """The linear system of a minimum-snap spline, ready to be looked at or solved.

    Attributes:
        points: Positions at the nodes. Shape (nodes, axes).
        durations: In s. Shape (nodes - 1,).
        band: Lower band of the matrix: `band[i - j, j]` is entry (i, j). Shape (6, unknowns).
        right: Right-hand sides. Shape (unknowns, axes).
        known: Values of velocity, acceleration and jerk at all nodes where given, else NaN. Shape (nodes, 3, axes).
            None where both ends rest and all between is free; the unknowns are then those of the inner nodes.
    """

    points: Floats
    durations: Floats
    band: Floats
    right: Floats
    known: Floats | None


def _weights() -> tuple[Floats, Floats]:
    """Return constant tables: band entries and right-hand sides as combinations of powers of the durations.

    A leg adds SNAP[i, j] / T^(7 - d_i - d_j) for derivatives d_i, d_j, so a diagonal block at a node is a sum over the leg
    that ends there and the leg that starts there, and the block below it belongs to the leg that starts there.
    """
    band = np.zeros((6, 3, 10))  # (diagonal, column within the block, 1/T^1..1/T^5 of the leg before and after)
    right = np.zeros((3, 6))  # (row, 1/T^4..1/T^6 of the leg before and after), times the step of the position
    for column in range(3):
        for row in range(column, 3):
            power = 7 - (row + 1) - (column + 1) - 1
            band[row - column, column, power] = SNAP[ORDER + 1 + row, ORDER + 1 + column]
            band[row - column, column, 5 + power] = SNAP[1 + row, 1 + column]
        for row in range(3):
            power = 7 - (row + 1) - (column + 1) - 1
            band[3 + row - column, column, 5 + power] = SNAP[ORDER + 1 + row, 1 + column]
    for row in range(3):
        right[row, 2 - row] = -SNAP[ORDER + 1 + row, ORDER]
        right[row, 5 - row] = -SNAP[1 + row, ORDER]
    return band.reshape(18, 10), right


_BAND, _RIGHT = _weights()


def banded_problem(waypoints: Floats, durations: Floats, known: Floats | None = None) -> BandedProblem:
    """Assemble the system for given points, times and known derivatives (see `BandedProblem`).

    Args:
        waypoints: m. Shape (nodes, axes).
        durations: s. Shape (nodes - 1,).
        known: Velocity, acceleration and jerk where given, else NaN. Shape (nodes, 3, axes).
    """
    inverse = 1.0 / durations
    powers = np.empty((6, len(durations)))
    powers[0] = inverse
    for k in range(1, 6):
        np.multiply(powers[k - 1], inverse, out=powers[k])
    steps = waypoints[1:] - waypoints[:-1]
    if known is None:
        pairs = np.concatenate([powers[:5, :-1], powers[:5, 1:]])
        pull = (powers[3:6, :, None] * steps).transpose(1, 0, 2)
        right = np.empty((len(durations) - 1, 3, waypoints.shape[1]))
        for row in range(3):
            right[:, row] = _RIGHT[row, 2 - row] * pull[:-1, 2 - row] + _RIGHT[row, 5 - row] * pull[1:, 2 - row]
    else:
        wide = np.zeros((10, len(waypoints)))
        wide[:5, 1:], wide[5:, :-1] = powers[:5], powers[:5]
        pairs = wide
        pull = np.zeros((len(waypoints), 6, waypoints.shape[1]))
        moved = (powers[3:6, :, None] * steps).transpose(1, 0, 2)
        pull[1:, :3], pull[:-1, 3:] = moved, moved
        right = np.matmul(_RIGHT, pull)
    nodes = pairs.shape[1]
    band = np.empty((6, nodes, 3))
    np.copyto(band, (_BAND @ pairs).reshape(6, 3, nodes).transpose(0, 2, 1))
    return BandedProblem(waypoints, durations, band.reshape(6, 3 * nodes), right.reshape(3 * nodes, waypoints.shape[1]), known)


def solve_banded(problem: BandedProblem) -> Spline:
    """Solve a system from `banded_problem`; each axis with known derivatives of its own is solved by itself.

    Raises:
        InternalError: The matrix is not positive definite in floats (durations too different in size).
    """
    nodes, axes = problem.points.shape
    states = np.zeros((nodes, ORDER, axes))
    states[:, 0] = problem.points
    if problem.known is None:
        if nodes > 2:
            states[1:-1, 1:] = _solve(problem.band, problem.right).reshape(nodes - 2, 3, axes)
        return Spline(problem.durations, states)
    for axis in range(axes):
        known = problem.known[:, :, axis].ravel()
        fixed = ~np.isnan(known)
        band, right = problem.band.copy(), problem.right[:, axis].copy()
        given = np.where(fixed, known, 0.0)
        right -= _times(band, given)
        right[fixed] = given[fixed]
        band[:, fixed] = 0.0
        for below in range(1, 6):
            band[below, :-below][fixed[below:]] = 0.0
        band[0, fixed] = 1.0
        states[:, 1:, axis] = _solve(band, right[:, None]).reshape(nodes, 3)
    return Spline(problem.durations, states)


def minimum_snap(
    waypoints: ArrayLike,
    times: ArrayLike,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    jerk: ArrayLike | None = None,
) -> Spline:
    """Return the spline of least snap through points at given times.

    By default the flight starts and ends at rest (velocity, acceleration and jerk zero) and everything between is free.

    Args:
        waypoints: In m, at least two. Shape (points, axes).
        times: In s, at each point, strictly increasing. Shape (points,).
        velocity: In m/s; NaN where it is free. Shape (points, axes). Left out: zero at both ends, free between.
        acceleration: In m/s^2, likewise.
        jerk: In m/s^3, likewise.

    Raises:
        BadInput: Shapes do not fit, numbers are not finite, times do not increase or differ too much in size.
    """
    points = np.asarray(waypoints, dtype=np.float64)
    at = np.asarray(times, dtype=np.float64)
    if points.ndim != 2 or at.ndim != 1 or len(points) < 2 or len(at) != len(points):
        raise BadInput(
            f"waypoints {points.shape} and times {at.shape} must have shapes (points, axes) and (points,), points >= 2."
        )
    durations = at[1:] - at[:-1]
    shortest, longest = durations.min(), durations.max()
    # A NaN makes each of these comparisons false, and a sum is finite only where all its terms are.
    if not (shortest >= SHORTEST and longest <= LONGEST and longest <= LARGEST_RATIO * shortest and np.isfinite(points.sum())):
        _explain(points, durations)
    if velocity is None and acceleration is None and jerk is None:
        return solve_banded(banded_problem(points, durations))
    known = np.stack([_known(given, points, name) for given, name in _named(velocity, acceleration, jerk)], axis=1)
    return solve_banded(banded_problem(points, durations, known))


def _named(velocity: ArrayLike | None, acceleration: ArrayLike | None, jerk: ArrayLike | None):
    return ((velocity, "velocity"), (acceleration, "acceleration"), (jerk, "jerk"))


def _known(given: ArrayLike | None, points: Floats, name: str) -> Floats:
    if given is None:
        values = np.full(points.shape, np.nan)
        values[[0, -1]] = 0.0
        return values
    values = np.array(given, dtype=np.float64)
    if values.shape != points.shape:
        raise BadInput(f"{name} has shape {values.shape}; like the waypoints it must have {points.shape} (NaN where free).")
    if np.any(np.isinf(values)):
        raise BadInput(f"{name} must be finite, or NaN where it is free.")
    return values


def _explain(points: Floats, durations: Floats) -> None:
    """Raise the error that says which number is wrong."""
    if not np.all(np.isfinite(points)):
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(points))[0])
        raise BadInput(f"waypoints[{where[0]}, {where[1]}] is {points[where]}; it must be finite.")
    if not np.all(np.isfinite(durations)):
        raise BadInput("times must be finite.")
    leg = int(np.argmin(durations))
    if durations[leg] <= 0:
        raise BadInput(
            f"leg {leg} lasts {durations[leg]:g} s; times must increase (give a hover piece for a wait, not a repeated point)."
        )
    raise BadInput(
        f"legs last {durations.min():g} s to {durations.max():g} s; each must be within {SHORTEST:g} and {LONGEST:g} s "
        f"and their ratio at most {LARGEST_RATIO:g}."
    )


def _solve(band: Floats, right: Floats) -> Floats:
    _, solution, info = dpbsv(band, right, lower=1)
    if info != 0:
        raise InternalError(f"The minimum-snap system is not positive definite (LAPACK dpbsv gave {info}).")
    return solution


def _times(band: Floats, vector: Floats) -> Floats:
    """Return the product of a symmetric lower band with a vector."""
    result = band[0] * vector
    for below in range(1, len(band)):
        result[below:] += band[below, :-below] * vector[:-below]
        result[:-below] += band[below, :-below] * vector[below:]
    return result
