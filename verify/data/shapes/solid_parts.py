"""Solid bodies of a mission: the convex parts of its obstacles, each with the openings that lead through it.

A part's opening is all of the part that lies nearer to the hoop's axis than the hoop's `opening`; a part has it where it holds the
hoop's centre, which is decided without rounding, since everyone must mean the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.data.shapes.conditions import HalfSpace, condition
from verify.data.shapes.convex_parts import Floats
from verify.data.shapes.inequalities import Inequality, Point
from verify.data.shapes.nearest import surface_of
from verify.data.shapes.obstacle import Obstacle
from verify.data.shapes.region import Hoop


@dataclass(frozen=True, slots=True)
class SolidPart:
    """One convex part of an obstacle.

    Attributes:
        obstacle: Its name.
        number: Which of the obstacle's parts, from 0.
        center: m, world frame; the inequalities are around it.
        inequalities: The part.
        holes: Hoops whose openings lead through it, by name.
    """

    obstacle: str
    number: int
    center: Point
    inequalities: tuple[Inequality, ...]
    holes: tuple[tuple[str, Hoop], ...]

    def distances(self, points: Floats) -> Floats:
        """Return how far points are from what is solid of the part, at the least, in m, in floats; below zero how deep they lie in it.

        Within an opening, and before and behind it, that is the distance from the opening's edge.

        Args:
            points: m, world frame. Shape (n, 3).

        Returns:
            m. Shape (n,).
        """
        found = self.distances_whole(points)
        for _, hoop in self.holes:
            offset, normal = points - np.array(hoop.center), np.array(hoop.normal)
            along = offset @ normal
            inside = hoop.opening - np.linalg.norm(offset - along[:, None] * normal, axis=1)
            surface, shift = surface_of(self.inequalities), float((np.array(self.center) - np.array(hoop.center)) @ normal)
            beyond = np.maximum(along - surface.reaches(normal) - shift, shift - surface.reaches(-normal) - along)
            found = np.maximum(found, np.where(inside > 0, np.hypot(inside, np.maximum(beyond, 0.0)), inside))
        return found

    def distances_whole(self, points: Floats) -> Floats:
        """Return how far points are from the part as if it had no openings, in m, in floats; below zero how deep they lie in it.

        Args:
            points: m, world frame. Shape (n, 3).

        Returns:
            m. Shape (n,).
        """
        return surface_of(self.inequalities).distances(points - np.array(self.center))


def solid_parts(obstacles: Mapping[str, Obstacle], hoops: Mapping[str, Hoop]) -> tuple[SolidPart, ...]:
    """Return the convex parts of all obstacles, in their order.

    Args:
        obstacles: By name.
        hoops: By name; those that an obstacle names but that are not there are no openings.
    """
    found: list[SolidPart] = []
    for name, obstacle in obstacles.items():
        inside = [(hoop, hoops[hoop]) for hoop in obstacle.openings if hoop in hoops]
        for number, part in enumerate(obstacle.body):
            holes = tuple((hoop, one) for hoop, one in inside if holds(obstacle.center, part, one.center))
            found.append(SolidPart(name, number, obstacle.center, part, holes))
    return tuple(found)


def holds(center: Point, part: tuple[Inequality, ...], point: Point | tuple[Fraction, Fraction, Fraction]) -> bool:
    """Tell without rounding whether a convex part around a centre holds a point.

    Args:
        center: The part's, m.
        part: Its inequalities.
        point: m, world frame, floats or exact.
    """
    offset = [Fraction(x) - Fraction(c) for x, c in zip(point, center, strict=True)]
    for inequality in part:
        one = condition(inequality)
        if isinstance(one, HalfSpace):
            value, most = sum((n * x for n, x in zip(one.normal, offset, strict=True)), Fraction(0)), one.bound
        else:
            from_centre = [x - c for x, c in zip(offset, one.centre, strict=True)]
            value = sum((from_centre[i] * one.matrix[i][j] * from_centre[j] for i in range(3) for j in range(3)), Fraction(0))
            most = one.square
        if value > most:
            return False
    return True
