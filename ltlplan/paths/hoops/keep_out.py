"""Bodies that a planned path keeps clear of, each by the mission's margin and a little more: regions, rings, obstacles, walls."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ltlplan.free_space.free_space import FreeSpace
from ltlplan.free_space.inflated_obstacles import Solids
from refine.corridor.passage_room import room_in_opening, room_in_region
from verify.data.arrays import Booleans, Floats
from verify.data.mission import Mission
from verify.data.shapes.convex_parts import ConvexBody
from verify.data.shapes.measures import Measures
from verify.data.shapes.region import Hoop

_STEPS = 401
"""Places on a line at which a region's level is looked at, where no formula gives it."""
_PAST = 1.000001
"""Times as far as a region reaches: there a point is clear of it for sure."""


@dataclass(frozen=True, eq=False, slots=True)
class KeptRegion:
    """One region with what must be kept from it.

    Attributes:
        centre: m. Shape (3,).
        matrix: The ellipsoid's; of another shape zero. Shape (3, 3).
        level: Points outside have a level above this one.
        normal: Of the ring, where there is one. Shape (3,).
        height: m; the ring with its clearance fills |x| <= height along the normal.
        outer: m; points farther from the axis than this are clear of the ring.
        inner: m; points nearer to the axis than this pass through the opening, and are in the region meanwhile.
        near: m; a path that stays on one side of the opening keeps this far from it.
        reach: m; points farther from the centre than this are clear of all of it.
        measures: Of a region of another shape; None of an ellipsoid.
        grown: Its parts, larger by what is kept from it.
    """

    name: str
    centre: Floats
    matrix: Floats
    level: float
    normal: Floats | None = None
    height: float = 0.0
    outer: float = 0.0
    inner: float = 0.0
    near: float = 0.0
    reach: float = np.inf
    measures: Measures | None = None
    grown: tuple[ConvexBody, ...] = ()

    def holds(self, point: Floats) -> bool:
        """Tell whether a point is in the region or nearer to it than allowed."""
        return self.level_at(point) <= self.level

    def level_at(self, point: Floats) -> float:
        """Return the region's own level at a point: at most 1 in it."""
        return float(self.levels((point - self.centre)[None])[0])

    def levels(self, offsets: Floats) -> Floats:
        """Return the region's level at offsets from its centre. Shape (n, 3) to (n,)."""
        if self.measures is not None:
            return self.measures.levels(offsets)
        return np.einsum("ni,ni->n", offsets @ self.matrix, offsets)

    def exit(self, way: Floats, level: float) -> float:
        """Return how far from the centre along a unit vector a level is left for good, m."""
        if self.measures is None:
            return (level / float(way @ self.matrix @ way)) ** 0.5
        far = np.linspace(0.0, 3.0 * self.reach, _STEPS)
        return float(far[min(np.flatnonzero(self.levels(far[:, None] * way) <= level)[-1] + 1, _STEPS - 1)])

    def gate(self, point: Floats, line: Floats, level: float) -> float | None:
        """Return the share of a line from a point in the region at which a level is left for good; None where it ends before that.

        Args:
            point: Where the line begins, m. Shape (3,).
            line: From there to its end, m. Shape (3,).
            level: Of the region, as `levels` gives it.
        """
        shares = np.linspace(0.0, 1.0, _STEPS)
        within = np.flatnonzero(self.levels(point - self.centre + shares[:, None] * line) <= level)
        if not len(within) or within[-1] == _STEPS - 1:
            return None
        return float(shares[within[-1] + 1])


@dataclass(frozen=True, eq=False, slots=True)
class Room:
    """A mission's regions, obstacles and walls, with a margin.

    Attributes:
        regions: By name.
        low: m, the workspace's lower corner, moved inwards by the margin. Shape (3,).
        high: m, the upper corner likewise. Shape (3,).
        centres: Of the regions, in their order, m. Shape (regions, 3).
        reaches: How far each of them reaches from its centre, m. Shape (regions,).
        solids: Of the mission's obstacles.
        space: Where ways around all of these are looked for.
        slack: m kept beyond the margin.
    """

    regions: dict[str, KeptRegion]
    low: Floats
    high: Floats
    centres: Floats
    reaches: Floats
    solids: Solids
    space: FreeSpace
    slack: float

    def near(self, low: Floats, high: Floats) -> Booleans:
        """Tell which regions may reach into boxes, given by their corners. Shapes (boxes, 3) twice to (boxes, regions)."""
        beside = np.maximum(np.maximum(low[:, None] - self.centres, self.centres - high[:, None]), 0.0)
        return np.einsum("bok,bok->bo", beside, beside) <= self.reaches**2

    def inside(self, point: Floats) -> bool:
        """Tell whether a point keeps clear of the walls."""
        return bool(np.all(point >= self.low) and np.all(point <= self.high))

    def holding(self, point: Floats) -> frozenset[str]:
        """Return the regions that hold a point."""
        return frozenset(region.name for region in self._reaching(point) if region.level_at(point) <= 1.0)

    def touching(self, point: Floats) -> frozenset[str]:
        """Return the regions that hold a point, or come nearer to it than is kept from those that are not entered."""
        return frozenset(region.name for region in self._reaching(point) if region.holds(point))

    def _reaching(self, point: Floats) -> Iterator[KeptRegion]:
        """Yield the regions that may reach to a point."""
        return itertools.compress(self.regions.values(), np.linalg.norm(self.centres - point, axis=1) <= self.reaches)


def room(mission: Mission, slack: float = 0.0, *, robot: str | None = None) -> Room:
    """Return what a path must keep clear of: the mission's margin plus `slack` m everywhere.

    Args:
        mission: Regions, hoops, obstacles and workspace.
        slack: m.
        robot: Whose vehicle flies; by default the mission's.
    """
    radius = mission.vehicle.radius if robot is None else mission.vehicle_of(robot).radius
    near, clear = mission.margin + slack, mission.margin + slack + radius
    space = FreeSpace.of(mission, radius)
    regions: dict[str, KeptRegion] = {}
    for name, region in mission.all_regions.items():
        level = (1.0 + near / region.inner_radius) ** 2
        kept = KeptRegion(name, np.array(region.center), np.zeros((3, 3)), level)
        if region.is_ellipsoid:
            kept = replace(kept, matrix=region.shape, reach=_PAST * region.outer_radius * level**0.5)
        else:
            grown = tuple(body.grown(near) for body in region.measures.parts)
            reach = _PAST * (region.outer_radius + 2.0 * near)
            kept = replace(kept, reach=reach, measures=region.measures, grown=grown)
        if isinstance(region, Hoop):
            height, outer = region.rim / 2 + clear, region.opening + region.rim + clear
            inner = max(min(room_in_opening(region, radius, near), room_in_region(region, near)), 1e-3)
            reach = max(kept.reach, _PAST * float(np.hypot(outer, height)))
            kept = replace(
                kept, normal=np.array(region.normal), height=height, outer=outer, inner=inner, near=near, reach=reach
            )
        regions[name] = kept
    return Room(
        regions,
        np.array(mission.workspace.min) + near,
        np.array(mission.workspace.max) - near,
        np.array([region.centre for region in regions.values()]).reshape(-1, 3),
        np.array([region.reach for region in regions.values()]),
        space.solids(slack),
        space,
        slack,
    )
