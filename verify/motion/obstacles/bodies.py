"""Solid bodies of a mission, for the checker: their parts as arrays, and distances of points and hulls to them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.arithmetic.intervals import Interval
from verify.data.mission import Mission
from verify.data.shapes.solid_parts import SolidPart, solid_parts
from verify.motion.obstacles.half_spaces import Hulls
from verify.motion.obstacles.part_tables import Outlines, PartTable, part_tables

_BLOCK = 16_384
MOST_AT_ONCE = 2_000_000
"""So many numbers are computed of boxes beside faces at once."""


@dataclass(frozen=True, eq=False)
class SolidBodies:
    """Solid bodies as arrays.

    Attributes:
        parts: Convex parts of all obstacles.
    """

    parts: tuple[SolidPart, ...]

    @classmethod
    def of(cls, mission: Mission) -> SolidBodies:
        """Look up what is solid in a mission."""
        return cls(solid_parts(mission.obstacles, mission.hoops))

    @cached_property
    def tables(self) -> tuple[PartTable, ...]:
        """The parts as arrays."""
        return part_tables(self.parts)

    @cached_property
    def outlines(self) -> Outlines:
        """The parts as boxes around them."""
        return Outlines.of(self.tables, len(self.parts))

    @cached_property
    def obstacles(self) -> tuple[str, ...]:
        """Names of the obstacles, in the mission's order."""
        return tuple(dict.fromkeys(part.obstacle for part in self.parts))

    @cached_property
    def obstacle_of(self) -> Indices:
        """Index of each part's obstacle. Shape (parts,)."""
        numbers = {name: index for index, name in enumerate(self.obstacles)}
        return np.array([numbers[part.obstacle] for part in self.parts], dtype=np.intp)

    @cached_property
    def _rows(self) -> tuple[Indices, Indices]:
        """For each part the table that it is in and its row there. Shape (parts,) each."""
        table, row = np.zeros(len(self.parts), dtype=np.intp), np.zeros(len(self.parts), dtype=np.intp)
        for k, one in enumerate(self.tables):
            table[one.indices], row[one.indices] = k, np.arange(len(one.indices))
        return table, row

    def distances(self, parts: Indices, hulls: Hulls, places: Floats, enough: Floats | None = None) -> tuple[Floats, Floats]:
        """Return how far hulls stay from parts, proved, and about how far one place of each is.

        Args:
            parts: The part that each hull is compared with. Shape (n,).
            hulls: n of them.
            places: One place of each, m. Shape (n, 3).
            enough: Hulls of which as much as this is proved soon are not looked at any closer, m. Shape (n,).

        Returns:
            m. Shape (n,) each.
        """
        low, near = np.empty(len(parts)), np.empty(len(parts))
        table, row = self._rows
        for k, one in enumerate(self.tables):
            for index in _blocks(np.flatnonzero(table[parts] == k)):
                wanted = None if enough is None else enough[index]
                found = one.distances(row[parts[index]], hulls[index], places[index], enough=wanted)
                low[index], near[index] = found.low, found.near
        return low, near

    @np.errstate(all="ignore")
    def nearest(self, places: Floats) -> tuple[Interval, Indices]:
        """Return how far places are from what is solid, and which part is nearest.

        Args:
            places: m. Shape (n, 3).

        Returns:
            Distances in m, proved at the least and, above, as floats say; and indices of parts. Shape (n,) each.
        """
        low, near = np.empty(len(places)), np.full(len(places), np.inf)
        part = np.zeros(len(places), dtype=np.intp)
        step = max(1, MOST_AT_ONCE // self.outlines.low.size)
        for first in range(0, len(places), step):
            some = places[first : first + step]
            beyond = self.outlines.beyond(some, some)
            _, reached = self.distances(np.argmin(beyond, axis=1), Hulls.points(some), some)
            close = ~(beyond > np.maximum(reached, 0.0)[:, None])
            low[first : first + step] = np.where(close, np.inf, beyond).min(axis=1)
            which, other = np.nonzero(close)
            sure, about = self.distances(other, Hulls.points(some[which]), some[which])
            np.minimum.at(low, first + which, sure)
            order = np.argsort(-about, kind="stable")  # the least of each is written last
            near[first + which[order]], part[first + which[order]] = about[order], other[order]
        return Interval(low, near), part


def _blocks(index: Indices) -> Iterator[Indices]:
    """Yield parts of what is asked at once, so that it takes little memory."""
    for first in range(0, len(index), _BLOCK):
        yield index[first : first + _BLOCK]
