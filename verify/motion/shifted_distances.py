"""Least distance of two robots whose clocks differ: over all pairs of times that lie no further apart than that.

At every instant one robot is where its path is at a time t, the other where its path is at u, with |t - u| up to the clocks' error.
Both paths are cut into parts. Two parts of which some times lie near enough are parted by the direction between their middles: a
polynomial lies in the hull of its Bernstein coefficients, so along that direction the one hull's least less the other's greatest is a
lower bound of their distance. Where that is too low, the part that reaches further is halved (branch and bound). Times are compared a
little too generously, and every rounding goes to the safe side, so that what is left out is out of reach.

Before its start a robot is where it starts and after its end where it ends: those places are reached within its flight, at times no
further apart. A lap is followed by its own beginning, for a robot that is already in the next one; waits between laps are at its end.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Balls, Floats, concatenate, halves
from verify.motion.paths import TeamPaths
from verify.motion.separation import MinimumDistance, PairwiseDistances, stretch_of, z_weight

PARTS = 8
"""Parts of a segment to begin with; a power of two."""

TOLERANCE = 2e-5
"""m that the proved least distance may stay below one that is reached."""

DEPTH = 48
MOST = 40_000
"""Pairs of parts that are open at once: more keep the (sound, looser) bounds that they have."""

_LATE = 1e-9
"""Share of the times, and s, by which they are compared too generously: roundings are far smaller."""

Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, slots=True)
class _Parts:
    """Parts of one robot's flight, or one of a pair's parts in each row.

    Attributes:
        start: s. Shape (parts,).
        stop: s. Shape (parts,).
        places: Bernstein coefficients of x, y and weighted z, m. Shape (parts, 3, 8).
    """

    start: Floats
    stop: Floats
    places: Balls

    def __getitem__(self, index: Indices | Flags) -> _Parts:
        return _Parts(self.start[index], self.stop[index], self.places[index])

    def halved(self) -> _Parts:
        """Return left halves, then right ones."""
        middle = (self.start + self.stop) / 2
        return _Parts(np.append(self.start, middle), np.append(middle, self.stop), halves(self.places))


@dataclass(frozen=True, eq=False)
class ShiftedDistances:
    """The least distances of pairs whose clocks differ, found when they are asked for and kept.

    Attributes:
        found: Distances of all pairs while clocks agree.
    """

    found: PairwiseDistances
    _lanes: dict[tuple[int, Fraction], _Parts] = field(default_factory=dict[tuple[int, Fraction], _Parts])
    _known: dict[tuple[int, Fraction], MinimumDistance] = field(default_factory=dict[tuple[int, Fraction], MinimumDistance])

    def least(self, pair: int, error: Fraction, reached: float) -> MinimumDistance:
        """Return a pair's least distance (z weighted), steps between pieces allowed for.

        Args:
            pair: Index of the pair.
            error: By how much clocks differ at most, s.
            reached: A distance that the pair comes to anyway, m.
        """
        if (pair, error) not in self._known:
            self._known[pair, error] = self._least(pair, error, reached)
        return self._known[pair, error]

    def _least(self, pair: int, error: Fraction, reached: float) -> MinimumDistance:
        paths, jumps = self.found.paths, self.found.jumps
        a, b = self.found.pairs[pair]
        low, high, time = _branch_and_bound(self._lane(a, error), self._lane(b, error), float(error), reached)
        low -= (jumps[a] + jumps[b]) * float(stretch_of(paths)) * (1 + 2.0**-40)
        low = float(np.nextafter(low, -np.inf)) if low > 0 else 0.0
        return MinimumDistance(paths.robots[a], paths.robots[b], low, high, Fraction(time))

    def _lane(self, robot: int, error: Fraction) -> _Parts:
        if (robot, error) not in self._lanes:
            self._lanes[robot, error] = _parts_of(self.found.paths, robot, error)
        return self._lanes[robot, error]


@np.errstate(all="ignore")
def _parts_of(paths: TeamPaths, robot: int, error: Fraction) -> _Parts:
    """Return a robot's flight in parts, in order of time; after a lap comes the beginning of the next one."""
    flown = [(int(i), paths.segments[i]) for i in np.flatnonzero(paths.owner == robot) if paths.segments[i].kind != "step"]
    rows = [(index, segment.start, segment.stop) for index, segment in flown]
    cycle = paths.trajectories[robot].cycle
    if cycle is not None:
        begin = paths.knots[robot][cycle]
        later = paths.end - begin
        again = [(index, segment) for index, segment in flown if begin <= segment.start <= begin + error]
        rows += [(index, segment.start + later, segment.stop + later) for index, segment in again]
    weight = z_weight(paths)
    number, off = float(weight), 0.0 if weight == 1 else abs(float(weight)) * 2.0**-52
    factors = np.array([1.0, 1.0, number])[:, None], np.array([0.0, 0.0, off])[:, None]
    parts = _Parts(
        np.array([float(start) for _, start, _ in rows]),
        np.array([float(stop) for *_, stop in rows]),
        paths.positions[np.array([index for index, *_ in rows])].scaled(*factors),
    )
    for _ in range(PARTS.bit_length() - 1):
        parts = parts.halved()
    return parts[np.argsort(parts.start, kind="stable")]


@np.errstate(all="ignore")
def _branch_and_bound(first: _Parts, second: _Parts, error: float, reached: float) -> tuple[float, float, float]:
    """Return a proved lower bound of the distance, m, one that is reached, m, and when, s of the first robot's clock."""
    error = error * (1 + _LATE) + _LATE * (1 + max(float(first.stop[-1]), float(second.stop[-1])))
    one, other = _near_pairs(first, second, error, reached)
    high, time, low = reached, 0.0, np.inf
    for _ in range(DEPTH):
        if not len(one.start):
            return min(low, high), high, time
        nearest, when = _reached(one, other, error)
        if nearest < high:
            high, time = nearest, when
        bounds = _apart(one.places, other.places)
        still = ~(bounds >= high - TOLERANCE)
        low = min(low, float(np.min(bounds[~still], initial=np.inf)))
        one, other, left = one[still], other[still], float(np.min(bounds[still], initial=np.inf))
        if len(one.start) > MOST:
            break
        one, other = _halved(one, other, error)
    else:
        left = float(np.min(_apart(one.places, other.places), initial=np.inf))
    return min(low, left, high), high, time


def _near_pairs(first: _Parts, second: _Parts, error: float, reached: float) -> tuple[_Parts, _Parts]:
    """Return the pairs of parts that lie near enough in time, but those whose boxes are further apart than what is reached."""
    begin = np.searchsorted(second.stop, first.start - error, side="left")
    end = np.searchsorted(second.start, first.stop + error, side="right")
    counts = np.maximum(end - begin, 0)
    i = np.repeat(np.arange(len(counts)), counts)
    j = np.arange(len(i)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(begin, counts)
    (low, high), (its_low, its_high) = ((lane.places.low.min(-1), lane.places.high.max(-1)) for lane in (first, second))
    gaps = np.maximum(np.maximum(low[i] - its_high[j], its_low[j] - high[i]), 0.0)
    kept = ~((gaps * gaps).sum(-1) * (1 - 1e-9) > reached * reached)
    return first[i[kept]], second[j[kept]]


def _reached(one: _Parts, other: _Parts, error: float) -> tuple[float, float]:
    """Return the least distance at the parts' ends that are near enough in time, m, and when that is, s."""
    least, when = np.inf, 0.0
    for mine, t in ((0, one.start), (-1, one.stop)):
        for its, u in ((0, other.start), (-1, other.stop)):
            gaps = np.sqrt(((one.places.mid[:, :, mine] - other.places.mid[:, :, its]) ** 2).sum(-1))
            gaps = np.where((np.abs(t - u) <= error) & np.isfinite(gaps), gaps, np.inf)
            index = int(np.argmin(gaps))
            if gaps[index] < least:
                least, when = float(np.nextafter(gaps[index], np.inf)), float(t[index])
    return least, when


def _apart(one: Balls, other: Balls) -> Floats:
    """Return lower bounds of the distances of parts, m; 0 where nothing is known. Shapes (k, 3, 8) to (k,)."""
    normal = one.mid.mean(-1) - other.mid.mean(-1)
    normal = normal / np.sqrt((normal * normal).sum(-1, keepdims=True))
    size = np.abs(normal)[:, :, None]
    here, there = ((normal[:, :, None] * part.mid).sum(1) for part in (one, other))
    # three products and two sums, then one difference, each rounded
    lost, its_lost = ((size * (part.rad + 8 * 2.0**-53 * np.abs(part.mid))).sum(1) for part in (one, other))
    gap = (here - lost).min(-1) - (there + its_lost).max(-1)
    gap = gap * (1 - 2.0**-45) - 2.0**-50 * (np.abs(here).max(-1) + np.abs(there).max(-1))  # the normal's length, and this sum
    return np.where(gap > 0, gap, 0.0)


def _halved(one: _Parts, other: _Parts, error: float) -> tuple[_Parts, _Parts]:
    """Return the pairs with the part that reaches further halved; those too far apart in time are left out."""
    reach, its = (np.ptp(part.places.mid, axis=-1).max(-1) for part in (one, other))
    mine = ~(its > reach)
    halved, theirs = one[mine].halved(), other[~mine].halved()
    one, other = _joined(halved, _twice(one[~mine])), _joined(_twice(other[mine]), theirs)
    kept = (one.start <= other.stop + error) & (other.start <= one.stop + error)
    return one[kept], other[kept]


def _twice(parts: _Parts) -> _Parts:
    return _joined(parts, parts)


def _joined(first: _Parts, second: _Parts) -> _Parts:
    places = concatenate([first.places, second.places])
    return _Parts(np.append(first.start, second.start), np.append(first.stop, second.stop), places)
