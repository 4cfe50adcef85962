"""A planned path as a controller reads it: derivatives at the commands, and bounds on them between two commands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.data.trajectory import DEGREE, Trajectory
from verify.tracking.sampled_loop import GROW, TICK

ORDERS = 6
"""Derivatives of a position that are used: up to the fifth."""
_SLACK = 1e-9
"""s by which the instants of commands and joints may be off in floats."""


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
    across, along = np.zeros((ticks, ORDERS)), np.zeros((ticks, ORDERS))
    at, middle, seen = (np.empty((ticks, rows, 3)) for rows in (ORDERS, ORDERS, 2))
    for tick, time in enumerate(times):
        at[tick] = pieces.at(time)[:ORDERS]
        middle[tick] = pieces.at(time + 0.5 * TICK)[:ORDERS]
        seen[tick] = pieces.at(time - latency)[:2] - at[tick, :2]
        for found, half in pieces.between(time, time + TICK):
            for order in range(ORDERS):
                reach = np.array([half**k / math.factorial(k) for k in range(DEGREE + 1 - order)])
                across[tick, order] = max(across[tick, order], reach @ np.hypot(found[order:, 0], found[order:, 1]))
                along[tick, order] = max(along[tick, order], reach @ found[order:, 2])
    jumps, rises = np.zeros((ticks, ORDERS)), np.zeros((ticks, ORDERS))
    for time, step, rise in pieces.joints():
        for tick in {int((time + sign * _SLACK) / TICK) for sign in (-1.0, 1.0)}:
            if tick < ticks:
                jumps[tick] += step[:ORDERS]
                rises[tick] += rise[:ORDERS]
    bounds = (across * GROW + _SLACK, along * GROW + _SLACK, jumps * GROW, rises * GROW)
    return PlanSamples(times, at, middle, *bounds, seen)


def derivatives_at(path: Trajectory, times: Floats) -> Floats:
    """Return a path's place and derivatives at some times; after its end it hovers. Shape (times, ORDERS, 3)."""
    pieces = _Pieces.of(path, 0.0, float(times[-1]) + TICK)
    return np.array([pieces.at(float(time))[:ORDERS] for time in times])


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
        hover[0, :, 0] = _derivatives(turned[-1], path.durations[-1])[0][0]
        before = np.zeros((1 if delay else 0, 3, DEGREE + 1))
        before[:, :, 0] = turned[0, :, 0]
        knots = np.concatenate([np.zeros(len(before)), path.knots + delay, [max(end, path.duration + delay + TICK)]])
        return cls(np.concatenate([before, turned, hover]), knots)

    def at(self, time: float) -> Floats:
        """Return all derivatives at a time; before time 0 those of a hover at the start. Shape (DEGREE + 1, 3)."""
        if time < 0.0:
            found = np.zeros((DEGREE + 1, 3))
            found[0] = self.coefficients[0, :, 0]
            return found
        piece = min(max(int(np.searchsorted(self.knots, time, side="right")) - 1, 0), len(self.coefficients) - 1)
        return _derivatives(self.coefficients[piece], time - self.knots[piece])[0]

    def between(self, start: float, stop: float) -> Iterator[tuple[Floats, float]]:
        """Yield bounds of the derivatives' magnitudes in the middle of each stretch of a piece in a span, and half its length, s."""
        first = max(int(np.searchsorted(self.knots, start - _SLACK, side="right")) - 1, 0)
        for piece in range(first, len(self.coefficients)):
            early, late = max(start, self.knots[piece]), min(stop, self.knots[piece + 1])
            if early > late + _SLACK:
                break
            found, lost = _derivatives(self.coefficients[piece], 0.5 * (early + late) - self.knots[piece])
            yield np.abs(found) + lost, 0.5 * max(late - early, 0.0) + 2.0 * _SLACK

    def joints(self) -> Iterator[tuple[float, Floats, Floats]]:
        """Yield the time of each joint, and bounds of what derivatives jump by there: lengths, and vertical parts; at time 0 the speed's, from a hover."""
        start, lost = _derivatives(self.coefficients[0], 0.0)
        begun, risen = np.zeros(DEGREE + 1), np.zeros(DEGREE + 1)
        begun[1], risen[1] = np.linalg.norm(np.abs(start[1]) + lost[1]), np.abs(start[1, 2]) + lost[1, 2]
        yield 0.0, begun, risen
        for joint in range(1, len(self.coefficients)):
            before, lost = _derivatives(self.coefficients[joint - 1], self.knots[joint] - self.knots[joint - 1])
            after, _ = _derivatives(self.coefficients[joint], 0.0)
            step = np.abs(after - before) + lost
            yield float(self.knots[joint]), np.linalg.norm(step, axis=1), step[:, 2]


def _derivatives(piece: Floats, time: float) -> tuple[Floats, Floats]:
    """Return all derivatives of a piece at a local time, and how far off rounding can leave them. Shapes (DEGREE + 1, 3)."""
    found, sizes, values = np.empty((DEGREE + 1, 3)), np.empty((DEGREE + 1, 3)), piece
    for order in range(DEGREE + 1):
        powers = float(time) ** np.arange(values.shape[1])
        found[order], sizes[order] = values @ powers, np.abs(values) @ np.abs(powers)
        values = values[:, 1:] * np.arange(1, values.shape[1])
    return found, gamma(64) * sizes
