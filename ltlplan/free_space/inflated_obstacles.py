"""The solid parts of a mission's obstacles, grown by what a vehicle's centre keeps from them, with the openings that lead through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.inflated_bodies import InflatedBody
from refine.obstacles.solid_body import solid_bodies
from verify.data.mission import Mission

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Hole:
    """A hoop's opening in a solid part, as far as a vehicle's centre may use it.

    Attributes:
        hoop: Its name.
        centre: m. Shape (3,).
        normal: Along its axis. Shape (3,).
        inner: m; nearer to the axis than this a path passes through.
    """

    hoop: str
    centre: Floats
    normal: Floats
    inner: float

    def off_axis(self, points: Floats) -> Floats:
        """Return squared distances from the axis, m^2. Shape (..., 3) to (...)."""
        offset = points - self.centre
        return np.einsum("...a,...a->...", offset, offset) - (offset @ self.normal) ** 2


@dataclass(frozen=True, eq=False, slots=True)
class Solid:
    """One convex part of an obstacle, grown by what a vehicle's centre keeps from it.

    Attributes:
        body: The part, in the world's frame.
        holes: Openings that lead through it.
    """

    body: InflatedBody
    holes: tuple[Hole, ...] = ()

    def met(self, points: Floats) -> NDArray[np.bool_]:
        """Return which points come too near, openings aside. Shape (n, 3) to (n,)."""
        met = self.body.holds(points)
        for hole in self.holes:
            met &= hole.off_axis(points) >= hole.inner**2
        return met


class Solids:
    """All solid parts together.

    Attributes:
        parts: In the mission's order.
    """

    def __init__(self, parts: tuple[Solid, ...]) -> None:
        self.parts = parts
        self._low = np.array([part.body.low for part in parts]).reshape(-1, 3)
        self._high = np.array([part.body.high for part in parts]).reshape(-1, 3)

    def near(self, low: Floats, high: Floats) -> NDArray[np.bool_]:
        """Return which parts may reach into boxes, given by their corners. Shapes (boxes, 3) twice to (parts, boxes)."""
        below = np.all(self._low[:, None] < high[None], axis=2)
        return below & np.all(self._high[:, None] > low[None], axis=2)


def grown_solids(mission: Mission, clearance: float) -> Solids:
    """Return a mission's solid parts, grown.

    Args:
        mission: Obstacles and hoops.
        clearance: m between a vehicle's centre and what is solid.
    """
    found: list[Solid] = []
    for body in solid_bodies(mission, clearance):
        holes = tuple(
            Hole(name, np.array(hoop.center), np.array(hoop.normal), max(hoop.opening - clearance, 0.0))
            for name, hoop in body.part.holes
        )
        found.append(Solid(body.inflated, holes))
    return Solids(tuple(found))
