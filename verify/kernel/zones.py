"""Zones that all of the ball around a path is inside of, or outside of: regions, obstacles, openings, rims, the workspace.

Each inequality is f(x) <= 0, by the weights of xx, xy, xz, yy, yz, zz, x, y, z and 1 in f. A quadric is (x - c)'Q(x - c) <= B with Q semidefinite,
its square completed. Of a ball of radius d around x all points keep it where sqrt((x - c)'Q(x - c)) <= sqrt(B) - s d, and none does where it is
above sqrt(B) + s d, s^2 being at least Q's greatest eigenvalue (Coq: `quadric_must`, `quadric_no`). A half-space n.x <= h moves by |n| d (Coq:
`half_space_must`, `half_space_no`).
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import lru_cache

from .flights import Path
from .polynomials import Polynomial, root
from .statement import ZERO, Inequality, Shape, Vector, require
from .trees import Atom, Cell, Rules

MOST_SUMS = 64
"""Sums of half-spaces that a proof may name for one part of an obstacle."""
CORNERS = 32
"""Directions between a rim's plane and its axis in which a path may be away from its edge."""
MOST_CHOICES = 300
"""Choices of one inequality of each part of a region."""
Sums = tuple[tuple[tuple[int, int], ...], ...]
"""Sums of inequalities, of each their numbers and weights."""
Terms = tuple[Fraction, ...]
NOTHING: Vector = (ZERO, ZERO, ZERO)


def along(path: Path, rules: Rules) -> Iterator[Cell]:
    """Yield claims of each segment of a path."""
    return (Cell(segment.sum, rules) for segment in path.segments)


@lru_cache(maxsize=65536)
def terms_of(one: Inequality, center: Vector) -> Terms:
    """Return the weights of an inequality around a centre."""
    q, linear = one.quadratic or (NOTHING,) * 3, one.linear or NOTHING
    pulled = [sum((q[i][k] * center[k] for k in range(3)), ZERO) for i in range(3)]
    rest = sum(((pulled[i] - linear[i]) * center[i] for i in range(3)), -one.bound)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = q
    return (xx, 2 * xy, 2 * xz, yy, 2 * yz, zz, *(linear[i] - 2 * pulled[i] for i in range(3)), rest)


def pivots(terms: Sequence[Fraction], size: int = 4) -> list[Fraction]:
    """Return pivots of the symmetric matrix of a function of x, y, z and 1; none is below zero where it is nowhere below zero.

    Where one is zero, and more stands in its row, it is -1 here. (Coq: `elimination_semidefinite`)
    """
    xx, xy, xz, yy, yz, zz, x, y, z, one = (value / (1 if i in (0, 3, 5, 9) else 2) for i, value in enumerate(terms))
    whole = [[xx, xy, xz, x], [xy, yy, yz, y], [xz, yz, zz, z], [x, y, z, one]]
    rows, found = [row[:size] for row in whole[:size]], list[Fraction]()
    while rows:
        pivot, *rest = rows[0]
        found.append(pivot if pivot or not any(rest) else Fraction(-1))
        rows = [[a - row[0] * b / pivot if pivot else a for a, b in zip(row[1:], rest, strict=True)] for row in rows[1:]]
    return found


def _scale(terms: Terms) -> Fraction:
    """Return s such that s^2 is at least the greatest eigenvalue of a semidefinite form (Coq: `rest_grows`, `rows_grow`)."""
    xx, xy, xz, yy, yz, zz = (abs(value) for value in terms[:6])
    low, high = max(xx, yy, zz), max(2 * xx + xy + xz, xy + 2 * yy + yz, xz + yz + 2 * zz) / 2
    for _ in range(32 if low < high else 0):
        middle = (low + high) / 2
        rest = [middle * (i in (0, 3, 5)) - value for i, value in enumerate(terms)]
        low, high = (low, middle) if min(pivots(rest, 3)) >= 0 else (middle, high)
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
    """Return the claims `m` that a path is inside a region by a margin, `n` that it is outside, `y` that it is so nowhere, and `i` that it is so up to
    some time, if at all, and then nowhere, or `o` the other way round.

    Outside it breaks an inequality of each part. Inside it keeps one of each `choice`, so that all of the ball is in some part, or in one
    part alone where choices are too many. If functions that break one only fall, or only rise, it comes, or goes, once (Coq: `comes_near_once`,
    `leaves_once`).
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
    """Return sets of inequalities of which a point is in some part if it keeps one of each; none where they are too many.

    A point that is in no part breaks an inequality of each. It keeps one of such a choice if two of these meet, so that others are enough.
    (Coq: `some_part`, `faces_meet`)
    """
    found = [frozenset[Terms]()]
    for part in parts:
        more = [one | {face} for one in found for face in part if not any(meet(face, other) for other in one)]
        found = [one for one in dict.fromkeys(more) if not any(other < one for other in more)]
        if len(found) > MOST_CHOICES:
            return []
    return found


def meet(one: Terms, other: Terms) -> bool:
    """Return whether each point keeps one of two inequalities: some sum of their functions is nowhere above zero (Coq: `faces_meet`)."""
    weight = next((-a / b for a, b in zip(one, other, strict=True) if b), ZERO)
    *rest, last = (a + weight * b for a, b in zip(one, other, strict=True))
    return weight > 0 and not any(rest) and last <= 0


class Hoop:
    """A hoop, measured.

    Of a place r, D = (r - c) . n with centre c and normal n, and P = |r - c|^2 |n|^2 - D^2: |D| / |n| is how far r is from the
    opening's plane, and sqrt(P) / |n| how far from its axis. Lengths are compared with |n|^2, or with `high`, above |n|.
    """

    def __init__(self, shape: Shape) -> None:
        assert shape.ring is not None
        (a, b, c), self.ring = shape.ring.normal, shape.ring
        self.square = a * a + b * b + c * c
        across = (b * b + c * c, -a * b, -a * c), (-a * b, a * a + c * c, -b * c), (-a * c, -b * c, a * a + b * b)
        self.high, self.along = root(self.square)[1], Polynomial.of(terms_of(Inequality(ZERO, (a, b, c)), shape.center))
        self.across = Polynomial.of(terms_of(Inequality(ZERO, None, across), shape.center))
        self.ways = {"F": self.along, "R": -self.along}

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


@lru_cache(maxsize=4096)
def opening(shape: Shape, margin: Fraction, radius: Fraction) -> Rules:
    """Return the claims `n` that no point within the margin is in a hoop's opening, and `F` and `R` that a vehicle there is inside by its radius
    and the margin; and that it flies on, forward or in reverse, or stays within the margin of the plane.

    (Coq: `before_plane`, `behind_plane`, `beside_opening`, `inside_opening`)

    Args:
        shape: The hoop.
        margin: m.
        radius: Of the vehicle, m.
    """
    hoop = Hoop(shape)
    inside = [(hoop.across, "<=", bound) for _, _, bound in hoop.within(margin + radius)]
    near = [("<=", margin * hoop.high), (">=", -margin * hoop.high)]
    ways = {way: [[inside, *([(p, "rises", ZERO), (p, *bound)] for bound in near)]] for way, p in hoop.ways.items()}
    return {"n": [[[*hoop.apart(margin), hoop.beside(margin)]]], **ways}


@lru_cache(maxsize=4096)
def rim(shape: Shape, length: Fraction) -> Rules:
    """Return the claim `n` that a path stays farther than a length from a hoop's rim: in its plane by one side of a right triangle,
    along the axis by the other, of which the length is the longest (Coq: `rim_clear`).
    """
    hoop, ways = Hoop(shape), list[list[list[Atom]]]()
    wide = hoop.ring.rim
    for t in (Fraction(k, CORNERS) for k in range(CORNERS)):
        aside, above = (1 - t * t) / (1 + t * t) * length, 2 * t / (1 + t * t) * length
        beside = [hoop.beside(wide + aside), *hoop.within(aside)]
        ways.append([beside, hoop.apart(wide / 2 + above)] if t else [beside])
    return {"n": [*ways, [hoop.apart(wide / 2 + length)]]}


@lru_cache(maxsize=4096)
def obstacle(shape: Shape, hoops: tuple[Shape, ...], length: Fraction, sums: tuple[Sums, ...]) -> Rules:
    """Return the claim `n` that a path is farther than a length from all that is solid of an obstacle.

    Of each part one inequality, or one sum of half-spaces, is broken by the length (Coq: `quadric_no`, `farkas_ball`), or all within the
    length is in an opening.

    Args:
        shape: The obstacle.
        hoops: Hoops that lead through the parts that hold their centres.
        length: m.
        sums: For each part sums of its half-spaces, which all points of the part keep (Coq: `farkas_keeps`).
    """
    clauses = list[list[Atom]]()
    require(len(sums) == len(shape.parts), "a proof sums half-spaces of other parts")
    for part, rows in zip(shape.parts, sums, strict=True):
        terms = [terms_of(one, shape.center) for one in part]
        fits = len(rows) <= MOST_SUMS and not any(k >= len(part) or part[k].quadratic for row in rows for k, _ in row)
        require(fits, "a proof sums half-spaces that there are not")
        summed = [tuple(sum((w * terms[k][i] for k, w in row), ZERO) for i in range(10)) for row in rows]
        clauses.append([asked(one, length)[1] for one in (*terms, *summed)])
        for hoop in hoops:
            x, y, z = hoop.center
            powers = x * x, x * y, x * z, y * y, y * z, z * z, x, y, z, 1
            if all(sum(map(operator.mul, one, powers)) <= 0 for one in terms):
                clauses[-1] += Hoop(hoop).within(length)
    return {"n": [clauses]}


@lru_cache(maxsize=64)
def workspace(corners: tuple[Vector, Vector], margin: Fraction) -> Rules:
    """Return the claim `m` that a path stays between the workspace's corners by the margin."""
    axes = [Polynomial([int(k == axis + 6) for k in range(10)]) for axis in range(3)]
    every = zip(axes, *corners, strict=True)
    return {"m": [[[wall] for axis, low, high in every for wall in ((axis, ">=", low + margin), (axis, "<=", high - margin))]]}
