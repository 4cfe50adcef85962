"""Flights through hoops, for all times: which openings are passed in which direction, and that no rim is met.

For a hoop with centre c and normal n let d = (r - c) . n / |n| be the distance along the normal and p the distance
from the axis. The opening is the disc d = 0, p <= opening; the rim is the solid ring of radii opening to
opening + rim and thickness rim along the normal. With margin m and vehicle radius v

* a *passage* is a maximal time during which some point within m of the path may lie in the opening: it begins more
  than m on one side of the plane and ends more than m on the other, and throughout p <= opening - m - v;
* the rim is not met if the path stays further than m + v from it.

Between passages every point within m of the path is outside the opening.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np

from verify.arithmetic.balls import Balls, Floats, constants, dot, gamma, halves
from verify.arithmetic.bounds import search
from verify.arithmetic.intervals import Interval, interval
from verify.data.shapes.region import Hoop
from verify.motion.paths import TeamPaths

Way = Literal["F", "R", None]

_DEPTH = 30

MAX_OPEN = 64
"""A piece with more open parts than this (it runs along an opening's edge) counts as near there."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """A maximal time near one hoop's opening.

    Attributes:
        robot: Name.
        hoop: Name.
        start: Exact time, in s, from which on the path may be within the margin of the opening.
        stop: Exact time, in s, after which it is not.
        way: "F" along the normal, "R" against it; None where it is no passage.
        off_axis: Proved upper bound on the distance from the axis, in m.
        reason: Why it is no passage; empty where it is one.
    """

    robot: str
    hoop: str
    start: Fraction
    stop: Fraction
    way: Way
    off_axis: float
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Clearance:
    """Least distance of one robot to one hoop's rim: proved never below `low`, and near `high` at `time`."""

    robot: str
    hoop: str
    low: float
    high: float
    time: Fraction


@dataclass(frozen=True, eq=False)
class HoopFrames:
    """All segments as seen from all hoops, computed once for any margin.

    Attributes:
        paths: The team.
        names: Hoops, in the mission's order.
        along: d on each segment and hoop. Shape (segments, hoops, 8).
        across: p^2. Shape (segments, hoops, 15).
    """

    paths: TeamPaths
    names: tuple[str, ...]
    along: Balls
    across: Balls

    def hoop(self, column: int) -> Hoop:
        """Return the hoop of a column."""
        return self.paths.mission.hoops[self.names[column]]


@np.errstate(all="ignore")
def hoop_frames(paths: TeamPaths) -> HoopFrames:
    """Compute distances along and across the axes of all hoops."""
    hoops = paths.mission.hoops
    count = len(paths.segments)
    along = Balls(np.empty((count, len(hoops), 8)), np.empty((count, len(hoops), 8)))
    across = Balls(np.empty((count, len(hoops), 15)), np.empty((count, len(hoops), 15)))
    for column, hoop in enumerate(hoops.values()):
        offset = paths.positions - constants(np.array(hoop.center)).reshape(1, 3, 1)
        normal, error = unit_normal(hoop)
        mid = np.einsum("j,kjn->kn", normal, offset.mid)
        rad = np.einsum("j,kjn->kn", np.abs(normal) + error, offset.rad + gamma(4) * np.abs(offset.mid))
        rad += np.einsum("j,kjn->kn", error, np.abs(offset.mid))
        d = Balls(mid, rad * (1 + 2.0**-40) + 1e-290)
        p = dot(offset, offset) - d * d
        along.mid[:, column], along.rad[:, column] = d.mid, d.rad
        across.mid[:, column], across.rad[:, column] = p.mid, p.rad
    return HoopFrames(paths, tuple(hoops), along, across)


@np.errstate(all="ignore")
def crossings(frames: HoopFrames, margin: Fraction) -> dict[str, tuple[Crossing, ...]]:
    """Return for each robot its times near openings, in order of their starts."""
    result: dict[str, tuple[Crossing, ...]] = {}
    near = _near(frames, margin)
    for robot, name in enumerate(frames.paths.robots):
        found: list[Crossing] = []
        for column in range(len(frames.names)):
            for parts in _joined(near.get((robot, column), [])):
                found.append(_crossing(frames, name, column, parts, margin))
        found.sort(key=lambda crossing: crossing.start)
        result[name] = tuple(found)
    return result


@np.errstate(all="ignore")
def clearances(frames: HoopFrames, slack: float = 1e-4) -> list[Clearance]:
    """Bound from below how near each robot comes to each rim, to about `slack` m."""
    paths, hoops = frames.paths, len(frames.names)
    if not hoops:
        return []
    along, across = frames.along.reshape(-1, 8), frames.across.reshape(-1, 15)
    opening = np.array([frames.hoop(c).opening for c in range(hoops)])
    rim = np.array([frames.hoop(c).rim for c in range(hoops)])
    column = np.tile(np.arange(hoops), len(paths.segments))
    groups = np.repeat(paths.owner, hoops) * hoops + column
    count = len(paths.robots) * hoops

    def negated_distance(state: tuple[Balls, ...], items: np.ndarray) -> tuple[Floats, Floats, Floats]:
        d, p = state[0], _roots(state[1])
        inner, thick = opening[column[items]], rim[column[items]]
        low = rim_distance(d.low.min(-1), d.high.max(-1), p.low.min(-1), p.high.max(-1), inner, thick)[0]
        first, last = (rim_distance(d.low[:, i], d.high[:, i], p.low[:, i], p.high[:, i], inner, thick)[1] for i in (0, -1))
        return -low, -first, -last

    found = search((along, across), negated_distance, groups, count, slack=np.full(count, slack), depth=_DEPTH, stride=2)
    result = []
    for group in range(count):
        robot, hoop = divmod(group, hoops)
        segment = paths.segments[int(found.item[group]) // hoops]
        time = segment.time(float(found.place[group]))
        name = frames.names[hoop]
        result.append(Clearance(paths.robots[robot], name, float(-found.upper[group]), float(-found.lower[group]), time))
    return result


def _roots(squares: Balls) -> Interval:
    """Enclose the square roots of coefficients; a polynomial between low and high has its root between theirs."""
    return Interval(np.maximum(squares.low, 0.0), np.maximum(squares.high, 0.0)).root()


def rim_distance(
    d_low: Floats, d_high: Floats, p_low: Floats, p_high: Floats, opening: Floats, rim: Floats
) -> tuple[Floats, Floats]:
    """Bound the distance to the solid ring from below and above, m, given bounds on d and p and the ring's two lengths.

    All arrays have one shape.

    Args:
        d_low: Lower bounds on the signed distances from the hoops' planes, m.
        d_high: Upper bounds on them, m.
        p_low: Lower bounds on the distances from the hoops' axes, m.
        p_high: Upper bounds on them, m.
        opening: Radii of the openings, m.
        rim: Widths of the rings across and along the axes, m.

    Returns:
        Lower and upper bounds, m, of the same shape.
    """
    d, p = Interval(d_low, d_high).magnitude(), Interval(p_low, p_high)
    inner = interval(opening)
    beside = (d - interval(rim / 2)).at_least_zero()
    within, beyond = inner - p, p - (inner + interval(rim))
    radial = Interval(np.maximum(within.low, beyond.low), np.maximum(within.high, beyond.high)).at_least_zero()
    distance = (beside.squared() + radial.squared()).root()
    return distance.low, distance.high


@dataclass(frozen=True, slots=True)
class OpeningPart:
    """A part of a segment that may be near an opening, with bounds on d at both ends and the greatest p^2."""

    segment: int
    start: float
    stop: float
    first: tuple[float, float]
    last: tuple[float, float]
    across: float


def _joined(parts: list[OpeningPart]) -> Iterator[list[OpeningPart]]:
    """Group parts that follow each other without a gap."""
    group: list[OpeningPart] = []
    for part in parts:
        if group:
            before = group[-1]
            same = before.segment == part.segment and before.stop == part.start
            across = before.segment + 1 == part.segment and before.stop == 1.0 and part.start == 0.0
            if not (same or across):
                yield group
                group = []
        group.append(part)
    if group:
        yield group


def _crossing(frames: HoopFrames, robot: str, column: int, parts: list[OpeningPart], margin: Fraction) -> Crossing:
    paths, name, hoop = frames.paths, frames.names[column], frames.hoop(column)
    first, last = parts[0], parts[-1]
    start, stop = paths.segments[first.segment].time(first.start), paths.segments[last.segment].time(last.stop)
    off_axis = float(np.nextafter(np.sqrt(np.max([part.across for part in parts])), np.inf))  # NaN stays NaN
    room = Fraction(hoop.opening) - margin - Fraction(paths.mission.vehicle_of(robot).radius)
    bound = float(np.nextafter(float(margin), np.inf))
    way: Way = None
    if first.first[1] < -bound and last.last[0] > bound:
        way = "F"
    elif first.first[0] > bound and last.last[1] < -bound:
        way = "R"
    ends = _position(paths, first), _position(paths, last)
    if ends[0] == "start" or ends[1] == "end":
        way, reason = None, "the path begins or ends in the opening"
    elif way is None:
        back = (first.first[1] < 0 and last.last[1] < 0) or (first.first[0] > 0 and last.last[0] > 0)
        reason = "the path enters the opening and turns back" if back else "the path leaves the opening sideways"
    elif goes_back(parts, bound if way == "F" else -bound):
        way, reason = None, "the path passes the opening and comes back through it"
    elif not (math.isfinite(off_axis) and Fraction(off_axis) <= room):
        reason = f"the path is {off_axis:.4f} m off the axis, where {float(room):.4f} m leave room for vehicle and margin"
    else:
        reason = ""
    return Crossing(robot, name, start, stop, way, off_axis, reason)


def goes_back(parts: list[OpeningPart], bound: float) -> bool:
    """Return whether a path that was beyond the margin behind the plane is at some joint of parts surely before it again."""
    sign = 1.0 if bound > 0 else -1.0
    passed = False
    for part in parts:
        for low, high in (part.first, part.last):
            if sign < 0:
                low, high = -high, -low
            passed |= low > abs(bound)
            if passed and high < -abs(bound):
                return True
    return False


def _position(paths: TeamPaths, part: OpeningPart) -> Literal["start", "end", ""]:
    """Return whether a part touches the start or the end of its robot's path."""
    segment = paths.segments[part.segment]
    if segment.start == 0 and part.start == 0.0 and segment.kind == "step":
        return "start"
    follower = part.segment + 1
    is_last = follower == len(paths.segments) or paths.segments[follower].robot != segment.robot
    return "end" if is_last and part.stop == 1.0 else ""


def _near(frames: HoopFrames, margin: Fraction) -> dict[tuple[int, int], list[OpeningPart]]:
    """Find for each robot and hoop the parts of segments where the opening may be within the margin, in order."""
    paths, hoops = frames.paths, len(frames.names)
    found: dict[tuple[int, int], list[OpeningPart]] = {}
    if not hoops:
        return found
    column = np.tile(np.arange(hoops), len(paths.segments))
    bound = float(np.nextafter(float(margin), np.inf))  # within this of the plane, or that of the opening's edge
    edge = np.array([np.nextafter(frames.hoop(c).opening + bound, np.inf) for c in range(hoops)])
    edge2 = np.nextafter(np.nextafter(edge * edge, np.inf), np.inf)
    along, across = frames.along.reshape(-1, 8), frames.across.reshape(-1, 15)
    items, starts, width = np.arange(len(column)), np.zeros(len(column)), 1.0
    for level in range(_DEPTH + 1):
        d_low, d_high, p_low, p_high = along.low, along.high, across.low, across.high
        limit = edge2[column[items]]
        far = (d_low.min(-1) > bound) | (d_high.max(-1) < -bound) | (p_low.min(-1) > limit)
        surely = (d_low.min(-1) >= -bound) & (d_high.max(-1) <= bound) & (p_high.max(-1) <= limit)
        if level == _DEPTH:
            surely = ~far
        open_ = ~far & ~surely
        surely |= open_ & (np.bincount(items[open_], minlength=len(column))[items] > MAX_OPEN)
        for index in np.flatnonzero(surely & ~far):
            segment, hoop = divmod(int(items[index]), hoops)
            part = OpeningPart(
                segment,
                float(starts[index]),
                float(starts[index] + width),
                (float(d_low[index, 0]), float(d_high[index, 0])),
                (float(d_low[index, -1]), float(d_high[index, -1])),
                float(p_high[index].max()),
            )
            found.setdefault((int(paths.owner[segment]), hoop), []).append(part)
        keep = np.flatnonzero(~far & ~surely)
        if len(keep) == 0:
            break
        along, across = halves(along[keep]), halves(across[keep])
        width /= 2
        items = np.concatenate([items[keep], items[keep]])
        starts = np.concatenate([starts[keep], starts[keep] + width])
    for parts in found.values():
        parts.sort(key=lambda part: (part.segment, part.start))
    return found


def unit_normal(hoop: Hoop) -> tuple[Floats, Floats]:
    """Return a hoop's stored normal, and bounds on how far each part is off that of the unit vector. Shapes (3,)."""
    normal = np.array(hoop.normal)
    length2 = sum((Fraction(x) ** 2 for x in normal.tolist()), Fraction(0))
    # the stored normal is a unit vector up to rounding: |n| lies within |n^2 - 1| of 1
    excess = abs(float(length2 - 1)) * (1 + 2.0**-40)
    return normal, np.abs(normal) * 2 * excess
