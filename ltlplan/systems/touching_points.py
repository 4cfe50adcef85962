"""Points at which routes touch large regions: deep enough in each, and so that the whole route is as short as it can be.

A route's length is a convex function of the points at which it touches convex regions, so that one small programme places them all (a sum of norms;
alternating direction method of multipliers, Boyd et al. 2011). Regions that are not large are come to in their middles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from verify.data import Mission
from verify.data.arrays import Floats
from verify.data.shapes.region import Hoop, Region

DEEP = 0.2
"""m inside a region, the margin aside, at which a route touches it."""
_WORTH = 0.2
"""m by which a region is to be deeper than that, so that it is worth it."""
_SWEEPS = 60
"""Of projections onto faces in turn (Dykstra 1983)."""
_ROUNDS = 400
"""Of the programme, at the most."""
_STILL = 1e-7
"""m by which points that no longer move may."""
_STEPS = 401
"""Places on a line at which a region's depth is looked at."""


def routes_may_touch(mission: Mission) -> bool:
    """Tell whether routes may be laid so: those of finite traces, without obstacles, of robots that do not gather as counts ask."""
    gather = len(mission.agents) > 1 and mission.written.counts
    return mission.spec.trace == "finite" and not mission.obstacles and not gather


def is_large(mission: Mission, name: str) -> bool:
    """Tell whether routes may touch a region before its middle: it is deep, convex, no hoop, and meets no other region's box."""
    region = mission.all_regions[name]
    if isinstance(region, Hoop) or len(region.body) > 1 or region.inner_radius < mission.margin + DEEP + _WORTH:
        return False
    centre, half = np.array(region.center), np.array(region.half_lengths)
    others = (other for other_name, other in mission.all_regions.items() if other_name != name)
    return all(
        bool(np.any(np.abs(centre - np.array(other.center)) > half + np.array(other.half_lengths) + 2.0 * mission.margin))
        for other in others
    )


def touching_points(mission: Mission, places: Sequence[Floats | str]) -> Floats:
    """Return the points of a shortest route through some places, in m. Shape (places, 3).

    Args:
        mission: Gives margin and regions.
        places: Points, in m, and large regions.
    """
    regions = {k: mission.all_regions[place] for k, place in enumerate(places) if isinstance(place, str)}
    points = np.array([regions[k].center if k in regions else place for k, place in enumerate(places)], dtype=np.float64)
    deep = mission.margin + DEEP
    legs = np.diff(np.eye(len(points)), axis=0)
    inverse = np.linalg.inv(legs.T @ legs + np.eye(len(points)))
    own, along = points.copy(), legs @ points
    own_price, along_price = np.zeros_like(own), np.zeros_like(along)
    for _ in range(_ROUNDS if regions else 0):
        found = inverse @ (legs.T @ (along - along_price) + own - own_price)
        before = own
        own = points.copy()
        for k, region in regions.items():
            own[k] = points[k] + _projected(region, found[k] + own_price[k] - points[k], deep)
        lines = legs @ found + along_price
        sizes = np.linalg.norm(lines, axis=1, keepdims=True)
        along = lines * np.maximum(0.0, 1.0 - 1.0 / np.maximum(sizes, _STILL))
        own_price += found - own
        along_price += legs @ found - along
        if max(np.abs(own - before).max(), np.abs(own - found).max(), np.abs(legs @ found - along).max()) < _STILL:
            break
    return own


def _projected(region: Region, point: Floats, deep: float) -> Floats:
    """Return the nearest point that is so deep in a region, from its centre; with round sides the one on the way to the middle. Shapes (3,) to (3,)."""
    (body,) = region.measures.parts
    if len(body.matrices):
        shares = np.linspace(0.0, 1.0, _STEPS)[:, None]
        line = point * (1.0 - shares)
        return line[int(np.argmax(region.measures.depths(line) >= deep))]
    found, left = point.copy(), np.zeros((len(body.normals), 3))
    for _ in range(_SWEEPS):
        begun = found
        for k, (normal, distance) in enumerate(zip(body.normals, body.distances - deep, strict=True)):
            moved = found + left[k]
            found = moved - max(0.0, float(moved @ normal) - distance) * normal
            left[k] = moved - found
        if np.array_equal(found, begun):
            break
    return found
