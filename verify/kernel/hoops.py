"""Openings that are passed, and rims that are not met.

Of a place r, D = (r - c) . n with the hoop's centre c and normal n, and P = |r - c|^2 |n|^2 - D^2: |D| / |n| is how far r is from the
opening's plane, and sqrt(P) / |n| how far from its axis. Both are polynomials; lengths are compared with |n| by rational bounds.

A passage is a time before which the path is more than the margin on one side of the plane, and after which it is on the other; all
the while it is inside the opening by the margin and the vehicle's radius. At other times no point within the margin is in the opening.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import dropwhile

from .bodies import ZERO
from .bounds import root
from .flights import Path, Segment, box_around
from .polynomials import Bernstein, Polynomial
from .refused import Refused
from .statement import Ring, Shape, Statement, Vector
from .timelines import Visits
from .trees import Cell, Marks, Rows, leaves, require

DIRECTIONS = ((0, 1, 1), (1, 0, 1), (3, 4, 5), (4, 3, 5), (5, 12, 13), (12, 5, 13), (8, 15, 17), (15, 8, 17))
"""Unit vectors a / c, b / c in the plane through a hoop's axis: what is beyond one by so much is so far away."""

Word = Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Frame:
    """A hoop: its ring and centre, |n|^2, a number above |n|, and the weights of D and of P."""

    ring: Ring
    center: Vector
    square: Fraction
    high: Fraction
    along: Polynomial
    across: Polynomial

    @classmethod
    def of(cls, shape: Shape) -> Frame:
        """Measure a hoop.

        Raises:
            Refused: It has no ring.
        """
        if shape.ring is None:
            raise Refused("a region without a ring is no hoop")
        n, c = shape.ring.normal, shape.center
        square = sum((x * x for x in n), ZERO)
        m = [[(square if i == k else 0) - n[i] * n[k] for k in range(3)] for i in range(3)]
        pulled = [sum((m[i][k] * c[k] for k in range(3)), ZERO) for i in range(3)]
        along = [*n, -sum((a * b for a, b in zip(n, c, strict=True)), ZERO)]
        across = [m[0][0], 2 * m[0][1], 2 * m[0][2], m[1][1], 2 * m[1][2], m[2][2], *(-2 * p for p in pulled)]
        across.append(sum((p * x for p, x in zip(pulled, c, strict=True)), ZERO))
        return cls(shape.ring, c, square, root(square)[1], Polynomial.of(along), Polynomial.of(across))

    def rows(self, segment: Segment) -> Rows:
        """Return D and P along a segment."""
        return [segment.sum(self.along), segment.sum(self.across)]


@dataclass(frozen=True, slots=True)
class Opening:
    """Claims about a path at an opening.

    `n`: no point within the margin is in it. `i`: should the vehicle be there, it is inside by all of its radius and the margin.
    """

    frame: Frame
    margin: Fraction
    radius: Fraction

    @property
    def far(self) -> Fraction:
        """A bound on |D| within the margin of the plane."""
        return self.margin * self.frame.high

    def claims(self, mark: str, rows: Rows) -> bool:
        """Return whether a mark is so."""
        (along, across), opening = rows, self.frame.ring.opening
        if mark == "n":
            return (
                along.above(self.far)
                or along.below(-self.far)
                or across.above((opening + self.margin) ** 2 * self.frame.square)
            )
        room = opening - self.margin - self.radius
        return mark == "i" and room > 0 and across.at_most(room**2 * self.frame.square)


@dataclass(frozen=True, slots=True)
class Passage:
    """A passage of an opening, and within which times it happens, s."""

    hoop: str
    way: str
    start: Fraction
    stop: Fraction


def passages(path: Path, hoop: str, opening: Opening, marks: Marks) -> list[Passage]:
    """Return when a path passes an opening.

    Args:
        path: The path.
        hoop: The hoop's name.
        opening: Its opening.
        marks: Evidence.

    Raises:
        Refused: A tree says what is not so, or the path may be near the opening without passing it.
    """
    frame, found = opening.frame, list[Passage]()
    planes = box_around(frame.center, [frame.ring.opening + opening.margin] * 3)
    sides: list[Bernstein] = []  # D on leaves, since the path was far from the opening
    begin = ZERO
    for segment in path.segments:
        if not sides and any(map(segment.is_beyond, planes)):
            continue
        for leaf in leaves(Cell(frame.rows(segment), opening.claims), marks):
            if leaf.mark == "n":
                if sides:
                    found.append(_passage(hoop, sides, opening.far, begin, segment.time(leaf.start)))
                sides = []
            elif leaf.mark == "i" and isinstance(leaf.part, Cell):
                begin = begin if sides else segment.time(leaf.start)
                sides.append(leaf.part.rows[0])
            else:
                raise Refused(f"the path may be near the opening of {hoop} and not inside it")
    if sides:
        raise Refused(f"the path ends in the opening of {hoop}")
    return found


def _passage(hoop: str, sides: list[Bernstein], far: Fraction, start: Fraction, stop: Fraction) -> Passage:
    """Return a passage: leaves before the far side is reached, leaves in which D never falls, and leaves after which the near side is not."""
    way = 1 if sides[-1].ends()[1] > 0 else -1
    along = [row if way > 0 else Bernstein([-n for n in row.numbers], row.unit) for row in sides]
    if not along[0].ends()[0] < -far <= far < along[-1].ends()[1]:
        raise Refused(f"the path may enter the opening of {hoop} without passing it")
    rest = dropwhile(lambda row: row.numbers == sorted(row.numbers), dropwhile(lambda row: row.at_most(far), along))
    if not all(row.at_least(-far) for row in rest):
        raise Refused(f"the path may pass the opening of {hoop} more than once")
    return Passage(hoop, "F" if way > 0 else "R", start, stop)


def check_passages(statement: Statement, path: Path, every: list[Passage], made: Visits) -> None:
    """Check that passages are the planned ones, in order, each while its visit must be in the region, and those of the sequence.

    Args:
        statement: Says which sequence is to be flown, if any.
        path: The path.
        every: Its passages, in order of their starts.
        made: Its visits.

    Raises:
        Refused: That is not so.
    """
    shown = " ".join(f"{one.hoop}{one.way}" for one in every[:40]) or "nothing"
    wanted = [(number, visit) for number, visit in enumerate(path.robot.visits) if visit.direction is not None]
    if [(one.hoop, one.way) for one in every] != [(visit.region, visit.direction) for _, visit in wanted]:
        raise Refused(f"it passes {shown}, which is not planned")
    words: tuple[list[tuple[str, str]], list[tuple[str, str]]] = ([], [])
    for position, ((number, _), one) in enumerate(zip(wanted, every, strict=True)):
        if position and every[position - 1].stop >= one.start:
            raise Refused("two of its passages cannot be told apart in time")
        if not any(span.start <= one.start and one.stop <= span.stop for span in made.stays[number].must):
            raise Refused(f"its visit of {one.hoop} may not contain the passage")
        in_lap = made.lap is not None and number >= made.lap
        if path.lap is not None and not (one.start > path.lap if in_lap else one.stop < path.lap):
            raise Refused("a passage is on the wrong side of where the lap begins")
        words[in_lap].append((one.hoop, one.way))
    if statement.sequence is not None and not same_words(*words, *statement.sequence):
        raise Refused(f"it passes {shown}, which is not the mission's sequence")


def same_words(prefix: Word, cycle: Word, other: Word, its_cycle: Word | None) -> bool:
    """Return whether two words are one, each a prefix and what is repeated for ever, if anything.

    Two such words are one if they agree on as many letters as the longer prefix and both cycles have.

    Args:
        prefix: Of the one.
        cycle: Of the one.
        other: Prefix of the other.
        its_cycle: Its cycle.
    """
    again = its_cycle or ()
    most = max(len(prefix), len(other)) + len(cycle) + len(again)
    long = [(*first, *(tuple(then) * (most // max(len(then), 1) + 1))) for first, then in ((prefix, cycle), (other, again))]
    return bool(cycle) == bool(again) and long[0][: most or None] == long[1][: most or None]


@dataclass(frozen=True, slots=True)
class Rim:
    """The claim `n` that a path stays farther than a length from a rim.

    Some direction, outwards of the ring, has all of the path farther out than the ring by more than the length.
    """

    frame: Frame
    length: Fraction

    def claims(self, mark: str, rows: Rows) -> bool:
        """Return whether a mark is so."""
        (along, across), (ring, square) = rows, (self.frame.ring, self.frame.square)
        least = max(Fraction(along.lowest, along.unit), Fraction(-along.highest, along.unit))
        beside = least / self.frame.high - ring.rim / 2  # at least so far before or behind the ring
        for a, b, c in DIRECTIONS if mark == "n" else ():
            if a and least <= 0:
                continue  # on both sides of the plane
            # a beside + b (opening - p) > c length, or a beside + b (p - outer) > c length, p the distance from the axis
            inner, outer = (
                a * beside - c * self.length + sign * b * r for sign, r in ((1, ring.opening), (-1, ring.opening + ring.rim))
            )
            if inner > 0 and (not b or across.below((inner / b) ** 2 * square)):
                return True
            if b and (outer > 0 or across.above((outer / b) ** 2 * square)):
                return True
        return False


def check_rim(path: Path, rim: Rim, marks: Marks) -> None:
    """Check that a path stays farther than a length from a hoop's rim.

    Args:
        path: The path.
        rim: The rim.
        marks: Evidence.

    Raises:
        Refused: That is not proved.
    """
    ring = rim.frame.ring
    planes = box_around(rim.frame.center, [ring.opening + 2 * ring.rim + rim.length] * 3)
    for segment in path.segments:
        if not any(map(segment.is_beyond, planes)):
            require(Cell(rim.frame.rows(segment), rim.claims), marks, "it stays clear of a rim")
