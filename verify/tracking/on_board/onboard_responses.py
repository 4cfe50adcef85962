"""Outputs of the linear loop of a hover under inputs that are known, step by step, every rounding counted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.on_board.onboard_loop import LINKED, SPREAD, SUBSTEPS, Frame, N, total
from verify.tracking.sampled_loop import GROW, Matrix

STEPPED, JUMPED = ("motion", "asked", "turned", "lift"), ("estimate", "spread")
"""Inputs of steps and of jumps of which something is known, in this order."""
_DOUBLINGS = 20
"""Of the time after which a loop that is off in one state has settled in all."""


class Responses:
    """Outputs of a loop under known inputs."""

    def __init__(self, frame: Frame, frames: int, outputs: Floats, ends: Floats) -> None:
        """Take a loop.

        Args:
            frame: The loop.
            frames: Of the flight.
            outputs: Rows of what is read after jumps and steps. Shape (rows, N).
            ends: Rows of what is read before a jump. Shape (rows, N).

        Raises:
            ArithmeticError: The loop is not shown to settle.
        """
        self._frame = frame
        maps = [Matrix.exact(np.eye(N))]
        for step in range(1, SUBSTEPS + 1):
            maps.append(frame.see(frame.step @ maps[-1], step))
        self._tick = frame.jump @ maps[-1]
        later = self._tick.mid
        with np.errstate(all="ignore"):
            for _ in range(_DOUBLINGS):
                later = later @ later
        if not np.all(np.abs(later) < 1.0):
            raise ArithmeticError("the controller's gains are not shown to stabilise the vehicle")
        self._rows, self._ends = Matrix.exact(outputs), Matrix.exact(ends)
        parts = [self._rows @ m for m in maps] + [self._ends @ maps[-1]]
        self._read = Matrix(np.concatenate([m.mid for m in parts]), np.concatenate([m.rad for m in parts]))
        self._rounding = _Rounding(self._tick, frames)

    def driven(self, known: Floats, direct: Floats) -> tuple[Floats, Floats, Floats]:
        """Return what known inputs make of outputs from a hover on.

        Args:
            known: Of each frame: the set-point, inputs of each step, those at the jump behind it, as `STEPPED` and `JUMPED` name them. Shape (frames, 141).
            direct: What outputs have of set-points at once. Shape (outputs, 12).

        Returns:
            Outputs after the jump and each step of each frame, what is read before jumps, and how far off each of these is. Shapes
            (frames, SUBSTEPS + 1, outputs), (frames, ends) and (outputs and ends,).
        """
        frame, column = self._frame, _beside([self._frame.stepped[name] for name in STEPPED])
        width = column.mid.shape[1]
        now, jumped = Matrix.exact(np.zeros((N, 12 + SUBSTEPS * width))), _beside([frame.jumped[name] for name in JUMPED])
        given, at_once = list[Matrix](), Matrix.exact(np.pad(direct, ((0, 0), (0, SUBSTEPS * width))))
        for step in range(SUBSTEPS + 1):
            if step:
                before, after = (Matrix.exact(np.zeros((N, width * count))) for count in (step - 1, SUBSTEPS - step))
                now = frame.see(total(frame.step @ now, _beside([frame.stepped["setpoint"], before, column, after])), step)
            given.append(total(self._rows @ now, at_once))
        entered = _beside([frame.jump @ now, jumped])
        given = _beside([part.T for part in (*given, self._ends @ now)]).T
        none = np.zeros((len(given.mid), jumped.mid.shape[1]))
        given, states = _beside([given, Matrix(none, none)]), np.zeros((len(known) + 1, N))
        for k, one in enumerate(known):
            states[k + 1] = self._tick.mid @ states[k] + entered.mid @ one
        size, largest = np.abs(known).max(0)[:, None], self._rounding.norms(np.abs(states).max(0)[:, None])
        drift = self._rounding.drift(largest, (entered.rad + gamma(N + 150) * np.abs(entered.mid)) @ size)
        off = self._rounding.off(self._read, largest, drift) + (given.rad + gamma(N + 150) * np.abs(given.mid)) @ size
        values, outputs = states[:-1] @ self._read.mid.T + known @ given.mid.T, len(direct)
        whole, ends = np.split(values, [(SUBSTEPS + 1) * outputs], axis=1)
        most = np.maximum.reduce(np.split(off[: (SUBSTEPS + 1) * outputs, 0], SUBSTEPS + 1))
        return (
            whole.reshape(len(known), SUBSTEPS + 1, outputs),
            ends,
            np.append(most, off[(SUBSTEPS + 1) * outputs :, 0]) * GROW,
        )


def _beside(columns: Sequence[Matrix]) -> Matrix:
    return Matrix(np.concatenate([c.mid for c in columns], axis=1), np.concatenate([c.rad for c in columns], axis=1))


class _Rounding:
    """Bounds on what rounding does to states that go on frame by frame.

    Norms are those of the states that act on each other, and of the covariance, which only follows: weighted largest magnitudes.
    """

    def __init__(self, tick: Matrix, frames: int) -> None:
        """Take the map of a frame.

        Args:
            tick: The map.
            frames: Of the flight.

        Raises:
            ArithmeticError: Rounding may be as large as the responses.
        """
        self._weights = np.concatenate([weights_of(tick.mid[rows, rows]) for rows in (slice(0, LINKED), SPREAD)])
        self._residual = self._norm_of(tick.rad + gamma(N + 2) * np.abs(tick.mid))
        self._follows = self._norm_of(tick.size)[1, 0]
        self._powers = np.zeros(2)
        for index, rows in enumerate((slice(0, LINKED), SPREAD)):
            weights, residual = self._weights[rows], self._residual[index, index]
            total, now = 0.0, np.eye(len(weights))
            for _ in range(frames + 2):
                total += float(np.max(np.abs(now) @ weights / weights)) * GROW
                now = tick.mid[rows, rows] @ now
            slack = (
                1.0 - residual * total
            )  # powers P_k and computed ones C_k: |P_k| <= |C_k| + residual * the sum of |P_j| |C_i|, i + j < k
            if not slack > 0.5:
                raise ArithmeticError("rounding may be as large as the responses")
            self._powers[index] = total / slack * (1.0 + 1e-9)

    def _norm_of(self, size: Floats) -> Floats:
        """Return the norms of the four parts of a map."""
        scaled = size * self._weights / self._weights[:, None]
        ends = np.array([0, LINKED])
        return np.maximum.reduceat(np.add.reduceat(scaled, ends, axis=1), ends, axis=0) * GROW

    def norms(self, states: Floats) -> Floats:
        """Return the norms of columns. Shape (2, columns)."""
        return np.maximum.reduceat(np.abs(states) / self._weights[:, None], np.array([0, LINKED]), axis=0) * GROW

    def drift(self, largest: Floats, begun: Floats) -> Floats:
        """Return the norms of what is wrong with computed states.

        Args:
            largest: Norms of these. Shape (2, columns).
            begun: What is wrong with them at first. Shape (N, columns).
        """
        each = self._residual @ largest + self.norms(begun)
        first = self._powers[0] * each[0]
        return np.stack([first, self._powers[1] * (each[1] + self._follows * first)]) * (1.0 + 1e-9)

    def off(self, read: Matrix, largest: Floats, drift: Floats) -> Floats:
        """Return how far off what is read of computed states can be."""
        return self._read(read.size, drift) + self._read(read.rad + gamma(N + 2) * np.abs(read.mid), largest + drift)

    def _read(self, size: Floats, norms: Floats) -> Floats:
        return np.add.reduceat(size * self._weights, np.array([0, LINKED]), axis=1) @ norms * GROW


def weights_of(tick: Floats) -> Floats:
    """Return weights of states in which no power of a map is large."""
    found, now = np.full(len(tick), 1e-9), np.eye(len(tick))
    for _ in range(200):
        now = tick @ now
        found = np.maximum(found, np.abs(now).max(1))
    return found
