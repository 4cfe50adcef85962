"""Points at which flights end in large regions: the nearest ones that are deep enough, in place of a middle that is far behind them."""

from __future__ import annotations

import numpy as np

from verify.data import Mission
from verify.data.arrays import Floats
from verify.data.shapes.region import Hoop, Region

_DEEP = 0.2
"""m inside a region, the margin aside, at which a flight may end."""
_WORTH = 0.2
"""m by which a region is to be deeper than that, so that it is worth it."""
_SWEEPS = 60
"""Of projections onto faces in turn (Dykstra 1983)."""
_STEPS = 401
"""Places on a line at which a region's depth is looked at."""


def ends_may_touch(mission: Mission) -> bool:
    """Tell whether flights may end so: of one robot that plans for itself, without obstacles."""
    return len(mission.agents) == 1 and not mission.obstacles and mission.spec.trace == "finite"


def is_large(mission: Mission, name: str) -> bool:
    """Tell whether flights may end before a region's middle: it is deep, convex, no hoop, and meets no other region's box."""
    region = mission.all_regions[name]
    if isinstance(region, Hoop) or len(region.body) > 1 or region.inner_radius < mission.margin + _DEEP + _WORTH:
        return False
    centre, half = np.array(region.center), np.array(region.half_lengths)
    others = (other for other_name, other in mission.all_regions.items() if other_name != name)
    return all(
        bool(np.any(np.abs(centre - np.array(other.center)) > half + np.array(other.half_lengths) + 2.0 * mission.margin))
        for other in others
    )


def touching_point(mission: Mission, name: str, start: Floats) -> Floats:
    """Return the point in a large region that is nearest to another point, as deep as a flight may end, m. Shape (3,).

    Args:
        mission: Gives margin and region.
        name: The region's.
        start: From where, m. Shape (3,).
    """
    region, deep = mission.all_regions[name], mission.margin + _DEEP
    centre = np.array(region.center)
    nearest = _projected(region, start - centre, deep)
    if nearest is None:  # with round sides: straight on to the middle
        shares = np.linspace(0.0, 1.0, _STEPS)[:, None]
        line = (start - centre) * (1.0 - shares)
        nearest = line[int(np.argmax(region.measures.depths(line) >= deep))]
    return centre + nearest


def _projected(region: Region, point: Floats, deep: float) -> Floats | None:
    """Return the nearest point that is so deep, where all of its faces are plane; None elsewhere. Shapes (3,) to (3,)."""
    (body,) = region.measures.parts
    if len(body.matrices):
        return None
    found, left = point.copy(), np.zeros((len(body.normals), 3))
    for _ in range(_SWEEPS):
        for k, (normal, distance) in enumerate(zip(body.normals, body.distances - deep, strict=True)):
            moved = found + left[k]
            found = moved - max(0.0, float(moved @ normal) - distance) * normal
            left[k] = moved - found
    return found if float(body.depths(found[None])[0]) >= deep - 1e-4 else None
