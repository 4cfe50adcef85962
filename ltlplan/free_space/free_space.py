"""A mission's free space for one size of vehicle: where it can fly, and how far it is from place to place.

A vehicle's centre keeps its radius and the margin from obstacles and rims, and the margin from the walls and from regions that it may not
be in. Openings of hoops are closed here: they are passed in visits, straight along the axis.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from verify.data.mission import Mission
from verify.data.shapes.inequalities import Point

if TYPE_CHECKING:  # what works among obstacles takes long to load, and most missions have none
    from ltlplan.free_space.inflated_obstacles import Solids
    from refine.obstacles.inflated_bodies import InflatedBody
    from refine.obstacles.visibility_graph import Roadmap

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]

ROOM = 0.15
"""m by which corners are passed more widely, where there is so much room: a smooth path cuts or swings out of them by about as much."""
_LONGER, _ASIDE = 1.15, 0.3
"""A way that keeps more than it must may be so many times as long, and so many m longer."""
_HEIGHTS = 6
"""Different heights at which ways may turn on upright edges, at most."""
_REMEMBERED, _WAYS = 24, 4096
"""Free spaces that are kept, and ways of each."""


@dataclass(frozen=True, slots=True)
class Place:
    """A point from which ways begin or at which they end.

    Attributes:
        point: m.
        inside: Regions that a way may be in there: those that hold the point.
    """

    point: Point
    inside: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Free space of one size of vehicle.

    Attributes:
        mission: Whose world.
        clearance: m between the vehicle's centre and obstacles, at the least.
    """

    mission: Mission
    clearance: float
    _solids: dict[float, Solids] = field(default_factory=dict, init=False, repr=False)
    _roadmaps: dict[float, Roadmap] = field(default_factory=dict, init=False, repr=False)
    _boxes: dict[frozenset[str], tuple[Floats, Floats]] = field(default_factory=dict, init=False, repr=False)
    _rows: dict[Place, Floats] = field(default_factory=dict, init=False, repr=False)
    _free: dict[Place, bool] = field(default_factory=dict, init=False, repr=False)
    _lengths: dict[Place, dict[Place, float]] = field(default_factory=dict, init=False, repr=False)
    _ways: dict[tuple[object, ...], Floats | None] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, mission: Mission, radius: float | None = None) -> FreeSpace:
        """Return a mission's free space; it is laid out when a way is asked for.

        Args:
            mission: Obstacles, hoops, regions, workspace, margin.
            radius: Of the vehicle, m; by default of the mission's.
        """
        size = mission.vehicle.radius if radius is None else radius
        things = (*mission.obstacles.items(), *mission.all_regions.items(), *mission.agents.items())
        key = (tuple((name, id(thing)) for name, thing in things), mission.workspace, mission.margin, size)
        if key not in _SPACES:
            while len(_SPACES) >= _REMEMBERED:
                _SPACES.popitem(last=False)
            _SPACES[key] = cls(mission, size + mission.margin), things
        _SPACES.move_to_end(key)
        return _SPACES[key][0]

    def solids(self, slack: float = 0.0) -> Solids:
        """Return what is solid, grown by the clearance and so many m more."""
        from ltlplan.free_space.inflated_obstacles import grown_solids

        if slack not in self._solids:
            self._solids[slack] = grown_solids(self.mission, self.clearance + slack)
        return self._solids[slack]

    def roadmap(self, slack: float = 0.0) -> Roadmap:
        """Return the ways that keep so many m more than they must."""
        if slack not in self._roadmaps:
            self._roadmaps[slack] = _roadmap(
                self.mission, self.clearance + slack, self.mission.margin + slack, self.solids(slack)
            )
        return self._roadmaps[slack]

    def narrower(self, clearance: float, margin: float | None = None) -> Roadmap:
        """Return the ways of a smaller vehicle.

        Args:
            clearance: m that it keeps from what is solid.
            margin: m that it keeps from regions and walls; by default it goes through whichever regions.
        """
        from ltlplan.free_space.inflated_obstacles import grown_solids

        walls = grown_solids(self.mission, clearance)
        near = self.mission.margin if margin is None else margin
        return _roadmap(self.mission, clearance, near, walls, regions=margin is not None)

    def way(self, start: Floats, end: Floats, permitted: Collection[str] = (), slack: float = 0.0) -> Floats | None:
        """Return a short way between two points with room at its corners where there is some; None where there is none.

        Args:
            start: m. Shape (3,).
            end: m. Shape (3,).
            permitted: Regions that it may enter; it leads around all others.
            slack: m that it keeps more than it must. None is returned as well where that makes it much longer.

        Returns:
            Both ends and the points at which it turns, m. Shape (points, 3).
        """
        key = (start.tobytes(), end.tobytes(), frozenset(permitted), slack)
        if key not in self._ways:
            if len(self._ways) >= _WAYS:
                self._ways.clear()
            self._ways[key] = self._way(start, end, permitted, slack)
        found = self._ways[key]
        return None if found is None else found.copy()

    def _way(self, start: Floats, end: Floats, permitted: Collection[str], slack: float) -> Floats | None:
        """Return a way that was not asked for yet."""
        near = self.roadmap().way(start, end, permitted, room=ROOM)
        if near is None or slack == 0.0:
            return near
        wider = self.roadmap(slack)
        if wider.clear(near, wider.stopping(permitted)) and np.all(near >= wider.low) and np.all(near <= wider.high):
            return near
        far = wider.way(start, end, permitted, room=ROOM)
        return far if far is not None and _length(far) <= _LONGER * _length(near) + _ASIDE else None

    def entered(self, points: Floats, slack: float = 0.0) -> list[frozenset[str]]:
        """Return the regions that each straight line from point to point enters, or comes too near to. Shape (points, 3)."""
        soft = self.roadmap(slack).soft
        lines, bodies = soft.pairs(points[:-1], points[1:])
        return [frozenset(soft.names[body] for body in bodies[lines == k]) for k in range(len(points) - 1)]

    def lengths(self, start: Place, ends: Sequence[Place]) -> Floats:
        """Return how long the shortest ways on the roadmap are, m; infinite where there is none.

        A way leaves the regions around its start before it enters those around its end, but for regions that touch.

        Args:
            start: Where they begin.
            ends: Where they end.

        Returns:
            Shape (ends,).
        """
        known = self._lengths.setdefault(start, {})
        new = [end for end in dict.fromkeys(ends) if end not in known]
        if new:
            touching = self._touching(start, new)
            for end, length, near in zip(new, self._found(start, new, touching).tolist(), touching.tolist(), strict=True):
                known[end] = length
                if not near:  # a way there is a way back
                    self._lengths.setdefault(end, {})[start] = length
        return np.array([known[end] for end in ends])

    def connects(self, places: Sequence[Place]) -> bool:
        """Return whether ways lead from each of some places to all others around all regions that hold neither end.

        Args:
            places: Where ways begin and end.
        """
        ways = self.lengths(places[0], places[1:]) if len(places) > 1 else ()
        return all(math.isfinite(length) for length in ways)

    def _found(self, start: Place, ends: Sequence[Place], touching: Booleans) -> Floats:
        """Return the lengths of ways to some places, of which some are in regions that touch those around the start. Shape (ends,)."""
        found = np.full(len(ends), np.nan)
        asked = np.flatnonzero([self._is_free(start) and self._is_free(end) for end in ends])
        roadmap, points = self.roadmap(), np.array([end.point for end in ends]).reshape(-1, 3)
        starts = np.broadcast_to(np.array(start.point), points.shape)
        asked = asked[~roadmap.solids.meets(starts[asked], points[asked])]
        direct = np.ones(len(asked), dtype=np.bool_)
        segments, bodies = roadmap.soft.pairs(starts[asked], points[asked])
        for segment, body in zip(segments.tolist(), bodies.tolist(), strict=True):
            name = roadmap.soft.names[body]
            direct[segment] &= name in start.inside or name in ends[int(asked[segment])].inside
        straight = asked[direct]
        found[straight] = np.linalg.norm(points[straight] - starts[straight], axis=1)
        for k in np.flatnonzero(np.isnan(found)).tolist():
            found[k] = self._turning(start, ends[k], bool(touching[k]))
        return found

    def _turning(self, start: Place, end: Place, touch: bool) -> float:
        """Return how long the shortest way by points at which it turns is, m; infinite where there is none."""
        if not touch:
            return float(np.min(self._row(start) + self._row(end), initial=np.inf))
        way = self.roadmap().way(np.array(start.point), np.array(end.point), start.inside | end.inside)
        return np.inf if way is None else _length(way)

    def _touching(self, start: Place, ends: Sequence[Place]) -> Booleans:
        """Tell around which places there are regions that may touch others around a start. Shape (ends,)."""
        low, high = self._box(start.inside)
        boxes = np.array([self._box(end.inside) for end in ends])
        meeting = np.all((low <= boxes[:, 1]) & (boxes[:, 0] <= high), axis=1)
        return meeting & np.array([end.inside != start.inside for end in ends])

    def _is_free(self, place: Place) -> bool:
        if place not in self._free:
            self._free[place] = self.roadmap().holds(np.array(place.point))
        return self._free[place]

    def _box(self, regions: frozenset[str]) -> tuple[Floats, Floats]:
        """Return the corners of a box around some regions; of none, an empty one."""
        if regions not in self._boxes:
            soft = self.roadmap().soft
            own = np.array([name in regions for name in soft.names], dtype=np.bool_)
            low, high = soft.low[own].min(axis=0, initial=np.inf), soft.high[own].max(axis=0, initial=-np.inf)
            self._boxes[regions] = low, high
        return self._boxes[regions]

    def _row(self, place: Place) -> Floats:
        if place not in self._rows:
            self._rows[place] = self.roadmap().distances(np.array(place.point), place.inside)
        return self._rows[place]


_SPACES: OrderedDict[tuple[object, ...], tuple[FreeSpace, object]] = OrderedDict()
"""Free spaces by what they were made of, which is kept beside them, so that no other thing takes its identity."""


def _length(points: Floats) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _roadmap(mission: Mission, clear: float, near: float, walls: Solids, *, regions: bool = True) -> Roadmap:
    """Return the ways that keep `clear` from what is solid, `near` from regions and the workspace's walls."""
    from refine.obstacles.inflated_bodies import grown_bodies
    from refine.obstacles.keep_out_bodies import ring
    from refine.obstacles.visibility_graph import Roadmap

    solids = [part.body for part in walls.parts] + [ring(name, hoop, clear).inflated for name, hoop in mission.hoops.items()]
    soft: list[InflatedBody] = []
    for name, region in mission.all_regions.items() if regions else ():
        soft += grown_bodies(name, region.center, region.body, near, bevelled=False)
    low, high = np.array(mission.workspace.min) + near, np.array(mission.workspace.max) - near
    return Roadmap(low, high, solids, soft, _heights(mission))


def _heights(mission: Mission) -> Floats:
    """Return the heights at which robots are at home: where they start, end and stop; some of them where they are many."""
    levels = [region.center[2] for region in mission.all_regions.values()]
    for agent in mission.agents.values():
        levels += [agent.start[2], *(() if agent.end is None else (agent.end[2],))]
    different = np.unique(np.round(np.array(levels) / 0.1)) * 0.1
    if len(different) <= _HEIGHTS:
        return different
    return different[np.unique(np.round(np.linspace(0, len(different) - 1, _HEIGHTS)).astype(np.int64))]
