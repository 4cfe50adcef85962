"""A C3 spline of degree-7 pieces, held as the states at its nodes: the value that refinement works on in float64."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refine.spline.basis import ORDER, SNAP, coefficients_of, values

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Spline:
    """Pieces that join up to the third derivative because neighbours share a node.

    Attributes:
        durations: In s. Shape (pieces,).
        states: Position (m or rad) and its first three derivatives at the nodes. Shape (pieces + 1, 4, axes).
    """

    durations: Floats
    states: Floats

    def __len__(self) -> int:
        return len(self.durations)

    @property
    def duration(self) -> float:
        """Length in s."""
        return float(self.durations.sum())

    @property
    def nodes(self) -> Floats:
        """Positions at the nodes. Shape (pieces + 1, axes)."""
        return self.states[:, 0]

    @cached_property
    def knots(self) -> Floats:
        """Times of the nodes in s, from 0. Shape (pieces + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    @cached_property
    def coefficients(self) -> Floats:
        """Ascending powers of local time. Shape (pieces, axes, 8)."""
        return coefficients_of(self.states, self.durations)

    def sample(self, shares: Floats, derivative: int = 0) -> Floats:
        """Evaluate every piece at the same shares (0 to 1) of its duration. Shape (pieces, shares, axes)."""
        return values(self.coefficients, self.durations[:, None] * shares, derivative)

    def stretched(self, factor: float) -> Spline:
        """Return the same path flown `factor` times slower."""
        scale = factor ** -np.arange(ORDER, dtype=np.float64)
        return Spline(self.durations * factor, self.states * scale[:, None])

    def snap_cost(self) -> float:
        """Return the integral of |snap|^2 over time, in m^2/s^7."""
        scale = self.durations[:, None] ** np.arange(ORDER)
        unit = np.concatenate([self.states[:-1] * scale[:, :, None], self.states[1:] * scale[:, :, None]], axis=1)
        return float(np.sum(np.einsum("nia,ij,nja->n", unit, SNAP, unit) / self.durations**7))

    def split(self, pieces: int) -> Spline:
        """Return the same curve with every piece cut into equal parts."""
        shares = np.arange(pieces) / pieces
        inner = np.stack([self.sample(shares, d) for d in range(ORDER)], axis=2)
        states = inner.reshape(-1, ORDER, self.states.shape[2])
        return Spline(np.repeat(self.durations / pieces, pieces), np.concatenate([states, self.states[-1:]]))
