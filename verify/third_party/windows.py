"""Times at which pieces are compared with others: always, or only above a height, and never where a column is checked in their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic import exact
from verify.arithmetic.balls import Floats
from verify.third_party.fleet import Fleet, Indices

BLOCK = 65_536
"""Pieces that are looked at at once, which bounds the memory."""

_WIDTH = Fraction(1, 2**60)


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """A stretch of each piece, outside of which it is not compared with others.

    Attributes:
        starts: Exact, in s, each the sum of two floats. Shape (rows, 2).
        stops: The same.
        kept: Whether there is any. Shape (rows,).
        tops: No point of the piece is higher, in m. Shape (rows,).
    """

    starts: Floats
    stops: Floats
    kept: NDArray[np.bool_]
    tops: Floats


def windows_of(fleet: Fleet, above: float | None, covered: NDArray[np.bool_] | None = None) -> Windows:
    """Return when pieces are compared with others.

    A piece that crosses the height is cut at its first and last crossing, at the next float outside.

    Args:
        fleet: The drones.
        above: From which height on, in m; None for any.
        covered: Rows that are left out. Shape (rows,).
    """
    starts, stops = fleet.knots[fleet.knot].copy(), fleet.knots[fleet.knot + 1].copy()
    kept = np.ones(len(fleet.values), dtype=bool) if covered is None else ~covered
    tops = np.full(len(fleet.values), np.inf)
    if above is None:
        return Windows(starts, stops, kept, tops)
    for first in range(0, len(kept), BLOCK):
        rows = np.arange(first, min(first + BLOCK, len(kept)))
        heights = fleet.positions(rows)[:, 2]
        low, tops[rows] = heights.low.min(-1), heights.high.max(-1)
        kept[rows] &= ~(tops[rows] < above)
        for row in rows[kept[rows] & ~(low >= above)].tolist():
            span = _higher(fleet, row, Fraction(above))
            if span is None:
                kept[row] = False
                continue
            begin, length = fleet.start(row), fleet.stop(row) - fleet.start(row)
            if span[0] > 0:
                starts[row] = max(float(np.nextafter(float(begin + length * span[0]), -np.inf)), float(starts[row, 0])), 0.0
                if Fraction(float(starts[row, 0])) < begin:
                    starts[row] = fleet.knots[fleet.knot[row]]
            if span[1] < 1:
                stops[row] = float(np.nextafter(float(begin + length * span[1]), np.inf)), 0.0
                if Fraction(float(stops[row, 0])) > begin + length:
                    stops[row] = fleet.knots[fleet.knot[row] + 1]
    return Windows(starts, stops, kept, tops)


def _higher(fleet: Fleet, row: int, above: Fraction) -> tuple[Fraction, Fraction] | None:
    """Return shares of a piece between which it is no lower than a height, outermost; None where it never is."""
    over = fleet.exactly(row)[2] - exact.rational(above)
    if over.degree() < 1:
        return (Fraction(0), Fraction(1)) if over(0) >= 0 else None
    found = exact.roots(over, Fraction(0), Fraction(1), _WIDTH)
    first = Fraction(0) if over(0) >= 0 else min((r.low for r in found), default=None)
    last = Fraction(1) if over(1) >= 0 else max((r.high for r in found), default=None)
    return None if first is None or last is None else (max(first, Fraction(0)), min(last, Fraction(1)))


def is_high(fleet: Fleet, rows: Sequence[int], time: Fraction, above: Fraction) -> bool:
    """Return whether drones are all no lower than a height at a time, exactly.

    Args:
        fleet: The drones.
        rows: Pieces that last then.
        time: In s.
        above: In m.
    """
    for row in rows:
        begin, length = fleet.start(row), fleet.stop(row) - fleet.start(row)
        if exact.fraction(fleet.exactly(row)[2](exact.rational((time - begin) / length))) < above:
            return False
    return True


def crossings(fleet: Fleet, row: int, above: Fraction) -> list[Fraction]:
    """Return times at which a piece crosses or touches a height, up to 2^-60 of its length, in s.

    Args:
        fleet: The drones.
        row: The piece.
        above: In m.
    """
    begin, length = fleet.start(row), fleet.stop(row) - fleet.start(row)
    over = fleet.exactly(row)[2] - exact.rational(above)
    if over.degree() < 1:
        return []
    return [begin + length * (r.low + r.high) / 2 for r in exact.roots(over, Fraction(0), Fraction(1), _WIDTH)]


def high_drones(windows: Windows, above: float | None, first: Indices, last: Indices) -> Indices:
    """Return which of some runs of pieces reach a height.

    Args:
        windows: When pieces are compared with others.
        above: In m; None for any.
        first: First row of each run. Shape (k,).
        last: Last row. Shape (k,).
    """
    if above is None:
        return np.arange(len(first))
    tops = np.maximum(windows.tops[first], windows.tops[last])
    for run in np.flatnonzero(last - first > 1).tolist():
        tops[run] = windows.tops[first[run] : last[run] + 1].max()
    return np.flatnonzero(~(tops < above))
