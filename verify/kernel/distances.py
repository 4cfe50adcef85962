"""Distances between robots whose clocks differ, for all times.

Either of all times that clocks may show together, or at each time, and then greater by as far as a robot may fly within the clocks' error.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from .flights import Path, Segment
from .polynomials import Bernstein, square
from .statement import ZERO, Statement
from .trees import Cell

BITS = 40
Row = tuple[Bernstein, Bernstein, Bernstein]
Box = Sequence[tuple[int, int]]
"""Along x, y and z from where to where, m, over 2^40."""


class Flown(NamedTuple):
    """A segment that takes time: from when to when, the segment, its places, and its box."""

    start: Fraction
    stop: Fraction
    segment: Segment
    places: Row
    box: Box


class Flight:
    """One robot's path as distances are measured: a metre in z may count more than one across. Lengths are `unit` times as long here."""

    def __init__(self, statement: Statement, path: Path) -> None:
        self.weight = Fraction(1) if statement.separation_z is None else statement.separation / statement.separation_z
        self.unit, self.path, self.rows = self.weight.denominator, path, list[Flown]()
        self.stretch = max(Fraction(1), self.weight)
        self.radius, self.loose = self.stretch * path.robot.radius, self.stretch * (statement.margin + path.steps[0])
        for one in (one for one in path.segments if one.start < one.stop):
            rows, unit = one.lines
            every = zip(rows, (self.unit, self.unit, self.weight.numerator), strict=False)
            x, y, z = (Bernstein([n * weight for n in row], unit) for row, weight in every)
            box = [((row.lowest << BITS) // unit, -((-row.highest << BITS) // unit)) for row in (x, y, z)]
            self.rows.append(Flown(one.start, one.stop, one, (x, y, z), box))
        boxes = zip(*(one.box for one in self.rows), strict=True)
        self.box = [(min(low for low, _ in axis), max(high for _, high in axis)) for axis in boxes]

    def around(self, error: Fraction) -> list[Flown]:
        """Return the segments, those of a lap's beginning once more behind its end if clocks differ."""
        lap, end = self.path.lap, self.rows[-1].stop
        again = [one for one in self.rows if lap is not None and error and lap <= one.start <= lap + error]
        later = end - (lap or ZERO)
        return self.rows + [one._replace(start=one.start + later, stop=one.stop + later) for one in again]


class Pair:
    """Two robots, and how far apart their paths must be, m; `drift` is what clocks add (Coq: `apart_moved`, `stretched_grows`)."""

    def __init__(self, separation: Fraction, flights: tuple[Flight, Flight], drift: Fraction) -> None:
        self.flights, (one, other) = flights, flights
        touching = one.radius + other.radius
        self.least = max(separation, touching) + one.loose + other.loose + one.stretch * drift
        self._square = (self.least * one.unit) ** 2
        self._gap = self._square.numerator << 2 * BITS, self._square.denominator

    def are_far(self) -> bool:
        """Return whether boxes around both paths part them."""
        return self._are_far(*(one.box for one in self.flights))

    def _are_far(self, box: Box, other: Box) -> bool:
        gaps = [max(0, low - d, c - high) for (low, high), (c, d) in zip(box, other, strict=True)]
        return sum(gap * gap for gap in gaps) * self._gap[1] >= self._gap[0]

    def at_each_time(self) -> Iterator[Cell]:
        """Yield the claims `m` that they are far enough apart at a time, where planes do not part them."""
        one = self.flights[0]
        weights = one.unit, one.unit, one.weight.numerator

        def row(a: Segment, b: Segment, _: str) -> Bernstein:
            times, both = (max(a.start, b.start), min(a.stop, b.stop)), zip(a.axes, b.axes, weights, strict=False)
            return square([(a.within(p, times) - b.within(q, times)).times(weight) for p, q, weight in both]).bernstein()

        for together in self.at_all_times(ZERO):
            a, b = together.segments
            if max(a.start, b.start) < min(a.stop, b.stop) and not together.holds("m"):
                yield Cell(partial(row, a, b), {"m": [[[("square", ">=", self._square)]]]})

    def at_all_times(self, error: Fraction) -> Iterator[Two]:
        """Yield the claims `m` that they are far enough apart at times of theirs that differ by at most an error, s, where boxes do not part them."""
        one, other = self.flights
        if self.are_far():
            return
        its = other.around(error)
        starts, stops = [b.start for b in its], [b.stop for b in its]
        for a in (a for a in one.around(error) if not self._are_far(a.box, other.box)):
            for b in its[bisect_left(stops, a.start - error) : bisect_right(starts, a.stop + error)]:
                if not self._are_far(a.box, b.box):
                    times = (a.start, a.stop), (b.start, b.stop)
                    yield Two((a.segment, b.segment), *times, a.places, b.places, error, self._square)


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
