"""Where a robot is, in the world and in A = E x R, as MTAC-E and teams in flight keep it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

from ltlplan.systems.visit_log import VisitLog
from verify.data.language.sequence import Direction
from verify.data.shapes.inequalities import Point

Key = tuple[Hashable, str, str]
"""Where a robot is, the region that it entered last, and its internal state."""


@dataclass(frozen=True, slots=True)
class AgentState:
    """Where a robot is, in the world and in A = E x R.

    Attributes:
        position: m.
        inside: The regions that it is in.
        vertex: Vertex of the environment: the region that it entered last, or the start vertex.
        internal: Its internal state.
        place: The region in whose middle it is; None where it is anywhere else.
        side: The direction in which it flies through the hoop that it is in, where ways around obstacles depend on it.
        kind: What robots have in common to whom the mission is the same (`Mission.alike_as`).
    """

    position: Point
    inside: frozenset[str]
    vertex: str
    internal: str
    place: str | None = None
    side: Direction | None = None
    kind: str = ""

    @property
    def key(self) -> Key:
        """What tells this state from the others that one robot can be in."""
        place: Hashable = self.place if self.side is None else (self.place, self.side)
        place = place or (self.position, self.inside)
        return ((place, self.kind) if self.kind else place, self.vertex, self.internal)

    def log(self) -> VisitLog:
        """Return a log of visits that begins where the robot is."""
        log = VisitLog()
        log.enter(self.inside)
        if self.inside:
            log.stop(self.vertex if self.vertex in self.inside else min(self.inside))
        return log

    def seen_in(self, regions: frozenset[str]) -> AgentState:
        """Return the state of the robot where it is seen in some regions, or in none."""
        return replace(self, inside=regions, vertex=min(regions - self.inside, default=self.vertex), place=None, side=None)
