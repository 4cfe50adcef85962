"""Narrow places: stretches of planned ways where two robots cannot pass each other, side by side or one above the other.

Around each point of a way lines to both sides, up and down measure the room for a robot's centre. Two robots pass where its diagonal is
what they keep from each other. What is solid counts, the workspace's walls, and borders of regions that the formula never lets a robot
leave, or enter.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from refine.obstacles.keep_out_bodies import grown_region
from verify.data import Mission, RobotPlan
from verify.data.language.lasting import lasting_regions
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Region
from verify.data.shapes.solid_parts import SolidPart, solid_parts
from verify.data.validation.spacing import Spacing

Floats = NDArray[np.float64]

WALL = "workspace"
"""What stands for the workspace's walls."""
_DOOR = 1.0
"""m of length up to which a narrow place between solid bodies is called a door."""
_STEP = 0.05
"""m between points of a way."""
_RAY = 0.01
"""m between points at which the room beside a way is measured."""


@dataclass(frozen=True, slots=True)
class NarrowPlace:
    """Stretch of a way on which two robots do not pass each other.

    Attributes:
        point: Where it is narrowest, m.
        width: Between what stands on both sides there, m.
        length: Of the stretch, m.
        needed: Width with which two robots pass side by side, m.
        between: Names of what stands on both sides, `WALL` for the workspace's walls.
        ending: Robots that end on it, or never leave it.
        borders: Regions of `between` whose borders the formula never lets these robots cross.
        passed_without_margin: Whether robots that keep the least separation of their vehicles, and no margin, would pass each other.
    """

    point: Point
    width: float
    length: float
    needed: float
    between: tuple[str, str]
    ending: tuple[str, ...]
    borders: tuple[str, ...]
    passed_without_margin: bool

    @property
    def is_door(self) -> bool:
        """Return whether it is a short gap in something solid."""
        return self.length <= _DOOR and WALL not in self.between and not self.borders

    @property
    def sentence(self) -> str:
        """Place, width, and the width that is needed, as a sentence."""
        sides = [f"'{name}'" if name != WALL else "the workspace's wall" for name in self.between]
        between = f"two sides of {sides[0]}" if sides[0] == sides[1] and WALL not in self.between else " and ".join(sides)
        if self.between == (WALL, WALL):
            between = "the workspace's walls"
        x, y, z = self.point
        long = f", for {self.length:.2g} m" if self.length > _STEP else ""
        return (
            f"The way is {self.width:.3g} m wide around ({x:.2f}, {y:.2f}, {z:.2f}){long}, between {between}: two robots pass each other "
            f"side by side from {self.needed:.3g} m on."
        )


def narrow_place(mission: Mission, robots: Sequence[RobotPlan], names: Sequence[str], kept: Spacing) -> NarrowPlace | None:
    """Return the longest narrow place that lies on the ways of two robots; None where there is none.

    Args:
        mission: Gives obstacles and workspace.
        robots: The two.
        names: Their names.
        kept: What they keep.
    """
    radius = max(mission.vehicle_of(name).radius for name in names)
    parts = solid_parts(mission.obstacles, mission.hoops)
    ways = [_dense(robot) for robot in robots]
    borders = [_borders(mission, name) for name in names]
    measured = [
        _Rooms(mission, parts, radius + mission.margin, kept, its).around(way) for way, its in zip(ways, borders, strict=True)
    ]
    (way, found), (other, _) = zip(ways, measured, strict=True)
    narrow = [each.diagonal < kept.at_rest for each in measured]
    if not narrow[1].any():
        return None
    near = np.linalg.norm(way[:, None] - other[None, narrow[1]], axis=2).min(axis=1) <= kept.distance
    stretch = _longest(narrow[0] & near)
    if stretch is None:
        return None
    narrowest = stretch[found.across[stretch] <= found.across[stretch].min() + _RAY]
    at = narrowest[len(narrowest) // 2]
    length = float(np.linalg.norm(np.diff(way[stretch], axis=0), axis=1).sum())
    lasts = {
        name: np.array(robot.waypoints[-1].position)
        for name, robot in zip(names, robots, strict=True)
        if robot.cycle_visit is None or robot.still
    }
    ending = tuple(name for name, last in lasts.items() if np.linalg.norm(way[stretch] - last, axis=1).min() <= _STEP)
    x, y, z = way[at].tolist()
    needed = float(np.sqrt(max(kept.at_rest**2 - found.upright[at] ** 2, 0.0)))
    sides = float(found.sides[at])
    bare = np.hypot(found.across[at] + 2.0 * mission.margin, found.upright[at] + 2.0 * mission.margin * kept.z_scale)
    passed = bool(bare > 2.0 * radius)
    between = found.between[at]
    crossed = tuple(border.name for border in borders[0] if border.name in between)
    return NarrowPlace((x, y, z), float(found.across[at]) + sides, length, needed + sides, between, ending, crossed, passed)


@dataclass(frozen=True, slots=True)
class _Room:
    """Room for a robot's centre around points of a way.

    Attributes:
        across: From side to side, m. Shape (points,).
        upright: From below to above, as distances in z count, m. Shape (points,).
        sides: What the robot keeps from both sides together, m. Shape (points,).
        between: What stands on both sides of each.
    """

    across: Floats
    upright: Floats
    sides: Floats
    between: list[tuple[str, str]]

    @property
    def diagonal(self) -> Floats:
        """Greatest distance of two centres beside the way, m. Shape (points,)."""
        return np.hypot(self.across, self.upright)


@dataclass(frozen=True, slots=True)
class _Border:
    """Border of a region that a robot may never leave, or may never enter.

    Attributes:
        name: The region's.
        within: How far points are on the side where the robot may be, m. Shape (points, 3) to (points,).
    """

    name: str
    within: Callable[[Floats], Floats]


def _borders(mission: Mission, robot: str) -> list[_Border]:
    """Return the borders that a robot never crosses."""
    regions = mission.all_regions
    kept = [_Border(name, partial(_depths, regions[name])) for name in sorted(lasting_regions(mission, robot, inside=True))]
    out = [
        _Border(name, grown_region(name, regions[name], 0.0).signed_distance)
        for name in sorted(lasting_regions(mission, robot, inside=False))
    ]
    return [*kept, *out]


def _depths(region: Region, points: Floats) -> Floats:
    return region.measures.depths(points - np.array(region.center))


@dataclass(frozen=True, slots=True)
class _Rooms:
    mission: Mission
    parts: tuple[SolidPart, ...]
    clearance: float
    kept: Spacing
    borders: Sequence[_Border]

    def around(self, way: Floats) -> _Room:
        """Return the room around the points of a way."""
        along = np.gradient(way, axis=0) if len(way) > 1 else np.array([[1.0, 0.0, 0.0]])
        beside = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(way))])
        sizes = np.linalg.norm(beside, axis=1, keepdims=True)
        beside = np.where(sizes > 0.0, beside / np.maximum(sizes, 1e-12), [0.0, 1.0, 0.0])
        (left, one, a), (right, other, b) = self._rays(way, beside), self._rays(way, -beside)
        up = np.broadcast_to([0.0, 0.0, 1.0], way.shape)
        upright = self._rays(way, up)[0] + self._rays(way, -up)[0]
        return _Room(left + right, upright * self.kept.z_scale, a + b, list(zip(one, other, strict=True)))

    def _rays(self, way: Floats, directions: Floats) -> tuple[Floats, list[str], Floats]:
        """Return how far a robot's centre can move from points, up to what two robots keep; what ends that, and what is kept from it."""
        steps = np.arange(0.0, self.kept.at_rest + _RAY, _RAY)
        points = way[:, None] + steps[:, None] * directions[:, None]  # (points, steps, 3)
        flat, margin = points.reshape(-1, 3), self.mission.margin
        low, high = (np.array(wall) for wall in (self.mission.workspace.min, self.mission.workspace.max))
        left = [np.minimum(flat - low, high - flat).min(axis=1) - margin]
        left += [border.within(flat) - margin for border in self.borders]
        left += [part.distances(flat) - self.clearance for part in self.parts]
        room = np.array(left).reshape(len(left), *points.shape[:2])
        blocked = room.min(axis=0) < -1e-6
        first = np.where(blocked.any(axis=1), blocked.argmax(axis=1), len(steps))
        names = [WALL, *(border.name for border in self.borders), *(part.obstacle for part in self.parts)]
        ends = np.minimum(first, len(steps) - 1)
        nearest = room[:, np.arange(len(way)), ends].argmin(axis=0)
        found = [names[k] for k in nearest]
        return np.maximum(first - 1, 0) * _RAY, found, np.where(nearest <= len(self.borders), margin, self.clearance)


def _dense(robot: RobotPlan) -> Floats:
    """Return points on a robot's straight legs. Shape (n, 3)."""
    points = np.array([waypoint.position for waypoint in robot.waypoints], dtype=float)
    lines = [
        a + np.linspace(0.0, 1.0, int(np.linalg.norm(b - a) / _STEP) + 1, endpoint=False)[:, None] * (b - a)
        for a, b in itertools.pairwise(points)
    ]
    return np.concatenate([*lines, points[-1:]])


def _longest(held: NDArray[np.bool_]) -> NDArray[np.intp] | None:
    """Return the indices of the longest run of points that are held; None where there is none."""
    index = np.flatnonzero(held)
    if not len(index):
        return None
    return max(np.split(index, np.flatnonzero(np.diff(index) > 1) + 1), key=len)
