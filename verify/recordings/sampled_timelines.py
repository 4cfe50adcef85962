"""Labels of a path at all times, proved from its samples and a bound on the speed.

Between two samples the robot stays in an ellipsoid of revolution around their chord: the sum of its distances to both
ends is at most what it can fly in the meantime. Near each sample it stays in a ball that grows with time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.data.shapes.conditions import HalfSpace, Quadric
from verify.data.shapes.region import Region
from verify.model_checking.timeline import Change, Enclosure, Status, Timeline
from verify.motion.membership.bodies import Body, Mark
from verify.recordings.measurement import longest_gaps

Floats = NDArray[np.float64]

_SLACK = 1e-12
"""Relative; the floats used here err by less than 100 units of 2^-53, so a status beyond this slack is proved."""


def sampled_timeline(
    robot: str, times: Floats, positions: Floats, regions: Mapping[str, Region], *, speed: float, error: float = 0.0
) -> Timeline:
    """Return what samples prove of one robot's labels at all times.

    Args:
        robot: Name.
        times: s, from 0, strictly increasing. Shape (n,).
        positions: m. Shape (n, 3).
        regions: By name.
        speed: Bound on the speed, m/s.
        error: Bound on the measurement error, m.
    """
    initial: dict[str, Status] = {}
    found: list[Change] = []
    for name, region in regions.items():
        row = _statuses(times, positions, region, speed, error)
        initial[name] = row[0][1]
        status = row[0][1]
        for time, following in row[1:]:
            instant = Enclosure(Fraction(time), Fraction(time))
            if {status, following} == {"no", "must"}:  # an interval of may of no length: crossed in between, in any way
                found.append(Change(instant, name, "may"))
            found.append(Change(instant, name, following))
            status = following
    found.sort(key=lambda change: change.time.low)
    return Timeline(robot, initial, tuple(found), Fraction(float(times[-1])))


def _statuses(times: Floats, positions: Floats, region: Region, speed: float, error: float) -> list[tuple[float, Status]]:
    """Return (from when, status), statuses alternating, for one robot and region.

    A status holds for a whole gap if it does in the whole ellipsoid of revolution, which lies within `wide` of the
    chord; it holds near a sample for as long as the ball that the robot can have reached stays clear of the boundary.
    """
    body = Body.of(region)
    if len(times) == 1:
        marks: list[Mark] = [_at_sample(body, k, positions, error) for k in range(len(body.conditions))]
        return [(0.0, body.status(marks))]
    step = np.diff(positions, axis=0)
    gap = longest_gaps(times)
    length = np.maximum(speed * gap + 2 * error, np.linalg.norm(step, axis=1)) * (1 + _SLACK)
    wide = np.sqrt(np.maximum(length**2 - np.einsum("ij,ij->i", step, step), 0.0) / 4 + 1e-14 * length**2)
    seen = [_seen(body, k, positions, wide) for k in range(len(body.conditions))]
    inside = np.logical_or.reduce([np.logical_and.reduce([seen[k].inside for k in cover]) for cover in body.covers])
    outside = np.logical_and.reduce([np.logical_or.reduce([seen[k].outside for k in part]) for part in body.parts])
    deep = np.maximum.reduce([np.minimum.reduce([seen[k].deep for k in cover]) for cover in body.covers])
    far = np.minimum.reduce([np.maximum.reduce([seen[k].far for k in part]) for part in body.parts])
    # for how long after (or before) each sample the ball is inside, or outside, for sure
    held_in = (deep - error) / speed * (1 - 1e-9)
    held_out = (far - error) / speed * (1 - 1e-9)
    shrink = np.diff(times) / gap  # the clock that was set to 0 may run slow by that much within a gap
    row: list[tuple[float, Status]] = []

    def add(time: float, status: Status) -> None:
        if not row or row[-1][1] != status:
            row.append((time, status))

    for k in range(len(gap)):
        start, stop = float(times[k]), float(times[k + 1])
        if inside[k] or outside[k]:
            add(start, "must" if inside[k] else "no")
            continue
        first, until = _near(held_in[k], held_out[k])
        last, since = _near(held_in[k + 1], held_out[k + 1])
        if first != "may":
            add(start, first)
        left = math.nextafter(start + until * shrink[k], -math.inf)
        right = math.nextafter(stop - since * shrink[k], math.inf)
        if left < right or first != last:
            add(max(min(left, stop), start) if first != "may" else start, "may")
        if last != "may":
            add(min(max(right, left, start), stop), last)
    return row


def _near(held_in: float, held_out: float) -> tuple[Status, float]:
    if held_in > 0:
        return "must", held_in
    return ("no", held_out) if held_out > 0 else ("may", 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class _Seen:
    """Facts about one inequality that samples prove.

    Attributes:
        inside: Whether it is kept in the whole of each gap.
        outside: Whether it is broken in the whole of each gap.
        deep: How far inside each sample is at least, m; below zero where that is not known.
        far: How far outside each sample is at least, m, likewise.
    """

    inside: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    deep: Floats
    far: Floats


def _seen(body: Body, k: int, positions: Floats, wide: Floats) -> _Seen:
    """Return what samples, and gaps whose ellipsoids are so wide, prove of one of a region's inequalities."""
    one = body.conditions[k]
    if isinstance(one, HalfSpace):
        values, slack, size = _along(body, k, positions)
        deep, far = (-values - slack) / size, (values - slack) / size
        inside = np.minimum(deep[:-1], deep[1:]) >= wide * (1 + _SLACK)
        outside = np.minimum(far[:-1], far[1:]) > wide * (1 + _SLACK)
        return _Seen(inside, outside, deep, far)
    level, size, scale, offset, matrix = _form(body, k, positions)
    turned, step = offset @ matrix, np.diff(positions, axis=0)
    reach = scale * wide * (1 + _SLACK)
    slack = _SLACK * (1 + np.maximum(size[:-1], size[1:])) * 16
    bend = np.einsum("ij,jk,ik->i", step, matrix, step)
    slope = 2 * np.einsum("ij,ij->i", turned[:-1], step)
    place = np.clip(np.divide(-slope, 2 * bend, out=np.zeros_like(slope), where=bend > 0), 0.0, 1.0)
    lowest = np.minimum.reduce([level[:-1], level[1:], level[:-1] + place * (slope + place * bend)])
    highest = np.maximum(level[:-1], level[1:])
    inside = (reach < 1) & (highest + slack <= (1 - reach) ** 2 * (1 - _SLACK))
    outside = lowest - slack > (1 + reach) ** 2 * (1 + _SLACK)
    root_low, root_high = np.sqrt(np.maximum(level - 16 * _SLACK * (1 + size), 0.0)), np.sqrt(level + 16 * _SLACK * (1 + size))
    return _Seen(inside, outside, (1 - root_high) / scale, (root_low - 1) / scale)


def _along(body: Body, k: int, positions: Floats) -> tuple[Floats, Floats, float]:
    """Return of a half-space normal . (r - c) - bound, what rounding may be off, and an upper bound of the normal's length."""
    one = body.conditions[k]
    assert isinstance(one, HalfSpace)
    normal, bound = np.array(body.inequalities[k].linear), body.inequalities[k].bound
    offset = positions - np.array(body.centre)
    slack = 16 * _SLACK * (np.abs(offset) @ np.abs(normal) + abs(bound))
    return offset @ normal - bound, slack, float(one.length) * (1 + _SLACK)


def _form(body: Body, k: int, positions: Floats) -> tuple[Floats, Floats, float, Floats, Floats]:
    """Return of a quadric its form, 1 on the surface; the sum of its terms' sizes; by how much its root changes a metre; offsets; matrix."""
    one = body.conditions[k]
    assert isinstance(one, Quadric)
    square = float(one.square)
    centre = np.array([float(Fraction(c) + own) for c, own in zip(body.centre, one.centre, strict=True)])
    matrix = np.array(body.inequalities[k].quadratic) / square
    scale = float(one.scale) / math.sqrt(square) * (1 + _SLACK)  # moving by d changes the root by at most scale d
    offset = positions - centre
    level = np.maximum(np.einsum("ij,ij->i", offset @ matrix, offset), 0.0)
    size = np.einsum("ij,jk,ik->i", np.abs(offset), np.abs(matrix), np.abs(offset))
    if any(one.centre):  # which is rounded where it is added
        size = size + (scale * float(np.linalg.norm(centre))) ** 2
    return level, size, scale, offset, matrix


def _at_sample(body: Body, k: int, positions: Floats, error: float) -> Status:
    """Return what one sample, known within an error, proves of one of a region's inequalities."""
    if isinstance(body.conditions[k], HalfSpace):
        values, slack, size = _along(body, k, positions)
        reach = size * error * (1 + _SLACK)
        if values[0] + slack[0] + reach <= 0:
            return "must"
        return "no" if values[0] - slack[0] - reach > 0 else "may"
    level, size, scale, _, _ = _form(body, k, positions)
    slack, reach = 16 * _SLACK * (1 + size[0]), scale * error
    if reach < 1 and level[0] + slack <= (1 - reach) ** 2:
        return "must"
    return "no" if level[0] - slack > (1 + reach) ** 2 else "may"
