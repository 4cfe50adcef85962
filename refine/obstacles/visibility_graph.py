"""A roadmap of free space: points at which shortest ways turn, joined where the straight line between them is free.

This is a visibility graph (Lozano-Perez and Wesley, "An algorithm for planning collision-free paths among polyhedral obstacles",
Communications of the ACM 22, 1979) in three dimensions, over points on the edges of grown bodies. Solid bodies stop every way. Soft ones,
regions that some ways may enter and others not, are looked up for each question: every line knows which of them it enters.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from refine.obstacles.graph_vertices import Bends, Lines, bends, lines_beside
from refine.obstacles.inflated_bodies import InflatedBodies, InflatedBody
from refine.obstacles.path_shortcutting import straightened

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

_ALL_PAIRS = 500
"""Points up to which every two are looked at."""
_NEAREST = 40
"""Beyond that, so many around each."""
_FROM_A_PLACE = 120
"""Points to which a place is joined, the nearest ones; where it sees none of them, so many more."""
_FAR, _AROUND = 1.5, 3.0
"""A way is first looked for within so many times the straight distance, and so many m more."""
_BRIDGES = 200
"""Pairs of points, the nearest ones, by which parts of the roadmap that hang together by nothing are joined where they can be."""


@dataclass(frozen=True, eq=False, slots=True)
class Joints:
    """Lines between points, and the soft bodies that they enter.

    Attributes:
        first: Index of one end. Shape (n,).
        second: Index of the other. Shape (n,).
        lengths: m. Shape (n,).
        entering: Index of a line for each soft body that a line enters. Shape (entries,).
        entered: That body's index. Shape (entries,).
    """

    first: Integers
    second: Integers
    lengths: Floats
    entering: Integers
    entered: Integers


class Roadmap:
    """Free space between bodies in a box, as a graph.

    Attributes:
        low: Lower corner of the box, m. Shape (3,).
        high: Upper corner, m. Shape (3,).
        solids: What no way may enter.
        soft: What ways may enter where that is permitted, by name.
        heights: At which robots are at home, m. Shape (n,).
    """

    def __init__(
        self, low: Floats, high: Floats, solids: Sequence[InflatedBody], soft: Sequence[InflatedBody], heights: Floats
    ) -> None:
        """Take note of what is there; points and lines are laid out when a way is asked for.

        Args:
            low: Lower corner of the box, m. Shape (3,).
            high: Upper corner, m. Shape (3,).
            solids: What no way may enter.
            soft: What ways may enter where that is permitted, by name.
            heights: At which robots are at home, m. Shape (n,).
        """
        self.low, self.high, self.heights = low, high, heights
        self.solids, self.soft = InflatedBodies(solids), InflatedBodies(soft)
        self._graphs: dict[bytes, csr_matrix] = {}

    @cached_property
    def bends(self) -> Bends:
        """The points at which ways may turn."""
        lines = _joined([lines_beside(body) for body in (*self.solids.bodies, *self.soft.bodies)])
        return bends(lines, self.solids, self.low, self.high, self.heights)

    @cached_property
    def joints(self) -> Joints:
        """The lines between points."""
        points = self.bends.points
        count = len(points)
        if count < 2:
            return self._joints(np.zeros((0, 2), dtype=np.int64))
        if count <= _ALL_PAIRS:
            pairs = np.argwhere(np.triu(np.ones((count, count), dtype=np.bool_), 1))
        else:
            near = np.asarray(KDTree(points).query(points, k=_NEAREST + 1)[1])
            pairs = _each_once(np.repeat(np.arange(count), _NEAREST), near[:, 1:].ravel(), count)
        step = points[pairs[:, 1]] - points[pairs[:, 0]]
        ways = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
        turns = self.bends.turns(pairs[:, 0], ways) & self.bends.turns(pairs[:, 1], ways)
        joints = self._joints(pairs[turns])
        return self._joints(np.concatenate([pairs[turns], self._bridges(joints)]))

    def way(self, start: Floats, end: Floats, permitted: Collection[str] = (), *, room: float = 0.0) -> Floats | None:
        """Return a shortest way between two points, both included; None where there is none.

        Args:
            start: m. Shape (3,).
            end: m. Shape (3,).
            permitted: Soft bodies that it may enter.
            room: m by which corners are passed more widely, where there is so much room.

        Returns:
            m. Shape (points, 3).
        """
        if not self.holds(start) or not self.holds(end):
            return None
        stopping = self.stopping(permitted)
        if self.clear(np.stack([start, end]), stopping):
            return np.stack([start, end])
        count = len(self.bends)
        if not count:
            return None
        graph, to_end = _with_start(self._graph(stopping), self.reach(start, stopping)), self.reach(end, stopping)
        for limit in (_FAR * float(np.linalg.norm(end - start)) + _AROUND, np.inf):
            costs, before = dijkstra(graph, indices=count, return_predecessors=True, limit=limit)
            total = costs[:count] + to_end
            last = int(np.argmin(total))
            if total[last] <= limit and np.isfinite(total[last]):
                break
        else:
            return None
        indices = [last]
        while (index := int(before[indices[-1]])) != count:
            indices.append(index)
        turns = [self.bends.turn(index) for index in indices[::-1]]
        return straightened(start, turns, end, lambda starts, ends: self.free(starts, ends, stopping), room)

    def holds(self, point: Floats) -> bool:
        """Return whether a point is in the box and in no solid body. Shape (3,)."""
        inside = bool(np.all(point >= self.low) and np.all(point <= self.high))
        return inside and not self.solids.holding(point)

    def stopping(self, permitted: Collection[str]) -> Booleans:
        """Return which soft bodies stop a way that may enter some. Shape (bodies,)."""
        return np.array([name not in permitted for name in self.soft.names], dtype=np.bool_)

    def clear(self, points: Floats, stopping: Booleans) -> bool:
        """Return whether the straight lines from point to point enter nothing that stops them.

        Args:
            points: m. Shape (points, 3).
            stopping: Of the soft bodies. Shape (bodies,).
        """
        return bool(np.all(self.free(points[:-1], points[1:], stopping)))

    def free(self, starts: Floats, ends: Floats, stopping: Booleans) -> Booleans:
        """Return which straight lines enter nothing that stops them, and stay in the box.

        Args:
            starts: m. Shape (n, 3).
            ends: m. Shape (n, 3).
            stopping: Of the soft bodies. Shape (bodies,).
        """
        free = np.all((ends >= self.low) & (ends <= self.high) & (starts >= self.low) & (starts <= self.high), axis=1)
        free &= ~self.solids.meets(starts, ends)
        lines, bodies = self.soft.pairs(starts, ends)
        free[lines[stopping[bodies]]] = False
        return free

    def reach(self, place: Floats, stopping: Booleans) -> Floats:
        """Return how far each point is from a place on a free straight line, infinite where there is none. Shape (points,)."""
        offsets = self.bends.points - place
        distances = np.linalg.norm(offsets, axis=1)
        ways = offsets / np.maximum(distances[:, None], 1e-12)
        asked = np.flatnonzero(self.bends.turns(np.arange(len(distances)), ways) | (distances < 1e-6))
        found = np.full(len(distances), np.inf)
        asked = asked[np.argsort(distances[asked], kind="stable")]
        for begin in range(0, len(asked), _FROM_A_PLACE):
            near = asked[begin : begin + _FROM_A_PLACE]
            free = self.free(np.broadcast_to(place, (len(near), 3)), self.bends.points[near], stopping)
            found[near[free]] = distances[near[free]]
            if np.any(free):
                break
        return found

    def distances(self, place: Floats, permitted: Collection[str] = ()) -> Floats:
        """Return how long the shortest way from a place to each point is, m; infinite where there is none. Shape (points,)."""
        stopping = self.stopping(permitted)
        if not len(self.bends) or not self.holds(place):
            return np.full(len(self.bends), np.inf)
        graph = _with_start(self._shut(stopping), self.reach(place, stopping))
        return np.asarray(dijkstra(graph, indices=len(self.bends)), dtype=np.float64)[: len(self.bends)]

    def _graph(self, stopping: Booleans) -> csr_matrix:
        """Return the graph of lines that enter no soft body that stops them: few besides those that enter none at all."""
        key = stopping.tobytes()
        if key not in self._graphs:
            more = self._passing(stopping)
            self._graphs[key] = self._open + self._matrix(more) if np.any(more) else self._open
        return self._graphs[key]

    def _shut(self, stopping: Booleans) -> csr_matrix:
        """Return the graph of all lines, of which those that enter what stops them are infinitely long: quickly made, for lengths alone."""
        graph, first, second = self._every
        more = np.flatnonzero(self._passing(stopping))
        data = graph.data.copy()
        data[first[more]] = data[second[more]] = self.joints.lengths[more]
        return csr_matrix((data, graph.indices, graph.indptr), shape=graph.shape)

    def _passing(self, stopping: Booleans) -> Booleans:
        """Return which lines enter soft bodies, but none that stops them. Shape (lines,)."""
        counts, joints = self._entered, self.joints
        passing = np.bincount(joints.entering[~stopping[joints.entered]], minlength=len(counts))
        return (counts > 0) & (passing == counts)

    @cached_property
    def _every(self) -> tuple[csr_matrix, Integers, Integers]:
        """The graph of all lines, infinite where they enter a soft body, and where each line stands in its data, in both directions."""
        joints, lines = self.joints, np.arange(len(self.joints.first))
        rows, columns = np.concatenate([joints.first, joints.second]), np.concatenate([joints.second, joints.first])
        order = np.lexsort((columns, rows))
        lengths = np.where(self._entered == 0, joints.lengths, np.inf)
        data, size = np.concatenate([lengths, lengths])[order], len(self.bends)
        starts = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=size))])
        at = np.empty(len(order), dtype=np.int64)
        at[order] = np.arange(len(order))
        return csr_matrix((data, columns[order], starts), shape=(size, size)), at[lines], at[len(lines) + lines]

    @cached_property
    def _entered(self) -> Integers:
        """Number of soft bodies that each line enters. Shape (lines,)."""
        return np.bincount(self.joints.entering, minlength=len(self.joints.first)).astype(np.int64)

    @cached_property
    def _open(self) -> csr_matrix:
        """The graph of lines that enter no soft body."""
        return self._matrix(self._entered == 0)

    def _matrix(self, kept: Booleans) -> csr_matrix:
        return _symmetric(self.joints, kept, len(self.bends))

    def _joints(self, pairs: Integers) -> Joints:
        starts, ends = self.bends.points[pairs[:, 0]], self.bends.points[pairs[:, 1]]
        free = ~self.solids.meets(starts, ends)
        pairs, starts, ends = pairs[free], starts[free], ends[free]
        entering, entered = self.soft.pairs(starts, ends)
        lengths = np.maximum(np.linalg.norm(ends - starts, axis=1), 1e-9)
        return Joints(pairs[:, 0], pairs[:, 1], lengths, entering, entered)

    def _bridges(self, joints: Joints) -> Integers:
        """Return pairs of points of different parts of the graph, the nearest ones, whatever their directions. Shape (pairs, 2)."""
        parts, part = connected_components(
            _symmetric(joints, np.ones(len(joints.first), np.bool_), len(self.bends)), directed=False
        )
        found: list[Integers] = []
        points = self.bends.points
        sizes = np.bincount(part)
        for one in np.argsort(-sizes, kind="stable")[:_BRIDGES].tolist() if parts > 1 else []:
            inside, outside = np.flatnonzero(part == one), np.flatnonzero(part != one)
            answer = KDTree(points[outside]).query(points[inside], k=min(8, len(outside)))
            distances, near = (np.asarray(part).reshape(len(inside), -1) for part in answer)
            order = np.argsort(distances, axis=None, kind="stable")[:_BRIDGES]
            row, column = np.unravel_index(order, distances.shape)
            found.append(np.stack([inside[row], outside[near[row, column]]], axis=1))
        if not found:
            return np.zeros((0, 2), dtype=np.int64)
        pairs = np.concatenate(found)
        return _each_once(pairs[:, 0], pairs[:, 1], len(points))


def _symmetric(joints: Joints, kept: Booleans, size: int) -> csr_matrix:
    """Return some lines between points as a graph."""
    one, other, lengths = joints.first[kept], joints.second[kept], joints.lengths[kept]
    rows, columns = np.concatenate([one, other]), np.concatenate([other, one])
    return csr_matrix((np.concatenate([lengths, lengths]), (rows, columns)), shape=(size, size))


def _each_once(one: Integers, other: Integers, count: int) -> Integers:
    """Return pairs of indices below a count, each once and its lower index first. Shapes (n,) twice to (pairs, 2)."""
    keys = np.unique(np.minimum(one, other).astype(np.int64) * count + np.maximum(one, other))
    return np.stack(np.divmod(keys, count), axis=1)


def _with_start(graph: csr_matrix, reach: Floats) -> csr_matrix:
    """Return a graph with one more vertex, from which there are ways to the points within reach."""
    near = np.flatnonzero(np.isfinite(reach))
    data = np.concatenate([graph.data, np.maximum(reach[near], 1e-9)])
    columns = np.concatenate([graph.indices, near])
    rows = np.concatenate([graph.indptr, [graph.indptr[-1] + len(near)]])
    size = (len(reach) + 1, len(reach) + 1)
    return csr_matrix((data, columns, rows), shape=size)


def _joined(lines: Sequence[Lines]) -> Lines:
    if not lines:
        empty = np.zeros((0, 3))
        return Lines(empty, empty, empty, np.zeros(0))
    return Lines(
        np.concatenate([one.starts for one in lines]),
        np.concatenate([one.ends for one in lines]),
        np.concatenate([one.outward for one in lines]),
        np.concatenate([one.opening for one in lines]),
    )
