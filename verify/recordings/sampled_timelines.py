"""What samples of one path prove of its labels at all times, given a bound on the speed.

Between two samples the robot stays in an ellipsoid of revolution around their chord: the sum of its distances to both
ends is at most what it can fly in the meantime. Near each sample it stays in a ball that grows with time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.behaviour.timeline import Change, Enclosure, Status, Timeline
from verify.data.shapes.region import Region
from verify.motion.regions import Ellipsoid, extent
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
    scale = float(extent(Ellipsoid.of(region)).scale) * (1 + _SLACK)  # moving by d changes sqrt(q) by at most scale d
    centre, matrix = np.array(region.center), region.shape
    offset = positions - centre
    turned = offset @ matrix
    level = np.maximum(np.einsum("ij,ij->i", turned, offset), 0.0)
    size = np.einsum("ij,jk,ik->i", np.abs(offset), np.abs(matrix), np.abs(offset))
    if len(times) == 1:
        return [(0.0, _at_sample(level[0], size[0], scale * error))]
    step = np.diff(positions, axis=0)
    gap = longest_gaps(times)
    length = np.maximum(speed * gap + 2 * error, np.linalg.norm(step, axis=1)) * (1 + _SLACK)
    wide = np.sqrt(np.maximum(length**2 - np.einsum("ij,ij->i", step, step), 0.0) / 4 + 1e-14 * length**2)
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
    # for how long after (or before) each sample the ball is inside, or outside, for sure
    held_in = ((1 - root_high) / scale - error) / speed * (1 - 1e-9)
    held_out = ((root_low - 1) / scale - error) / speed * (1 - 1e-9)
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


def _at_sample(level: float, size: float, reach: float) -> Status:
    slack = 16 * _SLACK * (1 + size)
    if reach < 1 and level + slack <= (1 - reach) ** 2:
        return "must"
    return "no" if level - slack > (1 + reach) ** 2 else "may"
