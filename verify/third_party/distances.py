"""Least distances between drones, for all times: bounds on polynomials first, exact arithmetic where those leave it open.

With `weight` k the distance in z counts k times. Where a drone's pieces do not join exactly it is nowhere between them for an instant;
the longest steps of both drones are taken off what is proved of a pair, as for planned flights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, dot, restricted_by, root_up
from verify.arithmetic.bounds import Peaks, peaks
from verify.third_party.fleet import Fleet, Indices, is_before, length_between
from verify.third_party.windows import Windows, crossings, is_high, windows_of

BLOCK = 16_384
"""Pairs of pieces whose distances are computed at once, which bounds the memory."""

MOST_BREACHES = 200_000
"""Pairs of pieces that are too near; of more the rest is not listed."""

NEAR = 1e-6
"""m; how nearly the least distance of all is told where it is no breach."""

_WIDTH = Fraction(1, 10**9)
"""s; how nearly it is told when a breach begins and ends."""

PiecePairs = Iterable[tuple[Indices, Indices]]
"""Rows of one drone's pieces and of another one's that share some time, block by block."""


@dataclass(frozen=True, slots=True)
class Breach:
    """Two drones nearer than they may be.

    Attributes:
        one: Index of a drone.
        other: Index of another one, above it.
        limit: What was asked, in m.
        distance: Reached at `time`, up to rounding, in m.
        time: When they are nearest, about, in s.
        start: From when they are too near, in s.
        stop: Until when, in s.
        sure: Whether it is refuted that they keep the limit; otherwise only steps between pieces stand against it.
    """

    one: int
    other: int
    limit: float
    distance: float
    time: float
    start: float
    stop: float
    sure: bool


@dataclass(frozen=True, slots=True)
class Nearest:
    """The least distance of all pairs.

    Attributes:
        low: Proved for all pairs and times, in m.
        high: Reached at `time`, up to rounding, in m.
        one: Index of a drone; -1 where there is no pair.
        other: Index of the other one.
        time: In s.
    """

    low: float
    high: float
    one: int
    other: int
    time: float


@dataclass(slots=True)
class Closest:
    """Least distance known so far: mutable, as it guides the search for near pieces.

    Attributes:
        high: Some pair comes so near, in m.
        one: Index of a drone of that pair.
        other: Index of the other one.
        time: When, in s.
        low: No pair of pieces that was put aside comes nearer, steps between pieces allowed for, in m.
    """

    high: float = np.inf
    one: int = -1
    other: int = -1
    time: float = 0.0
    low: float = np.inf

    def put_aside(self, squares: Floats, steps: Floats, floors: Floats | float = 0.0) -> None:
        """Take note of squared distances that pieces are proved to keep.

        Args:
            squares: In m^2. Shape (k,).
            steps: What their drones' steps between pieces come to, in m. Shape (k,).
            floors: Proved of their drones' distances by themselves, in m.
        """
        if len(squares):
            roots = np.nextafter(np.sqrt(np.maximum(squares, 0.0)), -np.inf)
            less = np.where(steps > 0, np.nextafter(roots - steps * (1 + 2.0**-40), -np.inf), roots)
            self.low = min(self.low, float(np.maximum(np.maximum(less, floors), 0.0).min()))

    # five parameters: pairs of pieces, and what they reach when
    def come_to(self, fleet: Fleet, windows: Windows, one: Indices, other: Indices, least: Peaks) -> None:
        """Take note of the least distance that pairs of pieces reach.

        Args:
            fleet: The drones.
            windows: When pieces are compared with others.
            one: Rows of one drone's pieces.
            other: Rows of the other one's.
            least: Greatest values of their negated squared distances, in m^2.
        """
        k = int(np.argmax(least.lower))
        if (distance := root_up(-float(least.lower[k]))) < self.high:
            start, stop = common_time(windows, int(one[k]), int(other[k]))
            self.high, self.one, self.other = distance, int(fleet.owner[one[k]]), int(fleet.owner[other[k]])
            self.time = float(start + (stop - start) * Fraction(float(least.place[k])))


@dataclass(frozen=True, eq=False)
class Separation:
    """Required distances of pairs.

    Attributes:
        limits: Least distances of drones given by two arrays of indices, in m.
        most: The greatest of them all, in m.
        weight: By which distances in z are multiplied.
        steps: Bound on each drone's longest step between pieces, weighted, in m. Shape (drones,).
        fewest: The least of all pairs' limits, in m.
        above: Two drones must keep it only while neither is lower than this, in m; None for always.
        windows: When pieces are compared with others; None for always.
    """

    def on(self, fleet: Fleet) -> Windows:
        """Return when pieces are compared with others.

        Args:
            fleet: The drones.
        """
        return self.windows or windows_of(fleet, self.above)

    limits: Callable[[Indices, Indices], Floats]
    most: float
    weight: Fraction
    steps: Floats
    fewest: float
    above: float | None = None
    windows: Windows | None = None


@np.errstate(all="ignore")
def judge_distances(fleet: Fleet, asked: Separation, pairs: PiecePairs, closest: Closest) -> tuple[Nearest, list[Breach]]:
    """Find every breach and the least distance.

    Args:
        fleet: The drones.
        asked: What pairs must keep.
        pairs: Pieces that may hold a breach or the least distance; of all others it is proved that they do not.
        closest: What is known of the least distance; it is brought up to date while `pairs` is gone through.
    """
    found: list[Breach] = []
    asked = replace(asked, windows=asked.on(fleet))
    for one, other in pairs:
        for low in range(0, len(one), BLOCK):
            found += _judge(fleet, asked, one[low : low + BLOCK], other[low : low + BLOCK], closest)
        if len(found) > MOST_BREACHES:
            closest.low = 0.0  # nothing is claimed of what was not looked at
            break
    return Nearest(max(min(closest.low, closest.high), 0.0), closest.high, closest.one, closest.other, closest.time), _joined(
        found
    )


def _judge(fleet: Fleet, asked: Separation, one: Indices, other: Indices, closest: Closest) -> Iterator[Breach]:
    """Check pairs of pieces over the times that both last."""
    windows = asked.on(fleet)
    meet = windows.kept[one] & windows.kept[other]
    meet &= is_before(windows.starts[one], windows.stops[other]) & is_before(windows.starts[other], windows.stops[one])
    if not meet.all():
        one, other = one[meet], other[meet]
    if not len(one):
        return
    first, second = fleet.owner[one], fleet.owner[other]
    limits = asked.limits(first, second)
    steps = asked.steps[first] + asked.steps[second]
    needed = np.where(steps > 0, np.nextafter(limits + steps * (1 + 2.0**-40), np.inf), limits)
    level = needed * needed * (1 + 2.0**-50)
    wanted = np.maximum(level, max(closest.high - NEAR, 0.0) ** 2)
    offsets = _offsets(fleet, windows, one, other, asked.weight)
    low = _apart_one_way(offsets) ** 2 * (1 - 2.0**-50)
    aside = low >= wanted  # what is not known is looked at
    closest.put_aside(low[aside], steps[aside], limits[aside])
    open_ = np.flatnonzero(~aside)
    if not len(open_):
        return
    squares = dot(offsets[open_], offsets[open_])
    low = squares.low.min(-1)
    aside = low >= wanted[open_]
    closest.put_aside(low[aside], steps[open_][aside], limits[open_][aside])
    squares, open_ = squares[~aside], open_[~aside]
    if not len(open_):
        return
    one, other = one[open_], other[open_]
    limits, needed, level, steps = limits[open_], needed[open_], level[open_], steps[open_]
    slack = np.maximum(1e-9 * level, NEAR * min(closest.high, 1.0) + 1e-9)
    least = peaks(-squares, np.arange(len(open_)), len(open_), slack=slack, critical=-level)
    closest.come_to(fleet, windows, one, other, least)
    apart = -least.upper >= level
    closest.put_aside(-least.upper[apart], steps[apart], limits[apart])
    for k in np.flatnonzero(~apart).tolist():
        a, b, limit = int(one[k]), int(other[k]), Fraction(float(limits[k]))
        start, stop = common_time(windows, a, b)
        gap = _gap(fleet, asked.weight, (a, b), (start, stop), Fraction(float(needed[k])))
        if exact.nonnegative(gap):
            closest.put_aside(-least.upper[k : k + 1], steps[k : k + 1], limits[k : k + 1])
            continue
        times = (
            _breach_times(gap, start, stop)
            if asked.above is None
            else _high_breach(fleet, gap, (a, b), (start, stop), asked.above)
        )
        if times is None:
            closest.put_aside(-least.upper[k : k + 1], steps[k : k + 1], limits[k : k + 1])
            continue
        closest.put_aside(-least.upper[k : k + 1], steps[k : k + 1])
        sure = needed[k] == limit or not exact.nonnegative(_gap(fleet, asked.weight, (a, b), (start, stop), limit))
        begin, end = times
        time = float(min(max(start + (stop - start) * Fraction(float(least.place[k])), begin), end))
        drones = int(fleet.owner[a]), int(fleet.owner[b])
        distance = root_up(-float(least.lower[k]))
        yield Breach(*drones, float(limit), distance, time, float(begin), float(end), sure)


# five parameters: pairs of pieces, and how they are compared with each other
def _offsets(fleet: Fleet, windows: Windows, one: Indices, other: Indices, weight: Fraction) -> Balls:
    """Return one drone's place less the other's, weighted, during the times that both pieces last. Shape (pairs, 3, degree + 1)."""
    begin = _later(windows.starts[one], windows.starts[other])
    end = _sooner(windows.stops[one], windows.stops[other])
    offset = _during(fleet, one, begin, end) - _during(fleet, other, begin, end)
    if weight != 1:
        number = float(weight)
        offset = offset.scaled(np.array([1.0, 1.0, number])[:, None], np.array([0.0, 0.0, abs(number) * 2.0**-52])[:, None])
    return offset


def _apart_one_way(offsets: Balls) -> Floats:
    """Bound distances from below by how far apart pieces are along one line; 0 where that shows nothing. Shape (pairs,).

    Any line will do. Taken is the one through both drones when they are nearest, as if the pieces were straight, which most nearly are: there it
    shows all of the distance, for a part of what squares cost.
    """
    first, chord = offsets.mid[..., 0], offsets.mid[..., -1] - offsets.mid[..., 0]
    share = np.clip(-(first * chord).sum(-1) / (chord * chord).sum(-1), 0.0, 1.0)
    way = first + np.where(np.isnan(share), 0.0, share)[:, None] * chord
    along = np.einsum("ij,ijk->ik", way, offsets.mid)
    doubt = np.einsum("ij,ijk->ik", np.abs(way), offsets.rad + 1e-14 * np.abs(offsets.mid))  # far more than its rounding
    low = (along - doubt).min(-1) / np.sqrt((way * way).sum(-1)) * (1 - 1e-14)
    return np.where(low > 0, low, 0.0)


def _during(fleet: Fleet, rows: Indices, begin: Floats, end: Floats) -> Balls:
    """Return positions on the parts of pieces between times. Shape (rows, 3, degree + 1)."""
    positions = fleet.positions(rows)
    start, stop = fleet.knots[fleet.knot[rows]], fleet.knots[fleet.knot[rows] + 1]
    cut = np.flatnonzero((start != begin).any(-1) | (stop != end).any(-1))
    if not len(cut):
        return positions
    ahead = _quotient(length_between(start[cut], begin[cut]), length_between(start[cut], stop[cut]))
    share = _quotient(length_between(begin[cut], end[cut]), length_between(begin[cut], stop[cut]))
    part = restricted_by(positions[cut], ahead, share)
    positions.mid[cut], positions.rad[cut] = part.mid, part.rad
    return positions


def _quotient(over: tuple[Floats, Floats], under: tuple[Floats, Floats]) -> Balls:
    """Return quotients of positive numbers known up to errors, for pieces of three coordinates. Shape (k, 1, 1)."""
    (a, da), (b, db) = over, under
    value = a / b
    off = ((da + value * db) / (b - db) + 2.0**-52 * value) * (1 + 2.0**-40) + 1e-290
    return Balls(value[:, None, None], off[:, None, None])


def _later(a: Floats, b: Floats) -> Floats:
    """Return the later of exact times, each the sum of two floats."""
    return np.where(is_before(a, b)[:, None], b, a)


def _sooner(a: Floats, b: Floats) -> Floats:
    return np.where(is_before(a, b)[:, None], a, b)


def common_time(windows: Windows, a: int, b: int) -> tuple[Fraction, Fraction]:
    """Return from when until when two pieces both last, exact, in s.

    Args:
        windows: When pieces are compared with others.
        a: Row of a piece.
        b: Row of another one.
    """
    starts, stops = (
        ((Fraction(x) + Fraction(y)) for x, y in table[[a, b]].tolist()) for table in (windows.starts, windows.stops)
    )
    return max(starts), min(stops)


def _gap(fleet: Fleet, weight: Fraction, rows: tuple[int, int], times: tuple[Fraction, Fraction], limit: Fraction) -> fmpq_poly:
    """Return the squared distance less the squared limit, exactly, on [0, 1] over the common time."""
    start, stop = times
    parts: list[list[fmpq_poly]] = []
    for row in rows:
        begin, length = fleet.start(row), fleet.stop(row) - fleet.start(row)
        parts.append([exact.on_unit_interval(p, (start - begin) / length, (stop - begin) / length) for p in fleet.exactly(row)])
    offset = [p - q for p, q in zip(*parts, strict=True)]
    offset[2] *= exact.rational(weight)
    return sum((p * p for p in offset), fmpq_poly([0])) - exact.rational(limit * limit)


def _breach_times(gap: fmpq_poly, start: Fraction, stop: Fraction) -> tuple[Fraction, Fraction]:
    """Return from when until when a polynomial on [0, 1] is below zero at some time, outermost."""
    length = stop - start
    places = [
        Fraction(0),
        *((r.low + r.high) / 2 for r in exact.roots(gap, Fraction(0), Fraction(1), _WIDTH / length)),
        Fraction(1),
    ]
    below = [(low, high) for low, high in pairwise(places) if low < high and gap(exact.rational((low + high) / 2)) < 0]
    if not below:
        return start, stop
    return start + length * below[0][0], start + length * below[-1][1]


# five parameters: two pieces, and what is asked of them when
def _high_breach(
    fleet: Fleet, gap: fmpq_poly, rows: tuple[int, int], times: tuple[Fraction, Fraction], above: float
) -> tuple[Fraction, Fraction] | None:
    """Return from when until when a polynomial on [0, 1] is below zero while neither of two drones is lower than a height, outermost."""
    start, stop = times
    least = Fraction(above)
    found = exact.roots(gap, Fraction(0), Fraction(1), _WIDTH / (stop - start)) if gap.degree() > 0 else []
    places = [start + (stop - start) * (r.low + r.high) / 2 for r in found]
    places += [time for row in rows for time in crossings(fleet, row, least) if start < time < stop]
    edges = sorted({start, *places, stop})
    below = [
        (low, high)
        for low, high in pairwise(edges)
        if gap(exact.rational(((low + high) / 2 - start) / (stop - start))) < 0
        and is_high(fleet, rows, (low + high) / 2, least)
    ]
    if not below:
        return None
    return below[0][0], below[-1][1]


def _joined(found: list[Breach]) -> list[Breach]:
    """Put together what goes on from one piece to the next, worst breach first."""
    result: list[Breach] = []
    for breach in sorted(found, key=lambda b: (b.one, b.other, b.start)):
        last = result[-1] if result else None
        if last is not None and (last.one, last.other) == (breach.one, breach.other) and breach.start <= last.stop + 1e-9:
            worst = min(last, breach, key=lambda b: b.distance)
            result[-1] = replace(
                worst, start=min(last.start, breach.start), stop=max(last.stop, breach.stop), sure=last.sure or breach.sure
            )
        else:
            result.append(breach)
    result.sort(key=lambda b: (b.distance - b.limit, b.start))
    return result
