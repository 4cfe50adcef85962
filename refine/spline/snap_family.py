"""Least-snap splines as a differentiable function of their durations and nodes.

For given times and points the spline of least snap is the solution of one linear system, so any value of its states has a
gradient in times and points at the price of one more solve with the same factor: the class of trajectories that MINCO optimises
over (Wang, Zhou, Xu and Gao, T-RO 2022). Nodes may be rests, and the last one may repeat an earlier one's state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs  # pyright: ignore[reportAttributeAccessIssue]  (made at import time)

from refine.spline.basis import ORDER, SNAP
from verify.data import InternalError

Floats = NDArray[np.float64]

_DERIVATIVES = np.array([1, 2, 3, 1, 2, 3])
"""Orders of the derivatives at a piece's two ends."""
_FREE, _PLACES = np.array([1, 2, 3, 5, 6, 7]), np.array([0, 4])
_PULL, _STEP = SNAP[np.ix_(_FREE, _FREE)], SNAP[np.ix_(_FREE, _PLACES)]
_PULL_POWER, _STEP_POWER = 7 - _DERIVATIVES[:, None] - _DERIVATIVES, 7 - _DERIVATIVES
_POWERS = np.arange(8)


class SnapFamily:
    """All least-snap splines of so many pieces that rest at the same nodes.

    Args:
        fixed: States that are given, NaN where free; of derivatives only zeros are given. Shape (nodes, 4, 3).
        cycle: Node whose state the last node repeats, or None.
    """

    def __init__(self, fixed: Floats, cycle: int | None) -> None:
        nodes = len(fixed)
        column = np.full((nodes, 3), -1)
        own = np.flatnonzero(np.isnan(fixed[: nodes if cycle is None else nodes - 1, 1, 0]))
        column[own] = np.arange(3 * len(own)).reshape(-1, 3)
        if cycle is not None:
            column[-1] = column[cycle]
        self.unknowns = 3 * len(own)
        self._column = column
        self._local = np.concatenate([column[:-1], column[1:]], axis=1)
        rows, columns = self._local[:, :, None], self._local[:, None, :]
        entries = np.where((rows >= 0) & (columns >= 0), rows * self.unknowns + columns, -1)
        self._form = _Adding(entries.ravel(), self.unknowns**2)
        self._right = _Adding(_by_axis(self._local), 3 * self.unknowns)
        self._summed = _Adding(_by_axis(column), 3 * self.unknowns)

    def at(self, durations: Floats, points: Floats) -> Member:
        """Return the spline of given durations and nodes.

        Args:
            durations: s. Shape (pieces,).
            points: m. Shape (nodes, 3).

        Raises:
            InternalError: The system is not positive definite in floats (durations too different in size).
        """
        inverse = (1.0 / durations)[:, None] ** _POWERS
        states = np.zeros((len(points), ORDER, 3))
        states[:, 0] = points
        ends = np.stack([points[:-1], points[1:]], axis=1)
        if not self.unknowns:
            return Member(self, states, inverse, ends, np.zeros((0, 0)))
        form = self._form((_PULL * inverse[:, _PULL_POWER]).ravel()).reshape(self.unknowns, self.unknowns)
        right = self._right((-(_STEP @ ends) * inverse[:, _STEP_POWER][:, :, None]).ravel()).reshape(-1, 3)
        factor, info = dpotrf(form, lower=1)
        if info:
            raise InternalError(f"The minimum-snap system is not positive definite (LAPACK dpotrf gave {info}).")
        solution, _ = dpotrs(factor, right, lower=1)
        states[:, 1:] = self.on_nodes(solution)
        return Member(self, states, inverse, ends, factor)

    def on_nodes(self, unknowns: Floats) -> Floats:
        """Return unknowns as derivatives at all nodes, zero where fixed. Shape (nodes, 3, 3)."""
        return np.where(self._column[:, :, None] >= 0, unknowns[self._column], 0.0)

    def summed(self, on_nodes: Floats) -> Floats:
        """Return derivatives by nodes' derivatives as derivatives by the unknowns. Shape (unknowns, 3)."""
        return self._summed(on_nodes.ravel()).reshape(-1, 3)

    def on_pieces(self, unknowns: Floats) -> Floats:
        """Return unknowns as derivatives at the ends of all pieces, zero where fixed. Shape (pieces, 6, 3)."""
        return np.where(self._local[:, :, None] >= 0, unknowns[self._local], 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """One spline of a family.

    Attributes:
        family: The family.
        states: At the nodes. Shape (nodes, 4, 3).
        inverse: Powers 0 to 7 of 1 / duration. Shape (pieces, 8).
        ends: Positions at the ends of pieces. Shape (pieces, 2, 3).
        factor: Of the linear system.
    """

    family: SnapFamily
    states: Floats
    inverse: Floats
    ends: Floats
    factor: Floats

    def gradient(self, by_states: Floats) -> tuple[Floats, Floats]:
        """Return the derivatives of a value by durations and nodes, given those by the states (adjoint method).

        Args:
            by_states: With durations held fixed. Shape (nodes, 4, 3).

        Returns:
            By durations, without what the value takes of them directly, shape (pieces,); by nodes, shape (nodes, 3).
        """
        by_points = by_states[:, 0].copy()
        if not self.family.unknowns:
            return np.zeros(len(self.inverse)), by_points
        weights, _ = dpotrs(self.factor, self.family.summed(by_states[:, 1:]), lower=1)
        local = self.family.on_pieces(weights)
        states = np.concatenate([self.states[:-1, 1:], self.states[1:, 1:]], axis=1)
        pull = (-_PULL_POWER * _PULL * self.inverse[:, _PULL_POWER + 1]) @ states
        step = (_STEP @ self.ends) * (-_STEP_POWER * self.inverse[:, _STEP_POWER + 1])[:, :, None]
        by_durations = -np.sum(local * (pull + step), axis=(1, 2))
        moved = -_STEP.T @ (local * self.inverse[:, _STEP_POWER][:, :, None])
        by_points[:-1] += moved[:, 0]
        by_points[1:] += moved[:, 1]
        return by_durations, by_points


def _by_axis(columns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the places of unknowns' three axes, axis by axis last. Shape (entries * 3,)."""
    return np.where(columns[..., None] >= 0, 3 * columns[..., None] + np.arange(3), -1).ravel()


class _Adding:
    """The sum of entries of an array by their places in another; entries of negative place are left out.

    Args:
        places: One for each entry.
        count: How many places there are.
    """

    def __init__(self, places: NDArray[np.int64], count: int) -> None:
        self._kept, self._count = np.flatnonzero(places >= 0), count
        self._places = places[self._kept]

    def __call__(self, values: Floats) -> Floats:
        return np.bincount(self._places, values[self._kept], self._count).astype(np.float64)
