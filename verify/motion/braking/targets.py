"""Surroundings that braking robots keep away from, and lower bounds on the distance of patches to them: walls, rims, obstacles.

A patch lies in the hull of its coefficients. From walls it stays by its greatest and least coordinates; from a hoop's rim by its distances along
and across the axis, of which the one across is at most that of a coefficient, and at least what the hull shows along one direction; from
obstacles by planes that part the hull from them (`verify.motion.obstacles`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.data.shapes.region import Hoop
from verify.motion.braking.patches import Patches, Point
from verify.motion.obstacles.bodies import MOST_AT_ONCE, SolidBodies
from verify.motion.obstacles.half_spaces import Hulls
from verify.motion.obstacles.points import is_near
from verify.motion.passages import rim_distance, unit_normal
from verify.motion.paths import TeamPaths

_ROUNDED = 1e-13
"""Share of coordinates' sizes, many times what a few operations on them round."""
_SURE = 1e-9
"""m; a rim is met for sure by more than what floats of an exact place are off."""

WALLS = ("x min", "y min", "z min", "x max", "y max", "z max")


@dataclass(frozen=True, eq=False)
class Walls:
    """The workspace's walls, in the order of `WALLS`.

    Attributes:
        paths: What is flown.
        margin: How far all stay from them, m, exact.
    """

    paths: TeamPaths
    margin: Fraction

    @property
    def asked(self) -> Floats:
        """Distance that each robot keeps, m, rounded up. Shape (robots,)."""
        return np.full(len(self.paths.robots), _above(self.margin))

    def close(self, parts: Patches, robots: Indices) -> tuple[Indices, Indices]:
        """Return the rows of patches, and the walls, of which it is not proved at once."""
        rows, targets = np.nonzero(~(self._gaps(parts.low, parts.high) >= self.asked[robots, None]))
        return rows, targets

    def low(self, parts: Patches, targets: Indices) -> Floats:
        """Bound distances from below, m; below zero outside."""
        return self._gaps(parts.low, parts.high)[np.arange(len(targets)), targets]

    def near(self, places: Floats, targets: Indices) -> Floats:
        """Return distances, m; below zero outside."""
        return self._gaps(places, places)[np.arange(len(targets)), targets]

    def breaks(self, place: Point, robot: int, target: int) -> bool:
        """Decide without rounding whether a place is nearer to a wall than is asked.

        Args:
            place: m, exact.
            robot: Its index.
            target: Index of what it may be too near to.
        """
        del robot
        box, (upper, axis) = self.paths.mission.workspace, divmod(target, 3)
        gap = Fraction(box.max[axis]) - place[axis] if upper else place[axis] - Fraction(box.min[axis])
        return gap < self.margin

    def _gaps(self, low: Floats, high: Floats) -> Floats:
        box = self.paths.mission.workspace
        return np.nextafter(np.concatenate([low - np.array(box.min), np.array(box.max) - high], axis=1), -np.inf)


@dataclass(frozen=True, eq=False)
class _Around:
    """Paths that vehicles' spheres keep away from, each robot's centre by its own radius more.

    Attributes:
        paths: What is flown.
        margin: How far the vehicles' spheres stay from them, m, exact.
    """

    paths: TeamPaths
    margin: Fraction

    @cached_property
    def limits(self) -> tuple[Fraction, ...]:
        """Distance that each robot's centre keeps, m, exact."""
        return tuple(self.margin + Fraction(self.paths.mission.vehicle_of(robot).radius) for robot in self.paths.robots)

    @property
    def asked(self) -> Floats:
        """Distance that each robot's centre keeps, m, rounded up. Shape (robots,)."""
        return np.array([_above(limit) for limit in self.limits])


@dataclass(frozen=True, eq=False)
class Rims(_Around):
    """The rims of all hoops."""

    @cached_property
    def hoops(self) -> tuple[Hoop, ...]:
        """The hoops, in the mission's order."""
        return tuple(self.paths.mission.hoops.values())

    @cached_property
    def _frames(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Centres, normals and their errors, shape (hoops, 3) each; openings and rims, shape (hoops,)."""
        normals = [unit_normal(hoop) for hoop in self.hoops]
        return (
            np.array([hoop.center for hoop in self.hoops]),
            np.array([normal for normal, _ in normals]),
            np.array([error for _, error in normals]),
            np.array([hoop.opening for hoop in self.hoops]),
            np.array([hoop.rim for hoop in self.hoops]),
        )

    def close(self, parts: Patches, robots: Indices) -> tuple[Indices, Indices]:
        """Return the rows of patches, and the hoops, whose boxes and balls are near enough to meet."""
        if not self.hoops:
            return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
        centres, *_, openings, rims = self._frames
        low, high = parts.low[:, None], parts.high[:, None]
        gap = np.maximum(np.maximum(low - centres, centres - high), 0.0)
        reach = (openings + 2 * rims + self.asked[robots, None]) * (1 + 1e-9)
        rows, targets = np.nonzero(~((gap * gap).sum(-1) * (1 - 1e-9) > reach * reach))
        return rows, targets

    def low(self, parts: Patches, targets: Indices) -> Floats:
        """Bound distances from below, m."""
        centres, normals, errors, openings, rims = (values[targets] for values in self._frames)
        hulls = Hulls(parts.mid.reshape(len(parts), 3, -1), parts.rad).beside(centres)
        slack = hulls.size.sum(axis=1) * (_ROUNDED + 4 * errors.sum(axis=1)) + hulls.rad.sum(axis=1) * (1 + _ROUNDED)
        along = np.einsum("ni,nik->nk", normals, hulls.mid)
        across = hulls.mid - along[:, None] * normals[..., None]
        outward = across.mean(axis=2)
        outward = outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-150)
        # the mean of what is near the axis need not be across it, for rounding
        outward = outward - np.einsum("ni,ni->n", normals, outward)[:, None] * normals
        least = np.einsum("ni,nik->nk", outward, hulls.mid).min(axis=1) - slack
        most = np.linalg.norm(across, axis=1).max(axis=1) + slack
        low, _ = rim_distance(
            along.min(axis=1) - slack, along.max(axis=1) + slack, np.maximum(least, 0.0), most, openings, rims
        )
        return low

    def near(self, places: Floats, targets: Indices) -> Floats:
        """Return distances, in floats, m."""
        centres, normals, _, openings, rims = (values[targets] for values in self._frames)
        offset = places - centres
        along = np.einsum("ni,ni->n", normals, offset)
        across = np.linalg.norm(offset - along[:, None] * normals, axis=1)
        return rim_distance(along, along, across, across, openings, rims)[1]

    def breaks(self, place: Point, robot: int, target: int) -> bool:
        """Prove that a place is nearer to a rim than is asked; False means only that no proof was found.

        Args:
            place: m, exact.
            robot: Its index.
            target: Index of what it may be too near to.
        """
        near = self.near(np.array([[float(x) for x in place]]), np.array([target]))
        return Fraction(float(near[0])) + Fraction(_SURE) <= self.limits[robot]


@dataclass(frozen=True, eq=False)
class Solids(_Around):
    """The convex parts of all obstacles."""

    @cached_property
    def bodies(self) -> SolidBodies:
        """The solid bodies."""
        return SolidBodies.of(self.paths.mission)

    def close(self, parts: Patches, robots: Indices) -> tuple[Indices, Indices]:
        """Return the rows of patches, and the obstacles' parts, whose boxes are near enough to meet."""
        none = np.empty(0, dtype=np.intp)
        if not self.bodies.parts:
            return none, none
        low, high, outlines = parts.low, parts.high, self.bodies.outlines
        step = max(1, MOST_AT_ONCE // outlines.low.size)
        rows, targets = [none], [none]
        for first in range(0, len(parts), step):
            some = slice(first, first + step)
            row, target = np.nonzero(~(outlines.beyond(low[some], high[some]) > self.asked[robots[some], None]))
            rows.append(first + row)
            targets.append(target)
        return np.concatenate(rows), np.concatenate(targets)

    def low(self, parts: Patches, targets: Indices) -> Floats:
        """Bound distances from below, m; below zero nothing is proved."""
        hulls = Hulls(parts.mid.reshape(len(parts), 3, -1), parts.rad)
        enough = self.asked[self.paths.owner[parts.item]]
        return self.bodies.distances(targets, hulls, parts.centres(), enough)[0]

    def near(self, places: Floats, targets: Indices) -> Floats:
        """Return distances, in floats, m; below zero inside."""
        return self.bodies.distances(targets, Hulls.points(places), places)[1]

    def breaks(self, place: Point, robot: int, target: int) -> bool:
        """Prove that a place is no farther from what is solid than is asked; False means only that no proof was found.

        Args:
            place: m, exact.
            robot: Its index.
            target: Index of what it may be too near to.
        """
        return is_near(place, self.bodies.parts[target], self.limits[robot])


def _above(limit: Fraction) -> float:
    """Return a float above a limit."""
    return math.nextafter(float(limit), math.inf)
