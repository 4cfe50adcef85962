"""Which pieces of two drones can hold a breach or the least distance of all: the rest is proved to be apart and left out.

Time is cut into short slices. During a slice of length w a drone is within V w / 2 of where it is at the slice's middle, V a bound on its
speed then (the greatest control point of its velocity), and where one piece lasts for the whole slice, within A w^2 / 8 of the line
that it would go on with its velocity at the middle, A a bound on its acceleration. A k-d tree over the middles gives the pairs whose balls
can come within the distance that matters, and of those the lines tell which do: the least distance of two points that go along lines is
that of a segment from a point. What is left out is farther apart for all of its times.

The distance that matters is what is asked or, where that is more, the least distance that was met so far: so the least distance of all is
found as well. All of this is in floats; the slack of `_SLACK` m and parts covers their rounding by far, as coordinates and times
are at most 1e6 (sums of a few terms are off by some 1e-16 of those), and times are widened by what two floats for one time can lose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from verify.arithmetic.balls import Floats
from verify.data.errors import BadInput
from verify.foreign.distances import NEAR, Closest, Separation
from verify.foreign.fleet import Fleet, Indices, length_between

FEW = 6
"""Drones up to which no pair of pieces is left out."""

BLOCK = 65_536
"""Pieces that are looked at at once, which bounds the memory."""

MOST_PAIRS = 20_000_000
"""Pairs of drones that are near at one time; with more, a separation is asked that nobody could mean."""

LONGEST = 2.0
"""s of a stretch of time that is cut into slices of one length."""
SHORTEST = 0.02
"""s of the shortest stretch."""
FINEST = 64
"""Slices of a stretch."""

_SLACK = 1e-9


def near_pieces(
    fleet: Fleet, asked: Separation, closest: Closest, told: Callable[[float], None] = lambda _: None
) -> Iterator[tuple[Indices, Indices]]:
    """Yield pairs of pieces, rows of the one and rows of the other, in blocks by time.

    Args:
        fleet: The drones.
        asked: What pairs must keep.
        closest: The least distance so far, which is brought up to date here and by who takes the blocks.
        told: Called with the share that is done.

    Raises:
        BadInput: The separation is so large that nearly all drones are too near to each other.
    """
    if len(fleet) <= FEW:
        yield from all_pieces(fleet)
        return
    search = _Search.of(fleet, asked)
    edges = _stretches(fleet)
    waiting: list[NDArray[np.int64]] = []
    count, before = 0, np.empty(0, dtype=np.int64)
    for index, (start, stop) in enumerate(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)):
        codes = search.during(start, stop, closest)
        waiting.append(np.setdiff1d(codes, before, assume_unique=True))
        before, count = codes, count + len(waiting[-1])
        if count >= BLOCK or index + 2 == len(edges):
            rows = len(fleet.values)
            found = np.concatenate(waiting)
            yield found // rows, found % rows
            waiting, count = [], 0
            told((index + 1) / (len(edges) - 1))


def all_pieces(fleet: Fleet) -> Iterator[tuple[Indices, Indices]]:
    """Yield all pairs of pieces of two drones that share some time: rows of the one, rows of the other.

    Args:
        fleet: The drones.
    """
    for one in range(len(fleet)):
        for other in range(one + 1, len(fleet)):
            pairs = list(_meeting(fleet, one, other))
            yield np.array([a for a, _ in pairs], dtype=np.intp), np.array([b for _, b in pairs], dtype=np.intp)


def _meeting(fleet: Fleet, one: int, other: int) -> Iterator[tuple[int, int]]:
    a, b = int(fleet.first[one]), int(fleet.first[other])
    while a < fleet.first[one + 1] and b < fleet.first[other + 1]:
        yield a, b
        ends = [tuple(fleet.knots[fleet.knot[row] + 1].tolist()) for row in (a, b)]
        a, b = a + (ends[0] <= ends[1]), b + (ends[1] <= ends[0])


def _stretches(fleet: Fleet) -> Floats:
    """Return times, from 0 to the end, that are near the knots of the drone that has most of them."""
    most = int(np.argmax(np.diff(fleet.first)))
    knots = fleet.knots[fleet.first[most] + most : fleet.first[most + 1] + most + 1, 0]
    edges = [0.0]
    for knot in knots[1:].tolist():
        if knot - edges[-1] >= SHORTEST:
            parts = int(np.ceil((knot - edges[-1]) / LONGEST))
            edges += np.linspace(edges[-1], knot, parts + 1)[1:].tolist()
    if edges[-1] != knots[-1]:
        edges.append(float(knots[-1]))
    return np.array(edges)


@dataclass(frozen=True, eq=False)
class _Search:
    """What is known of all pieces before time is gone through.

    Attributes:
        fleet: The drones.
        reach: What pairs must keep at the most, steps between pieces allowed for, in m.
        weights: By which x, y and z are multiplied. Shape (3,).
        speeds: Bound on each piece's speed, so weighted, in m/s. Shape (rows + 1,).
        accelerations: Bound on its acceleration, in m/s^2. Shape (rows + 1,).
        keys: Start of each piece in s, moved by `span` for each drone, so that all are in order. Shape (rows,).
        span: s; longer than the flights.
        late: What such a key can be off by, in s.
        slack: Of each drone: the longest step between its pieces and the rounding of its positions, in m. Shape (drones,).
    """

    fleet: Fleet
    reach: float
    weights: Floats
    speeds: Floats
    accelerations: Floats
    keys: Floats
    span: float
    late: float
    slack: Floats

    @classmethod
    def of(cls, fleet: Fleet, asked: Separation) -> _Search:
        weights = np.array([1.0, 1.0, float(asked.weight)])
        rows = len(fleet.values)
        speeds, accelerations, sizes = np.zeros(rows + 1), np.zeros(rows + 1), np.zeros(rows)
        for low in range(0, rows, BLOCK):
            part = np.arange(low, min(low + BLOCK, rows))
            speeds[part], accelerations[part], sizes[part] = (_most(fleet, part, order, weights) for order in (1, 2, 0))
        starts = fleet.knots[fleet.knot, 0]
        span = float(fleet.knots[-1, 0]) + 16.0
        keys = starts + fleet.owner * span
        late = 4 * float(np.spacing(keys[-1] + span)) + _SLACK
        rounding = _SLACK + 1e-12 * np.maximum.reduceat(sizes, fleet.first[:-1])
        reach = asked.most + 2 * float(asked.steps.max(initial=0.0))
        return cls(fleet, reach, weights, speeds, accelerations, keys, span, late, asked.steps * 2 + rounding)

    def rows_at(self, time: float) -> Indices:
        """Return the piece of each drone at a time, up to `late`. Shape (drones,)."""
        drones = np.arange(len(self.fleet))
        found = np.searchsorted(self.keys, time + drones * self.span, side="right") - 1
        return np.clip(found, self.fleet.first[:-1], self.fleet.first[1:] - 1)

    @np.errstate(all="ignore")
    def during(self, start: float, stop: float, closest: Closest) -> NDArray[np.int64]:
        """Return pairs of pieces that may matter between two times, each as one number, in order."""
        late = self.late
        wide = self.rows_at(start - 2 * late), self.rows_at(stop + 2 * late)
        inner = self.rows_at(start + 2 * late), self.rows_at(stop - 2 * late)
        single = inner[0] == inner[1]
        speed = _most_between(self.speeds, *wide)
        if not np.isfinite(closest.high):
            self._meet(start, inner[0], closest)
        goal = max(self.reach, closest.high)
        parts = int(np.clip(np.ceil((stop - start) * float(speed.max()) / max(goal, 1e-3)), 1, FINEST))
        width = (stop - start) / parts
        found: list[NDArray[np.int64]] = []
        for part in range(parts):
            middle = start + (part + 0.5) * width
            rows = np.where(single, inner[0], self.rows_at(middle)) if not single.all() else inner[0]
            points, velocities = self._state(rows, middle)
            half = width / 2 + 3 * late
            radius = speed * half + self.slack
            bend = np.where(single, self.accelerations[rows] * half * half / 2 + 8 * late * speed + self.slack, np.inf)
            tree = KDTree(points)
            if part == 0:
                self._note(tree, points, middle, closest)
            one, other = self._pairs(tree, points, radius, max(self.reach, closest.high), middle)
            offset, drift = points[one] - points[other], velocities[one] - velocities[other]
            along = -_dot(offset, drift) / _dot(drift, drift)
            along = np.clip(np.where(np.isnan(along), 0.0, along), -half, half)
            offset += along[:, None] * drift
            least = np.sqrt(_dot(offset, offset)) * (1 - _SLACK) - bend[one] - bend[other]
            apart = (least >= self.reach) & (least >= closest.high - NEAR)  # what is not known is kept
            if apart.any():
                closest.low = min(closest.low, float(least[apart].min()))
            one, other = one[~apart], other[~apart]
            both = single[one] & single[other]
            found.append(self._codes(rows[one[both]], rows[other[both]]))
            if not both.all():
                ends = self.rows_at(middle - half), self.rows_at(middle + half)
                found.append(self._all_codes(one[~both], other[~both], ends))
        return np.unique(np.concatenate(found))

    def _state(self, rows: Indices, time: float) -> tuple[Floats, Floats]:
        """Return weighted positions and velocities at a time. Shape (drones, 3) each."""
        control = self.fleet.positions(rows).mid * self.weights[:, None]
        starts, stops = self.fleet.knots[self.fleet.knot[rows]], self.fleet.knots[self.fleet.knot[rows] + 1]
        length = length_between(starts, stops)[0]
        place = np.clip(((time - starts[:, 0]) - starts[:, 1]) / length, 0.0, 1.0)[:, None, None]
        step = np.zeros_like(control[..., :1])
        while control.shape[-1] > 1:
            step = (control[..., 1:] - control[..., :-1]) if control.shape[-1] == 2 else step
            control = control[..., :-1] + place * (control[..., 1:] - control[..., :-1])
        return control[..., 0], step[..., 0] * (self.fleet.degree / length)[:, None]

    def _meet(self, time: float, rows: Indices, closest: Closest) -> None:
        points, _ = self._state(rows, time)
        self._note(KDTree(points), points, time, closest)

    def _note(self, tree: KDTree, points: Floats, time: float, closest: Closest) -> None:
        """Take note of the two drones that are nearest to each other at a time."""
        distances, neighbours = (np.asarray(part) for part in tree.query(points, k=2))
        drone = int(np.argmin(distances[:, 1]))
        high = float(distances[drone, 1]) * (1 + _SLACK) + 2 * float(self.slack.max())
        if high < closest.high:
            pair = sorted((drone, next(int(k) for k in neighbours[drone] if k != drone)))
            closest.high, closest.one, closest.other, closest.time = high, pair[0], pair[1], time

    def _pairs(self, tree: KDTree, points: Floats, radius: Floats, goal: float, time: float) -> tuple[Indices, Indices]:
        """Return drones whose balls come within `goal` of each other."""
        reach = (goal + 2 * float(radius.max())) * (1 + _SLACK)
        if len(points) > 4000 and tree.count_neighbors(tree, reach) > 2 * MOST_PAIRS:
            raise BadInput(
                f"{self.fleet.source}: at {time:.2f} s more than {MOST_PAIRS // 1_000_000} million pairs of drones are within "
                f"{reach:.4g} m of each other; ask for a smaller separation than {self.reach:g} m."
            )
        pairs = tree.query_pairs(reach, output_type="ndarray")
        one, other = pairs[:, 0], pairs[:, 1]
        offset = points[one] - points[other]
        gap = np.sqrt(_dot(offset, offset)) * (1 - _SLACK) - radius[one] - radius[other]
        near = ~(gap > goal)
        return one[near], other[near]

    def _codes(self, one: Indices, other: Indices) -> NDArray[np.int64]:
        low, high = np.minimum(one, other).astype(np.int64), np.maximum(one, other).astype(np.int64)
        return low * len(self.fleet.values) + high

    def _all_codes(self, one: Indices, other: Indices, ends: tuple[Indices, Indices]) -> NDArray[np.int64]:
        """Return pairs of all pieces that two drones may be on during a slice and that share some time."""
        begins, stops = self.fleet.knots[self.fleet.knot], self.fleet.knots[self.fleet.knot + 1]
        found: list[tuple[int, int]] = []
        for i, j in zip(one.tolist(), other.tolist(), strict=True):
            for a in range(int(ends[0][i]), int(ends[1][i]) + 1):
                for b in range(int(ends[0][j]), int(ends[1][j]) + 1):
                    if max(tuple(begins[a]), tuple(begins[b])) < min(tuple(stops[a]), tuple(stops[b])):
                        found.append((a, b))
        rows = np.array(found, dtype=np.intp).reshape(-1, 2)
        return self._codes(rows[:, 0], rows[:, 1])


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the inner products of rows. Shape (k,)."""
    return np.einsum("ij,ij->i", a, b)


def _most(fleet: Fleet, rows: Indices, order: int, weights: Floats) -> Floats:
    """Bound the length of a weighted derivative on pieces. Shape (rows,)."""
    table = fleet.derivative(rows, order)
    size = (np.abs(table.mid) + table.rad) * weights[:, None]
    return np.sqrt((size * size).sum(1)).max(-1) * (1 + 1e-12)


def _most_between(values: Floats, first: Indices, last: Indices) -> Floats:
    """Return the greatest of values from each first to each last index, both included. Shape (k,)."""
    return np.maximum.reduceat(values, np.stack([first, last + 1], -1).ravel())[::2]
