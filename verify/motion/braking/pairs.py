"""How near two robots come to one another when all brake at once, whatever the instant: branch and bound over instants and shares.

Both robots' flights are cut into patches (`patches`), of which those that boxes keep apart are left out (`lanes`). Two patches at the same
shares are parted by the direction between their middles: coefficients of one share's weight lie apart along it by the one's least less the other's
greatest, and the braking at any share is a mean of these. Where that is less than is asked, what reaches furthest is halved: the one's
instants, the other's, or the shares of both. Corners of patches are reached, so a pair that is too near is found to be, and what says so
is computed again without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.motion.braking.lanes import Lanes, Stretch
from verify.motion.braking.patches import Flags, Patches, Point, exact_place, joined
from verify.motion.paths import TeamPaths
from verify.motion.separation import z_weight

TOLERANCE = 1e-3
SHARE = 1 / 8
"""m, or this share of what is missing: how closely the least distance is sought of robots that come too near."""
FINEST = 1e-6
"""m; patches that reach no further are not halved."""
MOST = 300_000
"""Pairs of patches that are looked at; what is left then is not proved."""
CERTAIN = 1e-9
"""m; what is too near by less is left to the bounds: roundings are far smaller."""
_BLOCK = 4_096
"""Pairs of patches that are looked at at once."""


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
    search = _Search(lanes, np.nextafter((limits + jumps[:, None] + jumps) * (1 + 2.0**-50), np.inf))
    for first, second in lanes.near(search.asked):
        for begin in range(0, len(first), _BLOCK):
            some = slice(begin, begin + _BLOCK)
            search.run(_Couples(lanes.parts[first[some]], lanes.parts[second[some]]))
    if search.reached is None:
        return search.unproved()
    return search.meeting(search.reached, _too_near(paths, length, lanes, search.reached, asked, error))


@dataclass(frozen=True, eq=False, slots=True)
class _Couples:
    """Patches of two robots each, at the same shares and at instants that clocks may show at once."""

    one: Patches
    other: Patches

    def __len__(self) -> int:
        return len(self.one)

    def __getitem__(self, index: Indices | Flags | slice) -> _Couples:
        return _Couples(self.one[index], self.other[index])

    def reaches(self) -> Floats:
        """Return how far the one's instants, the other's, and the shares of both move what is between them, about, m. Shape (3, n)."""
        between = self.one.mid.mean(axis=3) - self.other.mid.mean(axis=3)
        return np.stack([self.one.extents[0], self.other.extents[0], np.ptp(between, axis=2).max(axis=1)])

    def halved(self, reaches: Floats) -> _Couples:
        """Return them with what reaches furthest halved."""
        by = np.argmax(reaches, axis=0)
        mine, its, shares = (self[by == k] for k in range(3))
        return _Couples(
            joined([mine.one.halved_in_time(), its.one.twice(), shares.one.halved_in_share()]),
            joined([mine.other.twice(), its.other.halved_in_time(), shares.other.halved_in_share()]),
        )

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


@dataclass(frozen=True, slots=True)
class _Instant:
    """Two robots at one share of braking, at instants that clocks may show at once.

    Attributes:
        distance: m, in floats.
        items: Indices of the stretches.
        times: When their braking begins, s, in floats.
        share: Of the braking.
    """

    distance: float
    items: tuple[int, int]
    times: tuple[float, float]
    share: float


def _share(times: Floats, ends: Floats) -> Floats:
    """Return where times lie between two, from 0 to 1. Shapes (4, n) and (2, n)."""
    return np.clip((times - ends[0]) / np.maximum(ends[1] - ends[0], 1e-300), 0.0, 1.0)


@dataclass(eq=False, slots=True)
class _Search:
    """Branch and bound: what is not proved, and what comes nearest of all that is too near.

    Attributes:
        lanes: Whose braking is looked at.
        asked: How far apart robots must be, m, rounded up. Shape (robots, robots).
    """

    lanes: Lanes
    asked: Floats
    excess: float = 0.0
    reached: _Instant | None = None
    seen: int = 0
    left: list[tuple[_Couples, Floats, Floats]] = field(default_factory=list[tuple[_Couples, Floats, Floats]])

    def run(self, couples: _Couples) -> None:
        """Halve couples until each is proved to be as far apart as is asked, or as what is reached already, or cannot be halved."""
        stack = [couples]
        while stack:
            now = stack.pop()
            if len(now) > _BLOCK:
                stack.append(now[_BLOCK:])
                now = now[:_BLOCK]
            self.seen += len(now)
            asked, low, near = self._asked(now), now.apart(), self._reach(now)
            still = np.flatnonzero(~(low >= asked + (self.excess - self.tolerance if self.reached else 0.0)))
            still = still[np.argsort((low - asked)[still])]
            now, low, near = now[still], low[still], near[still]
            reaches = now.reaches()
            done = np.ones(len(now), dtype=bool) if self.seen > MOST else ~(reaches.max(axis=0, initial=0.0) > FINEST)
            if done.any():
                self.left.append((now[done], low[done], near[done]))
            if not done.all():
                stack.append(self._at_once(now[~done].halved(reaches[:, ~done])))

    @property
    def tolerance(self) -> float:
        """How much nearer than what is reached robots may come, m."""
        return max(TOLERANCE, -SHARE * self.excess)

    def _asked(self, couples: _Couples) -> Floats:
        robots = self.lanes.robots
        return self.asked[robots[couples.one.item], robots[couples.other.item]]

    def _at_once(self, couples: _Couples) -> _Couples:
        """Return the couples whose instants clocks may show at once."""
        (start, stop), (its_start, its_stop) = self.lanes.times(couples.one), self.lanes.times(couples.other)
        return couples[(start <= its_stop + self.lanes.error) & (its_start <= stop + self.lanes.error)]

    def _reach(self, couples: _Couples) -> Floats:
        """Return how near ends of the shares are at instants of both patches' ends, m, and keep what is too near by most. Shape (n,)."""
        one, other = couples.one, couples.other
        ends, its_ends = (np.stack(self.lanes.times(part)) for part in (one, other))  # (2, n)
        times = np.concatenate([ends, np.clip(its_ends, ends[0], ends[1])])
        its_times = np.concatenate([np.clip(ends, its_ends[0], its_ends[1]), its_ends])
        mine, its = one.at(_share(times, ends)), other.at(_share(its_times, its_ends))  # (4, n, 3, 2)
        distances = np.sqrt(((mine - its) ** 2).sum(axis=2))
        distances = np.where((np.abs(times - its_times) <= self.lanes.error)[..., None], distances, np.inf)
        near = distances.min(axis=(0, 2))
        excess = near - self._asked(couples)
        k = int(np.argmin(excess)) if len(couples) else 0
        if len(couples) and excess[k] < min(self.excess, -CERTAIN):
            way, share = np.unravel_index(int(np.argmin(distances[:, k])), (4, 2))
            self.excess = float(excess[k])
            self.reached = _Instant(
                float(near[k]),
                (int(one.item[k]), int(other.item[k])),
                (float(times[way, k]), float(its_times[way, k])),
                float(one.share[k] + share * one.width[k]),
            )
        return near

    def meeting(self, found: _Instant, fails: bool) -> Meeting:
        """Return what is said of robots that come too near, as far as floats say, and of whom that is sure or not."""
        begins, low = found.times[0], max(found.distance - self.tolerance, 0.0)
        return Meeting(self._pair(found.items), low, found.distance, (begins, begins), (found.share, found.share), fails)

    def _pair(self, items: tuple[int, int]) -> tuple[int, int]:
        return int(self.lanes.robots[items[0]]), int(self.lanes.robots[items[1]])

    def unproved(self) -> Meeting | None:
        """Return what is said of the robots of which least is proved; None where all is."""
        if not self.left:
            return None
        couples = _Couples(joined([c.one for c, *_ in self.left]), joined([c.other for c, *_ in self.left]))
        low, near = np.concatenate([lows for _, lows, _ in self.left]), np.concatenate([nears for *_, nears in self.left])
        worst = int(np.argmin(low - self._asked(couples)))
        pair = self._pair((int(couples.one.item[worst]), int(couples.other.item[worst])))
        its = (self.lanes.robots[couples.one.item] == pair[0]) & (self.lanes.robots[couples.other.item] == pair[1])
        one, (start, stop) = couples.one[its], self.lanes.times(couples.one[its])
        jump = self.lanes.jumps[pair[0]] + self.lanes.jumps[pair[1]]
        return Meeting(
            pair,
            max(float(low[its].min()) - jump * (1 + 2.0**-40), 0.0),
            float(near[its].min()),
            (float(start.min()), float(stop.max())),
            (float(one.share.min()), float((one.share + one.width).max())),
            False,
        )


# six parameters: what flies, how it brakes, and what is asked at one instant
def _too_near(
    paths: TeamPaths, length: Fraction, lanes: Lanes, found: _Instant, asked: Sequence[Sequence[Fraction]], error: Fraction
) -> bool:
    """Decide without rounding whether two robots are nearer than is asked in braking that begins at instants that clocks may show at once."""
    one, other = (lanes.stretches[item] for item in found.items)
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
