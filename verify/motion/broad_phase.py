"""Broad phase: parts of two robots' flights that can hold their nearest approach. Distances are computed of these alone.

Every segment is cut into `PARTS` parts of equal time, and each part put into a box: a polynomial lies between the least and the
greatest of its Bernstein coefficients, errors included. While both robots are on certain parts they are no nearer than the gap
between the boxes, and no further apart than the boxes' far corners. So a pair's least distance is at most the least of these far
distances, and where two boxes are further apart than that the pair's nearest approach, or any breach of what it keeps at its nearest
approach, cannot be. Nothing else is left out, and nothing is sampled: what is left out is further apart for all of its times.

Parts are compared by the order of their exact times. Boxes and their gaps are rounded outwards; sums of squares are off by a few
roundings, for which `_SLACK` is far more than enough.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Floats, halves
from verify.motion.paths import TeamPaths

PARTS = 16
"""Parts of a segment; a power of two."""

_SLACK = 1e-9
"""Relative; the roundings of a few operations on numbers that are not negative are below 1e-15 each."""

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Lane:
    """One robot's flight without its steps, in boxes.

    Attributes:
        segments: Index of the segment that each part is of. Shape (parts,).
        knots: Ranks of the times at which parts begin, and of the end, among the whole team's. Shape (parts + 1,).
        low: Least x, y, weighted z of each part, in m. Shape (parts, 3).
        high: Greatest ones. Shape (parts, 3).
    """

    segments: Indices
    knots: Indices
    low: Floats
    high: Floats


def lanes_in_boxes(paths: TeamPaths, weight: Fraction) -> list[Lane]:
    """Put every robot's flight into boxes.

    Args:
        paths: The team.
        weight: By which distances in z are multiplied.
    """
    state = paths.positions
    count = len(paths.segments)
    parts = 1
    while parts < PARTS:  # lefts come first, so that part p of segment s is at [bits of p reversed] * count + s
        state, parts = halves(state), parts * 2
    order = np.array([_reversed_bits(p, parts) for p in range(parts)])
    low = state.low.min(-1).reshape(parts, count, 3)[order].transpose(1, 0, 2)  # (segments, parts, 3)
    high = state.high.max(-1).reshape(parts, count, 3)[order].transpose(1, 0, 2)
    up, down = np.nextafter(float(weight), np.inf), np.nextafter(float(weight), -np.inf)
    low[..., 2] = np.nextafter(np.where(low[..., 2] > 0, low[..., 2] * down, low[..., 2] * up), -np.inf)
    high[..., 2] = np.nextafter(np.where(high[..., 2] > 0, high[..., 2] * up, high[..., 2] * down), np.inf)
    lanes = [
        np.array([i for i in np.flatnonzero(paths.owner == robot) if paths.segments[i].kind != "step"], dtype=np.intp)
        for robot in range(len(paths.robots))
    ]
    ranks = _ranks(paths, lanes, parts)
    return [
        Lane(np.repeat(own, parts), knots, low[own].reshape(-1, 3), high[own].reshape(-1, 3))
        for own, knots in zip(lanes, ranks, strict=True)
    ]


def _ranks(paths: TeamPaths, lanes: Sequence[Indices], parts: int) -> list[Indices]:
    """Return the ranks of the times at which parts begin, and of the end: exact, for times are whole numbers of one small unit."""
    unit = math.lcm(*(time.denominator for s in paths.segments for time in (s.start, s.stop)), paths.end.denominator) * parts

    def whole(time: Fraction) -> int:
        return time.numerator * (unit // time.denominator)

    times: list[int] = []
    for own in lanes:
        for segment in (paths.segments[i] for i in own):
            start, stop = whole(segment.start), whole(segment.stop)
            times.extend(start + (stop - start) // parts * part for part in range(parts))
        times.append(whole(paths.end))
    rank = {time: i for i, time in enumerate(sorted(set(times)))}
    found = np.fromiter(map(rank.__getitem__, times), dtype=np.intp, count=len(times))
    return np.split(found, np.cumsum([len(own) * parts + 1 for own in lanes])[:-1])


def _reversed_bits(number: int, parts: int) -> int:
    found = 0
    while parts > 1:
        found, number, parts = found * 2 + number % 2, number // 2, parts // 2
    return found


@np.errstate(all="ignore")
def near_segments(first: Lane, second: Lane) -> Iterator[tuple[int, int]]:
    """Yield pairs of segments, in order of time, on which two robots can come as near to each other as they ever do.

    Args:
        first: One robot's flight.
        second: The other's, over the same time.
    """
    starts = np.sort(np.concatenate([first.knots[:-1], second.knots[:-1]]))
    a = np.searchsorted(first.knots, starts, side="right") - 1
    b = np.searchsorted(second.knots, starts, side="right") - 1
    gap = np.maximum(np.nextafter(np.maximum(first.low[a] - second.high[b], second.low[b] - first.high[a]), -np.inf), 0.0)
    span = np.nextafter(np.maximum(first.high[a] - second.low[b], second.high[b] - first.low[a]), np.inf)
    near, far = (gap * gap).sum(-1), (span * span).sum(-1)
    least = np.min(far[np.isfinite(far)], initial=np.inf)
    kept = np.flatnonzero(~(near * (1 - _SLACK) > least * (1 + _SLACK)))  # what is not known is kept
    before: tuple[int, int] | None = None
    for pair in zip(first.segments[a[kept]].tolist(), second.segments[b[kept]].tolist(), strict=True):
        if pair != before:
            yield pair
        before = pair
