"""Obstacles as convex bodies that a robot's centre must stay out of: their parts, grown by the vehicle's radius and the margin.

Growing rounds edges and corners: a point is outside where its distance from the part is greater. A plane between a straight leg and a
grown part is the one across the shortest way between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.inflated_bodies import InflatedBody, grown_bodies
from refine.planes import Plane, nearest_on_segment
from verify.data import Mission
from verify.data.shapes.inequalities import Inequality
from verify.data.shapes.nearest import Surface, surface_of
from verify.data.shapes.solid_parts import SolidPart, solid_parts

Floats = NDArray[np.float64]

_TOUCHING = 1e-6
"""m from a part at which no direction out of it is known."""


@dataclass(frozen=True, eq=False)
class SolidBody:
    """A convex part of an obstacle, grown: all points within `growth` of it, its openings left aside.

    Attributes:
        name: What it stands for, in messages.
        part: The part.
        box: Lower and upper corner of a box around the part, m: a long wall reaches far in one direction only. Shape (2, 3).
        growth: m.
    """

    name: str
    part: SolidPart
    box: Floats
    growth: float

    @cached_property
    def inflated(self) -> InflatedBody:
        """Return the polyhedron or quadrics around it that ways lead around."""
        return grown_bodies(self.part.obstacle, self.part.center, (self.part.inequalities,), self.growth)[0]

    @cached_property
    def centre(self) -> Floats:
        """Of the box, m. Shape (3,)."""
        return self.box.mean(axis=0)

    @cached_property
    def half_lengths(self) -> Floats:
        """Half the edges of a box around all of it, m. Shape (3,)."""
        return (self.box[1] - self.box[0]) / 2 + self.growth

    @cached_property
    def reach(self) -> float:
        """Greatest distance of its points from its centre, in m."""
        return float(np.linalg.norm(self.half_lengths))

    @cached_property
    def openings(self) -> tuple[str, ...]:
        """Hoops whose openings lead through it."""
        return tuple(name for name, _ in self.part.holes)

    @cached_property
    def _origin(self) -> Floats:
        return np.array(self.part.center)

    @cached_property
    def _surface(self) -> Surface:
        return surface_of(self.part.inequalities)

    def signed_distance(self, points: Floats) -> Floats:
        """Return how far points are outside, in m (a lower bound of the distance), negative inside. Shape (..., 3) to (...)."""
        surface = self._surface
        offset = points.reshape(-1, 3) - self._origin
        found = -surface.body.depths(offset) - self.growth
        unsure = (found < 0.0) & (found > -self.growth)  # beside edges and corners
        if unsure.any():
            found[unsure] = surface.distances(offset[unsure]) - self.growth
        return found.reshape(points.shape[:-1])

    def meets(self, a: Floats, b: Floats) -> bool:
        """Return whether the segment a b has no plane between it and the body."""
        body = self._surface.body
        ends = np.stack([a, b]) - self._origin
        if len(body.normals) and np.any(np.min(ends @ body.normals.T, axis=0) - body.distances > self.growth):
            return False  # beyond a face, as most are
        return self.plane(a, b) is None

    def grown(self, by: float) -> SolidBody:
        """Return it grown by `by` m more."""
        return replace(self, growth=self.growth + by)

    def pushed_out(self, a: Floats, b: Floats, by: float) -> Floats | None:
        """Return the point of a segment that is nearest to the part, moved out of the body; None where the segment meets the part itself.

        Args:
            a: One end, m. Shape (3,).
            b: The other.
            by: How far outside of the body the point then is, m.
        """
        surface = self._surface
        point = nearest_on_segment(a - self._origin, b - self._origin, surface.distances)
        foot = surface.nearest(point[None])[0]
        distance = float(np.linalg.norm(point - foot))
        if distance <= _TOUCHING:
            return None
        return self._origin + foot + (point - foot) / distance * (self.growth + by)

    def plane(self, a: Floats, b: Floats) -> Plane | None:
        """Return a plane with the body on one side and the segment a b on the other; None where they meet."""
        surface = self._surface
        start, end = a - self._origin, b - self._origin
        point = nearest_on_segment(start, end, surface.distances)
        normal = point - surface.nearest(point[None])[0]
        distance = float(np.linalg.norm(normal))
        if distance <= self.growth:
            return None
        normal = normal / distance
        offset = float(surface.body.reaches(normal[None], _corners(self.part.inequalities))[0]) + self.growth
        if min(float(normal @ start), float(normal @ end)) <= offset:
            return None
        return Plane(normal, offset + float(normal @ self._origin))


@lru_cache(maxsize=4096)
def _corners(inequalities: tuple[Inequality, ...]) -> Floats:
    return surface_of(inequalities).body.corners()


def solid_bodies(mission: Mission, growth: float) -> tuple[SolidBody, ...]:
    """Return the convex bodies outside of which a point is farther than `growth` from all obstacles of a mission.

    Args:
        mission: Gives obstacles, and hoops that are openings in them.
        growth: m.
    """
    return tuple(
        SolidBody(f"obstacle {part.obstacle}", part, _box(mission, part), growth)
        for part in solid_parts(mission.obstacles, mission.hoops)
    )


def _box(mission: Mission, part: SolidPart) -> Floats:
    """Return the corners of a box around a part; of an obstacle of one part, around the obstacle. Shape (2, 3)."""
    obstacle, centre = mission.obstacles[part.obstacle], np.array(part.center)
    if len(obstacle.body) == 1:
        half = np.array(obstacle.half_lengths)
        return np.stack([centre - half, centre + half])
    corners = _corners(part.inequalities)
    return centre + np.stack([corners.min(axis=0), corners.max(axis=0)])
