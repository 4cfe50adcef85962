"""Zones that all of the ball around a path is inside of, or outside of: regions, obstacles, openings, rims, the workspace.

Each inequality is f(x) <= 0, by the weights of xx, xy, xz, yy, yz, zz, x, y, z and 1 in f. A quadric is (x - c)'Q(x - c) <= B with Q semidefinite,
its square completed. Of a ball of radius d around x all points keep it where sqrt((x - c)'Q(x - c)) <= sqrt(B) - s d. None does where it is above
sqrt(B) + s d; s^2 is at least Q's greatest eigenvalue. A half-space n.x <= h moves by |n| d (Coq: `quadric_must`, `quadric_no`, `half_space_must`,
`half_space_no`). Last, distances between robots, of all times that their clocks, which differ, may show at one moment.
"""

import operator
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

from .flights import Path
from .statement import MOST, ZERO, Inequality, Shape, Statement, Vector, at_least, few, require
from .trees import Atom, Bernstein, Cell, Polynomial, Rules, root, square

Sums = tuple[tuple[tuple[int, int], ...], ...]  # sums of inequalities, of each their numbers and weights
Solid = tuple[Shape, tuple[Shape, ...], tuple[Sums, ...]]
"""An obstacle, its openings' hoops, and for each part sums of its half-spaces."""
Terms = tuple[Fraction, ...]
NOTHING: Vector = (ZERO, ZERO, ZERO)


def along(path: Path, rules: Rules) -> Iterator[Cell]:
    """Yield claims of each segment of a path."""
    return (Cell(segment.sum, rules) for segment in path.segments)


def terms_of(one: Inequality, center: Vector) -> Terms:
    """Return the weights of an inequality around a centre."""
    linear, q = one.linear or NOTHING, one.quadratic
    rest = sum((-linear[i] * center[i] for i in range(3) if linear[i]), -one.bound)
    if q is None:
        return (*NOTHING, *NOTHING, *linear, rest)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = q
    pulled = [sum((q[i][k] * center[k] for k in range(3)), ZERO) for i in range(3)]
    (x, y, z), last = (linear[i] - 2 * pulled[i] for i in range(3)), sum((pulled[i] * center[i] for i in range(3)), rest)
    return xx, 2 * xy, 2 * xz, yy, 2 * yz, zz, x, y, z, last


def pivots(terms: Terms) -> list[Fraction]:
    """Return pivots of a quadratic function, -1 for a zero with more in its row; if none is below zero, nor is the function (Coq: `elimination_quadratic`)."""
    xx, xy, xz, yy, yz, zz, x, y, z, one = (value / (1 if i in (0, 3, 5, 9) else 2) for i, value in enumerate(terms))
    rows, found = [[xx, xy, xz, x], [xy, yy, yz, y], [xz, yz, zz, z], [x, y, z, one]], list[Fraction]()
    while rows:
        pivot, *rest = rows[0]
        found.append(pivot if pivot or not any(rest) else Fraction(-1))
        rows = [[a - row[0] * b / pivot if pivot else a for a, b in zip(row[1:], rest, strict=True)] for row in rows[1:]]
    return found


def _scale(terms: Terms) -> Fraction:
    """Return s such that s^2 is at least the greatest eigenvalue of a semidefinite form, by row sums and halving (Coq: `rows_grow`, `rest_grows`, `elimination_semidefinite`)."""
    xx, xy, xz, yy, yz, zz = (abs(value) for value in terms[:6])
    low, high = max(xx, yy, zz), max(2 * xx + xy + xz, xy + 2 * yy + yz, xz + yz + 2 * zz) / 2
    for _ in range(32):
        middle = (low + high) / 2
        rest = [middle * (i in (0, 3, 5)) - value for i, value in enumerate(terms[:6])]
        low, high = (low, middle) if min(pivots((*rest, *[ZERO] * 4))) >= 0 else (middle, high)
    return root(high)[1]


@lru_cache(maxsize=4096)
def asked(terms: Terms, margin: Fraction) -> tuple[list[Atom], Atom]:
    """Return that all of the ball keeps an inequality, which may be nowhere, and that none of it does."""
    if any(terms[:6]):
        *kept, last = pivots(terms)  # Coq: `square_completed`
        require(min(kept) >= 0, "an inequality has a form that is not understood")
        require(last < 0, "an inequality leaves no points")
        (low, high), by = root(-last), _scale(terms) * margin
        inside, outside = ((low - by) ** 2 + last if low > by else None, (high + by) ** 2 + last) if margin else (ZERO, ZERO)
    else:
        require(any(terms[6:9]), "an inequality has no coordinate in it")
        outside = root(sum((x * x for x in terms[6:9]), ZERO))[1] * margin
        inside = -outside
    form = Polynomial.of(terms)
    return [] if inside is None else [(form, "<=", inside)], (form, ">", outside)


@lru_cache(maxsize=4096)
def region(shape: Shape, margin: Fraction) -> Rules:
    """Return the claims `m` that a path is inside a region by a margin, `n` that it is outside, and `y` that it is so nowhere. Claim `i` is that it
    is so up to some time, if at all, and then nowhere; `o` is the other way round.

    Outside it breaks an inequality of each part. Inside it keeps one of each `choice`, so that all of the ball is in some part, or in one part alone
    where choices are too many. If functions that break one only fall, or only rise, it comes, or goes, once (Coq: `comes_near_once`, `leaves_once`).
    """
    parts = [[terms_of(one, shape.center) for one in part] for part in shape.parts]
    clauses, broken = choices(parts), {one: asked(one, margin)[1] for part in parts for one in part}
    whole = {one: [(form, "<=", bound)] for one, (form, _, bound) in broken.items()}
    found = {"n": [[[broken[one] for one in part] for part in parts]]}
    for mark, kept in (("m", {one: asked(one, margin)[0] for one in broken}), ("y", whole)):
        together = [[atom for one in clause for atom in kept[one]] for clause in clauses]
        found[mark] = [together] if together else [[kept[one] for one in part] for part in parts]
    for mark, sign in (("i", "falls"), ("o", "rises")):
        ways = ((one, [broken[k] for k in part]) for part in parts for one in part)
        found[mark] = [[[*some, *whole[one], (broken[one][0], sign, ZERO)] for one, some in ways]]
    return found


def choices(parts: Sequence[Sequence[Terms]]) -> list[frozenset[Terms]]:
    """Return sets of inequalities of which a point is in some part if it keeps one of each; none where they are too many. A point in no part breaks
    one of each part. It keeps one of such a choice if two of these meet, so that others do (Coq: `some_part`, `faces_meet`).
    """
    found = [frozenset[Terms]()]
    for part in parts:
        more = [one | {face} for one in found for face in part if not any(_meet(face, other) for other in one)]
        found = [one for one in dict.fromkeys(more) if not any(other < one for other in more)]
        if len(found) > MOST["choices of faces"]:
            return []
    return found


def _meet(one: Terms, other: Terms) -> bool:
    """Return whether each point keeps one of two inequalities: some sum of their functions is nowhere above zero."""
    weight = next((-a / b for a, b in zip(one, other, strict=True) if b), ZERO)
    *rest, last = (a + weight * b for a, b in zip(one, other, strict=True))
    return weight > 0 and not any(rest) and last <= 0


class Hoop:
    """A hoop with centre c and normal n. Of a place r, D = (r - c) . n and P = |r - c|^2 |n|^2 - D^2. Then |D| / |n| is how far r is from the
    opening's plane, and sqrt(P) / |n| how far from its axis. Lengths are compared with |n|^2, or with `high`, above |n|.
    """

    def __init__(self, shape: Shape) -> None:
        assert shape.ring is not None
        (a, b, c), self.ring = shape.ring.normal, shape.ring
        self.square = a * a + b * b + c * c
        across = (b * b + c * c, -a * b, -a * c), (-a * b, a * a + c * c, -b * c), (-a * c, -b * c, a * a + b * b)
        self.high, self.along = root(self.square)[1], Polynomial.of(terms_of(Inequality(ZERO, (a, b, c)), shape.center))
        self.across = Polynomial.of(terms_of(Inequality(ZERO, None, across), shape.center))
        self.ways = {"F": self.along, "R": Polynomial([-1]) * self.along}

    def within(self, length: Fraction) -> list[Atom]:
        """Return that a path is inside the opening by more than a length."""
        room = self.ring.opening - length
        return [(self.across, "<", room**2 * self.square)] if room > 0 else []

    def beside(self, length: Fraction) -> Atom:
        """Return that a path is farther from the opening's axis than its radius and a length."""
        return self.across, ">", (self.ring.opening + length) ** 2 * self.square

    def apart(self, length: Fraction) -> list[Atom]:
        """Return that a path is farther from the opening's plane than a length, which is not below zero: behind it, or before it."""
        return [(self.along, ">", length * self.high), (self.along, "<", -length * self.high)]


def opening(shape: Shape, lengths: tuple[Fraction, Fraction]) -> Rules:
    """Return the claims `n` that no point within a margin is in a hoop's opening, and `F` and `R` of a vehicle there: it is inside by its radius, and
    flies on, forward or in reverse, or stays near the plane (Coq: `before_plane`, `behind_plane`, `beside_opening`, `inside_opening`).
    """
    (margin, radius), hoop = lengths, Hoop(shape)
    inside = [(hoop.across, "<=", bound) for _, _, bound in hoop.within(margin + radius)]
    near = [("<=", margin * hoop.high), (">=", -margin * hoop.high)]
    ways = {way: [[inside, *([(p, "rises", ZERO), (p, *bound)] for bound in near)]] for way, p in hoop.ways.items()}
    return {"n": [[[*hoop.apart(margin), hoop.beside(margin)]]], **ways}


def rim(shape: Shape, length: Fraction) -> Rules:
    """Return the claim `n` that a path stays farther than a length from a hoop's rim. It is so in its plane by one side of a right triangle, along
    the axis by the other, in some of 32 directions (Coq: `rim_clear`). The length is the triangle's longest side.
    """
    hoop, ways = Hoop(shape), list[list[list[Atom]]]()
    wide = hoop.ring.rim
    for t in (Fraction(k, 32) for k in range(32)):
        aside, above = (1 - t * t) / (1 + t * t) * length, 2 * t / (1 + t * t) * length
        beside = [hoop.beside(wide + aside), *hoop.within(aside)]
        ways.append([beside, hoop.apart(wide / 2 + above)] if t else [beside])
    return {"n": [*ways, [hoop.apart(wide / 2 + length)]]}


def obstacle(solid: Solid, length: Fraction) -> Rules:
    """Return the claim `n` that a path is farther than a length from all that is solid of an obstacle. Of each part one inequality is broken by the
    length, or one sum of half-spaces, which all its points keep (Coq: `quadric_no`, `farkas_keeps`, `farkas_ball`). Or all within the length is in
    the opening of a hoop that leads through the part, which holds its centre.
    """
    (shape, hoops, sums), clauses = solid, list[list[Atom]]()
    require(len(sums) == len(shape.parts), "a proof sums half-spaces of other parts")
    for part, rows in zip(shape.parts, sums, strict=True):
        terms = [terms_of(one, shape.center) for one in part]
        few(len(rows), "sums of half-spaces")
        fits = all(k < len(part) and not part[k].quadratic for row in rows for k, _ in row)
        require(fits, "a proof sums half-spaces that there are not")
        summed = [tuple(sum((w * terms[k][i] for k, w in row), ZERO) for i in range(10)) for row in rows]
        clauses.append([asked(one, length)[1] for one in (*terms, *summed)])
        for hoop in hoops:
            x, y, z = hoop.center
            powers = x * x, x * y, x * z, y * y, y * z, z * z, x, y, z, 1
            if all(sum(map(operator.mul, one, powers)) <= 0 for one in terms):
                clauses[-1] += Hoop(hoop).within(length)
    return {"n": [clauses]}


def workspace(corners: tuple[Vector, Vector], margin: Fraction) -> Rules:
    """Return the claim `m` that a path stays between the workspace's corners by the margin."""
    axes = [Polynomial([int(k == axis + 6) for k in range(10)]) for axis in range(3)]
    every = zip(axes, *corners, strict=True)
    return {"m": [[[wall] for axis, low, high in every for wall in ((axis, ">=", low + margin), (axis, "<=", high - margin))]]}


BITS = 40
Box = Sequence[tuple[int, int]]  # along x, y and z from where to where, m, over 2^40


class Flown(NamedTuple):
    """A part of a path that takes time: from when to when, its places along x, y and z, and a box around them."""

    start: Fraction
    stop: Fraction
    places: Sequence[Bernstein]
    box: Box

    def halves(self) -> "list[Flown]":
        """Return both halves."""
        middle = (self.start + self.stop) / 2
        times, places = ((self.start, middle), (middle, self.stop)), zip(*(row.halves() for row in self.places), strict=True)
        return [Flown(*when, where, self.box) for when, where in zip(times, places, strict=True)]


class Flight:
    """One robot's path, a metre in z counting `weight`, lengths `unit` times as long; it is within `loose` of each place then: of any place of a step."""

    def __init__(self, statement: Statement, path: Path) -> None:
        weight = Fraction(1) if statement.separation_z is None else statement.separation / statement.separation_z
        self.weight, self.unit, self.path, self.rows = weight, weight.denominator, path, list[Flown]()
        steps = [square([axis.derivative() for axis in one.axes]) for one in path.segments if one.start == one.stop]
        step, self.stretch = root(max((one.at(0) for one in steps), default=ZERO))[1], max(Fraction(1), weight)
        self.radius, self.loose = self.stretch * path.robot.radius, self.stretch * (statement.margin + step)
        for one in (one for one in path.segments if one.start < one.stop):
            every = zip(one.axes, (self.unit, self.unit, weight.numerator), strict=False)
            places = [
                one.bernstein(Polynomial([times * n for n in axis.numbers], axis.shift), 7) for axis, times in every
            ]  # as pieces
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

    def parts(self, error: Fraction) -> "Iterator[Two]":
        """Yield the claims that they are far enough apart at times that differ by at most an error, s, where boxes do not part them. Of segments that
        meet at one instant their neighbours are looked at: a robot may be anywhere on a step.
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
    """Parts of two paths. `k`: no two clocks show their times at once. `m`: a plane across the way between them parts them enough (Coq: `plane_parts`)."""

    one: Flown
    other: Flown
    error: Fraction
    square: Fraction

    def holds(self, mark: str) -> bool:
        """Return whether a mark is so."""
        if mark == "k":
            return max(self.one.start - self.other.stop, self.other.start - self.one.stop) > self.error
        unit = max(row.unit for row in (*self.one.places, *self.other.places))  # of powers of two, times one number
        mine, its = ([[n * (unit // row.unit) for n in row.numbers] for row in one.places] for one in (self.one, self.other))
        x, y, z = ((sum(a) - sum(b)) * 4096 // unit for a, b in zip(mine, its, strict=True))  # any would do
        near, far = ([x * a + y * b + z * c for a, b, c in zip(*rows, strict=True)] for rows in (mine, its))
        gap, least = min(near) - max(far), self.square * (x * x + y * y + z * z)
        return mark == "m" and gap > 0 and gap * gap * least.denominator >= least.numerator * unit * unit

    def halves(self) -> "tuple[Two, Two]":
        """Return both halves of the part that lasts longer."""
        if self.one.stop - self.one.start >= self.other.stop - self.other.start:
            first, second = (self._replace(one=half) for half in self.one.halves())
        else:
            first, second = (self._replace(other=half) for half in self.other.halves())
        return first, second
