"""Ends of a passage through a hoop where a region stands at the hoop's own control points.

A hoop's rear and front lie `reach` before and behind its centre. Where one of them, or the axis on the way to it, comes too near a
region that is not visited there, the passage ends earlier on the axis, as soon as the ring is passed, and the way leads on through
the hoop's region to a point beside the axis at which it has been left. Of the points tried that one is taken that is nearest to the hoop's
own. Where none is clear the hoop's own points stay, and what is said of them is said of the hoop as it is written.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ltlplan.paths.hoops.clearance import blocked, on_lines
from ltlplan.paths.hoops.hoop_frame import ControlPoints, control_points
from ltlplan.paths.hoops.keep_out import KeptRegion, Room
from verify.data.arrays import Floats
from verify.data.language.sequence import Direction
from verify.data.shapes.region import Hoop

_PAST = 0.01
"""m farther than the ring, or than the border of the hoop's region with what is kept from it."""
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Where on the axis a passage may end: of the way from the ring to the hoop's own point."""
_TILTS, _TURNS = np.deg2rad(np.arange(15.0, 91.0, 15.0)), np.deg2rad(np.arange(0.0, 360.0, 30.0))
"""Directions from the axis in which the hoop's region may be left."""
_FARTHER = (0.0, 0.1, 0.25)
"""m beyond the border at which it has been left."""


@dataclass(frozen=True, eq=False, slots=True)
class PassageEnds:
    """A hoop's control points as one robot can fly them.

    Attributes:
        points: The control points.
        before: A point outside the hoop's region that leads to its rear, where that lies inside. Shape (3,), m.
        beyond: Likewise of its front.
    """

    points: ControlPoints
    before: Floats | None = None
    beyond: Floats | None = None

    def outer(self, direction: Direction) -> tuple[Floats, Floats]:
        """Return where the way to a passage ends and where the way from it begins, m."""
        rear = self.points.rear if self.before is None else self.before
        front = self.points.front if self.beyond is None else self.beyond
        return (rear, front) if direction == "F" else (front, rear)

    def inner(self, direction: Direction) -> tuple[Floats | None, Floats | None]:
        """Return the passage's own first and last point where these are not the outer ones, m."""
        rear = None if self.before is None else self.points.rear
        front = None if self.beyond is None else self.points.front
        return (rear, front) if direction == "F" else (front, rear)


def passage_ends(hoop: Hoop, where: Room, name: str) -> PassageEnds:
    """Return a hoop's control points, and others where regions stand at its own.

    Args:
        hoop: What is flown through.
        where: What there is to keep clear of.
        name: The hoop's.
    """
    points, kept = control_points(hoop), where.regions[name]
    asked = _Asked(points, kept, where, where.holding(points.centre))
    before, beyond = asked.end(points.rear), asked.end(points.front)
    if before is None and beyond is None:
        return PassageEnds(points)
    rear, outer_rear = before or (points.rear, None)
    front, outer_front = beyond or (points.front, None)
    return PassageEnds(replace(points, rear=rear, front=front), outer_rear, outer_front)


@dataclass(frozen=True, eq=False, slots=True)
class _Asked:
    """A hoop and what stands around it."""

    points: ControlPoints
    kept: KeptRegion
    where: Room
    around: frozenset[str]

    def end(self, own: Floats) -> tuple[Floats, Floats | None] | None:
        """Return where a passage ends and by which point its region is left then; None where the hoop's own point serves, or none does."""
        if self._outside(own) and blocked(self.points.centre, own, self.where, self.around) is None:
            return None
        ahead = own - self.points.centre
        reach = float(np.linalg.norm(ahead))
        axis, ring = ahead / reach, self.kept.height + _PAST
        for share in _SHARES if ring < reach else ():
            last = self.points.centre + (ring + share * (reach - ring)) * axis
            if blocked(self.points.centre, last, self.where, self.around):
                continue
            if self._outside(last):
                return last, None
            if beside := self._beside(last, axis, own):
                return last, beside[0]
        return None

    def _outside(self, point: Floats) -> bool:
        """Tell whether a point is clear of all regions but those around the hoop."""
        return self.where.inside(point) and self.where.touching(point) <= self.around - {self.kept.name}

    def _beside(self, last: Floats, axis: Floats, own: Floats) -> Sequence[Floats]:
        """Return points outside of the hoop's region to which straight lines from a point on the axis lead, the nearest to its own first."""
        left, up = self.points.frame[:, 1], self.points.frame[:, 2]
        found: list[Floats] = []
        for tilt, turn in itertools.product(_TILTS, _TURNS):
            way = np.cos(tilt) * axis + np.sin(tilt) * (np.cos(turn) * left + np.sin(turn) * up)
            border = self.kept.exit(way, self.kept.level)
            found += [self.points.centre + (border + _PAST + farther) * way for farther in _FARTHER]
        found = [point for point in found if self._outside(point)]
        if not found:
            return ()
        met = {conflict.piece for conflict in on_lines(last, np.array(found), self.where, self.around)}
        free = [point for index, point in enumerate(found) if index not in met]
        return sorted(free, key=lambda point: round(float(np.linalg.norm(point - own)), 6))  # moving the world decides no tie
