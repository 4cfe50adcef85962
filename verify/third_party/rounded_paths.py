"""Drones' flights as float32 polynomials, which the kernel reads, and how far these are from the flights themselves at every time.

Flights of CSV files are such polynomials. A show's curves are not: their times and coefficients are rounded. A piece p over [s, e] becomes a piece q
over [s', e'], whose times are as near as float32 durations allow. At one share u of both, p(u) and q(u) differ by at most the sum of what their
coefficients differ by. At one time instead of one share, p has moved on for at most the greatest difference of s and s': by its greatest
speed times that, and by a jump to the next piece, since no piece is so short.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.exact import fraction
from verify.data.trajectory import DEGREE, Trajectory
from verify.kernel.statement import Refused
from verify.third_party.fleet import Fleet

Polynomials = Sequence[Sequence[Fraction]]
"""x, y and z, ascending powers of the share of a piece."""


@dataclass(frozen=True, eq=False, slots=True)
class RoundedPaths:
    """Flights as float32 polynomials.

    Attributes:
        paths: By drone; without the rests that only fill the time of others. Headings, which an audit leaves out, are 0.
        off: No drone is farther than this from its path here at any time, m.
    """

    paths: Mapping[str, Trajectory]
    off: Fraction


def rounded_paths(fleet: Fleet) -> RoundedPaths:
    """Return a fleet's flights as float32 polynomials.

    Raises:
        Refused: A piece is too short, or of too high a degree.
    """
    found: dict[str, Trajectory] = {}
    off = Fraction(0)
    for drone, name in enumerate(fleet.names):
        first, last = int(fleet.first[drone]), int(fleet.first[drone + 1])
        rows = range(first, max(last - fleet.rests[drone][1], first + 1))
        if fleet.basis == "power":
            values = fleet.values[rows.start : rows.stop]
            found[name] = Trajectory(fleet.durations[rows.start : rows.stop], _with_heading(values))
        else:
            found[name], its_off = _rounded(fleet, rows, name)
            off = max(off, its_off)
    return RoundedPaths(found, off)


def _with_heading(values: Floats) -> Floats:
    return np.concatenate([values, np.zeros_like(values[:, :1])], axis=1)


def _rounded(fleet: Fleet, rows: range, name: str) -> tuple[Trajectory, Fraction]:
    """Return one drone's flight in float32 numbers, and how far it is from that at most, m."""
    if fleet.degree > DEGREE:
        raise Refused(f"{name} flies curves of degree {fleet.degree}, and the kernel reads {DEGREE}.")
    durations, values = np.zeros(len(rows)), np.zeros((len(rows), 3, DEGREE + 1))
    time, late, off, speed, jump = Fraction(0), Fraction(0), Fraction(0), Fraction(0), Fraction(0)
    before: list[Fraction] | None = None
    for place, row in enumerate(rows):
        start, stop = fleet.start(row), fleet.stop(row)
        late = max(late, abs(start - time))
        durations[place] = np.float32(float(stop - time))
        length = Fraction(float(durations[place]))
        if length <= 0:
            raise Refused(f"piece {place} of {name} is too short for float32 times.")
        exact = [[fraction(c) for c in axis] for axis in fleet.exactly(row)]
        for axis, polynomial in enumerate(exact):
            for power, coefficient in enumerate(polynomial):
                values[place, axis, power] = np.float32(float(coefficient / length**power))
        off = max(off, _apart(exact, values[place], length))
        speed = max(speed, _speed(exact) / (stop - start))
        begin = [axis[0] if axis else Fraction(0) for axis in exact]
        jump = max(jump, Fraction(0) if before is None else _size(b - a for a, b in zip(before, begin, strict=True)))
        before = [sum(axis, Fraction(0)) for axis in exact]
        time += length
    late = max(late, abs(fleet.stop(rows[-1]) - time))
    if late >= min(fleet.stop(row) - fleet.start(row) for row in rows):
        raise Refused(f"{name} has a piece that is too short for float32 times.")
    return Trajectory(durations, _with_heading(values)), off + speed * late + jump


def _apart(exact: Polynomials, values: Floats, length: Fraction) -> Fraction:
    """Bound how far a rounded piece is from its own at one share of both, m."""

    def axis(polynomial: Sequence[Fraction], row: Floats) -> Fraction:
        rounded = [Fraction(float(c)) * length**power for power, c in enumerate(row)]
        own = [*polynomial, *[Fraction(0)] * (len(rounded) - len(polynomial))]
        return sum((abs(a - b) for a, b in zip(own, rounded, strict=True)), Fraction(0))

    return _size(axis(polynomial, row) for polynomial, row in zip(exact, values, strict=True))


def _speed(exact: Polynomials) -> Fraction:
    """Bound how fast a piece is, m a share."""
    return _size(sum((power * abs(c) for power, c in enumerate(polynomial)), Fraction(0)) for polynomial in exact)


def _size(numbers: Iterable[Fraction]) -> Fraction:
    """Bound the length of a vector: it is no longer than its numbers together."""
    return sum(map(abs, numbers), Fraction(0))
