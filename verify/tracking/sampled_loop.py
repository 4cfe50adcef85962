"""Linear loops as they are sampled, and bounds on what comes of their inputs: l1 kernels with every rounding counted.

A loop has a state, a map for each step of 2 ms on board, and a jump at each command, 50 times a second. An input acts in steps or at
commands. The kernel of an input and an output holds, for each number of commands between them, the largest sum of magnitudes by which
inputs within 1 can move the output: no input moves it by more, and the signs of the response reach it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, gamma

SUBSTEPS = 10
"""Steps on board between two commands."""
STEP = fmpq(1, 500)
"""s."""
TICK = 0.02
"""s between two commands."""
REMEMBERED = 500
"""Commands for which kernels are summed one by one; what is later is bounded by a geometric series."""
_AT_ONCE = 8
"""Commands whose kernels are read off at once, as many as fit a processor's cache."""

GROW = 1.0 + 2.0**-40
_TINY = 1e-290


@dataclass(frozen=True, eq=False, slots=True)
class Matrix:
    """Matrix of floats, each within `rad` of `mid`.

    Attributes:
        mid: Shape (rows, columns).
        rad: The same shape, not negative.
    """

    mid: Floats
    rad: Floats

    @classmethod
    def of(cls, values: arb_mat) -> Matrix:
        """Enclose a matrix of balls."""
        mid, rad = np.empty((values.nrows(), values.ncols())), np.empty((values.nrows(), values.ncols()))
        for i in range(values.nrows()):
            for j in range(values.ncols()):
                number = values[i, j]
                mid[i, j] = float(number.mid())
                rad[i, j] = float((number - arb(mid[i, j])).abs_upper()) * GROW + _TINY
        return cls(mid, rad)

    @classmethod
    def exact(cls, values: Floats) -> Matrix:
        """Take floats as they are."""
        return cls(values, np.zeros_like(values))

    @property
    def T(self) -> Matrix:  # noqa: N802  # as of arrays
        """Transpose."""
        return Matrix(self.mid.T, self.rad.T)

    def __matmul__(self, other: Matrix) -> Matrix:
        mid = self.mid @ other.mid
        size, size_other = np.abs(self.mid), np.abs(other.mid)
        rad = self.rad @ (size_other + other.rad) + size @ other.rad + gamma(self.mid.shape[1] + 2) * (size @ size_other)
        return Matrix(mid, rad * GROW + _TINY)

    @property
    def size(self) -> Floats:
        """Upper bounds of the magnitudes."""
        return (np.abs(self.mid) + self.rad) * GROW + _TINY


@dataclass(frozen=True, eq=False, slots=True)
class SampledLoop:
    """A linear loop.

    Attributes:
        states: Their names.
        step: Map of a step on board. Shape (n, n).
        jump: Map of a command. Shape (n, n).
        recorded: Pairs of states: the second takes the value of the first, as the cameras see it.
        seen: After which step of the ten they see it: 10 minus the latency; 0 is just after the command.
        stepped: Inputs that act in every step, by name: what a step of them within 1 leaves at its end. Shape (n,) each.
        commanded: Inputs that act at commands, by name: what they leave after the jump. Shape (n,) each.
        outputs: Rows of what is bounded at the ends of steps and after jumps, by name. Shape (n,) each.
        before: Rows of what is read off before a jump, by name. Shape (n,) each.
        direct: What an input of a command adds to these: (output, input) to a number.
    """

    states: tuple[str, ...]
    step: Matrix
    jump: Matrix
    recorded: tuple[tuple[int, int], ...]
    seen: int
    stepped: Mapping[str, Matrix]
    commanded: Mapping[str, Matrix]
    outputs: Mapping[str, Floats]
    before: Mapping[str, Floats] = field(default_factory=dict)
    direct: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def record(self, values: Matrix) -> Matrix:
        """Return states after the cameras have seen them."""
        if not self.recorded:
            return values
        mid, rad = values.mid.copy(), values.rad.copy()
        for source, target in self.recorded:
            mid[target], rad[target] = mid[source], rad[source]
        return Matrix(mid, rad)


@dataclass(frozen=True, eq=False, slots=True)
class Kernels:
    """The l1 kernels of a loop.

    Attributes:
        outputs: Their names.
        inputs: Their names.
        sums: By commands between them. Shape (outputs, inputs, ticks).
        tails: All later ones together. Shape (outputs, inputs).
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    sums: Floats
    tails: Floats

    def gain(self, output: str, source: str) -> float:
        """Return the l1 gain from an input to an output."""
        row, column = self.outputs.index(output), self.inputs.index(source)
        return float(self.sums[row, column].sum() * (1.0 + 1e-9) + self.tails[row, column])

    def moved(self, output: str, source: str, bound: Floats) -> Floats:
        """Bound what an input moves an output by, but for the tail. Shape (ticks,).

        Args:
            output: Its name.
            source: The input's.
            bound: Of the input at each command. Shape (ticks,).
        """
        kernel = self.sums[self.outputs.index(output), self.inputs.index(source)]
        last = int(np.max(np.flatnonzero(bound), initial=0))  # many inputs act in the first command alone
        found = np.concatenate([np.convolve(kernel, bound[: last + 1]), np.zeros(len(bound))])
        return found[: len(bound)]

    def response(self, driven: Mapping[str, Floats], ticks: int) -> dict[str, Floats]:
        """Bound all outputs under inputs within bounds at each command; the rounding of sums is not counted.

        Args:
            driven: By input. Shape (ticks,) each.
            ticks: Commands of the flight.
        """
        found = {output: np.zeros(ticks) for output in self.outputs}
        for (row, output), (name, bound) in product(enumerate(self.outputs), driven.items()):
            last = self.tails[row, self.inputs.index(name)] * float(bound.max())
            found[output] += self.moved(output, name, bound) + last
        return found

    def near_response(self, driven: Mapping[str, Floats], ticks: int) -> dict[str, Floats]:
        """Return nearly the same by Fourier transforms, block by block; nothing is known of their rounding.

        Args:
            driven: By input. Shape (ticks,) each.
            ticks: Commands of the flight.
        """
        spectra, lags, inputs = _spectra(self), self.sums.shape[-1], len(self.inputs)
        size = 2 * (len(spectra) - 1)
        block = size - lags + 1
        bounds = np.zeros((inputs, -(-ticks // block) * block))
        for name, bound in driven.items():
            bounds[self.inputs.index(name), :ticks] = bound
        with np.errstate(invalid="ignore", over="ignore"):  # where bounds are not finite, nor is what comes of them
            parts = np.fft.rfft(bounds.reshape(inputs, -1, block), size).transpose(2, 0, 1)
            pieces = np.fft.irfft((spectra @ parts).transpose(1, 2, 0), size)
            later = self.tails @ bounds.max(axis=1)
        found = np.zeros((len(self.outputs), bounds.shape[1] + size))
        for start, piece in zip(range(0, ticks, block), pieces.swapaxes(0, 1), strict=True):
            found[:, start : start + size] += piece
        return dict(zip(self.outputs, found[:, :ticks] + later[:, None], strict=True))


@lru_cache(maxsize=6)
def _spectra(kernels: Kernels) -> NDArray[np.complex128]:
    """Return kernels' Fourier transforms. Shape (frequencies, outputs, inputs)."""
    size = 2 ** math.ceil(math.log2(2 * kernels.sums.shape[-1]))
    return np.ascontiguousarray(np.fft.rfft(kernels.sums, size).transpose(2, 0, 1))


class TickMaps:
    """Maps of one command of a loop, and bounds on what rounding does to a state that goes on through them.

    A computed state satisfies the loop but for a residual in every command. The residuals are inputs, whose effect the sum of the norms of all powers
    bounds: with P the map of a command, the sum over P^i is at most the product of 1 + |P^(2^j)| for j < c, over 1 - |P^(2^c)|.
    """

    def __init__(self, loop: SampledLoop) -> None:
        """Compose the maps.

        Raises:
            ArithmeticError: The loop is not shown to settle.
        """
        self.loop = loop
        maps = _composed(loop)
        self.tick = maps[-1]
        rows = Matrix.exact(np.array([*loop.outputs.values()]))
        parts = [rows @ one for one in maps]
        self.read = Matrix(np.concatenate([p.mid for p in parts]), np.concatenate([p.rad for p in parts]))
        self.before = Matrix.exact(np.array([*loop.before.values()]).reshape(-1, len(loop.states)))
        self.weights, self.commands, self.share, self.powers = _contraction(self.tick)
        if not self.share < 1.0:
            raise ArithmeticError("the loop is not shown to settle")
        w, chain = self.weights, gamma(len(loop.states) + 2)
        self._residual = float(np.max(((self.tick.rad + chain * np.abs(self.tick.mid)) @ w) / w)) * GROW
        reach = (self.read.size @ w).reshape(len(maps), -1).max(0)
        lost = ((self.read.rad + chain * np.abs(self.read.mid)) @ w).reshape(len(maps), -1).max(0)
        first = np.abs(self.before.mid) @ w
        self.reach = np.concatenate([reach, first]) * GROW  # of outputs, then of those before a jump
        self._lost = np.concatenate([lost, chain * first]) * GROW

    def norm(self, states: Floats) -> Floats:
        """Return the weighted norm of each column."""
        return np.max(np.abs(states) / self.weights[:, None], axis=0) * GROW

    def drift(self, largest: Floats, begun: Floats | float = 0.0) -> Floats:
        """Return the weighted norm of what is wrong with computed states; arguments as in `error`."""
        return self.powers * (self._residual * largest + begun) * (1.0 + 1e-9)

    def error(self, largest: Floats, begun: Floats | float = 0.0) -> Floats:
        """Return how far outputs can be off that are read from computed states. Shape (outputs, columns).

        Args:
            largest: Largest weighted norm of the computed states, and of what was put in at once. Shape (columns,).
            begun: Weighted norm of the error in them at first, and in what is put in at each command.
        """
        off = self.drift(largest, begun)
        return self.reach[:, None] * off + self._lost[:, None] * (largest + off)


def kernels_of(loop: SampledLoop, ticks: int, remembered: int = REMEMBERED) -> Kernels:
    """Return the l1 kernels of a loop for a flight of some commands.

    Args:
        loop: The loop.
        ticks: Commands of the flight.
        remembered: Kernels are summed one by one for so many of them.

    Raises:
        ArithmeticError: The loop is not shown to settle.
    """
    maps, kept = TickMaps(loop), min(ticks, remembered)
    first, entered = _first(loop)
    begun = np.max(entered.rad / maps.weights[:, None], axis=0)
    states = np.empty((kept, *entered.mid.shape))
    states[0] = entered.mid
    for lag in range(1, kept):
        states[lag] = maps.tick.mid @ states[lag - 1]
    largest = maps.norm(np.max(np.abs(states), axis=0))
    values = np.concatenate([first[None], *(_lags(maps, states[lag : lag + _AT_ONCE]) for lag in range(0, kept - 1, _AT_ONCE))])
    off = _summed(maps.error(largest, begun).T, loop)
    later = np.zeros(off.shape)
    if kept < ticks:
        block, after = np.zeros(len(begun)), states[-1]
        for _ in range(maps.commands):
            block = block + maps.norm(after) + maps.drift(largest, begun)
            after = maps.tick.mid @ after
        later = _summed((maps.reach[:, None] * block).T, loop) / (1.0 - maps.share) * (1.0 + 1e-9)
    sums = np.ascontiguousarray(((values[:kept] + off) * (1.0 + 1e-12)).transpose(2, 1, 0))
    return Kernels((*loop.outputs, *loop.before), (*loop.stepped, *loop.commanded), sums, later.T)


def _first(loop: SampledLoop) -> tuple[Floats, Matrix]:
    """Return the kernels within the command at which inputs begin, shape (inputs, outputs), and the states at its end, of each input."""
    stepped, commanded = [*loop.stepped.values()], [*loop.commanded.values()]
    starts = len(stepped) * SUBSTEPS
    shape = len(loop.states), starts + len(commanded)
    state = Matrix(np.zeros(shape), np.zeros(shape))
    for column, what in enumerate(commanded, start=starts):
        state.mid[:, column], state.rad[:, column] = what.mid[:, 0], what.rad[:, 0]
    state = loop.record(state) if loop.seen == 0 else state
    rows = Matrix.exact(np.array([*loop.outputs.values()]))
    peaks = _summed((rows @ state).size.T, loop)
    for step in range(SUBSTEPS):
        state = loop.step @ state
        for column, what in zip(range(step, starts, SUBSTEPS), stepped, strict=True):
            state.mid[:, column], state.rad[:, column] = what.mid[:, 0], what.rad[:, 0]
        if step + 1 == loop.seen:
            state = loop.record(state)
        peaks = np.maximum(peaks, _summed((rows @ state).size.T, loop))
    direct = [
        [abs(loop.direct.get((output, name), 0.0)) for output in loop.before] for name in (*loop.stepped, *loop.commanded)
    ]
    return np.concatenate([peaks, np.array(direct).reshape(len(peaks), -1)], axis=1), state


def _lags(maps: TickMaps, states: Floats) -> Floats:
    """Return the kernels of lags from the states before their commands. Shape (lags, inputs, outputs)."""
    before = states.swapaxes(1, 2)
    moved = _summed(np.abs(before @ maps.read.mid.T), maps.loop)
    moved = np.max(moved.reshape(len(states), -1, SUBSTEPS + 1, len(maps.loop.outputs)), axis=2)
    return np.concatenate([moved, _summed(np.abs(before @ maps.before.mid.T), maps.loop)], axis=2)


def _summed(size: Floats, loop: SampledLoop) -> Floats:
    """Return sums of magnitudes over the steps in which an input can begin. Shape (..., columns, rows) to (..., inputs, rows)."""
    starts = len(loop.stepped) * SUBSTEPS
    steps = size[..., :starts, :].reshape(*size.shape[:-2], len(loop.stepped), SUBSTEPS, size.shape[-1]).sum(-2)
    return np.concatenate([steps, size[..., starts:, :]], axis=-2) * GROW


def _composed(loop: SampledLoop) -> list[Matrix]:
    """Return the maps from before a command to after its jump and after each of its steps."""
    now = loop.record(loop.jump) if loop.seen == 0 else loop.jump
    maps = [now]
    for step in range(SUBSTEPS):
        now = loop.step @ now
        if step + 1 == loop.seen:
            now = loop.record(now)
        maps.append(now)
    return maps


def _contraction(tick: Matrix) -> tuple[Floats, int, float, float]:
    """Return weights of states; after how many commands a state is which share of what it was, in that norm; and a bound on the norms of all powers, summed."""
    squares = [tick]
    for _ in range(9):
        squares.append(squares[-1] @ squares[-1])
    weights = np.max(np.abs(squares[0].mid) + np.abs(squares[2].mid) + np.abs(squares[4].mid), axis=1)
    weights = np.where(weights > 1e-9, weights, np.min(weights[weights > 1e-9], initial=1.0))  # a state that no other one moves
    powers, share = 1.0, 1.0
    for doubled, square in enumerate(squares):
        share = float(np.max((square.size @ weights) / weights)) * GROW
        if share < 0.5:
            return weights, 2**doubled, share, powers / (1.0 - share) * (1.0 + 1e-9)
        powers *= 1.0 + share
    return weights, 2**9, share, powers / (1.0 - share) * (1.0 + 1e-9) if share < 1.0 else np.inf
