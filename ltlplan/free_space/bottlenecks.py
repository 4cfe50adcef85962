"""Bottlenecks: the narrowest place of the widest path that there would be for a smaller vehicle.

A way is looked for with less and less clearance, halving the range each time; where the last one is narrowest, the bodies on both
sides are what shuts it.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ltlplan.free_space.free_space import FreeSpace
from verify.data.mission import Mission
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Region
from verify.data.shapes.solid_parts import SolidPart, solid_parts

if TYPE_CHECKING:  # it takes long to load, and most missions have no obstacles
    from refine.obstacles.visibility_graph import Roadmap

Floats = NDArray[np.float64]

WALL = "workspace"
"""What stands for the workspace's walls."""
_HALVINGS = 9
_LEAST = 1e-3
"""m; a way that leaves less to each side is none."""
_STEP = 0.01
"""m between places on a way at which its width is looked at."""
_WIDER = 0.1
"""m beside the margin with which a way past regions is not called narrow any more."""
_AWAY = 0.02
"""m by which the two sides of a narrow place are told apart."""


@dataclass(frozen=True, slots=True)
class Gap:
    """The narrowest place of a way.

    Attributes:
        point: m.
        width: m between what stands on both sides.
        needed: m that a vehicle needs there.
        between: Names of what stands on both sides, `WALL` for the workspace's own walls.
        regions: Those that hold the place.
    """

    point: Point
    width: float
    needed: float
    between: tuple[str, ...]
    regions: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Shut:
    """There is no way, however small the vehicle.

    Attributes:
        behind: Names of obstacles that stand between.
    """

    behind: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TooNear:
    """A place itself is nearer to something solid than a vehicle may be.

    Attributes:
        name: Of the obstacle, hoop or `WALL`.
        distance: m; not above zero inside.
    """

    name: str
    distance: float


@dataclass(frozen=True, slots=True)
class _Region:
    """A region as a body that ways lead around.

    Attributes:
        obstacle: Its name.
        region: Its body.
    """

    obstacle: str
    region: Region

    def distances_whole(self, points: Floats) -> Floats:
        """Return lower bounds on how far points are from it, m; below zero inside. Shape (n, 3) to (n,)."""
        from refine.obstacles.keep_out_bodies import grown_region

        return grown_region(self.obstacle, self.region, 0.0).signed_distance(points)


_Body = SolidPart | _Region


def what_shuts(space: FreeSpace, starts: Sequence[Point], end: Point) -> Gap | Shut | TooNear | None:
    """Return why no way leads from any of some points to another one; None where one does, through whichever regions.

    Args:
        space: Where a vehicle can fly.
        starts: From where, m.
        end: Where to, m.
    """
    mission, place = space.mission, np.array(end)
    if _reaches(space.roadmap(), starts, place):
        return None
    parts = solid_parts(mission.obstacles, mission.hoops)
    distances = [float(part.distances_whole(place[None])[0]) for part in parts]
    nearest = int(np.argmin(distances))
    if distances[nearest] < space.clearance:
        return TooNear(parts[nearest].obstacle, distances[nearest])
    low, high = _LEAST, space.clearance
    if not _reaches(space.narrower(low), starts, place):
        return Shut(_between(parts, np.array(starts[0]), place))
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _reaches(space.narrower(middle), starts, place) else (low, middle)
    ways = [_way(space.narrower(low), np.array(start), place) for start in starts]
    found = min(
        (way for way in ways if way is not None), key=lambda way: float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    )
    return _narrowest(mission, parts, found, space.clearance)


def narrowest(space: FreeSpace, way: Floats) -> Gap:
    """Return how wide a way that can hardly be flown is at its narrowest place, and what stands on both sides.

    Args:
        space: Where a vehicle can fly.
        way: m. Shape (points, 3).
    """
    parts = solid_parts(space.mission.obstacles, space.mission.hoops)
    dense = np.concatenate([np.linspace(a, b, max(2, int(np.linalg.norm(b - a) / _STEP))) for a, b in itertools.pairwise(way)])
    beside = np.min([part.distances_whole(dense) for part in parts], axis=0)
    near = dense[beside <= max(float(beside.min()), space.clearance) + _AWAY]
    gaps = [_narrowest(space.mission, parts, np.stack([at, at]), space.clearance) for at in near]
    return min(gaps, key=lambda gap: gap.width - gap.needed)


def narrowest_around(space: FreeSpace, start: Floats, end: Floats, permitted: Collection[str]) -> Gap | Shut:
    """Return the narrowest place of the widest way past regions that may not be entered.

    Args:
        space: Where a vehicle can fly; no way there leads past them.
        start: m. Shape (3,).
        end: m. Shape (3,).
        permitted: Regions that the way may enter.
    """
    mission, low, high = space.mission, _LEAST - space.clearance, _WIDER

    def wide(slack: float) -> Roadmap:  # a vehicle that is smaller keeps less margin, too
        share = 1.0 + slack / space.clearance
        return space.roadmap(slack) if slack >= 0.0 else space.narrower(share * space.clearance, share * mission.margin)

    way = wide(low).way(start, end, permitted)
    if way is None:
        return Shut(())
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        wider = wide(middle).way(start, end, permitted)
        way, low, high = (way, low, middle) if wider is None else (wider, middle, high)
    around = [_Region(name, region) for name, region in mission.all_regions.items() if name not in permitted]
    return _narrowest(mission, [*solid_parts(mission.obstacles, mission.hoops), *around], way, space.clearance)


def _reaches(roadmap: Roadmap, starts: Sequence[Point], end: Floats) -> bool:
    return any(_way(roadmap, np.array(start), end) is not None for start in starts)


def _way(roadmap: Roadmap, start: Floats, end: Floats) -> Floats | None:
    return roadmap.way(start, end, frozenset(roadmap.soft.names))


def _between(parts: Sequence[SolidPart], start: Floats, end: Floats) -> tuple[str, ...]:
    """Return the obstacles on the straight line between two points, the nearest to its end first."""
    line = end + np.linspace(0.0, 1.0, 2001)[:, None] * (start - end)
    met: dict[str, int] = {}
    for part in parts:
        inside = np.flatnonzero(part.distances_whole(line) <= 0.0)
        if len(inside):
            met[part.obstacle] = min(int(inside[0]), met.get(part.obstacle, len(line)))
    return tuple(sorted(met, key=met.__getitem__))


def _narrowest(mission: Mission, parts: Sequence[_Body], way: Floats, clearance: float) -> Gap:
    lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
    places = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.linspace(0.0, places[-1], max(2, int(places[-1] / _STEP)))
    path = np.column_stack([np.interp(at, places, way[:, axis]) for axis in range(3)])
    needs = np.array([mission.margin if isinstance(part, _Region) else clearance for part in parts])
    left = np.array([part.distances_whole(path) for part in parts]) - needs[:, None]
    index = int(np.argmin(left.min(axis=0)))
    point, own = path[index], left[:, index] + needs
    first = int(np.argmin(left[:, index]))
    name, towards = parts[first].obstacle, _towards(parts[first], point)
    sides = [
        (float(own[k]), part.obstacle, float(needs[k]), _towards(part, point)) for k, part in enumerate(parts) if k != first
    ]
    walls = np.concatenate([np.array(mission.workspace.max) - point, point - np.array(mission.workspace.min)])
    sides += [
        (float(gap), WALL, mission.margin, way) for gap, way in zip(walls, np.concatenate([np.eye(3), -np.eye(3)]), strict=True)
    ]
    opposite = [(gap, other, least) for gap, other, least, way in sides if way @ towards < -0.5]
    gap, other, least = min(opposite) if opposite else (float(own[first]), name, float(needs[first]))
    held = tuple(region for region, body in mission.all_regions.items() if float(body.level(point)) <= 1.0)
    x, y, z = point.tolist()
    return Gap((x, y, z), float(own[first]) + gap, float(needs[first]) + least, (name, other), held)


def _towards(part: _Body, point: Floats) -> Floats:
    """Return a unit vector from a point to a part, by differences of its distance. Shape (3,)."""
    around = point + _AWAY / 10 * np.concatenate([np.eye(3), -np.eye(3)])
    values = part.distances_whole(around)
    slope = values[3:] - values[:3]
    size = float(np.linalg.norm(slope))
    return slope / size if size > 0 else slope
