"""Remainder of a trajectory from a time on: its polynomials shifted exactly, rounded once, with a bound on the rounding."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from verify.data.errors import BadInput
from verify.data.trajectory import Trajectory

SHIFT = 1e-9
"""m; a cut trajectory's rounded coefficients are this near to the exact ones, and the margin is taken larger by it."""


def cut(trajectory: Trajectory, at: Fraction) -> Trajectory:
    """Return what is left of a finite trajectory from a time on, within SHIFT of it at every time.

    Raises:
        BadInput: Rounding would move it further.
    """
    knots = [Fraction(0), *itertools.accumulate(map(Fraction, trajectory.durations.tolist()))]
    if at >= knots[-1]:
        hover = np.zeros((1, 4, trajectory.coefficients.shape[2]))
        length = Fraction(float(trajectory.durations[-1]))
        ends = [_shifted(row, length)[0] for row in trajectory.coefficients[-1].tolist()]
        hover[0, :, 0] = [float(end) for end in ends]
        _require_near(max(abs(Fraction(float(end)) - end) for end in ends))
        return Trajectory([1.0], hover)
    index = max(bisect.bisect_right(knots, at) - 1, 0)
    local, left = max(at, Fraction(0)) - knots[index], knots[index + 1] - max(at, Fraction(0))
    coefficients, durations = trajectory.coefficients[index:].copy(), trajectory.durations[index:].copy()
    durations[0] = float(left)
    late = abs(Fraction(float(left)) - left)  # the rounded length puts what follows this much earlier or later
    worst = Fraction(0)
    for axis, row in enumerate(coefficients[0].tolist()):
        exact = _shifted(row, local)
        coefficients[0, axis] = [float(c) for c in exact]
        error = sum((abs(Fraction(float(c)) - c) * left**k for k, c in enumerate(exact)), Fraction(0))
        later = zip(coefficients[1:, axis].tolist(), durations[1:].tolist(), strict=True)
        fastest = max((_speed_bound(map(Fraction, row), Fraction(length)) for row, length in later), default=Fraction(0))
        worst = max(worst, error + late * (_speed_bound(exact, left + late) + fastest))
    _require_near(worst)
    return Trajectory(durations, coefficients)


def _require_near(worst: Fraction) -> None:
    """Reject what is off by more than SHIFT, given how far it is off along an axis: of three at most twice that."""
    if 2 * worst > Fraction(SHIFT):
        raise BadInput("These coefficients are too large to cut a trajectory in flight.")


def _speed_bound(row: Iterable[Fraction], length: Fraction) -> Fraction:
    """Bound the slope of a polynomial on [0, length]."""
    return sum((k * abs(c) * length ** (k - 1) for k, c in enumerate(row) if k), Fraction(0))


def _shifted(row: Sequence[float], by: Fraction) -> list[Fraction]:
    """Return the coefficients of p(t + by)."""
    exact = [Fraction(c) for c in row]
    return [
        sum((exact[n] * math.comb(n, k) * by ** (n - k) for n in range(k, len(exact))), Fraction(0)) for k in range(len(exact))
    ]
