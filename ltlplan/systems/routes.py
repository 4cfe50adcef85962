"""Ways of legs: around obstacles and what a robot may not enter on them, and within the regions that hold both ends.

Words are counted by these, and paths are laid by the same router: obstacles, regions that the formula may forbid and rooms are bodies to it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np

from ltlplan.free_space.free_space import FreeSpace, Place
from ltlplan.free_space.staying_inside import ROOMS, way_inside, way_stays_inside
from verify.data import Mission
from verify.data.arrays import Booleans, Floats

_PAST = 1.000001
"""Times as far as a region reaches: there a line is clear of it for sure."""
_ROUNDING = 1e-9
"""m by which a straight way may be longer than the distance."""


class Routes:
    """The ways between points that legs take.

    Attributes:
        straight: Whether nothing is in any way, so that all are straight lines.
    """

    def __init__(self, mission: Mission, radius: float | None = None, closed: Collection[str] = ()) -> None:
        """Lay out nothing yet.

        Args:
            mission: Obstacles, regions, workspace and margin.
            radius: Of the vehicle, m; by default of the mission's.
            closed: Regions that ways do not enter where they hold neither end; all of them in a world with obstacles.
        """
        regions = mission.all_regions
        self._mission, self._radius = mission, radius
        self._bent = frozenset(name for name, region in regions.items() if len(region.body) > 1)
        self._open = frozenset[str]() if mission.obstacles else frozenset(regions).difference(closed)
        bodies = [regions[name] for name in sorted(closed)]
        self._centres = np.array([body.center for body in bodies]).reshape(-1, 3)
        self._reaches = np.array([_PAST * (body.outer_radius + 2.0 * mission.margin) for body in bodies])
        self._lengths: dict[tuple[Place, Place], float] = {}
        self.straight = not (mission.obstacles or closed or self._bent)

    @cached_property
    def _space(self) -> FreeSpace:
        return FreeSpace.of(self._mission, self._radius)

    def lengths(self, start: Place, ends: Sequence[Place]) -> Floats:
        """Return how long the ways to some places are, m; infinite where there is none, or none was found. Shape (ends,).

        Args:
            start: Where they begin.
            ends: Where they end.
        """
        if self.straight:
            return np.array([math.dist(start.point, end.point) for end in ends])
        new = [end for end in dict.fromkeys(ends) if (start, end) not in self._lengths]
        found = np.array([math.dist(start.point, end.point) for end in new])
        asked = np.flatnonzero(~self._are_clear(start, new))
        if len(asked):
            found[asked] = self._space.lengths(self._permitting(start), [self._permitting(new[k]) for k in asked])
        for end, length in zip(new, found.tolist(), strict=True):
            self._lengths[start, end] = self._within(start, end, length)
        return np.array([self._lengths[start, end] for end in ends])

    def way(self, start: Place, end: Place) -> Floats | None:
        """Return a way with room at its corners; None where there is none. Shape (points, 3).

        Args:
            start: Where it begins.
            end: Where it ends.
        """
        ends, permitted = (np.array(start.point), np.array(end.point)), self._open | start.inside | end.inside
        rooms, found = start.inside & end.inside, self._space.way(*ends, permitted)
        if found is None or self._stays(rooms, found):
            return found
        return way_inside(self._space, rooms, ends, permitted, 0.0, ROOMS)

    def _are_clear(self, start: Place, ends: Sequence[Place]) -> Booleans:
        """Tell which straight lines pass none of the balls around what is closed, in a world without obstacles. Shape (ends,)."""
        if self._mission.obstacles or not ends:
            return np.zeros(len(ends), dtype=np.bool_)
        begin, lines = np.array(start.point), np.array([end.point for end in ends]) - np.array(start.point)
        offsets, squared = self._centres - begin, np.maximum(np.sum(lines**2, axis=1), _ROUNDING)
        shares = np.clip(lines @ offsets.T / squared[:, None], 0.0, 1.0)
        apart = np.linalg.norm(offsets - shares[:, :, None] * lines[:, None], axis=2)
        return np.all(apart > self._reaches, axis=1)

    def _within(self, start: Place, end: Place, length: float) -> float:
        """Return the length of a way that leaves none of the regions around both ends, where the shortest one is so long."""
        rooms, ends = start.inside & end.inside, (np.array(start.point), np.array(end.point))
        turns = length > float(np.linalg.norm(ends[1] - ends[0])) + _ROUNDING
        if not math.isfinite(length) or not (rooms if turns else rooms & self._bent):
            return length
        permitted = self._open | start.inside | end.inside
        found = self._space.way(*ends, permitted) if turns else np.stack(ends)
        if found is not None and self._stays(rooms, found):
            return length
        found = way_inside(self._space, rooms, ends, permitted, 0.0, ROOMS[-1:])
        return math.inf if found is None else float(np.linalg.norm(np.diff(found, axis=0), axis=1).sum())

    def _stays(self, rooms: Collection[str], way: Floats) -> bool:
        regions = (self._mission.all_regions[name] for name in rooms)
        return all(way_stays_inside(region, way, self._mission.margin) for region in regions)

    def _permitting(self, place: Place) -> Place:
        return Place(place.point, self._open | place.inside)
