"""A team's flight as its CSV files say: one polynomial piece a line, in float32 numbers, exactly. A robot's path is a row of segments without gaps.
First is the step from its start to where its first piece begins. Then come its pieces, and between them the steps from one piece's end to the next
one's beginning. Last is the hover from its own end to the team's, or the step back to where its lap begins. A step takes no time.
"""

import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import zip_longest
from typing import NamedTuple

from .statement import ZERO, Refused, Robot, Statement, require
from .trees import Bernstein, Polynomial

HEADER = ["duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8))]
MOST_PIECES = 4096
LARGEST = 1 << 40
_NUMBER = re.compile(r"[0-9+.eE-]{1,60}\Z")
GRAVITY = Fraction(9.80665)  # m/s^2


@dataclass(frozen=True)
class Segment:
    """A part of one robot's path: x, y and z, and of a piece the heading, over its own time, s. A step takes no time; it goes over u from 0 to 1."""

    start: Fraction
    stop: Fraction
    axes: Sequence[Polynomial]

    @cached_property
    def length(self) -> Fraction:
        """Greatest argument of its polynomials."""
        return self.stop - self.start or Fraction(1)

    def bernstein(self, polynomial: Polynomial, degree: int | None = None) -> Bernstein:
        """Return a polynomial of its own time in Bernstein form."""
        return polynomial.stretched(self.length).bernstein(degree)

    def ends(self, order: int = 0) -> tuple[list[Fraction], list[Fraction]]:
        """Return a derivative of all axes where it begins, and where it ends."""
        rows = self.derivatives[order] if order else self.axes
        return [row.at(0) for row in rows], [row.at(self.length) for row in rows]

    @cached_property
    def derivatives(self) -> list[Sequence[Polynomial]]:
        """Its axes, and their first four derivatives by time."""
        found = [self.axes]
        for _ in range(4):
            found.append([axis.derivative() for axis in found[-1]])
        return found

    @cached_property
    def force(self) -> tuple[Polynomial, Polynomial, Polynomial]:
        """F = r'' + g e3, m/s^2: the thrust is m |f|."""
        x, y, z = self.derivatives[2][:3]
        return x, y, z + Polynomial.of([GRAVITY])

    @cached_property
    def _forms(self) -> tuple[list[tuple[int, ...]], int]:
        x, y, z = (axis.stretched(self.length) for axis in self.axes[:3])
        forms = [x * x, x * y, x * z, y * y, y * z, z * z, x, y, z, Polynomial([1])]
        shift = max(one.shift for one in forms)
        return list(zip_longest(*([n << shift - one.shift for n in one.numbers] for one in forms), fillvalue=0)), shift

    def sum(self, weights: Polynomial) -> Bernstein:
        """Return the sum of xx, xy, xz, yy, yz, zz, x, y, z and 1 along it, each times its weight."""
        powers, shift = self._forms
        total = [sum(n * a for n, a in zip(weights.numbers, row, strict=True) if n) for row in powers]
        return Polynomial(total, shift + weights.shift).bernstein()


class Path(NamedTuple):
    """One robot's path: its segments, which of them are pieces (of a lasso, of prefix and one lap), and when its lap begins."""

    name: str
    robot: Robot
    segments: list[Segment]
    pieces: list[Segment]
    lap: Fraction | None


class Team(NamedTuple):
    """All paths, the time at which the flight, or its first lap, ends, in s, and how many laps are flown."""

    paths: Mapping[str, Path]
    end: Fraction
    repeat: int


def _read_pieces(text: str, name: str, cycle: int | None, repeat: int) -> list[Segment]:
    """Read a CSV file: of laps, of which it holds so many, from some piece on, prefix and one lap."""
    rows = [[cell.strip() for cell in line.split(",")] for line in text.removeprefix("\ufeff").split("\n") if line.strip()]
    fits = 2 <= len(rows) <= MOST_PIECES + 1 and rows[0] == HEADER and all(len(row) == len(HEADER) for row in rows)
    require(fits, f"{name}.csv is no flight of 1 to {MOST_PIECES} pieces, each a line of 33 numbers below their names.")
    found, start, rows = list[Segment](), ZERO, rows[1:]
    if cycle is not None:
        length, rest = divmod(len(rows) - cycle, repeat)
        require(length > 0 and not rest, f"{name}.csv does not hold {repeat} laps from piece {cycle} on.")
        require(rows[cycle:-length] == rows[cycle + length :], f"{name}.csv holds laps that are not alike.")
        rows = rows[: cycle + length]
    for row in rows:
        try:
            require(all(map(_NUMBER.match, row)), f"{name}.csv has what is no number.")
            numbers = struct.unpack("<33f", struct.pack("<33f", *map(float, row)))  # as a vehicle reads them
        except (ValueError, OverflowError):
            raise Refused(f"{name}.csv has what is no float32.") from None
        fits = numbers[0] > 0 and max(map(abs, numbers)) <= LARGEST
        require(fits, f"{name}.csv has a piece of no length, or what no flight has.")
        axes = [Polynomial.of(numbers[k : k + 8]) for k in (1, 9, 17, 25)]
        found.append(Segment(start, start + Fraction(numbers[0]), axes))
        start = found[-1].stop
    return found


def read_team(statement: Statement, texts: Mapping[str, str]) -> Team:
    """Read a team's flight from each robot's CSV file; laps have to be alike, and to begin and end together."""
    pieces = {of: _read_pieces(texts.get(of, ""), of, one.cycle, statement.repeat) for of, one in statement.robots.items()}
    end = max(row[-1].stop for row in pieces.values())
    paths = {name: _path(name, statement.robots[name], row, end) for name, row in pieces.items()}
    laps = {(path.lap, path.pieces[-1].stop) for path in paths.values()}
    require(not statement.lasso or len(laps) == 1, "The laps of a team do not begin and end together.")
    return Team(paths, end, statement.repeat)


def _path(name: str, robot: Robot, pieces: list[Segment], end: Fraction) -> Path:
    lap = None if robot.cycle is None else pieces[robot.cycle]
    found: list[Segment] = []
    before: Sequence[Fraction] = robot.start
    for piece in (*pieces, *([] if lap is None else [lap])):
        first, last = piece.ends()
        time = found[-1].stop if found else ZERO
        step = [Polynomial.of([a, b - a]) for a, b in zip(before, first[:3], strict=True)]
        found += [Segment(time, time, step), piece]
        before = last[:3]
    if lap is not None:
        found.pop()  # the lap's first piece once more
    elif found[-1].stop < end:
        found.append(Segment(found[-1].stop, end, [Polynomial.of([value]) for value in before]))
    return Path(name, robot, found, pieces, None if lap is None else lap.start)
