"""A certified team, flown more slowly where a simulated flight of it strays too far: all robots at once, on one clock.

Paths stay as they are, and robots are where they were when others were where they were; so words, order and distances stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.coordination.common_clock import Clock, retimed
from refine.rest_to_rest import TICK
from refine.spline.basis import ORDER, derivative_rows
from refine.spline.rounding import quantise
from refine.spline.spline import Spline
from verify.data import Trajectory

Floats = NDArray[np.float64]

_KNOT = 0.2
"""s between two knots of the clock."""
_BEFORE, _AROUND = 0.8, 1.0
"""s before an error within which what is flown there brings it about, and s around that time in which the clock slows down and goes on."""


@dataclass(frozen=True, slots=True)
class Dip:
    """One time at which a team is to fly more slowly.

    Attributes:
        time: Of the flight, s.
        factor: How many times slower, above 1.
    """

    time: float
    factor: float


def slowed_at(team: Mapping[str, Trajectory], dips: Sequence[Dip]) -> dict[str, Trajectory]:
    """Return a team's flights, slower at some times; as a whole where it repeats, so that every lap stays the same.

    Args:
        team: One flight a robot.
        dips: Where, and how much.
    """
    end = max(path.duration for path in team.values())
    if any(path.cycle is not None for path in team.values()):
        coefficients = np.full(8, -np.log(max(dip.factor for dip in dips)))
    else:
        count = int(np.ceil(end / _KNOT)) + 5
        at = np.linspace(0.0, end, count)
        depth = [np.log(dip.factor) * np.exp(-(((at - dip.time + _BEFORE) / _AROUND) ** 2)) for dip in dips]
        coefficients = -np.max(depth, axis=0)
    clock = Clock(coefficients, end)
    return {name: _slowed(path, clock) for name, path in team.items()}


def _slowed(flight: Trajectory, clock: Clock) -> Trajectory:
    """Return one robot's flight on the clock, its pieces on whole ticks."""
    path = retimed(Spline(flight.durations, _states(flight)), 0.0, clock)
    ticks = np.round(path.knots / TICK) * TICK
    known = np.round(clock.flown(flight.knots) / TICK) * TICK
    cuts = [int(np.argmin(np.abs(ticks - known[cut]))) for cut in flight.cuts]
    cycle = None if flight.cycle is None else int(np.argmin(np.abs(ticks - known[flight.cycle])))
    slow = quantise(Spline(np.diff(ticks), path.states), cycle=cycle)
    return Trajectory(slow.durations, slow.coefficients, cycle=cycle, cuts=cuts)


def _states(flight: Trajectory) -> Floats:
    """Return position, velocity, acceleration and jerk at all knots. Shape (pieces + 1, 4, 4)."""
    factorials = np.array([1.0, 1.0, 2.0, 6.0])
    begins = (flight.coefficients[:, :, :ORDER] * factorials).transpose(0, 2, 1)
    end = derivative_rows(float(flight.durations[-1]), ORDER) @ flight.coefficients[-1].T
    return np.concatenate([begins, end[None]])
