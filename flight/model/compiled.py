"""Arithmetic of arrays as one compiled function, for few vehicles: CasADi, of which this is the only importer in `flight`.

Hundreds of small NumPy calls a step cost a hundred times what they compute where one robot flies. So a step is written once, for arrays; it
is called with arrays of symbols, and what it does to them is kept as a list of operations on single numbers, which CasADi carries out
in the same order. Every operation is rounded as NumPy rounds it (sums, products, quotients, roots), so the numbers are NumPy's to the
last bit. Sines and exponentials are not, and are rejected.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import casadi as ca
import numpy as np

from flight.model.attitude import Floats


class Compiled:
    """A step of vehicles, compiled: from their rows and what acts on them to their rows after it."""

    def __init__(self, step: Callable[[Floats, Floats], Floats], rows: int, acting: int) -> None:
        """Trace a step.

        Args:
            step: Told rows of shape (rows, n) and (acting, n); returns (rows, n). Its arithmetic is to be element by element, of sums,
                products, quotients, roots and extremes, and its new arrays made by `empty_like`.
            rows: How many numbers a vehicle has.
            acting: How many act on it.
        """
        self._rows, self._acting = rows, acting
        with _as_written():
            before, push = ca.SX.sym("before", rows), ca.SX.sym("push", acting)
            after = step(_traced(before), _traced(push))
            self._step = ca.Function("step", [before, push], [ca.vertcat(*after.ravel().tolist())])

    def flight(self, vehicles: int) -> CompiledFlight:
        """Return what steps so many vehicles."""
        return CompiledFlight(self._step.map(vehicles), (vehicles, self._rows), (vehicles, self._acting))

    def repeated(self, rows: Floats, acting: Floats, count: int) -> Floats:
        """Return the rows after some steps. Shape (rows, n).

        Args:
            rows: Before the first. Shape (rows, n).
            acting: On all of them alike. Shape (acting, n).
            count: How many steps.
        """
        return self.flight(rows.shape[1]).steps(rows, acting, count)[-1]


class CompiledFlight:
    """Memory of a compiled step for some vehicles."""

    def __init__(self, step: Any, rows: tuple[int, int], acting: tuple[int, int]) -> None:  # a CasADi function
        self._before, self._push, self._after = np.zeros(rows), np.zeros(acting), np.zeros(rows)
        self._buffer, self._trigger = step.buffer()
        self._buffer.set_arg(0, self._before.data)
        self._buffer.set_arg(1, self._push.data)
        self._buffer.set_res(0, self._after.data)

    def step(self, rows: Floats, acting: Floats) -> Floats:
        """Return the rows after one step. Shapes (rows, n) and (acting, n)."""
        self._before[...], self._push[...] = rows.T, acting.T
        self._trigger()
        return self._after.T.copy()

    def steps(self, rows: Floats, acting: Floats, count: int) -> Floats:
        """Return the rows after each of some steps. Shape (count, rows, n).

        Args:
            rows: Before the first. Shape (rows, n).
            acting: On all of them alike. Shape (acting, n).
            count: How many steps.
        """
        self._before[...], self._push[...] = rows.T, acting.T
        found = np.empty((count, *self._after.shape))
        for k in range(count):
            self._trigger()
            self._before[...] = found[k] = self._after
        return found.transpose(0, 2, 1)


class _Traced(np.ndarray):
    """An array of symbols: what NumPy does to it element by element is done to each."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any) -> Any:
        if method != "__call__" or options or (ufunc not in _DIRECT and ufunc not in _BY_NAME):
            raise TypeError(f"{ufunc.__name__} is not compiled.")
        known = [np.asarray(one, dtype=object) for one in inputs]
        found = np.asarray(ufunc(*known) if ufunc in _DIRECT else _BY_NAME[ufunc](*known), dtype=object)
        if out is None:
            return found.view(_Traced)
        out[0].view(np.ndarray)[...] = found
        return out[0]

    def __array_function__(self, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if func is np.where:
            return np.asarray(_WHERE(*(np.asarray(one, dtype=object) for one in args)), dtype=object).view(_Traced)
        return super().__array_function__(func, types, args, kwargs)


_DIRECT = {np.add, np.subtract, np.multiply, np.divide, np.negative}
_BY_NAME: dict[np.ufunc, Any] = {
    np.minimum: np.frompyfunc(ca.fmin, 2, 1),
    np.maximum: np.frompyfunc(ca.fmax, 2, 1),
    np.sqrt: np.frompyfunc(ca.sqrt, 1, 1),
    np.less: np.frompyfunc(ca.lt, 2, 1),
}
"""Of numbers that are no numbers extremes say otherwise than NumPy's; who flies such is to ask NumPy."""
_WHERE: Any = np.frompyfunc(ca.if_else, 3, 1)


def _traced(symbols: Any) -> Any:
    values = np.empty((symbols.numel(), 1), dtype=object)
    for i in range(len(values)):
        values[i, 0] = symbols[i]
    return values.view(_Traced)


@contextmanager
def _as_written() -> Generator[None]:
    """Let CasADi keep every operation as it stands: what it would simplify may round otherwise."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
