"""Distances for all times: to the workspace's walls, to obstacles, and between robots whose clocks differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from .bodies import ZERO, Condition, condition
from .bounds import root
from .evidence import Evidence
from .flights import BITS, Path, Plane, Segment
from .hoops import Frame
from .polynomials import Polynomial, square
from .refused import Refused
from .statement import Inequality, Shape, Statement
from .trees import Cell, Marks, Rows, at_least, require

MOST_SUMS = 64
"""Sums of half-spaces that a proof may name for one part of an obstacle."""


def check_workspace(statement: Statement, path: Path, marks: Marks) -> None:
    """Check that a path stays in the workspace by the margin.

    Args:
        statement: Has the workspace.
        path: The path.
        marks: Evidence.

    Raises:
        Refused: That is not proved.
    """
    walls: list[Plane] = []
    for axis in range(3):
        weights = Polynomial([int(k == axis) for k in range(4)])
        walls += [
            Plane(weights, statement.low[axis] + statement.margin),
            Plane(-weights, statement.margin - statement.high[axis]),
        ]
    for segment in path.segments:
        require(at_least([(segment.sum(wall.weights), wall.bound) for wall in walls]), marks, "it stays in the workspace")


@dataclass(frozen=True, slots=True)
class Solid:
    """The claim `n` that a path is farther than a length from what is solid of a convex part of an obstacle.

    One inequality, or one sum of half-spaces, is broken by the length (Coq: `quadric_no`, `farkas_ball`), or all within the length is in
    an opening: of each there is its hoop, and how far from the axis the path may be.
    """

    asked: list[Condition]
    openings: list[tuple[Frame, Fraction]]

    def rows(self, segment: Segment) -> Rows:
        """Return what is asked along a segment."""
        return [
            segment.sum(weights) for weights in (*(one.weights for one in self.asked), *(f.across for f, _ in self.openings))
        ]

    def claims(self, mark: str, rows: Rows) -> bool:
        """Return whether a mark is so."""
        count = len(self.asked)
        broken = any(row.above(one.outside) for row, one in zip(rows[:count], self.asked, strict=True))
        inside = (row.below(room**2 * f.square) for row, (f, room) in zip(rows[count:], self.openings, strict=True) if room > 0)
        return mark == "n" and (broken or any(inside))


def check_obstacles(statement: Statement, path: Path, evidence: Evidence) -> None:
    """Check that a path stays farther from all that is solid than the margin and the vehicle's radius.

    Args:
        statement: Has the obstacles.
        path: The path.
        evidence: Marks, and sums of half-spaces.

    Raises:
        Refused: That is not proved.
    """
    length = statement.margin + path.robot.radius
    for name, obstacle in statement.obstacles.items():
        marks = evidence.marks(f"obstacles/{path.name}/{name}")
        for number, part in enumerate(obstacle.parts):
            sums = summed(part, evidence.rows(f"sums/{name}/{number}", 2))
            asked = [condition(one, obstacle.center, length) for one in (*part, *sums)]
            frames = [
                Frame.of(shape) for hoop in obstacle.openings or () if _holds(obstacle, part, shape := statement.regions[hoop])
            ]
            solid = Solid(asked, [(frame, frame.ring.opening - length) for frame in frames])
            planes = [plane for one in asked for plane in one.planes]
            for segment in path.segments:
                if not any(map(segment.is_beyond, planes)):
                    require(Cell(solid.rows(segment), solid.claims), marks, f"it stays clear of obstacle {name}")


def summed(part: Sequence[Inequality], weights: list[list[list[int]]]) -> list[Inequality]:
    """Return sums of a part's half-spaces, each a list of their numbers and weights; all points of the part keep them (Coq: `farkas_keeps`).

    Raises:
        Refused: They are none.
    """
    if len(weights) > MOST_SUMS or any(k >= len(part) or part[k].quadratic for row in weights for k, _ in row):
        raise Refused("a proof sums half-spaces that there are not")
    found: list[Inequality] = []
    for row in weights:
        x, y, z = (sum((w * (part[k].linear or (ZERO,) * 3)[axis] for k, w in row), ZERO) for axis in range(3))
        found.append(Inequality(sum((w * part[k].bound for k, w in row), ZERO), (x, y, z)))
    return found


def _holds(obstacle: Shape, part: Sequence[Inequality], hoop: Shape) -> bool:
    """Return whether a part holds a hoop's centre."""
    offset = Segment(ZERO, ZERO, [Polynomial.of([x]) for x in hoop.center])
    asked = [condition(one, obstacle.center, ZERO) for one in part]
    return all(offset.sum(one.weights).at_most(one.outside) for one in asked)


@dataclass(frozen=True, slots=True)
class Pace:
    """Bounds on how a path may differ from itself: by its longest step, and within the clocks' error, steps included, m."""

    step: Fraction
    drift: Fraction


def pace_of(path: Path, speed: Fraction, error: Fraction) -> Pace:
    """Return how a path may differ from itself.

    Args:
        path: The path.
        speed: A proved bound, m/s.
        error: By how much two clocks differ at most, s.

    Raises:
        Refused: That is longer than a lap, in which a path has each step once.
    """
    if path.lap is not None and error > path.segments[-1].stop - path.lap:
        raise Refused("clocks differ by more than a lap")
    gaps = [[axis.at(1) - axis.at(0) for axis in one.axes] for one in path.segments if one.start == one.stop]
    steps = [root(x * x + y * y + z * z)[1] for x, y, z in gaps]
    return Pace(max(steps), speed * error + sum(steps) if error else ZERO)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two robots, how far apart their paths must be, m, and how much more a metre in z counts than one across."""

    one: Path
    other: Path
    least: Fraction
    weight: Fraction

    @classmethod
    def of(cls, statement: Statement, one: Path, other: Path, more: Fraction) -> Pair:
        """Return what is asked of two robots.

        Args:
            statement: What is asked.
            one: The one.
            other: The other.
            more: What clocks and steps add, m.
        """
        weight = Fraction(1) if statement.separation_z is None else statement.separation / statement.separation_z
        stretch = max(Fraction(1), weight)
        touching = (one.robot.radius + other.robot.radius) * stretch
        return cls(one, other, max(statement.separation, touching) + stretch * (2 * statement.margin + more), weight)

    @property
    def square(self) -> Fraction:
        """The squared distance that is asked, in a measure in which coordinates are whole numbers of times the world's."""
        return (self.least * self.weight.denominator) ** 2

    def _weighed(self, axes: Sequence[Polynomial]) -> list[Polynomial]:
        return [axis.times(n) for axis, n in zip(axes, (self.weight.denominator,) * 2 + (self.weight.numerator,), strict=True)]

    def _is_far(self, mine: Segment, its: Segment) -> bool:
        """Return whether boxes alone show that two segments are far enough apart."""
        gaps = [
            max(0, low - its_high, its_low - high) for (low, high), (its_low, its_high) in zip(mine.box, its.box, strict=True)
        ]
        x, y, z = (gap * n for gap, n in zip(gaps, (self.weight.denominator,) * 2 + (self.weight.numerator,), strict=True))
        return (x * x + y * y + z * z) * self.square.denominator >= self.square.numerator << (2 * BITS)

    def check(self, marks: Marks) -> None:
        """Check that they are far enough apart at each time.

        Raises:
            Refused: That is not proved.
        """
        for mine, its in _together(self.one.segments, self.other.segments):
            if not self._is_far(mine, its):
                start, stop = max(mine.start, its.start), min(mine.stop, its.stop)
                gaps = [a - b for a, b in zip(mine.within(start, stop), its.within(start, stop), strict=True)]
                require(at_least([(square(self._weighed(gaps)).bernstein(), self.square)]), marks, "they keep apart")

    def check_all_times(self, error: Fraction, end: Fraction, marks: Marks) -> None:
        """Check that they are far enough apart at all times of theirs that differ by at most an error.

        Args:
            error: s.
            end: When the flight, or its first lap, ends, s.
            marks: Evidence.

        Raises:
            Refused: That is not proved.
        """
        for start, stop, mine in _flown(self.one, end, error):
            for its_start, its_stop, its in _flown(self.other, end, error):
                if max(start - its_stop, its_start - stop) <= error and not self._is_far(mine, its):
                    rows = [
                        [axis.bernstein(7) for axis in self._weighed(one.within(one.start, one.stop))] for one in (mine, its)
                    ]
                    both = Two((start, stop), (its_start, its_stop), rows[0], rows[1], error, self.square)
                    require(both, marks, "they keep apart, however their clocks differ")


def _together(mine: list[Segment], its: list[Segment]) -> Iterator[tuple[Segment, Segment]]:
    """Yield the pairs of segments that share some time; steps take none."""
    first, second = ([s for s in row if s.start < s.stop] for row in (mine, its))
    i = k = 0
    while i < len(first) and k < len(second):
        yield first[i], second[k]
        ahead = first[i].stop - second[k].stop
        i, k = i + (ahead <= 0), k + (ahead >= 0)


def _flown(path: Path, end: Fraction, error: Fraction) -> list[tuple[Fraction, Fraction, Segment]]:
    """Return a path's segments with their times, those of a lap's beginning once more behind its end."""
    found = [(one.start, one.stop, one) for one in path.segments if one.start < one.stop]
    if path.lap is not None:
        later = end - path.lap
        found += [(a + later, b + later, one) for a, b, one in found if path.lap <= a <= path.lap + error]
    return found


@dataclass(frozen=True, slots=True)
class Two:
    """A part of one path and a part of another, each with its own times.

    `k`: no two clocks show these times at one moment. `m`: a plane across the way from middle to middle parts them by what is asked.
    """

    times: tuple[Fraction, Fraction]
    its_times: tuple[Fraction, Fraction]
    rows: Rows
    its_rows: Rows
    error: Fraction
    square: Fraction

    def holds(self, mark: str) -> bool:
        """Return whether a mark is so."""
        if mark == "k":
            return max(self.times[0] - self.its_times[1], self.its_times[0] - self.times[1]) > self.error
        middles = ([Fraction(sum(row.numbers) << 7, row.unit) for row in rows] for rows in (self.rows, self.its_rows))
        normal = [round(a - b) for a, b in zip(*middles, strict=True)]
        gap = -_most([-n for n in normal], self.rows) - _most(normal, self.its_rows)
        return mark == "m" and gap > 0 and gap * gap >= self.square * sum(n * n for n in normal)

    def halves(self) -> tuple[Two, Two]:
        """Return both halves of the part that lasts longer."""
        mine = self.times[1] - self.times[0] >= self.its_times[1] - self.its_times[0]
        (start, stop), rows = (self.times, self.rows) if mine else (self.its_times, self.its_rows)
        first, second = zip(*(row.halves() for row in rows), strict=True)
        parts = ((start, (start + stop) / 2), first), (((start + stop) / 2, stop), second)
        one, other = (
            Two(t, self.its_times, r, self.its_rows, self.error, self.square)
            if mine
            else Two(self.times, t, self.rows, r, self.error, self.square)
            for t, r in parts
        )
        return one, other


def _most(normal: Sequence[int], rows: Rows) -> Fraction:
    """Return what a sum of polynomials is at most."""
    unit = max(row.unit for row in rows)  # units differ by powers of two
    columns = zip(
        *([n * (unit // row.unit) * number for number in row.numbers] for n, row in zip(normal, rows, strict=True)), strict=True
    )
    return Fraction(max(map(sum, columns)), unit)
