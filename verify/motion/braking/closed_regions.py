"""Regions that are closed to robots, for braking: whether inequalities of every part are broken throughout a patch, by more than the margin.

A half-space's is by the least coefficient of the patch, a quadric's, which is convex, by the least along its tangent at the coefficients' mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import Condition, HalfSpace
from verify.data.shapes.inequalities import Inequality
from verify.motion.braking.patches import Patches, Point
from verify.motion.membership.bodies import Body
from verify.motion.membership.subdivision import Thresholds
from verify.motion.obstacles.half_spaces import Hulls
from verify.motion.paths import TeamPaths

_ROUNDED = 1e-13
"""Share of coordinates' sizes, many times what a few operations on them round."""


@dataclass(frozen=True, eq=False)
class ClosedRegions:
    """The regions of a mission that are closed to some robot. How far one is from its bound is told in units of its inequalities.

    Attributes:
        paths: What is flown.
        margin: How far all stay out of them, m, exact.
    """

    paths: TeamPaths
    margin: Fraction

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        mission = self.paths.mission
        closed = (
            name for name in mission.all_regions if not all(mission.may_enter(robot, name) for robot in self.paths.robots)
        )
        return tuple(closed)

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """The regions' bodies."""
        return tuple(Body.of(self.paths.mission.all_regions[name]) for name in self.names)

    @property
    def asked(self) -> Floats:
        """By how much inequalities are broken, more than the margin asks. Shape (robots,)."""
        return np.full(len(self.paths.robots), np.nextafter(0.0, 1.0))

    def close(self, parts: Patches, robots: Indices) -> tuple[Indices, Indices]:
        """Return the rows of patches of robots that regions are closed to, and these regions, where it is not proved at once."""
        found: list[tuple[Indices, Indices]] = [(np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))]
        for target, name in enumerate(self.names):
            shut = np.array([not self.paths.mission.may_enter(robot, name) for robot in self.paths.robots])
            rows = np.flatnonzero(shut[robots])
            targets = np.full(len(rows), target)
            still = ~(self.low(parts[rows], targets) >= self.asked[0])
            found.append((rows[still], targets[still]))
        return np.concatenate([rows for rows, _ in found]), np.concatenate([targets for _, targets in found])

    def low(self, parts: Patches, targets: Indices) -> Floats:
        """Bound from below by how much more than the margin asks patches break inequalities of every part of one region each."""
        return self._broken(Hulls(parts.mid.reshape(len(parts), 3, -1), parts.rad), targets)

    def near(self, places: Floats, targets: Indices) -> Floats:
        """Return by how much more places do, in floats."""
        return self._broken(Hulls.points(places), targets)

    def breaks(self, place: Point, robot: int, target: int) -> bool:
        """Decide without rounding whether a place is in a region.

        Args:
            place: m, exact.
            robot: Its index.
            target: Index of what it may be too near to.
        """
        del robot
        body = self.bodies[target]
        offset = [x - Fraction(c) for x, c in zip(place, body.centre, strict=True)]
        return any(all(_keeps(body.inequalities[k], offset) for k in part) for part in body.parts)

    def _broken(self, hulls: Hulls, targets: Indices) -> Floats:
        result = np.full(len(hulls), np.inf)
        for target in np.unique(targets):
            rows, body = np.flatnonzero(targets == target), self.bodies[target]
            mine = hulls[rows].beside(np.broadcast_to(np.array(body.centre), (len(rows), 3)))
            values = [
                _least(one, known, mine) - Thresholds.of(known, self.margin).outside[1]
                for one, known in zip(body.inequalities, body.conditions, strict=True)
            ]
            for part in body.parts:
                result[rows] = np.minimum(result[rows], np.max([values[k] for k in part], axis=0))
        return np.nextafter(result, -np.inf)


def _least(one: Inequality, known: Condition, hulls: Hulls) -> Floats:
    """Bound from below what an inequality bounds, on hulls in its region's frame. Shape (n,)."""
    if isinstance(known, HalfSpace):
        normal = np.array(one.linear)
        return _along(np.broadcast_to(normal, (len(hulls), 3)), hulls) - _ROUNDED * (hulls.size @ np.abs(normal))
    matrix = np.array(one.quadratic)
    own = np.array([float(x) for x in known.centre])
    mine = hulls.beside(np.broadcast_to(own, (len(hulls), 3)))
    middle = mine.mid.mean(axis=2)
    slope, size = middle @ matrix, mine.size + np.abs(middle) + np.abs(own)
    doubt = _ROUNDED * np.einsum("ni,ij,nj->n", size, np.abs(matrix), size)
    return 2 * _along(slope, mine) - np.einsum("ni,ni->n", slope, middle) - doubt


def _along(directions: Floats, hulls: Hulls) -> Floats:
    """Return the least along one direction each, up to rounding. Shape (n, 3) to (n,)."""
    return np.einsum("ni,nik->nk", directions, hulls.mid).min(axis=1) - np.einsum("ni,ni->n", np.abs(directions), hulls.rad)


def _keeps(one: Inequality, offset: Sequence[Fraction]) -> bool:
    """Decide without rounding whether a point keeps an inequality."""
    value = sum((Fraction(a) * x for a, x in zip(one.linear, offset, strict=True)), Fraction(0))
    for row, x in zip(one.quadratic, offset, strict=True):
        value += x * sum((Fraction(a) * y for a, y in zip(row, offset, strict=True)), Fraction(0))
    return value <= Fraction(one.bound)
