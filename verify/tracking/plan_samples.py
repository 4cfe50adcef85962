"""A planned path as a controller reads it: derivatives at the commands, and bounds on them between two commands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, gamma
from verify.data.trajectory import DEGREE, Trajectory
from verify.tracking.sampled_loop import GROW, TICK

ORDERS = 6
"""Derivatives of a position that are used: up to the fifth."""
_SLACK = 1e-9
"""s by which the instants of commands and joints may be off in floats."""
_LEFT = np.arange(DEGREE + 1) - np.arange(DEGREE + 1)[:, None]
"""Powers that a derivative (row) leaves of a monomial (column)."""
_FACTORIALS = np.array([math.factorial(k) for k in range(DEGREE + 1)], dtype=np.float64)
_FALLING = np.where(_LEFT >= 0, _FACTORIALS / _FACTORIALS[_LEFT], 0.0)
"""By what factor."""


@dataclass(frozen=True, eq=False, slots=True)
class PlanSamples:
    """A path, sampled at 50 Hz, in a frame turned by its heading.

    Attributes:
        times: Of the commands, s. Shape (ticks,).
        at: Position and its derivatives at each command, m and s. Shape (ticks, ORDERS, 3).
        middle: The same, between two commands. Shape (ticks, ORDERS, 3).
        across: Bounds of their horizontal lengths until the next command. Shape (ticks, ORDERS).
        along: Bounds of their vertical magnitudes. Shape (ticks, ORDERS).
        jumps: Bounds of what they jump by at joints of pieces until the next command, summed. Shape (ticks, ORDERS).
        rises: The same, of their vertical parts.
        seen: Position and velocity some time before each command, less those at it. Shape (ticks, 2, 3).
    """

    times: Floats
    at: Floats
    middle: Floats
    across: Floats
    along: Floats
    jumps: Floats
    rises: Floats
    seen: Floats

    def __len__(self) -> int:
        return len(self.times)


def fixed_heading(path: Trajectory) -> float | None:
    """Return the heading that a path keeps, rad; None where it turns."""
    yaw = path.coefficients[:, 3]
    return float(yaw[0, 0]) if np.all(yaw[:, 1:] == 0.0) and np.all(yaw[:, 0] == yaw[0, 0]) else None


def sample_plan(path: Trajectory, duration: float, heading: float, latency: float, delay: float = 0.0) -> PlanSamples:
    """Return a path as a controller reads it; after its end it hovers.

    Args:
        path: A finite flight.
        duration: Of the team's flight, s.
        heading: rad, that it keeps.
        latency: s, by which cameras are late; before time 0 the vehicle hovered.
        delay: s, for which it hovers before the path begins.
    """
    ticks = max(math.ceil(duration / TICK), 1)
    times = np.arange(ticks, dtype=np.float64) * TICK
    pieces = _Pieces.of(path, heading, float(times[-1]) + 2.0 * TICK, delay)
    at, middle = pieces.at(times), pieces.at(times + 0.5 * TICK)
    seen = pieces.at(times - latency)[:, :2] - at[:, :2]
    sizes, jumped = np.zeros((ticks, 2, ORDERS)), np.zeros((ticks, 2, ORDERS))
    tick, largest = pieces.between(times, times + TICK)
    np.maximum.at(sizes, tick, largest)
    for time, steps in zip(*pieces.joints(), strict=True):
        for k in {int((time + sign * _SLACK) / TICK) for sign in (-1.0, 1.0)}:
            if k < ticks:
                jumped[k] += steps
    (across, along), (jumps, rises) = sizes.swapaxes(0, 1), jumped.swapaxes(0, 1)
    bounds = (across * GROW + _SLACK, along * GROW + _SLACK, jumps * GROW, rises * GROW)
    return PlanSamples(times, at, middle, *bounds, seen)


def derivatives_at(path: Trajectory, times: Floats) -> Floats:
    """Return a path's place and derivatives at some times; after its end it hovers. Shape (times, ORDERS, 3)."""
    return _Pieces.of(path, 0.0, float(times[-1]) + TICK).at(times)


@dataclass(frozen=True, eq=False, slots=True)
class _Pieces:
    """The pieces of a path in a turned frame, and the hover behind them.

    Attributes:
        coefficients: Of x, y, z. Shape (pieces, 3, DEGREE + 1).
        knots: Shape (pieces + 1,).
    """

    coefficients: Floats
    knots: Floats

    @classmethod
    def of(cls, path: Trajectory, heading: float, end: float, delay: float = 0.0) -> _Pieces:
        """Take a path, a hover behind it until some time, and one before it."""
        cosine, sine = math.cos(heading), math.sin(heading)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        own = path.coefficients[:, :3]
        turned = np.asarray(np.einsum("ij,pjk->pik", turn, own) if heading else own, dtype=np.float64)
        hover = np.zeros((1, 3, DEGREE + 1))
        hover[0, :, 0] = _derivatives(turned[-1:], path.durations[-1:])[0][0, 0]
        before = np.zeros((1 if delay else 0, 3, DEGREE + 1))
        before[:, :, 0] = turned[0, :, 0]
        knots = np.concatenate([np.zeros(len(before)), path.knots + delay, [max(end, path.duration + delay + TICK)]])
        return cls(np.concatenate([before, turned, hover]), knots)

    def at(self, times: Floats) -> Floats:
        """Return the derivatives at some times; before time 0 those of a hover at the start. Shape (times, ORDERS, 3)."""
        piece = np.clip(np.searchsorted(self.knots, times, side="right") - 1, 0, len(self.coefficients) - 1)
        found = _derivatives(self.coefficients[piece], times - self.knots[piece])[0][:, :ORDERS]
        found[times < 0.0] = 0.0
        found[times < 0.0, 0] = self.coefficients[0, :, 0]
        return found

    def between(self, starts: Floats, stops: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Bound the derivatives' horizontal lengths and vertical magnitudes on each stretch of a piece in spans.

        Returns:
            To which span each stretch belongs, and the bounds. Shapes (stretches,) and (stretches, 2, ORDERS).
        """
        first = np.maximum(np.searchsorted(self.knots, starts - _SLACK, side="right") - 1, 0)
        last = np.minimum(np.searchsorted(self.knots, stops + _SLACK, side="right"), len(self.coefficients))
        span = np.repeat(np.arange(len(starts)), last - first)
        piece = np.concatenate([np.arange(*ends) for ends in zip(first, last, strict=True)])
        early, late = np.maximum(starts[span], self.knots[piece]), np.minimum(stops[span], self.knots[piece + 1])
        found, lost = _derivatives(self.coefficients[piece], 0.5 * (early + late) - self.knots[piece])
        sizes = np.abs(found) + lost
        half = 0.5 * np.maximum(late - early, 0.0) + 2.0 * _SLACK
        reach = np.where(_LEFT >= 0, half[:, None, None] ** np.maximum(_LEFT, 0) / _FACTORIALS[_LEFT], 0.0)
        lengths = np.stack([np.hypot(sizes[..., 0], sizes[..., 1]), sizes[..., 2]], axis=-1)
        return span, (reach @ lengths).swapaxes(1, 2)[..., :ORDERS]

    def joints(self) -> tuple[Floats, Floats]:
        """Return the time of each joint, and bounds of what derivatives jump by there: lengths, and vertical parts; at time 0 the speed's, from a hover.

        Returns:
            Shapes (joints,) and (joints, 2, ORDERS).
        """
        after, lost = _derivatives(self.coefficients, np.zeros(len(self.coefficients)))
        step = np.zeros_like(after)
        step[0, 1] = np.abs(after[0, 1]) + lost[0, 1]
        before, lost = _derivatives(self.coefficients[:-1], np.diff(self.knots)[:-1])
        step[1:] = np.abs(after[1:] - before) + lost
        step = step[:, :ORDERS]
        return np.concatenate([[0.0], self.knots[1:-1]]), np.stack([np.linalg.norm(step, axis=-1), step[..., 2]], axis=1)


def _derivatives(pieces: Floats, times: Floats) -> tuple[Floats, Floats]:
    """Return all derivatives of pieces at a local time of each, and how far off rounding can leave them.

    Args:
        pieces: Shape (n, 3, DEGREE + 1).
        times: Shape (n,).

    Returns:
        Shape (n, DEGREE + 1, 3) each.
    """
    powers = times[:, None, None] ** np.maximum(_LEFT, 0) * _FALLING
    own = pieces.swapaxes(1, 2)
    return powers @ own, gamma(64) * (np.abs(powers) @ np.abs(own))
