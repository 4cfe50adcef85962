"""Least distances of robots to obstacles, for all times: branch and bound over segments of paths and convex parts of obstacles.

The quantity is the distance of a path from what is solid (`verify.data.shapes.solid_parts`). Far parts are told by boxes around
several segments at once; of what is left each segment is halved until what `verify.motion.obstacles.half_spaces` proves of its
halves meets what is reached. That a path meets an obstacle is shown by one instant and one solid point (`points`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from verify.arithmetic.balls import Balls, Floats, halves
from verify.arithmetic.bounds import Indices
from verify.data.shapes.solid_parts import SolidPart, solid_parts
from verify.motion.obstacles.bodies import MOST_AT_ONCE, SolidBodies
from verify.motion.obstacles.half_spaces import Hulls
from verify.motion.paths import TeamPaths

SLACK = 1e-4
"""m; how closely the nearest approach is bounded at first."""
_FAR_SLACK = 0.01
"""And this share of what it is more than is needed."""
_SLICE = 8
"""So many segments of a robot are compared with a part at once, to begin with."""
_FIRST, _SECOND = 4, 32
"""So many of the nearest slices of each robot, and then of its nearest segments, are looked at to know about how near it comes."""
_DEPTH, _DEPTH_AT_LIMIT = 30, 44
_MOST = 200_000
"""More open parts of segments than this keep the (sound, looser) bounds that they have."""
_MIDDLE = np.array([math.comb(7, k) for k in range(8)]) / 128.0
_STEP = 1e-6


@dataclass(frozen=True, slots=True)
class Approach:
    """Least distance of one robot to one obstacle.

    Attributes:
        robot: Name.
        obstacle: Name.
        low: Proved: it is never nearer, m; below zero nothing is proved.
        high: About how near it comes, m; below zero how deep it lies inside.
        segment: Index of the segment where.
        place: Where in it, from 0 to 1.
        part: Index among the parts of all obstacles.
        time: When, exact, in s.
        way: Unit vector there along which the distance grows fastest.
    """

    robot: str
    obstacle: str
    low: float
    high: float
    segment: int
    place: float
    part: int
    time: Fraction
    way: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SolidWorld:
    """A team's paths and what is solid around them.

    Attributes:
        paths: The team.
        parts: Convex parts of all obstacles.
    """

    paths: TeamPaths
    parts: tuple[SolidPart, ...]

    @classmethod
    def of(cls, paths: TeamPaths) -> SolidWorld:
        """Look up what is solid in the team's mission."""
        return cls(paths, solid_parts(paths.mission.obstacles, paths.mission.hoops))

    @cached_property
    def bodies(self) -> SolidBodies:
        """The solid bodies, as arrays."""
        return SolidBodies(self.parts)

    @np.errstate(all="ignore")
    def approaches(self, needed: Mapping[str, float]) -> dict[str, tuple[Approach, ...]]:
        """Return how near each robot comes to the obstacle nearest to it, and to all others that are nearer than is needed.

        Args:
            needed: For each robot, how far it should stay away, m.

        Returns:
            For each robot its approaches, the nearest first; no obstacle is nearer than that one's `low`.
        """
        search = _Search(self, np.array([needed[robot] for robot in self.paths.robots]), SLACK)
        search.run(np.arange(len(self.paths.segments)), _DEPTH)
        return {name: search.of_robot(robot) for robot, name in enumerate(self.paths.robots)}

    @np.errstate(all="ignore")
    def nearer_than(self, robot: int, limit: Fraction) -> tuple[Approach, ...]:
        """Return how near one robot comes to the obstacles that it may be as near to as a limit, as closely as that can be told.

        Args:
            robot: Its index.
            limit: m, exact.

        Returns:
            Its approaches, the nearest first; one more where it is farther from all.
        """
        bound = np.nextafter(float(limit), np.inf)
        search = _Search(self, np.full(len(self.paths.robots), bound), 0.0)
        search.run(np.flatnonzero(self.paths.owner == robot), _DEPTH_AT_LIMIT)
        return search.of_robot(robot)


class _Search:
    """Branch and bound: for each robot and obstacle the nearest approach so far, and what is proved."""

    def __init__(self, world: SolidWorld, needed: Floats, slack: float) -> None:
        self.world, self.needed, self.slack = world, needed, slack
        groups = (len(world.paths.robots), len(world.bodies.obstacles))
        self.low, self.near = np.full(groups, np.inf), np.full(groups, np.inf)
        self.segment, self.part, self.place = np.zeros(groups, np.intp), np.zeros(groups, np.intp), np.zeros(groups)

    def run(self, segments: Indices, depth: int) -> None:
        """Search some segments.

        Args:
            segments: Indices, robot by robot, in order of time.
            depth: At most so many halvings.
        """
        paths = self.world.paths
        items, parts = self._not_far(segments)
        state: Balls = paths.positions[items]
        starts, width = np.zeros(len(items)), 1.0
        for level in range(depth + 1):
            places = state.mid @ _MIDDLE
            robots = paths.owner[items]
            low, near = self.world.bodies.distances(
                parts, Hulls(state.mid, state.rad.max(axis=-1)), places, self._enough()[robots]
            )
            self._reach(items, parts, starts + width / 2, near)
            closed = ~self._is_open(robots, parts, low)
            closed |= np.ptp(state.mid, axis=2).max(axis=1) <= state.rad.max(axis=(1, 2))  # smaller than what rounding may be
            if level == depth or 2 * np.count_nonzero(~closed) > _MOST:
                closed[:] = True
            self._close(robots[closed], parts[closed], low[closed])
            keep = np.flatnonzero(~closed)
            if not len(keep):
                break
            state = halves(state[keep])
            width /= 2
            items, parts = np.tile(items[keep], 2), np.tile(parts[keep], 2)
            starts = np.concatenate([starts[keep], starts[keep] + width])

    def of_robot(self, robot: int) -> tuple[Approach, ...]:
        """Return what was found of one robot: the nearest obstacle, and those nearer than is needed."""
        order = np.argsort(self.near[robot], kind="stable")
        floor = float(self.low[robot].min())
        found: list[Approach] = []
        for obstacle in order.tolist():
            near, low = float(self.near[robot, obstacle]), float(self.low[robot, obstacle])
            if found and not low <= self.needed[robot]:
                continue
            found.append(self._approach(robot, obstacle, low if found or self.slack == 0 else floor, near))
        return tuple(found)

    def _approach(self, robot: int, obstacle: int, low: float, high: float) -> Approach:
        paths = self.world.paths
        segment, part, place = (
            int(self.segment[robot, obstacle]), int(self.part[robot, obstacle]), float(self.place[robot, obstacle]),
        )  # fmt: skip
        share = np.array([math.comb(7, k) * place**k * (1 - place) ** (7 - k) for k in range(8)])
        point = paths.positions.mid[segment] @ share
        return Approach(
            paths.robots[robot],
            self.world.bodies.obstacles[obstacle],
            low,
            high,
            segment,
            place,
            part,
            paths.segments[segment].time(place),
            _way_out(self.world.parts[part], point),
        )

    def _not_far(self, segments: Indices) -> tuple[Indices, Indices]:
        """Return the pairs of segments and parts that boxes alone do not tell apart."""
        paths, count = self.world.paths, len(self.world.parts)
        owner = paths.owner[segments]
        low, high = paths.positions[segments].low.min(-1), paths.positions[segments].high.max(-1)
        turns = np.flatnonzero(np.diff(owner)) + 1
        cuts = np.unique(np.concatenate([np.arange(begin, end, _SLICE) for begin, end in _runs(turns, len(segments))]))
        lengths = np.diff(np.append(cuts, len(segments)))
        box_low, box_high = np.minimum.reduceat(low, cuts), np.maximum.reduceat(high, cuts)
        outlines = self.world.bodies.outlines
        bounds = np.concatenate([outlines.beyond(box_low[b], box_high[b]) for b in self._rows_of(len(cuts))])
        for robot in np.unique(owner):
            mine = np.flatnonzero(owner[cuts] == robot)
            nearest = _least(bounds[mine].ravel(), _FIRST)
            slices = mine[nearest // count]
            self._look(segments[cuts[slices] + lengths[slices] // 2], nearest % count)
        enough = self._enough()[owner[cuts]]
        close = ~(bounds > enough[:, None])
        far = np.nonzero(~close)
        self._close(owner[cuts[far[0]]], far[1], bounds[far])
        slices, parts = np.nonzero(close)
        repeats = lengths[slices]
        ends = np.cumsum(repeats)
        items, parts = (
            np.arange(ends[-1] if len(ends) else 0) + np.repeat(cuts[slices] - ends + repeats, repeats),
            np.repeat(parts, repeats),
        )
        apart = outlines.beyond_one(low[items], high[items], parts)
        for robot in np.unique(owner):
            mine = np.flatnonzero(owner[items] == robot)
            nearest = mine[_least(apart[mine], _SECOND)]
            self._look(segments[items[nearest]], parts[nearest])
        far = apart > self._enough()[owner[items]]
        self._close(owner[items[far]], parts[far], apart[far])
        return segments[items[~far]], parts[~far]

    def _look(self, segments: Indices, parts: Indices) -> None:
        """Look how near the middles of segments come to parts."""
        places = self.world.paths.positions.mid[segments] @ _MIDDLE
        enough = self._enough()[self.world.paths.owner[segments]]
        _, near = self.world.bodies.distances(parts, Hulls.points(places), places, enough)
        self._reach(segments, parts, np.full(len(segments), 0.5), near)

    def _rows_of(self, count: int) -> Iterator[slice]:
        """Yield blocks of boxes, so that all of them beside all faces take little memory."""
        step = max(1, MOST_AT_ONCE // self.world.bodies.outlines.low.size)
        for first in range(0, count, step):
            yield slice(first, first + step)

    def _enough(self) -> Floats:
        """Return for each robot the distance beyond which nothing matters: it comes nearer than that, or need not be known to."""
        return np.maximum(self.near.min(axis=1), self.needed) if self.slack > 0 else self.needed

    def _is_open(self, robots: Indices, parts: Indices, low: Floats) -> np.ndarray:
        obstacles = self.world.bodies.obstacle_of[parts]
        near, needed = self.near[robots, obstacles], self.needed[robots]
        if self.slack > 0:
            room = np.maximum(self.slack, _FAR_SLACK * (near - needed))
            return ~(low > self._enough()[robots]) & ~(low >= near - room)
        return ~(low > needed) & ~(near < needed * (1 - 1e-12))

    def _reach(self, segments: Indices, parts: Indices, places: Floats, near: Floats) -> None:
        robots, obstacles = self.world.paths.owner[segments], self.world.bodies.obstacle_of[parts]
        better = np.flatnonzero(near < self.near[robots, obstacles])
        better = better[np.argsort(-near[better], kind="stable")]  # the least of each is written last
        at = robots[better], obstacles[better]
        self.near[at], self.segment[at], self.part[at] = near[better], segments[better], parts[better]
        self.place[at] = places[better]

    def _close(self, robots: Indices, parts: Indices, low: Floats) -> None:
        np.minimum.at(self.low, (robots, self.world.bodies.obstacle_of[parts]), low)


def _least(values: Floats, count: int) -> Indices:
    return np.argpartition(values, count)[:count] if count < len(values) else np.arange(len(values))


def _runs(turns: Indices, count: int) -> Iterator[tuple[int, int]]:
    ends = [0, *turns.tolist(), count]
    yield from itertools.pairwise(ends)


def _way_out(part: SolidPart, point: Floats) -> tuple[float, float, float]:
    """Return the unit vector along which the distance from what is solid grows fastest, in floats."""
    ahead = np.concatenate([point + _STEP * np.eye(3), point - _STEP * np.eye(3)])
    values = part.distances(ahead)
    slope = values[:3] - values[3:]
    length = float(np.linalg.norm(slope))
    x, y, z = (slope / length).tolist() if length > 0 else (0.0, 0.0, 1.0)
    return x, y, z
