"""Splines of least snap through points at given times, as matrices: one for all paths of a round.

A path through points p_0 .. p_m at times t_0 .. t_m has one polynomial of degree 7 a piece, is three times
continuously differentiable, starts and ends at rest, and has the smallest integral of |snap|^2 of all such paths. For
given times the polynomials depend linearly on the points, so whatever is sampled of a path (positions, velocities,
snap at any times) is one matrix times the points, and a thousand paths are one matrix product.
A lasso closes on itself: velocity, acceleration and jerk at the last point are those at the point where the cycle began.
A cycle of one piece leads from a point to the same point: it is a hover, and both its ends are at rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.linalg import splu

from refine.spline.basis import END_STATES, SNAP_GRAM, power_rows
from verify.data import BadInput
from verify.data.arrays import Floats, Integers

ORDERS = 4
"""Position, velocity, acceleration and jerk are held at each point."""


_HERMITE = np.asarray(np.linalg.inv(END_STATES), dtype=np.float64)
"""From (position, velocity, acceleration, jerk at 0, the same at 1) to ascending coefficients of degree 7."""
_SNAP = _HERMITE.T @ SNAP_GRAM @ _HERMITE
"""Integral of snap^2 over a piece of length 1, as a quadratic form of its end states."""


@dataclass(frozen=True, eq=False)
class LeastSnapSpline:
    """The least-snap spline through any points at these times.

    Attributes:
        times: Time at each point, s, increasing; the first need not be 0. Shape (points,), at least 2.
        cycle: Index of the point at which a lasso's cycle begins, its last point being where it closes; None for
            a path that ends at rest.
    """

    times: Floats
    cycle: int | None = None

    def __init__(self, times: ArrayLike, cycle: int | None = None) -> None:
        at = np.array(times, dtype=np.float64)
        if at.ndim != 1 or len(at) < 2 or not np.all(np.isfinite(at)) or np.any(np.diff(at) <= 0):
            raise BadInput("A spline needs two or more times that are finite and increase.")
        at.setflags(write=False)
        object.__setattr__(self, "times", at)
        object.__setattr__(self, "cycle", cycle)

    @property
    def durations(self) -> Floats:
        """Length of each piece, s. Shape (points - 1,)."""
        return self.times[1:] - self.times[:-1]

    @cached_property
    def coefficients(self) -> Floats:
        """Map points to ascending coefficients of local time. Shape (pieces, 8, points), read-only."""
        result = self.solve(np.eye(len(self.times)))
        result.setflags(write=False)
        return result

    def through(self, points: ArrayLike) -> Floats:
        """Return the coefficients of the spline through these points, read-only. Shape (points, axes) to (pieces, axes, 8)."""
        values = np.asarray(points, dtype=np.float64)
        return _through(self.times.tobytes(), self.cycle, values.tobytes(), values.shape[1])

    def evaluate(self, points: ArrayLike, at: ArrayLike, derivative: int = 0) -> Floats:
        """Return one path, or a derivative of it, at times within the spline's own, without the matrix.

        Args:
            points: Shape (points, axes).
            at: s. Shape (instants,).
            derivative: 0 for position, 1 for velocity, and so on.

        Returns:
            Shape (instants, axes).
        """
        piece, rows = self._rows(at, derivative)
        return np.einsum("ik,iak->ia", rows, self.through(points)[piece])

    def sampling(self, at: ArrayLike, derivative: int = 0) -> Floats:
        """Return the matrix that maps points to a derivative of the path at the times `at`.

        Args:
            at: s, each within the spline's times. Shape (instants,).
            derivative: 0 for position, 1 for velocity, and so on.

        Returns:
            Shape (instants, points).
        """
        piece, rows = self._rows(at, derivative)
        return np.einsum("ik,ikp->ip", rows, self.coefficients[piece])

    def _rows(self, at: ArrayLike, derivative: int) -> tuple[Integers, Floats]:
        """Return the piece of each instant, and what its coefficients are multiplied by there. Shapes (instants,), (instants, 8)."""
        times = np.asarray(at, dtype=np.float64)
        piece = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        return piece, power_rows(times - self.times[piece], derivative)

    def solve(self, points: Floats) -> Floats:
        """Return ascending coefficients of the splines through the columns of `points`. Shape (pieces, 8, columns)."""
        pieces, columns = len(self.times) - 1, points.shape[1]
        unit = float(np.mean(self.durations))  # solved in this unit of time, so that the orders are of one size
        lengths = self.durations / unit
        scale = lengths[:, None] ** np.arange(ORDERS)
        scales = np.concatenate([scale, scale], axis=1)
        forms = scales[:, :, None] * _SNAP * scales[:, None, :] / lengths[:, None, None] ** 7
        hovers = self.cycle == pieces - 1
        unknown = -np.ones((pieces + 1, ORDERS - 1), dtype=np.int64)
        moving = np.arange(1, pieces - 1 if hovers else pieces)
        unknown[moving] = np.arange(3 * len(moving)).reshape(-1, 3)
        if self.cycle is not None and not hovers:
            if self.cycle == 0:
                unknown[0] = 3 * len(moving) + np.arange(3)
            unknown[-1] = unknown[self.cycle]
        states = np.zeros((pieces + 1, ORDERS, columns))
        states[:, 0] = points
        count = int(unknown.max(initial=-1)) + 1
        if count:
            index = np.full((pieces, 2 * ORDERS), -1, dtype=np.int64)
            index[:, 1:ORDERS], index[:, ORDERS + 1 :] = unknown[:-1], unknown[1:]
            ends = np.zeros((pieces, 2 * ORDERS, columns))
            ends[:, 0], ends[:, ORDERS] = points[:-1], points[1:]
            pull = np.einsum("pij,pjc->pic", forms, ends)
            known = index >= 0
            right = np.zeros((count, columns))
            np.add.at(right, index[known], -pull[known])
            pair = known[:, :, None] & known[:, None, :]
            rows = np.broadcast_to(index[:, :, None], pair.shape)[pair]
            cols = np.broadcast_to(index[:, None, :], pair.shape)[pair]
            matrix = sparse.csc_matrix((forms[pair], (rows, cols)), shape=(count, count))
            solved = splu(matrix).solve(right)
            free = unknown[:, 0] >= 0
            states[free, 1:] = solved[unknown[free]]
        ends = np.concatenate([states[:-1], states[1:]], axis=1) * scales[:, :, None]
        local = np.einsum("kj,pjc->pkc", _HERMITE, ends)
        return local / self.durations[:, None, None] ** np.arange(8)[None, :, None]


@lru_cache(maxsize=64)  # a path is priced, sampled and looked at for conflicts by several callers
def _through(times: bytes, cycle: int | None, points: bytes, axes: int) -> Floats:
    """Return the coefficients of the spline through points."""
    spline = LeastSnapSpline(np.frombuffer(times), cycle)
    found = spline.solve(np.frombuffer(points).reshape(-1, axes)).transpose(0, 2, 1)
    found.setflags(write=False)
    return found
