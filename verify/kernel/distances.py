"""Distances between robots, of all times that their clocks, which differ, may show at one moment."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from .flights import Path
from .polynomials import Bernstein, Polynomial, common, root, square
from .statement import ZERO, Statement, at_least

BITS = 40
Box = Sequence[tuple[int, int]]
"""Along x, y and z from where to where, m, over 2^40."""


class Flown(NamedTuple):
    """A part of a path that takes time: from when to when, its places along x, y and z, and a box around them."""

    start: Fraction
    stop: Fraction
    places: Sequence[Bernstein]
    box: Box

    def halves(self) -> list[Flown]:
        """Return both halves."""
        middle = (self.start + self.stop) / 2
        times, places = ((self.start, middle), (middle, self.stop)), zip(*(row.halves() for row in self.places), strict=True)
        return [Flown(*when, where, self.box) for when, where in zip(times, places, strict=True)]


class Flight:
    """One robot's path as distances are measured: a metre in z may count more than one across. Lengths are `unit` times as long here.

    Its robot is within `loose` of a place that the path has then: it may be within the margin of any place of a step.
    """

    def __init__(self, statement: Statement, path: Path) -> None:
        weight = Fraction(1) if statement.separation_z is None else statement.separation / statement.separation_z
        self.weight, self.unit, self.path, self.rows = weight, weight.denominator, path, list[Flown]()
        steps = [square([axis.derivative() for axis in one.axes]) for one in path.segments if one.start == one.stop]
        step, self.stretch = root(max((one.at(0) for one in steps), default=ZERO))[1], max(Fraction(1), weight)
        self.radius, self.loose = self.stretch * path.robot.radius, self.stretch * (statement.margin + step)
        for one in (one for one in path.segments if one.start < one.stop):
            every = zip(one.axes, (self.unit, self.unit, weight.numerator), strict=False)
            places = [one.bernstein(axis * Polynomial([times]), 7) for axis, times in every]  # of one degree, as pieces are
            box = [((row.lowest << BITS) // row.unit, -((-row.highest << BITS) // row.unit)) for row in places]
            self.rows.append(Flown(one.start, one.stop, places, box))
        axes = zip(*(one.box for one in self.rows), strict=True)
        self.box = [(min(low for low, _ in axis), max(high for _, high in axis)) for axis in axes]

    def around(self, error: Fraction) -> list[Flown]:
        """Return the segments, those of a lap's beginning once more behind its end if clocks differ."""
        lap, end = self.path.lap, self.rows[-1].stop
        again = [one for one in self.rows if lap is not None and error and lap <= one.start <= lap + error]
        later = end - (lap or ZERO)
        return self.rows + [one._replace(start=one.start + later, stop=one.stop + later) for one in again]


class Pair:
    """Two robots, and how far apart their paths must be, m (Coq: `apart_moved`, `stretched_grows`)."""

    def __init__(self, separation: Fraction, one: Flight, other: Flight) -> None:
        self.flights, self.least = (one, other), max(separation, one.radius + other.radius) + one.loose + other.loose
        self._square = (self.least * one.unit) ** 2
        self.apart = f"{at_least(self.least)} m"
        self.apart += f", a metre in z counted as {float(one.weight):.4g}," if one.weight != 1 else ""

    def parts(self, error: Fraction) -> Iterator[Two]:
        """Yield the claims that they are far enough apart at times of theirs that differ by at most an error, s, where boxes do not part them.

        Of segments that clocks show together at one instant alone, their neighbours are looked at: a robot may be anywhere on a step.
        """
        one, other = self.flights
        if self._are_far(one.box, other.box):
            return
        its = other.around(error)
        starts, stops = [b.start for b in its], [b.stop for b in its]
        for a in (a for a in one.around(error) if not self._are_far(a.box, other.box)):
            for b in its[bisect_right(stops, a.start - error) : bisect_left(starts, a.stop + error)]:
                if not self._are_far(a.box, b.box):
                    yield Two(a, b, error, self._square)

    def _are_far(self, box: Box, other: Box) -> bool:
        gaps = [max(0, low - d, c - high) for (low, high), (c, d) in zip(box, other, strict=True)]
        return sum(gap * gap for gap in gaps) * self._square.denominator >= self._square.numerator << 2 * BITS


class Two(NamedTuple):
    """A part of one path and a part of another, each with its own times.

    `k`: no two clocks show these times at one moment. `m`: a plane across the way from middle to middle parts them by what is asked (Coq: `plane_parts`).
    """

    one: Flown
    other: Flown
    error: Fraction
    square: Fraction

    def holds(self, mark: str) -> bool:
        """Return whether a mark is so."""
        if mark == "k":
            return max(self.one.start - self.other.stop, self.other.start - self.one.stop) > self.error
        rows, unit = common([*self.one.places, *self.other.places])
        mine, its = rows[:3], rows[3:]
        x, y, z = ((sum(a) - sum(b)) * 4096 // unit for a, b in zip(mine, its, strict=True))  # any would do
        near, far = ([x * a + y * b + z * c for a, b, c in zip(*rows, strict=True)] for rows in (mine, its))
        gap, least = min(near) - max(far), self.square * (x * x + y * y + z * z)
        return mark == "m" and gap > 0 and gap * gap * least.denominator >= least.numerator * unit * unit

    def halves(self) -> tuple[Two, Two]:
        """Return both halves of the part that lasts longer."""
        if self.one.stop - self.one.start >= self.other.stop - self.other.start:
            first, second = (self._replace(one=half) for half in self.one.halves())
        else:
            first, second = (self._replace(other=half) for half in self.other.halves())
        return first, second
