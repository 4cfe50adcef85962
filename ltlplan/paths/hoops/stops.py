"""Stops: waypoints in the making, each with what the segment that leads to it may enter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ltlplan.paths.hoops.hoop_frame import control_points
from ltlplan.paths.hoops.primitives import Primitive, choose
from verify.data import Infeasible, Mission
from verify.data.arrays import Floats
from verify.data.language.sequence import Direction
from verify.data.plan import Role
from verify.data.shapes.region import Hoop

Side = Direction | None
"""From which side a visit enters its hoop; None where it enters a plain region, or stays in the hoop."""

_DEEP = 0.9
"""Share of the way from a region's centre to where the margin begins within which a robot stays; refinement uses as much."""
_STEPS = 401
"""Places on an axis at which a region's depth is looked at, where no formula gives it."""


@dataclass(frozen=True, eq=False, slots=True)
class Stop:
    """One waypoint with what belongs to the segment that leads to it.

    Attributes:
        position: m. Shape (3,).
        role: Which control point it is.
        region: The hoop or region that it belongs to.
        visit: Index of the visit that it serves.
        permitted: Regions that the segment to this point may enter.
        axes: Frame of the hoop in which the segment is measured, as columns; None where there is no hoop. Shape (3, 3).
    """

    position: Floats
    role: Role
    region: str | None = None
    visit: int | None = None
    permitted: frozenset[str] = frozenset()
    axes: Floats | None = None


def primitives_between(stops: Sequence[Stop]) -> list[Primitive]:
    """Return the primitive of each segment between stops."""
    positions = [stop.position for stop in stops]
    segments = zip([None, *positions], positions, stops[1:], strict=False)
    return [choose(previous, current, stop.position, stop.axes) for previous, current, stop in segments]


def holds(mission: Mission, point: Floats, region: str) -> bool:
    """Tell whether a point lies in a region.

    Args:
        mission: Whose region.
        point: m. Shape (3,).
        region: Its name.
    """
    return bool(mission.all_regions[region].level(point) <= 1.0)


def hoop_axes(mission: Mission, region: str | None) -> Floats | None:
    """Return a hoop's own axes as columns; None for whatever is no hoop. Shape (3, 3)."""
    hoop = mission.hoops.get(region or "")
    return None if hoop is None else control_points(hoop).frame


def before_opening(mission: Mission, name: str, hoop: Hoop, side: Role) -> Floats:
    """Return a place to hover in a hoop's region, on its front or rear side: halfway between opening and border, both less the margin.

    Args:
        mission: Its margin.
        name: The hoop's name.
        hoop: Whose region.
        side: "front" or "rear".

    Returns:
        m. Shape (3,).

    Raises:
        Infeasible: The region is too flat for that.
    """
    normal = np.array(hoop.normal) if side == "front" else -np.array(hoop.normal)
    deep = max(1.0 - mission.margin / hoop.inner_radius, 0.0)
    if hoop.is_ellipsoid:
        farthest = _DEEP * deep / float(normal @ hoop.shape @ normal) ** 0.5
    else:
        ahead = np.linspace(0.0, 1.01 * hoop.outer_radius, _STEPS)
        shallow = np.flatnonzero(hoop.measures.depths(ahead[:, None] * normal) < mission.margin)
        farthest = _DEEP * float(ahead[max(shallow[0] - 1, 0)])
    if farthest <= mission.margin:
        raise Infeasible(
            f"A robot cannot stay in '{name}' without flying through it: {mission.margin:g} m in front of its opening, where the margin "
            f"ends, a place should still be inside by the margin, and such places end {farthest:.3f} m in front of it. Ask for a "
            "smaller margin or a larger region."
        )
    ahead = (mission.margin + farthest) / 2.0
    return np.array(hoop.center) + ahead * normal
