"""Ways that do not leave regions: a room with a corner is the free space of a leg that may not leave it.

A way turns in the common part of two of a region's bodies, at its corners, or upright above or below these. It stays in a region where each line
is as deep in it as asked for: where the stretches that are so deep in one of its convex bodies leave no gap between them.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from functools import lru_cache

import numpy as np

from ltlplan.free_space.free_space import ROOM, Booleans, Floats, FreeSpace
from verify.data.shapes.convex_parts import ConvexBody, polyhedron_corners
from verify.data.shapes.measures import Measures
from verify.data.shapes.region import Region

_ROUNDING = 1e-9
"""m, and share of a line's length."""
_FOUND_TO = 3e-3
"""m to which it is found out how wide a region is where it is narrowest."""
ROOMS = (ROOM, ROOM / 3.0, 0.0)
"""m by which corners are passed more widely, where there is so much room."""


def stays_inside(region: Region, starts: Floats, ends: Floats, deep: float) -> Booleans:
    """Return which straight lines are in a region by so many m, or by as much as their ends are.

    Args:
        region: Which one.
        starts: m. Shape (lines, 3).
        ends: m. Shape (lines, 3).
        deep: m.
    """
    middle = np.array(region.center)
    begin, finish = starts - middle, ends - middle
    least = np.minimum(deep, np.minimum(region.measures.depths(begin), region.measures.depths(finish))) - _ROUNDING
    spans = np.array([_span(body, begin, finish - begin, least) for body in region.measures.covers])  # (bodies, 2, lines)
    order = np.argsort(spans[:, 0], axis=0)
    entered = np.take_along_axis(spans[:, 0], order, axis=0)
    left = np.maximum(np.maximum.accumulate(np.take_along_axis(spans[:, 1], order, axis=0), axis=0), 0.0)
    joined = (entered[1:] <= left[:-1] + _ROUNDING) | (left[:-1] >= 1.0 - _ROUNDING)
    return (entered[0] <= _ROUNDING) & (left[-1] >= 1.0 - _ROUNDING) & joined.all(axis=0)


def way_stays_inside(region: Region, way: Floats, deep: float) -> bool:
    """Return whether a way is in a region by so many m, its turns as well, or by as much as its ends are.

    Args:
        region: Which one.
        way: m. Shape (points, 3).
        deep: m.
    """
    depths = region.measures.depths(way - np.array(region.center))
    least = min(deep, float(depths[0]), float(depths[-1])) - _ROUNDING
    return bool(np.all(depths >= least) and np.all(stays_inside(region, way[:-1], way[1:], deep)))


def _span(body: ConvexBody, begin: Floats, along: Floats, least: Floats) -> tuple[Floats, Floats]:
    """Return between which shares of their lengths lines are in a convex body as deep as asked for; infinity and its negative where nowhere.

    Args:
        body: Around the origin.
        begin: Where lines begin, m. Shape (lines, 3).
        along: From there to their ends, m. Shape (lines, 3).
        least: m. Shape (lines,).
    """
    low, high = np.full(len(begin), -np.inf), np.full(len(begin), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes, rooms = along @ body.normals.T, body.distances - begin @ body.normals.T - least[:, None]
        shares = rooms / slopes
        low = np.maximum(low, np.where(slopes < 0.0, shares, -np.inf).max(axis=1, initial=-np.inf))
        high = np.minimum(high, np.where(slopes > 0.0, shares, np.inf).min(axis=1, initial=np.inf))
        outside = ((slopes == 0.0) & (rooms < 0.0)).any(axis=1)
        for matrix, centre, root, scale in zip(body.matrices, body.centres, body.roots, body.scales, strict=True):
            offset, radius = begin - centre, root - scale * least
            square, mixed, constant = (
                np.einsum("ni,ij,nj->n", one, matrix, other)
                for one, other in ((along, along), (along, offset), (offset, offset))
            )
            constant = constant - radius**2
            half = np.sqrt(mixed**2 - square * constant)  # nan where the line passes outside
            flat = square <= _ROUNDING**2
            low = np.maximum(low, np.where(flat, -np.inf, (-mixed - half) / square))
            high = np.minimum(high, np.where(flat, np.inf, (-mixed + half) / square))
            outside |= (radius < 0.0) | (flat & (constant > 0.0)) | (~flat & np.isnan(half))
    outside |= ~(low <= high)
    return np.where(outside, np.inf, low), np.where(outside, -np.inf, high)


def way_inside(
    space: FreeSpace,
    regions: Collection[str],
    ends: tuple[Floats, Floats],
    permitted: Collection[str],
    slack: float,
    rooms: Sequence[float] = ROOMS,
) -> Floats | None:
    """Return a shortest way between two points that leaves none of some regions; None where there is none.

    Args:
        space: Where a vehicle can fly.
        regions: Which ones.
        ends: m. Shape (3,) each.
        permitted: Regions that it may enter, these among them.
        slack: m that it keeps more than it must.
        rooms: m by which it passes corners more widely; the first with which there is a way is taken.

    Returns:
        m. Shape (points, 3).
    """
    from scipy.sparse import csr_matrix  # here: it takes long to load, and few missions have such rooms
    from scipy.sparse.csgraph import dijkstra

    within, roadmap = [space.mission.all_regions[name] for name in regions], space.roadmap(slack)
    for room in rooms:
        deep = space.mission.margin + slack + room
        turns = np.concatenate([roadmap.bends.points, *(_turns(region, deep, ends) for region in within)])
        for region in within:
            turns = turns[region.measures.depths(turns - np.array(region.center)) >= deep - _ROUNDING]
        places = np.concatenate([np.stack(ends), turns])
        one, other = np.triu_indices(len(places), 1)
        free = roadmap.free(places[one], places[other], roadmap.stopping(permitted))
        for region in within:
            free[free] = stays_inside(region, places[one[free]], places[other[free]], deep)
        lengths = np.linalg.norm(places[one[free]] - places[other[free]], axis=1).round(6)  # moving the world decides no tie
        graph = csr_matrix((lengths, (one[free], other[free])), shape=(len(places), len(places)))
        _, before = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
        way = [1]
        while before[way[-1]] >= 0:
            way.append(int(before[way[-1]]))
        if way[-1] == 0:
            return places[way[::-1]]
    return None


def narrowest_inside(
    space: FreeSpace,
    regions: Collection[str],
    ends: tuple[Floats, Floats],
    permitted: Collection[str],
    slack: float,
    most: float | None = None,
) -> tuple[Floats, float] | None:
    """Return where ways between two points come nearest to the border of what they may not leave, and how deep they are there at the most.

    Args:
        space: Where a vehicle can fly.
        regions: What they may not leave.
        ends: m. Shape (3,) each.
        permitted: Regions that they may enter, these among them.
        slack: m that ways keep more than they must of all else.
        most: m from which on a way is deep enough; the margin and `slack` where left out.

    Returns:
        A point, m, shape (3,), and m; None where no way is inside at all.
    """
    own = space.mission.margin + slack
    low, high = 0.0, own if most is None else most
    way = way_inside(space, regions, ends, permitted, slack, [-own])
    while way is not None and high - low > _FOUND_TO:
        middle = (low + high) / 2.0
        deeper = way_inside(space, regions, ends, permitted, slack, [middle - own])
        way, low, high = (way, low, middle) if deeper is None else (deeper, middle, high)
    if way is None:
        return None
    within = [space.mission.all_regions[name] for name in regions]
    shares = np.linspace(0.0, 1.0, 101)[:, None, None]
    points = (way[:-1] + shares * (way[1:] - way[:-1])).reshape(-1, 3)
    depths = np.min([region.measures.depths(points - np.array(region.center)) for region in within], axis=0)
    narrow = points[depths <= depths.min() + _FOUND_TO]
    return narrow[len(narrow) // 2], float(depths.min())


def _turns(region: Region, deep: float, ends: tuple[Floats, Floats]) -> Floats:
    """Return points at which ways may turn in a region: corners of the common parts of its bodies, also at the heights of both ends. Shape (points, 3)."""
    found = [np.zeros((0, 3))]
    for common in _common_corners(region.measures, deep):
        corners = common + np.array(region.center)
        found += [corners, corners.mean(axis=0, keepdims=True)]
        for end in ends:
            at = corners.copy()
            at[:, 2] = np.clip(end[2], corners[:, 2].min(), corners[:, 2].max())
            found.append(at)
    points = np.concatenate(found)
    return points[np.unique(points.round(6), axis=0, return_index=True)[1]]


@lru_cache(maxsize=64)
def _common_corners(body: Measures, deep: float) -> tuple[Floats, ...]:
    """Return the corners of what two of a body's convex bodies share, so deep in both; of each two that share something. Shape (corners, 3) each."""
    found: list[Floats] = []
    for one, other in itertools.combinations(body.covers, 2):
        normals = np.concatenate([one.normals, other.normals, np.eye(3), -np.eye(3)])
        distances = np.concatenate([one.distances - deep, other.distances - deep, np.full(6, body.outer_radius)])
        corners = polyhedron_corners(normals, distances)
        found += [corners] if len(corners) else []
    return tuple(found)
