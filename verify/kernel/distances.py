"""Distances between robots whose clocks differ, for all times.

Either of all times that clocks may show together, or at each time, and then greater by as far as a robot may fly within the clocks' error.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from .flights import Path, Segment
from .polynomials import Bernstein, square
from .statement import ZERO, Statement
from .trees import Cell

BITS = 40
Row = tuple[Bernstein, Bernstein, Bernstein]
_Flown = tuple[tuple[Fraction, Fraction], Segment, Row, list[tuple[int, int]]]
"""A segment's times, the segment, its places, and along x, y and z from where to where it is, m, over 2^40."""


class Pair:
    """Two robots, and how far apart their paths must be, m, where a metre in z may count more than one across.

    `more` is what clocks and steps add. (Coq: `apart_moved`, `stretched_grows`)
    """

    def __init__(self, statement: Statement, one: Path, other: Path, more: Fraction) -> None:
        weight = Fraction(1) if statement.separation_z is None else statement.separation / statement.separation_z
        self.paths, self._end, stretch = (one, other), one.segments[-1].stop, max(Fraction(1), weight)
        touching = (one.robot.radius + other.robot.radius) * stretch
        self.least = max(statement.separation, touching) + stretch * (2 * statement.margin + more)
        self.weights = weight.denominator, weight.denominator, weight.numerator
        self._square = (self.least * weight.denominator) ** 2  # where lengths are whole numbers of times the world's

    def at_each_time(self) -> Iterator[Cell]:
        """Yield the claims `m` that they are far enough apart at a time, where planes do not part them."""

        def row(a: Segment, b: Segment, _: str) -> Bernstein:
            times, both = (max(a.start, b.start), min(a.stop, b.stop)), zip(a.axes, b.axes, self.weights, strict=False)
            return square([(a.within(p, times) - b.within(q, times)).times(weight) for p, q, weight in both]).bernstein()

        for together in self.at_all_times(ZERO):
            a, b = together.segments
            if max(a.start, b.start) < min(a.stop, b.stop) and not together.holds("m"):
                yield Cell(partial(row, a, b), {"m": [[[("square", ">=", self._square)]]]})

    def at_all_times(self, error: Fraction) -> Iterator[Two]:
        """Yield the claims `m` that they are far enough apart at times of theirs that differ by at most an error, s, where boxes do not part them."""
        one, other = (self._flown(path, error) for path in self.paths)
        starts, stops = [own[0][0] for own in other], [own[0][1] for own in other]
        least, under = self._square.numerator << 2 * BITS, self._square.denominator
        for times, a, rows, box in one:
            near = other[bisect_left(stops, times[0] - error) : bisect_right(starts, times[1] + error)]
            for its, b, its_rows, its_box in near:
                gaps = [max(0, low - d, c - high) for (low, high), (c, d) in zip(box, its_box, strict=True)]
                if sum(gap * gap for gap in gaps) * under < least:
                    yield Two((a, b), times, its, rows, its_rows, error, self._square)

    def _flown(self, path: Path, error: Fraction) -> list[_Flown]:
        """Return a path's segments with their times and boxes, those of a lap's beginning once more behind its end."""
        found: list[_Flown] = []
        for one in (one for one in path.segments if one.start < one.stop):
            rows, unit = one.lines
            x, y, z = (Bernstein([n * w for n in row], unit) for row, w in zip(rows, self.weights, strict=False))
            box = [((row.lowest << BITS) // unit, -((-row.highest << BITS) // unit)) for row in (x, y, z)]
            found.append(((one.start, one.stop), one, (x, y, z), box))
        if error and path.lap is not None:
            lap, later = path.lap, self._end - path.lap
            found += [((a + later, b + later), one, row, box) for (a, b), one, row, box in found if lap <= a <= lap + error]
        return found


class Two(NamedTuple):
    """A part of one path and a part of another, each with its own times.

    `k`: no two clocks show these times at one moment. `m`: a plane across the way from middle to middle parts them by what is asked (Coq: `plane_parts`).
    """

    segments: tuple[Segment, Segment]
    times: tuple[Fraction, Fraction]
    its: tuple[Fraction, Fraction]
    rows: Row
    its_rows: Row
    error: Fraction
    square: Fraction

    def holds(self, mark: str) -> bool:
        """Return whether a mark is so."""
        if mark == "k":
            return max(self.times[0] - self.its[1], self.its[0] - self.times[1]) > self.error
        unit = max(row.unit for row in (*self.rows, *self.its_rows))  # units differ by powers of two
        mine, its = ([[n * (unit // row.unit) for n in row.numbers] for row in rows] for rows in (self.rows, self.its_rows))
        x, y, z = ((sum(a) - sum(b)) * 4096 // unit for a, b in zip(mine, its, strict=True))  # any would do
        near, far = ([x * a + y * b + z * c for a, b, c in zip(*rows, strict=True)] for rows in (mine, its))
        gap, least = min(near) - max(far), self.square * (x * x + y * y + z * z)
        return mark == "m" and gap > 0 and gap * gap * least.denominator >= least.numerator * unit * unit

    def halves(self) -> tuple[Two, Two]:
        """Return both halves of the part that lasts longer."""
        mine = self.times[1] - self.times[0] >= self.its[1] - self.its[0]
        (start, stop), (x, y, z) = (self.times, self.rows) if mine else (self.its, self.its_rows)
        (a, p), (b, q), (c, r) = x.halves(), y.halves(), z.halves()
        first, second, middle = (a, b, c), (p, q, r), (start + stop) / 2
        if mine:
            return self._replace(times=(start, middle), rows=first), self._replace(times=(middle, stop), rows=second)
        return self._replace(its=(start, middle), its_rows=first), self._replace(its=(middle, stop), its_rows=second)
