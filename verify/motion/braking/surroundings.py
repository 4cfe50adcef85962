"""Least distances of braking robots to their surroundings: walls, rims, obstacles, and regions that are closed to them.

Each of these (`targets`, `closed_regions`) tells how far a patch's hull stays from it at the least. Branch and bound over instants and shares does the rest; what
boxes keep far enough is left out first, and what says that a robot comes too near is computed again without rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Protocol

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.motion.braking.branching import BLOCK, Search
from verify.motion.braking.patches import Flags, Patches, Point, exact_place, joined, patches_of, shortened
from verify.motion.paths import TeamPaths


class Surrounding(Protocol):
    """One kind of what stands around robots: targets, from each of which a distance is asked."""

    @property
    def asked(self) -> Floats:
        """Distance that each robot keeps, m, rounded up. Shape (robots,)."""
        ...

    def close(self, parts: Patches, robots: Indices) -> tuple[Indices, Indices]:
        """Return the rows of patches, and the targets, that boxes do not keep as far apart as is asked."""
        ...

    def low(self, parts: Patches, targets: Indices) -> Floats:
        """Bound from below how far patches stay from one target each. Shape (n,)."""
        ...

    def near(self, places: Floats, targets: Indices) -> Floats:
        """Return how far places are from one target each, in floats. Shape (n, 3) to (n,)."""
        ...

    def breaks(self, place: Point, robot: int, target: int) -> bool:
        """Prove that a robot is too near to a target at a place; False means only that no proof was found.

        Args:
            place: m, exact.
            robot: Its index.
            target: Index of what it may be too near to.
        """
        ...


@dataclass(frozen=True, slots=True)
class Nearness:
    """A robot whose braking was not proved to keep it away from something.

    Attributes:
        robot: Its index.
        target: Index of what it comes near to.
        low: Proved: never nearer, m; below zero nothing is proved.
        high: How near it comes, m, in floats.
        instants: Between which the braking begins where it is not proved, s; one instant where it is too near.
        shares: Between which shares of the braking.
        fails: Whether it is too near, which was computed without rounding; else nothing is known but the bounds.
    """

    robot: int
    target: int
    low: float
    high: float
    instants: tuple[float, float]
    shares: tuple[float, float]
    fails: bool


@dataclass(frozen=True, eq=False)
class Braking:
    """A team that brakes.

    Attributes:
        paths: What is flown.
        length: L, s that braking takes.
    """

    paths: TeamPaths
    length: Fraction

    @cached_property
    def parts(self) -> Patches:
        """All flights in short parts, with all of the braking.

        Raises:
            BadInput: Coefficients are too large to tell where braking leads.
        """
        flies = np.array([float(one.stop - one.start) if one.kind == "piece" else 0.0 for one in self.paths.segments])
        whole = patches_of(self.paths, self.length)
        whole.require_finite()
        return shortened(whole, flies, float(self.length) / 4)

    @np.errstate(all="ignore")
    def nearness(self, around: Surrounding) -> Nearness | None:
        """Return a robot whose braking is not proved to keep it away from what is around it, as far as is asked; None where it is, of all.

        Robots that come too near are looked for before those of which nothing is known.

        Args:
            around: One kind of what stands around robots.
        """
        rows, targets = around.close(self.parts, self.paths.owner[self.parts.item])
        search = Search[_Cells](lambda cells: cells.bounds(around))
        for begin in range(0, len(rows), BLOCK):
            some = slice(begin, begin + BLOCK)
            search.run(_Cells(self.paths, self.parts[rows[some]], targets[some]))
        if search.worst is None:
            return self._unproved(search.left, around)
        cell, target = search.worst.parts, int(search.worst.targets[0])
        robot, segment = int(self.paths.owner[cell.item[0]]), int(cell.item[0])
        place, share = float(cell.place[0] + cell.length[0] / 2), float(cell.share[0] + cell.width[0] / 2)
        fails = around.breaks(exact_place(self.paths, self.length, segment, Fraction(place), Fraction(share)), robot, target)
        high = float(search.excess + around.asked[robot])
        time = float(self.paths.segments[segment].time(place))
        return Nearness(robot, target, high - search.tolerance, high, (time, time), (share, share), fails)

    def _unproved(self, left: Sequence[tuple[_Cells, Floats]], around: Surrounding) -> Nearness | None:
        if not left:
            return None
        cells = _Cells(self.paths, joined([c.parts for c, _ in left]), np.concatenate([c.targets for c, _ in left]))
        low, robots = np.concatenate([lows for _, lows in left]), self.paths.owner[cells.parts.item]
        worst = int(np.argmin(low))
        robot, target = int(robots[worst]), int(cells.targets[worst])
        its = (robots == robot) & (cells.targets == target)
        asked, cells = float(around.asked[robot]), cells[its]
        high = float(cells.bounds(around)[1].min()) + asked
        return Nearness(
            robot, target, math.nextafter(float(low[its].min()) + asked, -math.inf), high, *cells.parts.spans(self._times), False
        )  # fmt: skip

    def _times(self, parts: Patches) -> tuple[Floats, Floats]:
        starts = np.array([float(one.start) for one in self.paths.segments])[parts.item]
        seconds = np.array([float(one.stop - one.start) for one in self.paths.segments])[parts.item]
        return starts + parts.place * seconds, starts + (parts.place + parts.length) * seconds


@dataclass(frozen=True, eq=False, slots=True)
class _Cells:
    """Patches, and one target of each."""

    paths: TeamPaths
    parts: Patches
    targets: Indices

    def __len__(self) -> int:
        return len(self.targets)

    def __getitem__(self, index: Indices | Flags | slice) -> _Cells:
        return _Cells(self.paths, self.parts[index], self.targets[index])

    def reaches(self) -> Floats:
        """Return how far instants, and shares, reach, about, m. Shape (2, n)."""
        return np.stack(self.parts.extents)

    def halved(self, reaches: Floats) -> _Cells:
        """Return the halves of each along the direction that reaches furthest."""
        in_time = reaches[0] >= reaches[1]
        times, shares = self[in_time], self[~in_time]
        parts = joined([times.parts.halved_in_time(), shares.parts.halved_in_share()])
        return _Cells(self.paths, parts, np.concatenate([times.targets, times.targets, shares.targets, shares.targets]))

    def bounds(self, around: Surrounding) -> tuple[Floats, Floats]:
        """Return how much more than is asked is proved, and how much more is kept in their middles, in floats, m. Shape (n,) each."""
        asked = around.asked[self.paths.owner[self.parts.item]]
        return around.low(self.parts, self.targets) - asked, around.near(self.parts.centres(), self.targets) - asked
