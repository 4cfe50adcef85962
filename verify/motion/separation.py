"""Distances for all times: between robots, and to the walls of the workspace.

Within the margin m of their paths two robots come at most 2 m nearer to each other, and to a wall at most m. With
`separation_z` the distance in z counts k = separation / separation_z, and moving by m, by a step between two pieces or by
what clocks that differ by up to e let one path run ahead (its greatest speed times e) changes the distance so measured by
at most max(1, k) times as much.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, concatenate, dot, restricted
from verify.arithmetic.bounds import Indices, Peaks, peaks
from verify.data.errors import BadInput
from verify.data.trajectory import DEGREE
from verify.motion.broad_phase import lanes_in_boxes, near_segments
from verify.motion.paths import TeamPaths

_SLACK = 1e-7

FEW = 8
"""Robots up to which no interval is left out."""

BLOCK = 8_192
"""Intervals whose distances are computed at once, which bounds the memory."""

PAIRS = 1_024
"""Pairs whose least distances are sought at once."""

_NONE = Balls(np.empty((0, 2 * DEGREE + 1)), np.empty((0, 2 * DEGREE + 1)))


@dataclass(frozen=True, slots=True)
class MinimumDistance:
    """Least distance: proved never below `low`, and about `high` at `time`.

    Attributes:
        robot: Name.
        other: The other robot, or the wall ("x min", ...).
        low: Proved lower bound, in m (rounded down).
        high: Proved to be reached up to rounding, in m.
        time: When, in s.
    """

    robot: str
    other: str
    low: float
    high: float
    time: Fraction


@np.errstate(all="ignore")
def walls(paths: TeamPaths) -> list[MinimumDistance]:
    """Return for each robot its least distance to the workspace's walls (negative: outside)."""
    box = paths.mission.workspace
    positions = paths.positions
    count = len(paths.robots)
    tables, groups, names = [], [], []
    for axis, letter in enumerate("xyz"):
        for side, value, sign in (("min", box.min[axis], 1.0), ("max", box.max[axis], -1.0)):
            part = positions[:, axis]
            wall = Balls(np.full((1, 1), value), np.zeros((1, 1)))
            tables.append(part - wall if sign > 0 else wall - part)
            names.append(f"{letter} {side}")
            groups.append(paths.owner)
    found = peaks(-concatenate(tables), np.concatenate(groups), count, slack=np.full(count, _SLACK))
    result = []
    for robot, name in enumerate(paths.robots):
        wall, index = divmod(int(found.item[robot]), len(paths.segments))
        time = paths.segments[index].time(float(found.place[robot]))
        result.append(MinimumDistance(name, names[wall], float(-found.upper[robot]), float(-found.lower[robot]), time))
    return result


def wall_exactly(paths: TeamPaths, robot: int, margin: Fraction) -> bool:
    """Decide without rounding whether a robot's path stays at least `margin` from the walls.

    Args:
        paths: The team.
        robot: Index of the robot in it.
        margin: m, exact.
    """
    box = paths.mission.workspace
    for index in np.flatnonzero(paths.owner == robot):
        for axis, position in enumerate(paths.exact_position(int(index))):
            low, high = Fraction(box.min[axis]) + margin, Fraction(box.max[axis]) - margin
            if not (
                exact.nonnegative(position - exact.rational(low), Fraction(0), Fraction(1))
                and exact.nonnegative(exact.rational(high) - position, Fraction(0), Fraction(1))
            ):
                return False
    return True


@dataclass(frozen=True, slots=True)
class CommonInterval:
    """A time during which each of two robots is on one segment.

    Attributes:
        pair: Index of the pair.
        first: Segment of the first robot.
        second: Segment of the second.
        start: Exact time, in s.
        stop: Exact time, in s, after `start`.
    """

    pair: int
    first: int
    second: int
    start: Fraction
    stop: Fraction


@dataclass(frozen=True, eq=False)
class PairwiseDistances:
    """Squared distances of all pairs of robots over all times, computed once for any margin.

    Attributes:
        paths: The team.
        pairs: Indices of the robots.
        intervals: In order of pairs and times; of large teams those that can hold a pair's nearest approach, or any that is as near.
        squares: Squared distance (z weighted) during each. Shape (intervals, 15).
        jumps: Bound on each robot's longest step between pieces, in m, whatever its direction.
    """

    paths: TeamPaths
    pairs: tuple[tuple[int, int], ...]
    intervals: tuple[CommonInterval, ...]
    squares: Balls
    jumps: tuple[float, ...]


def z_weight(paths: TeamPaths) -> Fraction:
    """Return k, by which distances in z are multiplied.

    Raises:
        BadInput: `separation_z` is 0.
    """
    mission = paths.mission
    if mission.separation_z is None:
        return Fraction(1)
    if mission.separation_z == 0:
        raise BadInput("separation_z must be above 0 m; leave it out for the same clearance in all directions.")
    return Fraction(mission.separation) / Fraction(mission.separation_z)


def stretch_of(paths: TeamPaths) -> Fraction:
    """Return by how many m the measured distance changes at most where a robot moves by 1 m."""
    return max(Fraction(1), z_weight(paths))


@np.errstate(all="ignore")
def pairwise_distances(paths: TeamPaths, *, few: int = FEW) -> PairwiseDistances:
    """Compute the squared distances of all pairs of robots.

    Args:
        paths: The team.
        few: Robots up to which distances are computed at all times; of more only where a pair's least one can be.
    """
    weight = z_weight(paths)
    pairs = tuple(itertools.combinations(range(len(paths.robots)), 2))
    rows = _intervals(paths, pairs) if len(paths.robots) <= few else _near_intervals(paths, pairs, weight)
    squares = [_squares(paths, rows[i : i + BLOCK], weight) for i in range(0, len(rows), BLOCK)]
    return PairwiseDistances(paths, pairs, tuple(rows), concatenate([_NONE, *squares]), _jumps(paths))


def _intervals(paths: TeamPaths, pairs: Sequence[tuple[int, int]]) -> list[CommonInterval]:
    rows: list[CommonInterval] = []
    lanes = [
        [i for i in np.flatnonzero(paths.owner == r) if paths.segments[i].kind != "step"] for r in range(len(paths.robots))
    ]
    for pair, (a, b) in enumerate(pairs):
        i = j = 0
        time = Fraction(0)
        while time < paths.end:
            first, second = int(lanes[a][i]), int(lanes[b][j])
            ends = paths.segments[first].stop, paths.segments[second].stop
            stop = min(ends)
            rows.append(CommonInterval(pair, first, second, time, stop))
            i, j, time = i + (ends[0] == stop), j + (ends[1] == stop), stop
    return rows


def _near_intervals(paths: TeamPaths, pairs: Sequence[tuple[int, int]], weight: Fraction) -> list[CommonInterval]:
    lanes = lanes_in_boxes(paths, weight)
    rows: list[CommonInterval] = []
    for pair, (a, b) in enumerate(pairs):
        for first, second in near_segments(lanes[a], lanes[b]):
            one, other = paths.segments[first], paths.segments[second]
            rows.append(CommonInterval(pair, first, second, max(one.start, other.start), min(one.stop, other.stop)))
    return rows


def _squares(paths: TeamPaths, rows: Sequence[CommonInterval], weight: Fraction) -> Balls:
    parts = [_during(paths, [(m.first, m.second)[side] for m in rows], rows) for side in (0, 1)]
    offset = parts[0] - parts[1]
    number, error = float(weight), abs(float(weight)) * 2.0**-52
    factors = np.array([1.0, 1.0, number])[:, None], np.array([0.0, 0.0, 0.0 if weight == 1 else error])[:, None]
    weighted = offset.scaled(*factors)
    return dot(weighted, weighted)


def _during(paths: TeamPaths, segments: list[int], rows: Sequence[CommonInterval]) -> Balls:
    """Return positions on the parts of segments that the intervals take. Shape (intervals, 3, 8)."""
    positions = paths.positions[np.array(segments)]
    mid, rad = positions.mid.copy(), positions.rad.copy()
    cut, starts, stops = [], [], []
    for row, (index, interval) in enumerate(zip(segments, rows, strict=True)):
        segment = paths.segments[index]
        if segment.kind == "hover" or (interval.start == segment.start and interval.stop == segment.stop):
            continue
        length = segment.stop - segment.start
        cut.append(row)
        starts.append((interval.start - segment.start) / length)
        stops.append((interval.stop - segment.start) / length)
    if cut:
        parts = restricted(positions[np.array(cut)], starts, stops)
        mid[cut], rad[cut] = parts.mid, parts.rad
    return Balls(mid, rad)


def _jumps(paths: TeamPaths) -> tuple[float, ...]:
    longest = [0.0] * len(paths.robots)
    for index, segment in enumerate(paths.segments):
        if segment.kind == "step":
            longest[segment.robot] = max(longest[segment.robot], step_length(paths, index))
    return tuple(longest)


def step_length(paths: TeamPaths, index: int) -> float:
    """Return an upper bound on the length of a step, in m; exactly 0 where it begins at rest and goes nowhere."""
    segment, ends = paths.segments[index], paths.positions[index]
    coefficients = paths.trajectories[segment.robot].coefficients
    goal = coefficients[segment.after, :3, 0]
    if segment.piece < 0:
        if np.array_equal(paths.mission.agents[paths.robots[segment.robot]].start, goal):
            return 0.0
    elif not coefficients[segment.piece, :3, 1:].any() and np.array_equal(coefficients[segment.piece, :3, 0], goal):
        return 0.0
    bounds = (np.abs(ends.mid[:, -1] - ends.mid[:, 0]) + ends.rad[:, 0] + ends.rad[:, -1]) * (1 + 2.0**-40)
    return float(np.sqrt((bounds * bounds).sum()) * (1 + 2.0**-40))


@np.errstate(all="ignore")
def minimum_distances(found: PairwiseDistances) -> list[MinimumDistance]:
    """Return for each pair of robots its least distance (z weighted), steps between pieces allowed for."""
    paths = found.paths
    if not found.pairs:
        return []
    stretch = _up(stretch_of(paths))
    groups = np.array([m.pair for m in found.intervals], dtype=np.intp)
    upper, lower, item, place = _least_squares(found.squares, groups, len(found.pairs))
    result = []
    for pair, (a, b) in enumerate(found.pairs):
        interval = found.intervals[int(item[pair])]
        time = interval.start + (interval.stop - interval.start) * Fraction(float(place[pair]))
        low = _root_down(-float(upper[pair])) - (found.jumps[a] + found.jumps[b]) * stretch * (1 + 2.0**-40)
        high = float(np.nextafter(np.sqrt(max(-float(lower[pair]), 0.0)), np.inf))
        low = float(np.nextafter(low, -np.inf)) if low > 0 else 0.0
        result.append(MinimumDistance(paths.robots[a], paths.robots[b], low, high, time))
    return result


def _least_squares(squares: Balls, groups: Indices, count: int) -> tuple[Floats, Floats, Indices, Floats]:
    """Return the greatest values of the negated squares: bounds from above and below, row and place, for each pair in order."""
    found: list[Peaks] = []
    for first in range(0, count, PAIRS):
        last = min(first + PAIRS, count)
        begin, end = np.searchsorted(groups, [first, last])
        least = peaks(-squares[begin:end], groups[begin:end] - first, last - first, slack=np.full(last - first, _SLACK))
        found.append(replace(least, item=least.item + begin))
    joined = (np.concatenate([getattr(part, name) for part in found]) for name in ("upper", "lower", "item", "place"))
    upper, lower, item, place = joined
    return upper, lower, item, place


def distance_exactly(found: PairwiseDistances, pair: int, limit: Fraction) -> bool:
    """Decide without rounding whether a pair stays at least `limit` apart between its steps.

    Args:
        found: Distances of all pairs.
        pair: Index of the pair among them.
        limit: m, exact, not negative; distances in z count as they do in `found`.
    """
    weight = exact.rational(z_weight(found.paths))
    for row, interval in enumerate(found.intervals):
        if interval.pair != pair:
            continue
        least = float(found.squares[row].low.min())
        if math.isfinite(least) and Fraction(least) >= limit * limit:
            continue
        total = None
        for axis in range(3):
            gap = (
                _exact_part(found.paths, interval.first, interval)[axis]
                - _exact_part(found.paths, interval.second, interval)[axis]
            )
            gap = gap * weight if axis == 2 else gap
            total = gap * gap if total is None else total + gap * gap
        assert total is not None
        if not exact.nonnegative(total - exact.rational(limit * limit), Fraction(0), Fraction(1)):
            return False
    return True


def _exact_part(paths: TeamPaths, index: int, interval: CommonInterval) -> list[fmpq_poly]:
    segment = paths.segments[index]
    length = segment.stop - segment.start
    start, stop = (interval.start - segment.start) / length, (interval.stop - segment.start) / length
    return [exact.on_unit_interval(p, start, stop) for p in paths.exact_position(index)]


def _up(value: Fraction) -> float:
    return float(np.nextafter(float(value), np.inf))


def _root_down(value: float) -> float:
    return float(np.nextafter(np.sqrt(value), -np.inf)) if value > 0 else 0.0
