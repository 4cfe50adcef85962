"""Ways that do not leave regions: a room with a corner is the free space of a leg that may not leave it.

A way turns in the common part of two of a region's bodies, at its corners, or upright above or below these. It stays in a region where each line
is as deep in it as asked for, by samples: the depth of a point changes by no more than it moves.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence

import numpy as np

from ltlplan.free_space.free_space import ROOM, Booleans, Floats, FreeSpace
from verify.data.shapes.convex_parts import polyhedron_corners
from verify.data.shapes.region import Region

_STEP = 0.01
"""m between samples of a line."""
_COARSE = 16
"""Samples of each line, about, by which most lines are left out."""
_ROUNDING = 1e-9
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
    count = int(np.linalg.norm(ends - starts, axis=1).max(initial=0.0) / _STEP) + 2
    shares, kept, middle = np.linspace(0.0, 1.0, count), np.arange(len(starts)), np.array(region.center)
    least = np.minimum(deep, np.minimum(region.measures.depths(starts - middle), region.measures.depths(ends - middle)))
    for some in (shares[:: max(1, count // _COARSE)], shares):
        along = starts[kept] + some[:, None, None] * (ends - starts)[kept]
        kept = kept[np.all(region.measures.depths(along - middle) >= least[kept] - _ROUNDING, axis=0)]
    found = np.zeros(len(starts), dtype=bool)
    found[kept] = True
    return found


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
    space: FreeSpace, regions: Collection[str], ends: tuple[Floats, Floats], permitted: Collection[str], slack: float
) -> tuple[Floats, float] | None:
    """Return where ways between two points come nearest to the border of what they may not leave, and how deep they are there at the most.

    Args:
        space: Where a vehicle can fly.
        regions: What they may not leave.
        ends: m. Shape (3,) each.
        permitted: Regions that they may enter, these among them.
        slack: m that ways keep more than they must of all else.

    Returns:
        A point, m, shape (3,), and m; None where no way is inside at all.
    """
    own, low, high = space.mission.margin + slack, 0.0, space.mission.margin + slack
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
    for one, other in itertools.combinations(region.measures.covers, 2):
        normals = np.concatenate([one.normals, other.normals, np.eye(3), -np.eye(3)])
        distances = np.concatenate([one.distances - deep, other.distances - deep, np.full(6, region.outer_radius)])
        corners = polyhedron_corners(normals, distances) + np.array(region.center)
        if not len(corners):
            continue
        found += [corners, corners.mean(axis=0, keepdims=True)]
        for end in ends:
            at = corners.copy()
            at[:, 2] = np.clip(end[2], corners[:, 2].min(), corners[:, 2].max())
            found.append(at)
    points = np.concatenate(found)
    return points[np.unique(points.round(6), axis=0, return_index=True)[1]]
