"""Regions that share points, and letters along a straight flight, in floats and with room to spare.

A plan is made over letters that can really be flown. Where regions lie apart that is simple: in a region, in free flight,
in the next region. Where one lies in another, or two overlap, a stay in the middle of one may be a stay in both, and the way
between two middles passes the borders of both in some order. Ways on which that order is not clear by more than the
margin are not offered to the planner. Regions that hold neither end of a way are assumed to be flown around.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.gaps import widest_gap
from verify.data import Letter, Mission
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop, Region

Floats = NDArray[np.float64]

_SAMPLES = 1001
"""Places on a way at which the border of a region is looked for, where no formula gives it."""
_STEP = 0.005
"""m between places on a way that turns, at the most."""
_GAP = 1e-9
"""m; regions that are not farther from each other than this may have a point in common."""


@dataclass(frozen=True, slots=True)
class Location:
    """A point that robots stop at, and the regions around it.

    Attributes:
        point: m.
        inside: The regions that hold it, outermost first.
        clear: Whether each region holds it, or does not, by more than the margin.
    """

    point: Point
    inside: tuple[str, ...]
    clear: bool


class Layout:
    """The regions of a mission and how they lie."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self.regions = mission.all_regions
        self.slack = max(mission.margin, 1e-6)
        every = list(self.regions.values())
        self._names = list(self.regions)
        self._centres = np.array([region.center for region in every]).reshape(-1, 3)
        self._shapes = ellipsoid_matrices(every)
        self._others = [k for k, region in enumerate(every) if not region.is_ellipsoid]
        self._least = np.array([region.inner_radius for region in every])
        self._greatest = np.array([region.outer_radius for region in every])

    @cached_property
    def neighbours(self) -> dict[str, frozenset[str]]:
        """For each region, the others with which it may have a point in common."""
        near: dict[str, set[str]] = {name: set() for name in self.regions}
        for i, a in enumerate(self._names):  # centres and radii tell most of them apart, many at a time
            distances = np.linalg.norm(self._centres[i + 1 :] - self._centres[i], axis=1)
            for k in np.flatnonzero(distances <= (self._greatest[i + 1 :] + self._greatest[i]) * (1 + 1e-9)):
                b = self._names[i + 1 + int(k)]
                if not apart(self.regions[a], self.regions[b]):
                    near[a].add(b)
                    near[b].add(a)
        return {name: frozenset(others) for name, others in near.items()}

    @cached_property
    def middles(self) -> dict[str, Location]:
        """The centre of each region."""
        return {name: self.at(region.center) for name, region in self.regions.items()}

    def at(self, point: Point) -> Location:
        """Return which regions hold a point."""
        levels = self._levels(point)
        clear = bool(np.all(np.abs(levels - 1) * self._least > self.slack))
        return Location(point, self.outermost_first(self._names[k] for k in np.flatnonzero(levels <= 1)), clear)

    def near_borders(self, point: Point) -> dict[str, float]:
        """Return the regions whose borders are too near a point for it to be clear, and how far away, in m, they are for sure."""
        sure = np.abs(self._levels(point) - 1) * self._least
        return {self._names[k]: float(sure[k]) for k in np.flatnonzero(sure <= self.slack)}

    def _levels(self, point: Point) -> Floats:
        """Return the root of each region's level at a point. Shape (regions,)."""
        offsets = np.array(point) - self._centres
        levels = np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", offsets, self._shapes, offsets), 0.0))
        for k in self._others:
            levels[k] = math.sqrt(float(self.regions[self._names[k]].level(np.array(point))))
        return levels

    def outermost_first(self, regions: Iterable[str]) -> tuple[str, ...]:
        """Return regions in the order of their sizes, the largest first."""
        return tuple(sorted(regions, key=self._size, reverse=True))

    def regions_at(self, points: NDArray[np.float64]) -> list[frozenset[str]]:
        """Return the regions that hold each of some points, m. Shape (n, 3)."""
        offset = points[:, None] - self._centres
        inside = np.einsum("nri,rij,nrj->nr", offset, self._shapes, offset) <= 1.0
        for k in self._others:
            inside[:, k] = self.regions[self._names[k]].level(points) <= 1.0
        anywhere = inside.any(axis=1).tolist()  # most points are in no region
        return [
            frozenset(self._names[k] for k in np.flatnonzero(row)) if some else frozenset()
            for row, some in zip(inside, anywhere, strict=True)
        ]

    def around(self, region: str) -> tuple[str, ...] | None:
        """Return the regions that a robot is in just after it has left this one; None where that is not clear."""
        spot = self.middles[region]
        own = self.regions[region]
        outer = tuple(name for name in spot.inside if name != region)
        if not spot.clear or self.neighbours[region] - set(outer):
            return None
        space = own.outer_radius + self.slack
        if isinstance(own, Hoop):
            space = max(space, (own.reach or 0.0) + self.slack)
        for name in outer:
            level = math.sqrt(float(self.regions[name].level(np.array(own.center))))
            if level + space / self.regions[name].inner_radius > 1:
                return None
        return outer

    def way(self, start: Location, end: Location) -> tuple[Letter, ...] | None:
        """Return the sets of regions on a straight way, both ends included; None where their order is not clear."""
        if not start.clear or not end.clear:
            return None
        current = frozenset(start.inside)
        final = frozenset(end.inside)
        borders: list[tuple[float, float, str]] = []
        for name in current ^ final:
            found = self._border(name, start.point, end.point)
            if found is None:
                return None
            borders.append((*found, name))
        return self._in_order(borders, current)

    def along(self, start: Location, points: Floats, end: Location) -> tuple[Letter, ...] | None:
        """Return the sets of regions on a way that turns, both ends included; None where their order is not clear.

        Every region around either end is entered or left once at most, and one around both ends is not left.

        Args:
            start: Where it begins.
            points: Both ends and the points at which it turns, m. Shape (points, 3).
            end: Where it ends.
        """
        if not start.clear or not end.clear:
            return None
        places = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        at = np.union1d(np.linspace(0.0, places[-1], max(_SAMPLES, int(places[-1] / _STEP))), places)
        way = np.column_stack([np.interp(at, places, points[:, axis]) for axis in range(3)])
        current, final = frozenset(start.inside), frozenset(end.inside)
        borders: list[tuple[float, float, str]] = []
        for name in current | final:
            region = self.regions[name]
            levels, slack = np.sqrt(np.maximum(region.level(way), 0.0)), self.slack / region.inner_radius
            within, beyond = levels > 1 - slack, levels < 1 + slack  # maybe outside, maybe inside
            if name in current and name in final:
                if np.any(within):
                    return None
                continue
            first, last = (within, beyond) if name in current else (beyond, within)
            begins, ends = np.flatnonzero(first), np.flatnonzero(last)
            if not len(begins) or begins[0] == 0 or not len(ends) or ends[-1] == len(at) - 1:
                return None
            borders.append((float(at[begins[0] - 1]), float(at[ends[-1] + 1]), name))
        return self._in_order(borders, current)

    def _in_order(self, borders: list[tuple[float, float, str]], current: Letter) -> tuple[Letter, ...] | None:
        """Return the sets of regions as borders are crossed one after the other; None where two may be crossed in either order."""
        ordered = self._straight_on(sorted(borders), current)
        if any(later[0] <= earlier[1] for earlier, later in itertools.pairwise(ordered)):
            return None
        letters = [current]
        for _, _, name in ordered:
            current = current ^ {name}
            letters.append(current)
        return tuple(letters)

    def _straight_on(self, borders: list[tuple[float, float, str]], start: frozenset[str]) -> list[tuple[float, float, str]]:
        """Put the borders of two regions that share a wall one after the other where a way leads straight from one into the other.

        At the wall the way shows both names for an instant: the region that is entered is so before the other one is left.
        """
        ordered = list(borders)
        for k, (earlier, later) in enumerate(itertools.pairwise(borders)):
            (low, high, one), (_, end, other) = earlier, later
            inside = {one, other} & start
            if later[0] > high or len(inside) != 1 or other not in self.neighbours[one]:
                continue
            if any(self.regions[name].is_ellipsoid for name in (one, other)):
                continue
            (left,) = inside
            entered, middle = other if left == one else one, (low + max(high, end)) / 2
            ordered[k], ordered[k + 1] = (low, math.nextafter(middle, 0.0), entered), (middle, max(high, end), left)
        return ordered

    def _border(self, name: str, start: Point, end: Point) -> tuple[float, float] | None:
        """Return where, as shares of the way, a region's border may be met: between its scalings by the margin."""
        region = self.regions[name]
        outwards = float(region.level(np.array(start))) < 1
        here, there = (start, end) if outwards else (end, start)  # now the way leads out of the region
        if not region.is_ellipsoid:
            found = self._crossing(region, np.array(here), np.array(there))
            return found if outwards or found is None else (1 - found[1], 1 - found[0])
        offset, step = np.array(here) - np.array(region.center), np.array(there) - np.array(here)
        a = float(step @ region.shape @ step)
        b = float(offset @ region.shape @ step)
        c = float(offset @ region.shape @ offset)
        slack = self.slack / region.inner_radius
        times: list[float] = []
        for scale in (1 - slack, 1 + slack):
            root = b * b - a * (c - scale * scale)
            if scale <= 0 or a <= 0 or root < 0:
                return None
            times.append((-b + math.sqrt(root)) / a)
        low, high = times
        if low <= 0 or high >= 1:
            return None
        return (low, high) if outwards else (1 - high, 1 - low)

    def _crossing(self, region: Region, here: Floats, there: Floats) -> tuple[float, float] | None:
        """Return where a way out of a region of any shape may meet its border, as shares of the way, one sample to spare."""
        shares = np.linspace(0.0, 1.0, _SAMPLES)
        levels = np.sqrt(region.level(here + shares[:, None] * (there - here)))
        slack = self.slack / region.inner_radius
        within, beyond = np.flatnonzero(levels > 1 - slack), np.flatnonzero(levels < 1 + slack)
        if not len(within) or within[0] == 0 or not len(beyond) or beyond[-1] == _SAMPLES - 1:
            return None
        return float(shares[within[0] - 1]), float(shares[beyond[-1] + 1])

    def _size(self, name: str) -> float:
        return self.regions[name].volume


def apart(one: Region, other: Region) -> bool:
    """Return whether two regions have no common point for sure."""
    between = np.array(other.center) - np.array(one.center)
    if not (one.is_ellipsoid and other.is_ellipsoid):
        return widest_gap(one.body, other.body, between) > _GAP
    distance = float(np.linalg.norm(between))
    if distance > (one.outer_radius + other.outer_radius) * (1 + 1e-9):
        return True
    if distance <= max(one.inner_radius, other.inner_radius):  # one holds the other's centre
        return False
    first, second = np.linalg.inv(one.shape), np.linalg.inv(other.shape)
    # apart if and only if, for some share s, between' (first / (1 - s) + second / s)^-1 between > 1
    shares = np.linspace(0.0, 1.0, 201)[1:-1, None, None]
    sums = first / (1 - shares) + second / shares
    levels = np.einsum("i,kij,j->k", between, np.linalg.inv(sums), between)
    return bool(np.max(levels) > 1 + 1e-9)


def ellipsoid_matrices(regions: Collection[Region]) -> NDArray[np.float64]:
    """Return the matrix of each ellipsoid among some regions, in m^-2, and zeros for other shapes. Shape (regions, 3, 3)."""
    zero = np.zeros((3, 3))
    return np.array([region.shape if region.is_ellipsoid else zero for region in regions]).reshape(-1, 3, 3)
