"""Least distance of two robots when all brake at once, whatever the instant: branch and bound over instants and shares.

Both robots' flights are cut into patches (`patches`), of which those that boxes keep apart are left out (`lanes`). Two patches at the same
shares are parted by the direction between their middles: coefficients of one share's weight lie apart along it by the one's least less the other's
greatest, and the braking at any share is a mean of these. Where that is less than is asked, what reaches furthest is halved: the one's
instants, the other's, or the shares of both. Corners of patches are reached, so a pair that is too near is found to be, and what says so
is computed again without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.motion.braking.branching import BLOCK, Search
from verify.motion.braking.patches import Flags, Patches, Point, exact_place, joined
from verify.motion.braking.swept_boxes import Lanes, Stretch
from verify.motion.paths import TeamPaths
from verify.motion.separation import z_weight


@dataclass(frozen=True, slots=True)
class Meeting:
    """Two robots whose braking was not proved to keep them apart.

    Attributes:
        robots: Their indices.
        low: Proved never to be nearer, m; z weighted, as is the other one.
        high: Reached, m.
        instants: Between which the first robot's braking begins where it is not proved, s; one instant where they are too near.
        shares: Between which shares of the braking.
        fails: Whether they are too near, which was computed without rounding; else nothing is known but the bounds.
    """

    robots: tuple[int, int]
    low: float
    high: float
    instants: tuple[float, float]
    shares: tuple[float, float]
    fails: bool


@np.errstate(all="ignore")
def closest_braking(paths: TeamPaths, length: Fraction, asked: Sequence[Sequence[Fraction]], error: Fraction) -> Meeting | None:
    """Return two robots whose braking is not proved to keep them as far apart as is asked; None where it is, of all.

    Robots that come too near are looked for before those of which nothing is known.

    Args:
        paths: What is flown.
        length: L, s that braking takes.
        asked: m, exact; a distance in z counts as `separation_z` says. Shape (robots, robots).
        error: By how much clocks may differ, s.

    Raises:
        BadInput: Coefficients are too large to tell where braking leads.
    """
    lanes = Lanes.of(paths, length, z_weight(paths), error)
    lanes.parts.require_finite()
    limits, jumps = np.array([[math.nextafter(float(one), math.inf) for one in row] for row in asked]), np.array(lanes.jumps)
    least = np.nextafter((limits + jumps[:, None] + jumps) * (1 + 2.0**-50), np.inf)
    search = Search[_Couples](lambda one: (one.apart() - one.of(least), one.meet()[0] - one.of(least)))
    for first, second in lanes.near(least):
        for begin in range(0, len(first), BLOCK):
            some = slice(begin, begin + BLOCK)
            search.run(_Couples(lanes, lanes.parts[first[some]], lanes.parts[second[some]]))
    if search.worst is None:
        return _unproved(search.left, least) if search.left else None
    distance, times, share = search.worst.meet()
    found = _Instant(search.worst, (float(times[0, 0]), float(times[1, 0])), float(share[0]))
    low, begins = max(float(distance[0]) - search.tolerance, 0.0), (found.times[0], found.times[0])
    fails = _too_near(paths, length, found, asked, error)
    return Meeting(search.worst.pair(0), low, float(distance[0]), begins, (found.share, found.share), fails)


@dataclass(frozen=True, eq=False, slots=True)
class _Couples:
    """Patches of two robots each, at the same shares and at instants that clocks may show at once."""

    lanes: Lanes
    one: Patches
    other: Patches

    def __len__(self) -> int:
        return len(self.one)

    def __getitem__(self, index: Indices | Flags | slice) -> _Couples:
        return _Couples(self.lanes, self.one[index], self.other[index])

    def reaches(self) -> Floats:
        """Return how far the one's instants, the other's, and the shares of both move what is between them, about, m. Shape (3, n)."""
        between = self.one.mid.mean(axis=3) - self.other.mid.mean(axis=3)
        return np.stack([self.one.extents[0], self.other.extents[0], np.ptp(between, axis=2).max(axis=1)])

    def halved(self, reaches: Floats) -> _Couples:
        """Return them with what reaches furthest halved."""
        by = np.argmax(reaches, axis=0)
        mine, its, shares = (self[by == k] for k in range(3))
        one = joined([mine.one.halved_in_time(), its.one.twice(), shares.one.halved_in_share()])
        other = joined([mine.other.twice(), its.other.halved_in_time(), shares.other.halved_in_share()])
        (start, stop), (its_start, its_stop) = self.lanes.times(one), self.lanes.times(other)
        at_once = (start <= its_stop + self.lanes.error) & (its_start <= stop + self.lanes.error)
        return _Couples(self.lanes, one[at_once], other[at_once])

    def of(self, table: Floats) -> Floats:
        """Return what stands in a table for each couple's robots. Shape (robots, robots) to (n,)."""
        robots = self.lanes.robots
        return table[robots[self.one.item], robots[self.other.item]]

    def pair(self, index: int) -> tuple[int, int]:
        """Return the robots of one couple."""
        return int(self.lanes.robots[self.one.item[index]]), int(self.lanes.robots[self.other.item[index]])

    def apart(self) -> Floats:
        """Bound the distances from below, m; 0 where nothing is known. Shape (n,)."""
        normal = self.one.mid.mean(axis=(2, 3)) - self.other.mid.mean(axis=(2, 3))
        normal = normal / np.sqrt((normal * normal).sum(-1, keepdims=True))
        shape, size = self.one.mid.shape, np.abs(normal)
        here, there = (
            (normal[:, None] @ part.mid.reshape(len(self), 3, -1)).reshape(-1, *shape[2:]) for part in (self.one, self.other)
        )
        gap = (here.min(-1) - there.max(-1)).min(-1)
        # three products and two sums, then one difference, each rounded; the normal's length, and this sum
        lost = sum((size * (part.rad + 8 * 2.0**-53 * part.size)).sum(-1) for part in (self.one, self.other))
        gap = (gap - lost) * (1 - 2.0**-45) - 2.0**-50 * (np.abs(here).max(axis=(1, 2)) + np.abs(there).max(axis=(1, 2)))
        return np.where(gap > 0, gap, 0.0)

    def meet(self) -> tuple[Floats, Floats, Floats]:
        """Return how near robots are at the first or the last share, at one of the ends of their instants and what is at once with it, in floats.

        Returns:
            Distances, m, infinite where nothing is at once; shape (n,). Instants of the one and of the other, s; shape (2, n). Shares; shape (n,).
        """
        ends, its_ends = (np.stack(self.lanes.times(part)) for part in (self.one, self.other))  # (2, n)
        times = np.concatenate([ends, np.clip(its_ends, ends[0], ends[1])])
        its_times = np.concatenate([np.clip(ends, its_ends[0], its_ends[1]), its_ends])
        mine, its = self.one.at(_share(times, ends)), self.other.at(_share(its_times, its_ends))  # (4, n, 3, 2)
        distances = np.sqrt(((mine - its) ** 2).sum(axis=2))
        distances = np.where((np.abs(times - its_times) <= self.lanes.error)[..., None], distances, np.inf)
        rows = np.arange(len(self))
        way, share = np.divmod(np.argmin(np.moveaxis(distances, 1, 0).reshape(len(self), -1), axis=1), 2)
        return (
            distances[way, rows, share], np.stack([times[way, rows], its_times[way, rows]]), self.one.share + share * self.one.width
        )  # fmt: skip


@dataclass(frozen=True, eq=False, slots=True)
class _Instant:
    """Two robots at one share of braking that begins at instants that clocks may show at once: one couple, s, s, and the share, in floats."""

    couple: _Couples
    times: tuple[float, float]
    share: float


def _share(times: Floats, ends: Floats) -> Floats:
    """Return where times lie between two, from 0 to 1. Shapes (4, n) and (2, n)."""
    return np.clip((times - ends[0]) / np.maximum(ends[1] - ends[0], 1e-300), 0.0, 1.0)


def _unproved(left: Sequence[tuple[_Couples, Floats]], least: Floats) -> Meeting:
    """Return what is said of the robots of which least is proved."""
    lanes = left[0][0].lanes
    couples = _Couples(lanes, joined([part.one for part, _ in left]), joined([part.other for part, _ in left]))
    low = np.concatenate([lows for _, lows in left])
    pair = couples.pair(int(np.argmin(low)))
    its = (lanes.robots[couples.one.item] == pair[0]) & (lanes.robots[couples.other.item] == pair[1])
    couples, jump = couples[its], lanes.jumps[pair[0]] + lanes.jumps[pair[1]]
    proved = float((low[its] + couples.of(least)).min()) * (1 - 2.0**-50) - jump * (1 + 2.0**-40)
    return Meeting(pair, max(proved, 0.0), float(couples.meet()[0].min()), *couples.one.spans(lanes.times), False)


def _too_near(
    paths: TeamPaths, length: Fraction, found: _Instant, asked: Sequence[Sequence[Fraction]], error: Fraction
) -> bool:
    """Decide without rounding whether two robots are nearer than is asked in braking that begins at instants that clocks may show at once."""
    one, other = (found.couple.lanes.stretches[int(part.item[0])] for part in (found.couple.one, found.couple.other))
    time, its_time = map(Fraction, found.times)
    time = min(max(time, one.start), one.stop)
    its_time = min(max(its_time, time - error, other.start), time + error, other.stop)
    if abs(time - its_time) > error:
        return False
    x, y, z = (
        a - b
        for a, b in zip(
            *(_place(paths, length, done, at, found.share) for done, at in ((one, time), (other, its_time))), strict=True
        )
    )
    limit = asked[one.robot][other.robot]
    return x * x + y * y + (z * z_weight(paths)) ** 2 < limit * limit


def _place(paths: TeamPaths, length: Fraction, done: Stretch, time: Fraction, share: float) -> Point:
    if done.still is not None:
        return exact_place(paths, length, done.segment, Fraction(done.still), Fraction(0))
    return exact_place(paths, length, done.segment, (time - done.start) / (done.stop - done.start), Fraction(share))
