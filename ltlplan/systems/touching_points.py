"""Points at which routes touch regions: deep enough in each, and so that the whole route is as short as it can be.

A route's length is a convex function of the points at which it touches convex regions, so that one small programme places them all (a sum of norms;
alternating direction method of multipliers, Boyd et al. 2011). Around obstacles it places them between the points at which the route turns, and the
route is laid anew from there, as long as that makes it shorter. Regions with no such room are come to in their middles.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from verify.data import Infeasible, Mission
from verify.data.arrays import Floats
from verify.data.shapes.convex_parts import ConvexBody
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Hoop

_DEEP, _SHARE = 0.2, 0.3
"""m inside a region, the margin aside, at which a route touches it at the most, and that as a share of what its least radius leaves."""
_WORTH = 0.1
"""m by which a region is to reach further than that from its middle, so that it is worth it."""
_THIN = 0.03
"""m that the margin leaves of a region's least radius, at the least."""
_SWEEPS = 60
"""Of projections onto faces in turn (Dykstra 1983)."""
_ROUNDS = 400
"""Of the programme, at the most."""
_STILL = 1e-6
"""m by which points that no longer move may."""
_NEWTON, _NEWTON_STILL = 30, 1e-12
"""Steps to the nearest point of a quadric, at the most, and the share by which the last one changes its multiplier."""
_ROUTES, _SHORTER = 6, 1e-3
"""Times that a route is laid anew around obstacles, at the most, and m by which each is to be shorter than the one before."""


@dataclass(frozen=True, slots=True)
class Lap:
    """Laps in which a route ends: from its last place back to an earlier one, again and again.

    Attributes:
        begins: Number of the place to which laps lead back.
        count: How many are flown.
    """

    begins: int
    count: int


Way = Callable[[int, Floats, Floats], Sequence[Floats]]
"""From a leg's number and its ends, in m, to the points at which it turns between them; raises Infeasible where it is blocked."""


def routes_may_touch(mission: Mission) -> bool:
    """Tell whether routes may be laid so: those without bounds in seconds, unless middles are asked for.

    Near an edge a robot is in the region for sure for a short time only, which bounds in seconds ask for.
    """
    return mission.planner.visits == "near" and not mission.timed_parts


def words_touch(mission: Mission) -> bool:
    """Tell whether words are compared where their routes touch regions.

    Those of counted teams are not, as they take too long to look for many times.
    """
    return routes_may_touch(mission) and not (len(mission.agents) > 1 and mission.written.counts)


def touching_depth(mission: Mission, name: str) -> float:
    """Return how deep in a region a route touches it, in m.

    Args:
        mission: Gives margin and regions.
        name: The region's.
    """
    return mission.margin + min(_DEEP, _SHARE * (mission.all_regions[name].inner_radius - mission.margin))


def is_large(mission: Mission, name: str) -> bool:
    """Tell whether routes may touch a region before its middle: it is deep, convex, no hoop, and meets no other region's box."""
    region = mission.all_regions[name]
    if isinstance(region, Hoop) or len(region.body) > 1 or region.inner_radius < mission.margin + _THIN:
        return False
    if max(region.half_lengths) < touching_depth(mission, name) + _WORTH:
        return False
    centre, half = np.array(region.center), np.array(region.half_lengths)
    others = (other for other_name, other in mission.all_regions.items() if other_name != name)
    return all(
        bool(np.any(np.abs(centre - np.array(other.center)) > half + np.array(other.half_lengths) + 2.0 * mission.margin))
        for other in others
    )


def distance_to_touch(mission: Mission, point: Point, name: str) -> float:
    """Return how far a point is from where a region is touched, in m.

    Args:
        mission: Gives margin and regions.
        point: In m.
        name: The region's.
    """
    region = mission.all_regions[name]
    offset = np.subtract(point, region.center)
    return float(np.linalg.norm(offset - _projected(_touched_part(mission, name), offset)))


def touching_route(mission: Mission, places: Sequence[Floats | str], way: Way, lap: Lap | None = None) -> Floats:
    """Return the points of a short route through some places around what is in its way, in m. Shape (places, 3).

    Args:
        mission: Gives margin and regions.
        places: Points, in m, and regions that are touched.
        way: Leads around what is in the way of a leg.
        lap: Laps in which it ends; the way back is its last leg.
    """
    points = np.array([mission.all_regions[place].center if isinstance(place, str) else place for place in places])
    best, least, turned = points, np.inf, None
    for _ in range(_ROUTES):
        try:
            turns = [list(way(k, a, b)) for k, (a, b) in enumerate(itertools.pairwise(_closed(points, lap)))]
        except Infeasible:
            break
        between = turns if lap else [*turns, []]
        stops = [[point, *turn] for point, turn in zip(points, between, strict=True)]
        at = np.cumsum([0, *map(len, stops)])[:-1]
        again = lap and Lap(int(at[lap.begins]), lap.count)
        lines = np.diff(_closed(np.concatenate(stops), again), axis=0)
        length = float(_times_flown(len(lines), again) @ np.linalg.norm(lines, axis=1))
        if length >= least - _SHORTER:
            break
        best, least, before, turned = points, length, turned, [np.reshape(turn, (-1, 3)) for turn in turns]
        if before is not None and all(map(np.array_equal, before, turned)):
            break
        through = [each for place, stop in zip(places, stops, strict=True) for each in (place, *stop[1:])]
        points = touching_points(mission, through, again)[at]
    return best


def touching_points(mission: Mission, places: Sequence[Floats | str], lap: Lap | None = None) -> Floats:
    """Return the points of a shortest route through some places, in m. Shape (places, 3).

    Args:
        mission: Gives margin and regions.
        places: Points, in m, and large regions.
        lap: Laps in which it ends.
    """
    regions = {k: mission.all_regions[place] for k, place in enumerate(places) if isinstance(place, str)}
    points = np.array([regions[k].center if k in regions else place for k, place in enumerate(places)], dtype=np.float64)
    bodies = {k: _touched_part(mission, str(places[k])) for k in regions}
    legs = np.diff(_closed(np.eye(len(points)), lap), axis=0)
    inverse = np.linalg.inv(legs.T @ legs + np.eye(len(points)))
    own = points.copy()
    for k, body in () if mission.obstacles else bodies.items():  # of points as good as each other those that come first
        own[k] = points[k] + _projected(body, own[max(k - 1, 0)] - points[k])
    along = legs @ own
    step = max(float(np.linalg.norm(along, axis=1).mean()) / 2.0, _STILL)
    steps = step * _times_flown(len(legs), lap)[:, None]
    own_price, along_price = np.zeros_like(own), np.zeros_like(along)
    for _ in range(_ROUNDS if regions else 0):
        found = inverse @ (legs.T @ (along - along_price) + own - own_price)
        before = own
        own = points.copy()
        for k, body in bodies.items():
            own[k] = points[k] + _projected(body, found[k] + own_price[k] - points[k])
        lines = legs @ found + along_price
        sizes = np.linalg.norm(lines, axis=1, keepdims=True)
        along = lines * np.maximum(0.0, 1.0 - steps / np.maximum(sizes, _STILL))
        own_price += found - own
        along_price += legs @ found - along
        if max(np.abs(own - before).max(), np.abs(own - found).max(), np.abs(legs @ found - along).max()) < _STILL:
            break
    return own


def _closed(points: Floats, lap: Lap | None) -> Floats:
    """Return a route's points with that to which laps lead back as its last."""
    return points if lap is None else np.concatenate([points, points[lap.begins : lap.begins + 1]])


def _times_flown(legs: int, lap: Lap | None) -> Floats:
    """Return how often each leg of a route is flown. Shape (legs,)."""
    return np.where(np.arange(legs) < (legs if lap is None else lap.begins), 1.0, 1.0 if lap is None else lap.count)


def _touched_part(mission: Mission, name: str) -> ConvexBody:
    """Return the part of a region, relative to its centre, that is so deep inside that it is touched there."""
    return mission.all_regions[name].measures.parts[0].grown(-touching_depth(mission, name))


def _projected(body: ConvexBody, point: Floats) -> Floats:
    """Return the nearest point of a body. Shapes (3,) to (3,)."""
    if not len(body.matrices) and bool(np.all(np.abs(body.normals).max(axis=1) == 1.0)):  # a box along the axes
        limits = body.normals * body.distances[:, None]
        return np.clip(point, limits.min(axis=0), limits.max(axis=0))
    if len(body.matrices) == 1 and not len(body.normals):
        return _on_quadric(body.matrices[0], body.centres[0], float(body.roots[0]), point)
    found, left = point.copy(), np.zeros((len(body.normals) + len(body.matrices), 3))
    for _ in range(_SWEEPS):
        begun, faces = found, len(body.normals)
        for k, (normal, distance) in enumerate(zip(body.normals, body.distances, strict=True)):
            moved = found + left[k]
            found = moved - max(0.0, float(moved @ normal) - distance) * normal
            left[k] = moved - found
        for k, quadric in enumerate(zip(body.matrices, body.centres, body.roots.tolist(), strict=True), start=faces):
            moved = found + left[k]
            found = _on_quadric(*quadric, moved)
            left[k] = moved - found
        if np.array_equal(found, begun):
            break
    return found


def _on_quadric(matrix: Floats, centre: Floats, root: float, point: Floats) -> Floats:
    """Return the nearest point at which a quadric's root is at most so much, by Newton's method for its multiplier. Shapes (3,) to (3,)."""
    offset = point - centre
    if float(offset @ matrix @ offset) <= root**2:
        return point
    values, ways = np.linalg.eigh(matrix)
    along, multiplier = offset @ ways, 0.0
    for _ in range(_NEWTON):
        shrunk = along / (1.0 + multiplier * values)
        level = float(values @ shrunk**2) ** 0.5
        step = (level / root - 1.0) * level**2 / float(values**2 @ (shrunk**2 / (1.0 + multiplier * values)))
        multiplier += step
        if step <= _NEWTON_STILL * multiplier:
            break
    return centre + ways @ (along / (1.0 + multiplier * values))
