"""A team's flight as its CSV files say: one polynomial piece a line, in float32 numbers, exactly.

A robot's path is a row of segments without gaps: the step from its start to where its first piece begins, its pieces, between them the
steps from one piece's end to the next one's beginning, and the hover from its own end to the team's, or the step back to where its
lap begins. A step takes no time.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

from .polynomials import Bernstein, Polynomial, square
from .refused import Refused
from .statement import Robot, Statement, Vector

HEADER = ["duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8))]
MOST_PIECES = 4096
LARGEST = 1 << 40
GRAVITY = Fraction(9.80665)
"""m/s^2."""
BITS = 40


@dataclass(frozen=True)
class Piece:
    """One piece: its length in s, and x, y, z and heading over its own time."""

    length: Fraction
    axes: tuple[Polynomial, ...]

    @cached_property
    def derivatives(self) -> list[tuple[Polynomial, ...]]:
        """x, y, z and heading, and their first four derivatives by time."""
        found = [self.axes]
        for _ in range(4):
            found.append(tuple(axis.derivative() for axis in found[-1]))
        return found

    @cached_property
    def force(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """F = r'' + g e3, m/s^2: the thrust is m |f|."""
        x, y, z, _ = self.derivatives[2]
        return x, y, z + Polynomial.of([GRAVITY])

    @cached_property
    def size(self) -> Polynomial:
        """|f|^2."""
        return square(self.force)

    def bernstein(self, polynomial: Polynomial) -> Bernstein:
        """Return a polynomial of the piece's time in Bernstein form."""
        return polynomial.stretched(self.length).bernstein()


class Plane(NamedTuple):
    """Beyond a plane are the points at which a sum of x, y, z and 1, each with its weight, is above a bound."""

    weights: Polynomial
    bound: Fraction


def box_around(center: Sequence[Fraction], reach: Sequence[Fraction | None]) -> list[Plane]:
    """Return planes around a box, two for each axis that has a reach."""
    found: list[Plane] = []
    for axis, length in enumerate(reach):
        if length is not None:
            weights = Polynomial([int(k == axis) for k in range(4)])
            found += [Plane(weights, length + center[axis]), Plane(-weights, length - center[axis])]
    return found


@dataclass(frozen=True)
class Segment:
    """A part of one robot's path, from one time to another, s: x, y and z over its own time, or, of a step, over u from 0 to 1."""

    start: Fraction
    stop: Fraction
    axes: Sequence[Polynomial]

    def time(self, u: Fraction) -> Fraction:
        """Return the time at a place of it, from 0 to 1."""
        return self.start + (self.stop - self.start) * u

    def within(self, start: Fraction, stop: Fraction) -> list[Polynomial]:
        """Return x, y and z from one of its times to a later one, over u from 0 to 1; all of it where both are its own."""
        if start == stop:
            return list(self.axes)
        return [(axis.moved(start - self.start) if start > self.start else axis).stretched(stop - start) for axis in self.axes]

    @cached_property
    def _lines(self) -> tuple[list[list[int]], int]:
        return _common([*self.within(self.start, self.stop), Polynomial([1])], 7)

    @cached_property
    def _squares(self) -> tuple[list[list[int]], int]:
        x, y, z = self.within(self.start, self.stop)
        return _common([x * x, x * y, x * z, y * y, y * z, z * z, x, y, z, Polynomial([1])], 14)

    def sum(self, weights: Polynomial) -> Bernstein:
        """Return the sum of x, y, z and 1 along it, or of xx, xy, xz, yy, yz, zz, x, y, z and 1, each times its weight."""
        rows, unit = self._lines if len(weights.numbers) == 4 else self._squares
        total: list[int] = [0] * len(rows[0])
        for weight, row in zip(weights.numbers, rows, strict=True):
            if weight:
                total = [a + weight * b for a, b in zip(total, row, strict=True)]
        return Bernstein(total, unit << weights.shift)

    @cached_property
    def places(self) -> tuple[Bernstein, Bernstein, Bernstein]:
        """x, y and z along it."""
        rows, unit = self._lines
        return Bernstein(rows[0], unit), Bernstein(rows[1], unit), Bernstein(rows[2], unit)

    @cached_property
    def box(self) -> list[tuple[int, int]]:
        """A box that holds it: along x, y and z from where to where, m, over 2^40."""
        return [((row.lowest << BITS) // row.unit, -((-row.highest << BITS) // row.unit)) for row in self.places]

    def is_beyond(self, plane: Plane) -> bool:
        """Return whether its box is beyond a plane, so that it is."""
        *normal, one = plane.weights.numbers
        least = sum((w * (low if w > 0 else high) for w, (low, high) in zip(normal, self.box, strict=True)), one << BITS)
        return least * plane.bound.denominator > plane.bound.numerator << (BITS + plane.weights.shift)


def _common(polynomials: Sequence[Polynomial], degree: int) -> tuple[list[list[int]], int]:
    """Return Bernstein coefficients over one number."""
    shift = max(p.shift for p in polynomials)
    raised = [Polynomial([n << (shift - p.shift) for n in p.numbers], shift).bernstein(degree) for p in polynomials]
    return [row.numbers for row in raised], raised[0].unit


@dataclass(frozen=True)
class Path:
    """One robot's path: its pieces (of a lasso, of prefix and one lap), when they begin and the last one ends, its segments and lap."""

    name: str
    robot: Robot
    pieces: list[Piece]
    knots: list[Fraction]
    segments: list[Segment]
    lap: Fraction | None


@dataclass(frozen=True)
class Team:
    """All paths, and the time at which the flight, or its first lap, ends, in s."""

    paths: Mapping[str, Path]
    end: Fraction


def read_pieces(text: str, name: str) -> list[Piece]:
    """Read a CSV file.

    Raises:
        Refused: It is none, or a number of it is none that a flight has.
    """
    rows = [[cell.strip() for cell in line.split(",")] for line in text.removeprefix("\ufeff").splitlines() if line.strip()]
    if not 2 <= len(rows) <= MOST_PIECES + 1 or rows[0] != HEADER or any(len(row) != len(HEADER) for row in rows):
        raise Refused(
            f"{name}.csv is no flight of 1 to {MOST_PIECES} pieces, each a line of 33 numbers below the names of columns."
        )
    found: list[Piece] = []
    for row in rows[1:]:
        length, *numbers = [_float32(cell, name) for cell in row]
        if length <= 0:
            raise Refused(f"{name}.csv has a piece of no length.")
        found.append(Piece(length, tuple(Polynomial.of(numbers[k : k + 8]) for k in (0, 8, 16, 24))))
    return found


def _float32(cell: str, name: str) -> Fraction:
    """Return the float32 that a vehicle reads, exactly."""
    try:
        if not 0 < len(cell) <= 60 or not set(cell) <= set("0123456789+-.eE"):
            raise ValueError
        (value,) = struct.unpack("<f", struct.pack("<f", float(cell)))
        exact = Fraction(value)
    except (ValueError, OverflowError):
        raise Refused(f"{name}.csv has {cell[:40]!r}, which is no float32.") from None
    if abs(exact) > LARGEST:
        raise Refused(f"{name}.csv has {cell[:40]}, which no flight has.")
    return exact


def read_team(statement: Statement, texts: Mapping[str, str]) -> Team:
    """Read a team's flight from each robot's CSV file.

    Raises:
        Refused: Files are none, or laps do not repeat, or do not begin and end together.
    """
    pieces = {name: _one_lap(read_pieces(texts[name], name), statement, name) for name in statement.robots}
    knots = {name: _knots(row) for name, row in pieces.items()}
    end = max(times[-1] for times in knots.values())
    paths: dict[str, Path] = {}
    for name, robot in statement.robots.items():
        lap = None if robot.cycle is None else knots[name][robot.cycle]
        paths[name] = Path(name, robot, pieces[name], knots[name], _segments(robot, pieces[name], knots[name], end), lap)
    if statement.lasso and len({(path.lap, path.knots[-1]) for path in paths.values()}) > 1:
        raise Refused("The laps of a team do not begin and end together.")
    return Team(paths, end)


def _one_lap(pieces: list[Piece], statement: Statement, name: str) -> list[Piece]:
    """Return prefix and one lap of all laps that a file holds."""
    cycle = statement.robots[name].cycle
    if cycle is None:
        return pieces
    length, rest = divmod(len(pieces) - cycle, statement.repeat)
    if rest or length < 1:
        raise Refused(f"{name}.csv does not hold {statement.repeat} laps from piece {cycle} on.")
    known = [(piece.length, [(axis.shift, list(axis.numbers)) for axis in piece.axes]) for piece in pieces]
    if known[cycle : len(known) - length] != known[cycle + length :]:
        raise Refused(f"{name}.csv holds laps that are not alike.")
    return pieces[: cycle + length]


def _knots(pieces: list[Piece]) -> list[Fraction]:
    times = [Fraction(0)]
    for piece in pieces:
        times.append(times[-1] + piece.length)
    return times


def _segments(robot: Robot, pieces: list[Piece], times: list[Fraction], end: Fraction) -> list[Segment]:
    def step(time: Fraction, start: Vector, piece: Piece) -> Segment:
        stop = [axis.at(0) for axis in piece.axes[:3]]
        return Segment(time, time, [Polynomial.of([a, b - a]) for a, b in zip(start, stop, strict=True)])

    found: list[Segment] = []
    before = robot.start
    for piece, (start, stop) in zip(pieces, pairwise(times), strict=True):
        x, y, z = piece.axes[:3]
        found += [step(start, before, piece), Segment(start, stop, (x, y, z))]
        before = x.at(piece.length), y.at(piece.length), z.at(piece.length)
    if robot.cycle is not None:
        found.append(step(times[-1], before, pieces[robot.cycle]))
    elif times[-1] < end:
        found.append(Segment(times[-1], end, [Polynomial.of([value]) for value in before]))
    return found
