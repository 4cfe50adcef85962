"""Responses of a loop on board: largest sums of what inputs do over a flight, every rounding counted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from verify.arithmetic.balls import Floats, gamma
from verify.tracking.on_board.onboard_loop import LINKED, PLACE, SPREAD, SUBSTEPS, Frame, N, total
from verify.tracking.sampled_loop import GROW, Matrix

STEPPED, JUMPED = ("motion", "asked", "turned", "lift"), ("estimate", "spread")
"""Inputs of steps and of jumps of which something is known, in this order."""
KEPT = 6001
"""Frames for which responses are summed one by one; what is later is bounded by norms."""


class Responses:
    """Largest sums of magnitudes of what inputs do, at all steps and after all jumps.

    Attributes:
        peaks: By input: to each output, then to what is read before jumps. Shape (rows, k) each.
        begun: Largest magnitudes of what a start off by 1 does. Shape (rows, 3).
        steady: By input that is constant from the first step on: largest magnitudes. Shape (rows,) each.
        places: By input: to the place, as a vector, of inputs whose length is at most 1.
        lengths: By input: to the place, as a vector, of each component within 1. Shape (k,) each.
    """

    def __init__(self, frame: Frame, frames: int, outputs: Floats, ends: Floats, kept: int = KEPT) -> None:
        """Sum responses.

        Args:
            frame: The loop.
            frames: Of the flight.
            outputs: Rows of what is bounded after jumps and steps; the first three are the place. Shape (rows, N).
            ends: Rows of what is bounded before a jump. Shape (rows, N).
            kept: Frames that are summed one by one.

        Raises:
            ArithmeticError: The loop is not shown to settle.
        """
        self._frame = frame
        maps = [Matrix.exact(np.eye(N))]
        for step in range(1, SUBSTEPS + 1):
            maps.append(frame.see(frame.step @ maps[-1], step))
        self.tick = frame.jump @ maps[-1]
        rows = Matrix.exact(outputs)
        parts = [rows @ m for m in maps] + [Matrix.exact(ends) @ maps[-1]]
        self._rows, self._ends = rows, Matrix.exact(ends)
        self._read = Matrix(np.concatenate([m.mid for m in parts]), np.concatenate([m.rad for m in parts]))
        self._sum(frames, kept)

    def _direct(self, now: Matrix, first: int) -> Iterator[tuple[int, Floats, Matrix]]:
        """Yield what a column does at steps until the next jump, and the states at the end."""
        for step in range(first, SUBSTEPS + 1):
            now = self._frame.see(now if step == first else self._frame.step @ now, step)
            yield step, (self._rows @ now).size, now

    def _entered(self) -> tuple[Matrix, list[tuple[str, int]], dict[str, _Sums]]:
        """Return columns of all inputs after the next jump, whose they are, and what they do before it."""
        frame, columns, whose = self._frame, list[Matrix](), list[tuple[str, int]]()
        sums = {name: _Sums(len(self._rows.mid), len(self._ends.mid), c.mid.shape[1]) for name, c in self._columns()}
        for name, column in frame.stepped.items():
            for first in range(1, SUBSTEPS + 1):
                now = column
                for step, size, state in self._direct(column, first):
                    sums[name].add(step, size)
                    now = state
                sums[name].ends += (self._ends @ now).size
                columns.append(frame.jump @ now)
                whose.append((name, column.mid.shape[1]))
        for name, column in frame.jumped.items():
            columns.append(column)
            whose.append((name, column.mid.shape[1]))
        return _beside(columns), whose, sums

    def _columns(self) -> list[tuple[str, Matrix]]:
        return [*self._frame.stepped.items(), *self._frame.jumped.items()]

    def _sum(self, frames: int, kept: int) -> None:
        entered, whose, sums = self._entered()
        forced, at_once = self._constant()
        begin = np.zeros((N, 3))
        for rows in (PLACE, slice(23, 26), slice(36, 39), slice(42, 45)):
            begin[rows] = np.eye(3)
        width, count = entered.mid.shape[1], min(frames + 1, kept)
        first = _beside([entered, Matrix.exact(begin), forced])
        self._rounding = rounding = _Rounding(self.tick, frames, count)
        state, largest = first.mid, np.zeros((2, first.mid.shape[1]))
        start, steady, most = np.zeros((len(self._read.mid), 3)), np.zeros_like(at_once), np.abs(at_once)
        for _ in range(count):
            signed = self._read.mid @ state
            moved = np.abs(signed)
            at = 0
            for name, size in whose:
                sums[name].take(moved[:, at : at + size])
                at += size
            start = np.maximum(start, moved[:, width : width + 3])
            steady = steady + signed[:, width + 3 :]
            most = np.maximum(most, np.abs(steady + at_once))
            largest = np.maximum(largest, rounding.norms(state))
            state = self.tick.mid @ state
        drift = rounding.drift(largest, first.rad)
        later = count * rounding.off(self._read, largest, drift)
        if frames + 1 > count:
            later = later + rounding.reach(self._read, rounding.rest(state, drift))
        later = later * (1.0 + 1e-9)
        at = 0
        for name, size in whose:
            sums[name].take(later[:, at : at + size])
            at += size
        self.peaks = {name: one.peaks() for name, one in sums.items()}
        self.places = {name: float(one.place.max()) * (1.0 + 1e-9) for name, one in sums.items()}
        self.lengths = {name: one.lengths.max(0) * (1.0 + 1e-9) for name, one in sums.items()}
        self.begun = self._most(start + later[:, width : width + 3])
        constant = self._most(most + later[:, width + 3 :]) + 1e-12
        self.steady = {name: constant[:, k] for k, name in enumerate(self._frame.constant)}

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
            states[k + 1] = self.tick.mid @ states[k] + entered.mid @ one
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

    def _most(self, values: Floats) -> Floats:
        """Return the largest of each output over the steps, and what is read before jumps."""
        outputs = len(self._rows.mid)
        whole = values[: (SUBSTEPS + 1) * outputs].reshape(SUBSTEPS + 1, outputs, -1).max(0)
        return np.concatenate([whole, values[(SUBSTEPS + 1) * outputs :]]) * (1.0 + 1e-9)

    def _constant(self) -> tuple[Matrix, Floats]:
        """Return what inputs that are constant leave after the next jump, and what they do before it."""
        frame, whole = self._frame, _beside([*self._frame.constant.values()])
        now = Matrix.exact(np.zeros(whole.mid.shape))
        found = [self._rows.mid @ now.mid]
        for step in range(1, SUBSTEPS + 1):
            now = frame.see(total(frame.step @ now, whole), step)
            found.append(self._rows.mid @ now.mid)
        found.append(self._ends.mid @ now.mid)
        return frame.jump @ now, np.concatenate(found)  # its rounding is far below the slack of what is constant


class _Sums:
    """Sums of what an input does.

    Attributes:
        whole: To each output, at each step. Shape (SUBSTEPS + 1, outputs, k).
        ends: To what is read before jumps. Shape (ends, k).
        place: Norms of the map to the place, at each step. Shape (SUBSTEPS + 1,).
        lengths: By column, lengths of what it does to the place. Shape (SUBSTEPS + 1, k).
    """

    def __init__(self, outputs: int, ends: int, size: int) -> None:
        self.whole, self.ends = np.zeros((SUBSTEPS + 1, outputs, size)), np.zeros((ends, size))
        self.place, self.lengths = np.zeros(SUBSTEPS + 1), np.zeros((SUBSTEPS + 1, size))

    def add(self, step: int, size: Floats) -> None:
        """Add magnitudes at a step."""
        self.whole[step] += size
        near = size[:3]
        self.place[step] += np.sqrt(near.sum(0).max() * near.sum(1).max())
        self.lengths[step] += np.sqrt((near**2).sum(0))

    def take(self, size: Floats) -> None:
        """Add magnitudes at all steps, and before a jump."""
        steps, outputs, width = self.whole.shape
        whole = size[: steps * outputs].reshape(steps, outputs, width)
        self.whole += whole
        self.ends += size[steps * outputs :]
        near = whole[:, :3]
        self.place += np.sqrt(near.sum(1).max(1) * near.sum(2).max(1))
        self.lengths += np.sqrt((near**2).sum(1))

    def peaks(self) -> Floats:
        """Return the largest at any step. Shape (outputs and ends, k)."""
        return np.concatenate([self.whole.max(0), self.ends]) * (1.0 + 1e-9)


def _beside(columns: Sequence[Matrix]) -> Matrix:
    return Matrix(np.concatenate([c.mid for c in columns], axis=1), np.concatenate([c.rad for c in columns], axis=1))


class _Rounding:
    """Bounds on what rounding does to states that go on frame by frame, and on all that is later.

    Norms are those of the states that act on each other, and of the covariance, which only follows: weighted largest magnitudes.
    """

    def __init__(self, tick: Matrix, frames: int, kept: int) -> None:
        """Take the map of a frame.

        Args:
            tick: The map.
            frames: Of the flight.
            kept: Frames that are summed one by one.

        Raises:
            ArithmeticError: Rounding may be as large as the responses.
        """
        self._weights = np.concatenate([_weights(tick.mid[rows, rows]) for rows in (slice(0, LINKED), SPREAD)])
        self._residual = self._norm_of(tick.rad + gamma(N + 2) * np.abs(tick.mid))
        self._follows = self._norm_of(tick.size)[1, 0]
        self._powers, self._later = np.zeros(2), np.zeros(2)
        for index, rows in enumerate((slice(0, LINKED), SPREAD)):
            weights, residual = self._weights[rows], self._residual[index, index]
            total, later, now = 0.0, 0.0, np.eye(len(weights))
            for frame in range(frames + 2):
                size = float(np.max(np.abs(now) @ weights / weights)) * GROW
                total += size
                later += size if frame <= frames - kept + 1 else 0.0
                now = tick.mid[rows, rows] @ now
            slack = (
                1.0 - residual * total
            )  # powers P_k and computed ones C_k: |P_k| <= |C_k| + residual * the sum of |P_j| |C_i|, i + j < k
            if not slack > 0.5:
                raise ArithmeticError("rounding may be as large as the responses")
            self._powers[index] = total / slack * (1.0 + 1e-9)
            self._later[index] = (later + residual * total * total / slack) / slack * (1.0 + 1e-9)

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

    def reach(self, read: Matrix, norms: Floats) -> Floats:
        """Return what is read of states within norms. Shape (rows, columns)."""
        return self._read(read.size, norms)

    def off(self, read: Matrix, largest: Floats, drift: Floats) -> Floats:
        """Return how far off what is read of computed states can be."""
        return self._read(read.size, drift) + self._read(read.rad + gamma(N + 2) * np.abs(read.mid), largest + drift)

    def _read(self, size: Floats, norms: Floats) -> Floats:
        return np.add.reduceat(size * self._weights, np.array([0, LINKED]), axis=1) @ norms * GROW

    def rest(self, state: Floats, drift: Floats) -> Floats:
        """Return the norms of all later states of the flight, summed.

        Args:
            state: The first of them, as it is computed.
            drift: As it was found.
        """
        now = self.norms(state) + drift
        first = self._later[0] * now[0]
        return np.stack([first, self._powers[1] * (now[1] + self._follows * first)]) * (1.0 + 1e-9)


def _weights(tick: Floats) -> Floats:
    """Return weights of states in which no power of a map is large."""
    found, now = np.full(len(tick), 1e-9), np.eye(len(tick))
    for _ in range(200):
        now = tick @ now
        found = np.maximum(found, np.abs(now).max(1))
    return found
