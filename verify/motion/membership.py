"""From polynomials to label timelines: for all times, in which regions a robot must, may or cannot be.

With r the path, c and M a region's centre and matrix, q = (r - c)' M (r - c) is a polynomial of degree 14 on each
piece. A point within the margin d of r has sqrt(q) within s d of the path's, where s^2 bounds the greatest
eigenvalue of M. So q <= (1 - s d)^2 means *must*, q > (1 + s d)^2 means *no*, and what is neither proved is *may*.
At margin 0 the two thresholds are one, and an interval that holds exactly one simple root of q - 1 is one switch.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, constants, dot, gamma, halves, nearest
from verify.arithmetic.bounds import Indices
from verify.behaviour.timeline import Change, Enclosure, Status
from verify.data.shapes.region import Region
from verify.motion.paths import Segment, TeamPaths
from verify.motion.regions import Ellipsoid, extent

Mark = Literal["no", "may", "must", "switch"]

DEPTH_WITH_MARGIN = 20
"""Halvings of a piece before what is not proved yet counts as *may*: a millionth of its duration."""

DEPTH_WITHOUT = 34
"""At margin 0 an enclosure of a switch is this many halvings of its piece."""

MAX_OPEN = 64
"""A piece with more open parts than this (it runs along a boundary) is left to exact arithmetic, or to *may*."""

_CHUNK = 20_000


@dataclass(frozen=True, slots=True)
class Span:
    """A part of one path with one status; "switch" holds exactly one crossing of the boundary."""

    start: Fraction
    stop: Fraction
    mark: Mark


@dataclass(frozen=True, eq=False)
class MembershipPolynomials:
    """Membership polynomials of all segments in all regions, computed once for any margin.

    Attributes:
        paths: The team.
        regions: Names, in the mission's order.
        values: q on each segment and region. Shape (segments, regions, 15).
    """

    paths: TeamPaths
    regions: tuple[str, ...]
    values: Balls


@np.errstate(all="ignore")
def membership_polynomials(paths: TeamPaths) -> MembershipPolynomials:
    """Compute the membership polynomials of a team."""
    regions = paths.mission.all_regions
    count = len(paths.segments)
    mid, rad = np.empty((count, len(regions), 15)), np.empty((count, len(regions), 15))
    for column, region in enumerate(regions.values()):
        centre = constants(np.array(region.center)).reshape(1, 3, 1)
        for first in range(0, count, _CHUNK):
            part = slice(first, first + _CHUNK)
            offset = paths.positions[part] - centre
            values = dot(offset, _turned(region.shape, offset))
            mid[part, column], rad[part, column] = values.mid, values.rad
    return MembershipPolynomials(paths, tuple(regions), Balls(mid, rad))


@np.errstate(all="ignore")
def statuses(found: MembershipPolynomials, margin: Fraction) -> dict[str, dict[str, tuple[Span, ...]]]:
    """Return for each robot and region the spans of its path, in order and without gaps.

    Args:
        found: The team's membership polynomials.
        margin: Within how many metres of the path the status must hold, exact.
    """
    paths = found.paths
    near = np.flatnonzero(~_far(found, margin))
    regions = [paths.mission.all_regions[found.regions[column]] for column in near]
    thresholds = [_thresholds(region, margin) for region in regions]
    count = len(near)
    place = {int(column): k for k, column in enumerate(near)}
    width = found.values.mid.shape[-1]
    table = Balls(found.values.mid[:, near].reshape(-1, width), found.values.rad[:, near].reshape(-1, width))
    inside = np.array([t[0] for t in thresholds] * len(paths.segments)).reshape(-1, 2)
    outside = np.array([t[1] for t in thresholds] * len(paths.segments)).reshape(-1, 2)
    depth = DEPTH_WITHOUT if margin == 0 else DEPTH_WITH_MARGIN
    leaves = _classified(table, inside, outside, depth)
    result: dict[str, dict[str, tuple[Span, ...]]] = {}
    of_robot: list[list[int]] = [[] for _ in paths.robots]
    for index, segment in enumerate(paths.segments):
        of_robot[segment.robot].append(index)
    for robot, name in enumerate(paths.robots):
        result[name] = {}
        whole = paths.segments[of_robot[robot][0]].start, paths.segments[of_robot[robot][-1]].stop
        for column, region in enumerate(found.regions):
            spans: list[Span] = []
            if column not in place:
                _append(spans, *whole, "no")
            for index in of_robot[robot] if column in place else ():
                segment, row = paths.segments[index], index * count + place[column]
                parts = leaves[row]
                if len(parts) == 1 and parts[0][2] is not None:
                    _append(spans, segment.start, segment.stop, parts[0][2])
                elif margin == 0:
                    _without_margin(spans, parts, _SegmentInRegion(found, index, column))
                else:
                    for start, stop, mark in parts:
                        _append(spans, segment.time(start), segment.time(stop), mark or "may")
            result[name][region] = _settled(spans)
    return result


def _far(found: MembershipPolynomials, margin: Fraction) -> np.ndarray:
    """Tell which regions all robots are proved to be out of at all times, by the least coefficients alone. Shape (regions,).

    Thresholds are rounded upwards by a thousand times what their floats are off.
    """
    scales = [float(extent(Ellipsoid.of(region)).scale) for region in found.paths.mission.all_regions.values()]
    outside = (1.0 + np.array(scales) * float(margin) * (1 + 2.0**-40)) ** 2 * (1 + 2.0**-40)
    return np.all(found.values.low.min(-1) > outside, axis=0)


def changes(spans: dict[str, tuple[Span, ...]]) -> tuple[dict[str, Status], tuple[Change, ...]]:
    """Turn spans into a timeline's initial statuses and its changes, sorted."""
    initial: dict[str, Status] = {}
    found: list[Change] = []
    for region, row in spans.items():
        status: Status = _status(row[0])
        initial[region] = status
        for before, span in itertools.pairwise(row):
            if span.mark == "switch":
                continue
            if before.mark == "switch":
                found.append(Change(Enclosure(before.start, before.stop), region, _status(span)))
            else:
                found.append(Change(Enclosure(span.start, span.start), region, _status(span)))
    found.sort(key=lambda change: change.time.low)  # stable: two changes of one region at one instant keep their order
    return initial, tuple(found)


def _status(span: Span) -> Status:
    assert span.mark != "switch"
    return span.mark


def _turned(matrix: Floats, offset: Balls) -> Balls:
    """Return the (exact) matrix times vectors of polynomials. Shape (k, 3, n + 1)."""
    mid = np.einsum("ij,kjn->kin", matrix, offset.mid)
    rad = np.einsum("ij,kjn->kin", np.abs(matrix), offset.rad + gamma(4) * np.abs(offset.mid))
    return Balls(mid, rad * (1.0 + 2.0**-40) + 1e-290)


def _thresholds(region: Region, margin: Fraction) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return lower and upper float bounds of (1 - s d)^2 and of (1 + s d)^2; -1 stands for "never inside"."""
    spread = extent(Ellipsoid.of(region)).scale * margin
    within = (-1.0, -1.0) if spread >= 1 else _bracket((1 - spread) ** 2)
    return within, _bracket((1 + spread) ** 2)


def _bracket(value: Fraction) -> tuple[float, float]:
    number, error = nearest(value)
    if error == 0.0:
        return number, number
    return float(np.nextafter(number, -np.inf)), float(np.nextafter(number, np.inf))


@dataclass(frozen=True, eq=False, slots=True)
class _SegmentInRegion:
    """One segment of a path, seen from one region.

    Attributes:
        found: The team's membership polynomials.
        index: Of the segment, among all of the team's.
        column: Of the region.
    """

    found: MembershipPolynomials
    index: int
    column: int

    @property
    def segment(self) -> Segment:
        return self.found.paths.segments[self.index]

    @property
    def level(self) -> Balls:
        """Its membership polynomial, enclosed. Shape (15,)."""
        return self.found.values[self.index, self.column]

    @property
    def exact_level(self) -> fmpq_poly:
        """The same, exactly."""
        paths = self.found.paths
        return exact_level(paths, self.index, paths.mission.all_regions[self.found.regions[self.column]])


Leaf = tuple[float, float, Mark | None]
"""From one place of a segment to another, with its status; None where nothing could be proved."""

_CODES: tuple[Mark | None, ...] = ("no", "may", "must", None)


def _classified(table: Balls, inside: Floats, outside: Floats, depth: int) -> list[list[Leaf]]:
    """Sort polynomials into no, may and must, halving those that are not one of them throughout.

    Returns:
        For each row its leaves in order, neighbours with one status joined.
    """
    count = len(table.mid)
    if count == 0:
        return []
    rows, starts, width = np.arange(count), np.zeros(count), 1.0
    state = table
    leaves: list[tuple[Indices, Floats, Floats, Indices]] = []
    for level in range(depth + 1):
        low, high = state.low.min(-1), state.high.max(-1)
        no = low > outside[rows, 1]
        must = high <= inside[rows, 0]
        may = (low > inside[rows, 1]) & (high <= outside[rows, 0])
        done = no | must | may
        crowded = np.bincount(rows[~done], minlength=count)[rows] > MAX_OPEN
        ended = done | crowded if level < depth else np.ones_like(done)
        code = np.select([no, must, may], [0, 2, 1], 3)[ended]
        leaves.append((rows[ended], starts[ended], starts[ended] + width, code))
        keep = np.flatnonzero(~ended)
        if len(keep) == 0:
            break
        state = halves(state[keep])
        width /= 2
        rows = np.concatenate([rows[keep], rows[keep]])
        starts = np.concatenate([starts[keep], starts[keep] + width])
    row, start, stop, code = (np.concatenate([part[i] for part in leaves]) for i in range(4))
    order = np.lexsort((start, row))
    row, start, stop, code = row[order], start[order], stop[order], code[order]
    first = np.flatnonzero(np.concatenate([[True], (row[1:] != row[:-1]) | (code[1:] != code[:-1])]))
    last = np.append(first[1:], len(row)) - 1
    result: list[list[Leaf]] = [[] for _ in range(count)]
    columns = (row[first].tolist(), start[first].tolist(), stop[last].tolist(), code[first].tolist())
    for where, begin, end, kind in zip(*columns, strict=True):
        result[where].append((begin, end, _CODES[kind]))
    return result


def _without_margin(spans: list[Span], leaves: Sequence[Leaf], here: _SegmentInRegion) -> None:
    """Append the spans of one segment at margin 0, with each simple root as a switch."""
    segment, level = here.segment, here.level
    for position, (start, stop, mark) in enumerate(leaves):
        around = {leaves[i][2] for i in (position - 1, position + 1) if 0 <= i < len(leaves)}
        if mark is not None:
            _append(spans, segment.time(start), segment.time(stop), mark)
        elif around == {"no", "must"} and _is_monotone(level, start, stop):
            _append(spans, segment.time(start), segment.time(stop), "switch")
        elif segment.kind == "piece":
            _exactly(spans, start, stop, here)
        else:
            _append(spans, segment.time(start), segment.time(stop), "may")


def _is_monotone(level: Balls, start: float, stop: float) -> bool:
    """Prove that a polynomial strictly rises or falls on a (dyadic) part of [0, 1]."""
    mid = np.diff(level.mid)
    slope = Balls(mid, (level.rad[1:] + level.rad[:-1] + 2.0**-53 * np.abs(mid)) * (1 + 2.0**-40) + 1e-290)
    state, left, width = slope[None], 0.0, 1.0
    while True:  # walk down to a part that holds [start, stop] and on which the slope has one sign
        if np.all(state.low > 0) or np.all(state.high < 0):
            return True
        middle = left + width / 2
        if start < middle < stop or width <= stop - start:
            return False
        both = halves(state)
        if stop <= middle:
            state = both[:1]
        else:
            state, left = both[1:], middle
        width /= 2


def _exactly(spans: list[Span], start: float, stop: float, here: _SegmentInRegion) -> None:
    """Decide a part of a piece that balls leave open, with exact roots: ties, tangencies, roots close together."""
    segment, level = here.segment, here.exact_level - 1
    low, high = Fraction(start), Fraction(stop)

    def mark_at(place: Fraction) -> Mark:
        return "must" if level(exact.rational(place)) <= 0 else "no"

    if level.degree() < 1:  # constant: on the boundary or on one side throughout
        _append(spans, segment.time(low), segment.time(high), "may" if level == 0 else mark_at(low))  # pyright: ignore[reportUnnecessaryComparison]  # flint's polynomials compare with numbers
        return
    place = low
    for root in exact.roots(level, low, high, (high - low) / 16):
        if place < root.low:
            _append(spans, segment.time(place), segment.time(root.low), mark_at((place + root.low) / 2))
        simple = root.multiplicity == 1 and low < root.low and root.high < high
        _append(spans, segment.time(root.low), segment.time(root.high), "switch" if simple else "may")
        place = root.high
    if place < high:
        _append(spans, segment.time(place), segment.time(high), mark_at((place + high) / 2))


def exact_level(paths: TeamPaths, index: int, region: Region) -> fmpq_poly:
    """Return q of one segment and region as an exact polynomial in u, from 0 to 1.

    Args:
        paths: The team.
        index: Of the segment, among all of the team's.
        region: The region; q is at most 1 in it.
    """
    offset = [p - exact.rational(c) for p, c in zip(paths.exact_position(index), region.center, strict=True)]
    matrix = region.quadratic
    total = fmpq_poly([0])
    for i in range(3):
        for j in range(3):
            total += offset[i] * offset[j] * exact.rational(matrix[i][j])
    return total


def _append(spans: list[Span], start: Fraction, stop: Fraction, mark: Mark) -> None:
    if spans and spans[-1].mark == mark != "switch":
        spans[-1] = Span(spans[-1].start, stop, mark)
    else:
        spans.append(Span(start, stop, mark))


def _settled(spans: list[Span]) -> tuple[Span, ...]:
    """Turn switches that do not part "no" from "must" into "may", and part the two where nothing does."""
    result: list[Span] = []
    for index, span in enumerate(spans):
        mark = span.mark
        if mark == "switch":
            around = {spans[i].mark for i in (index - 1, index + 1) if 0 <= i < len(spans)}
            mark = "switch" if around == {"no", "must"} else "may"
        if result and {result[-1].mark, mark} == {"no", "must"}:
            _append(result, span.start, span.start, "may")
        _append(result, span.start, span.stop, mark)
    return tuple(result)
