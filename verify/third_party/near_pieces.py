"""Pairs of pieces that can hold a violation or the least distance of all: the rest is proved to be apart and left out.

Time is cut into short slices. During a slice of length w a drone is within V w / 2 of where it is at the slice's middle, V a bound on its
speed then (the greatest control point of its velocity), and within A w^2 / 8 + J w / 2 of the line that it would go on with its velocity
at the middle, A a bound on its acceleration and J on what its velocity jumps by where pieces join. A k-d tree over the middles gives the pairs whose balls
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

from verify.arithmetic.balls import Balls, Floats
from verify.data.errors import BadInput
from verify.third_party.distances import NEAR, Closest, Separation
from verify.third_party.fleet import Fleet, Indices, is_before, length_between
from verify.third_party.windows import Windows, high_drones

FEW = 6
"""Drones up to which no pair of pieces is left out."""

BLOCK = 65_536
"""Pieces that are looked at at once, which bounds the memory."""

MOST_PAIRS = 20_000_000
"""Pairs of drones that are near at one time; with more, a separation is asked that nobody could mean."""

LONGEST = 2.0
"""s of a stretch of time that is cut into slices of one length."""
MOST_STRETCHES = 10_000
"""Such stretches; of longer flights each is longer. None is shorter than a hundredth of that."""
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
    longest = max(LONGEST, float(knots[-1]) / MOST_STRETCHES)
    for knot in knots[1:].tolist():
        if knot - edges[-1] >= longest / 100:
            parts = int(np.ceil((knot - edges[-1]) / longest))
            edges += np.linspace(edges[-1], knot, parts + 1)[1:].tolist()
    if len(edges) > 1 and knots[-1] - edges[-1] < longest / 100:
        edges[-1] = float(knots[-1])
    elif edges[-1] != knots[-1]:
        edges.append(float(knots[-1]))
    return np.array(edges)


@dataclass(frozen=True, eq=False)
class _Search:
    """Bounds on all pieces, computed before the sweep through time.

    Attributes:
        fleet: The drones.
        reach: What pairs must keep at the most, steps between pieces allowed for, in m.
        weights: By which x, y and z are multiplied. Shape (3,).
        speeds: Bound on each piece's speed, so weighted, in m/s. Shape (rows + 1,).
        accelerations: Bound on its acceleration, in m/s^2. Shape (rows + 1,).
        turns: Bound on how far velocity jumps where a piece begins, in m/s. Shape (rows + 1,).
        keys: Start of each piece in s, moved by `span` for each drone, so that all are in order. Shape (rows,).
        span: s; longer than the flights.
        starts: When each piece begins, up to rounding, in s. Shape (rows,).
        stops: When it ends. Shape (rows,).
        late: What such a key can be off by, in s.
        slack: Of each drone: the longest step between its pieces and the rounding of its positions, in m. Shape (drones,).
        above: Drones that are lower are left out, in m; None where none is.
        windows: When pieces are compared with others.
    """

    fleet: Fleet
    reach: float
    weights: Floats
    speeds: Floats
    accelerations: Floats
    turns: Floats
    keys: Floats
    span: float
    starts: Floats
    stops: Floats
    late: float
    slack: Floats
    above: float | None
    windows: Windows

    @classmethod
    def of(cls, fleet: Fleet, asked: Separation) -> _Search:
        weights = np.array([1.0, 1.0, float(asked.weight)])
        rows = len(fleet.values)
        speeds, accelerations, turns, sizes = (np.zeros(rows + 1) for _ in range(4))
        for low in range(0, rows, BLOCK):
            part = np.arange(low, min(low + BLOCK, rows))
            speeds[part], accelerations[part], sizes[part] = (_most(fleet.derivative(part, k), weights) for k in (1, 2, 0))
            part = np.arange(max(low - 1, 0), part[-1] + 1)
            velocity = fleet.derivative(part, 1)
            turns[part[1:]] = _most(velocity[1:, :, :1] - velocity[:-1, :, -1:], weights)
        starts = fleet.knots[fleet.knot, 0]
        span = float(fleet.knots[-1, 0]) + 16.0
        keys = starts + fleet.owner * span
        late = 4 * float(np.spacing(keys[-1] + span)) + _SLACK
        rounding = _SLACK + 1e-12 * np.maximum.reduceat(sizes[:-1], fleet.first[:-1])
        reach = asked.most + 2 * float(asked.steps.max(initial=0.0))
        return cls(
            fleet,
            reach,
            weights,
            speeds,
            accelerations,
            turns,
            keys,
            span,
            starts,
            fleet.knots[fleet.knot + 1, 0],
            late,
            asked.steps * 2 + rounding,
            asked.above,
            asked.on(fleet),
        )

    def rows_at(self, time: float) -> Indices:
        """Return the piece of each drone at a time, up to `late`. Shape (drones,)."""
        drones = np.arange(len(self.fleet))
        found = np.searchsorted(self.keys, time + drones * self.span, side="right") - 1
        return np.clip(found, self.fleet.first[:-1], self.fleet.first[1:] - 1)

    @np.errstate(all="ignore")
    def during(self, start: float, stop: float, closest: Closest) -> NDArray[np.int64]:
        """Return pairs of pieces that may matter between two times, each as one number, in order."""
        late = self.late
        inner = self.rows_at(start + 2 * late), self.rows_at(stop - 2 * late)
        single = inner[0] == inner[1]
        if not np.isfinite(closest.high) and self.above is None:
            self._note(KDTree(points := self._state(inner[0], start)[0]), points, start, closest)
        speed = np.sort(_most_between(self.speeds, self.rows_at(start - 2 * late), self.rows_at(stop + 2 * late)))
        usual = float(speed[int(0.98 * (len(speed) - 1))])
        goal = max(self.reach, closest.high if np.isfinite(closest.high) else 0.0, 1e-3)
        most = max(min(FINEST, int((stop - start) / (32 * late))), 1)  # a slice is longer than what its edges are widened by
        parts = int(np.clip(np.ceil((stop - start) * usual / goal), 1, most))
        width = (stop - start) / parts
        found: list[NDArray[np.int64]] = []
        for part in range(parts):
            begin, end = start + part * width, start + (part + 1) * width
            lone = single if 0 < part < parts - 1 else np.zeros_like(single)
            found.append(self._slice(begin, end, (inner[0], lone), closest, first=part == 0))
        return np.unique(np.concatenate(found))

    def _slice(
        self, begin: float, end: float, known: tuple[Indices, NDArray[np.bool_]], closest: Closest, *, first: bool
    ) -> NDArray[np.int64]:
        """Return pairs of pieces that may matter during one slice; `known` has pieces, and of which drones they last for all of it."""
        late, half, middle = self.late, (end - begin) / 2 + 3 * self.late, (begin + end) / 2
        low, high, rows = known[0], known[0], known[0]
        if not known[1].all():
            low, high, rows = self.rows_at(begin - 2 * late), self.rows_at(end + 2 * late), self.rows_at(middle)
        if self.above is not None:
            high_enough = high_drones(self.windows, self.above, low, high)
            if len(high_enough) < 2:
                return np.empty(0, dtype=np.int64)
            low, high, rows = low[high_enough], high[high_enough], rows[high_enough]
        slack = self.slack[self.fleet.owner[rows]]
        points, velocities = self._state(rows, middle)
        speed = _most_between(self.speeds, low, high)
        radius = speed * half + slack
        turning = (high - low) * _most_between(self.turns, np.minimum(low + 1, high), high)
        bend = _most_between(self.accelerations, low, high) * half * half / 2 + turning * half + 8 * late * speed + slack
        bend += 1e-3 * slack * self.fleet.degree / (self.stops[rows] - self.starts[rows]) * half  # the velocity's rounding
        tree = KDTree(points)
        if first and self.above is None:
            self._note(tree, points, middle, closest)
        goal = max(self.reach, closest.high)
        if not np.isfinite(
            goal
        ):  # nothing is known of drones that are high enough: what is farther apart than is asked is left out
            goal = self.reach
            closest.low = min(closest.low, goal)
        one, other = self._pairs(tree, points, radius, goal, middle)
        offset, drift = points[one] - points[other], velocities[one] - velocities[other]
        along = -_dot(offset, drift) / _dot(drift, drift)
        along = np.clip(np.where(np.isnan(along), 0.0, along), -half, half)
        offset += along[:, None] * drift
        least = np.sqrt(_dot(offset, offset)) * (1 - _SLACK) - bend[one] - bend[other]
        apart = (least >= self.reach) & (least >= closest.high - NEAR)  # what is not known is kept
        if apart.any():
            closest.low = min(closest.low, float(least[apart].min()))
        one, other = one[~apart], other[~apart]
        return self._codes((low[one], high[one]), (low[other], high[other]), (begin, end))

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
        swift = np.flatnonzero(~(radius <= 2 * goal))
        slow = np.flatnonzero(radius <= 2 * goal) if len(swift) else np.arange(len(points))
        tree = KDTree(points[slow]) if len(swift) else tree
        reach = (goal + 2 * float(radius[slow].max(initial=0.0))) * (1 + _SLACK)
        if len(slow) > 4000 and tree.count_neighbors(tree, reach) > 2 * MOST_PAIRS:
            raise BadInput(
                f"{self.fleet.source}: at {time:.2f} s more than {MOST_PAIRS // 1_000_000} million pairs of drones are within "
                f"{reach:.4g} m of each other; ask for a smaller separation than {self.reach:g} m."
            )
        pairs = slow[tree.query_pairs(reach, output_type="ndarray")]
        one, other = [pairs[:, 0]], [pairs[:, 1]]
        for drone in swift.tolist():  # few: each is compared with all
            rest = np.setdiff1d(np.arange(len(points)), swift[swift <= drone])
            one.append(np.full(len(rest), drone, dtype=np.intp))
            other.append(rest)
        first, second = np.concatenate(one), np.concatenate(other)
        offset = points[first] - points[second]
        gap = np.sqrt(_dot(offset, offset)) * (1 - _SLACK) - radius[first] - radius[second]
        near = ~(gap > goal)
        return first[near], second[near]

    def _codes(
        self, one: tuple[Indices, Indices], other: tuple[Indices, Indices], during: tuple[float, float]
    ) -> NDArray[np.int64]:
        """Return pairs of pieces, from first to last of either drone, that share some time in the slice.

        What only touches the slice's edge, and lasts longer than that, is left to the slice beyond, whose bounds reach over the edge.
        """
        late, knots, starts, stops = self.late, self.fleet.knots, self.starts, self.stops
        found: list[NDArray[np.int64]] = []
        for i in range(int((one[1] - one[0]).max(initial=0)) + 1):
            for j in range(int((other[1] - other[0]).max(initial=0)) + 1):
                both = (one[0] + i <= one[1]) & (other[0] + j <= other[1])
                a, b = (one[0] + i)[both], (other[0] + j)[both]
                start, stop = np.maximum(starts[a], starts[b]), np.minimum(stops[a], stops[b])
                kept = (stop - start >= 8 * late) & (stop > during[0] + 3 * late) & (start < during[1] - 3 * late)
                short = np.flatnonzero(np.abs(stop - start) < 8 * late)
                first, second = self.fleet.knot[a[short]], self.fleet.knot[b[short]]
                kept[short] = is_before(knots[first], knots[second + 1]) & is_before(knots[second], knots[first + 1])
                low, high = np.minimum(a, b)[kept].astype(np.int64), np.maximum(a, b)[kept].astype(np.int64)
                found.append(low * len(self.fleet.values) + high)
        return np.concatenate(found)


def _dot(a: Floats, b: Floats) -> Floats:
    """Return the inner products of rows. Shape (k,)."""
    return np.einsum("ij,ij->i", a, b)


def _most(table: Balls, weights: Floats) -> Floats:
    """Bound the length of weighted vectors of polynomials. Shape (rows, 3, degree + 1) to (rows,)."""
    size = (np.abs(table.mid) + table.rad) * weights[:, None]
    return np.sqrt((size * size).sum(1)).max(-1) * (1 + 1e-12)


def _most_between(values: Floats, first: Indices, last: Indices) -> Floats:
    """Return the greatest of values from each first to each last index, both included. Shape (k,)."""
    if (last - first).max() <= 1:
        return np.maximum(values[first], values[last])
    return np.maximum.reduceat(values, np.stack([first, last + 1], -1).ravel())[::2]
