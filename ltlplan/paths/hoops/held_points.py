"""Which regions hold a point on the way: what a leg that begins or ends there may be in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ltlplan.paths.hoops.keep_out import KeptRegion, Room
from ltlplan.systems.region_labels import apart
from verify.data import Mission
from verify.data.arrays import Floats


@dataclass(frozen=True, eq=False, slots=True)
class HeldPoints:
    """A mission's regions as points lie in them.

    Attributes:
        mission: Whose regions.
        where: What is kept from them.
    """

    mission: Mission
    where: Room

    def holding(self, point: Floats) -> frozenset[str]:
        """Return the regions that hold a point."""
        return frozenset(region.name for region in self._reaching(point) if region.level_at(point) <= 1.0)

    def near(self, point: Floats) -> frozenset[str]:
        """Return the regions that hold a point, or come nearer to it than is kept from those that are not entered."""
        return frozenset(region.name for region in self._reaching(point) if region.holds(point))

    def around(self, name: str, point: Floats) -> frozenset[str]:
        """Return the other regions that hold a point beside a region, and its centre: those that it stands in."""
        return (self.holding(point) & self.holding(np.array(self.mission.all_regions[name].center))) - {name}

    def shared(self, names: frozenset[str], name: str) -> frozenset[str]:
        """Return those of some regions that may have a point in common with another one."""
        regions = self.mission.all_regions
        return frozenset(other for other in names if not apart(regions[other], regions[name]))

    def _reaching(self, point: Floats) -> Iterator[KeptRegion]:
        """Yield the regions that may reach to a point."""
        near = np.flatnonzero(np.linalg.norm(self.where.centres - point, axis=1) <= self.where.reaches)
        regions = list(self.where.regions.values()) if len(near) else []
        yield from (regions[k] for k in near)
