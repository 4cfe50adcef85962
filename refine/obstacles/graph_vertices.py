"""Vertices of the visibility graph: points on the edges of inflated bodies, and the lines on which they may be moved.

A shortest way turns only at edges. Along each edge there are points at its ends, at the heights at which robots are at home and in between;
whether a way may turn at one is asked of its direction (`Bends.outward`, `Bends.opening`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from refine.obstacles.inflated_bodies import InflatedBodies, InflatedBody
from refine.obstacles.path_shortcutting import Turn
from verify.data.shapes.convex_parts import ConvexBody

Floats = NDArray[np.float64]

BESIDE = 1e-3
"""m; points lie this far outside the growth, so that rounding never puts one into it."""
_SPACING = 1.5
"""m between points of one edge, about."""
_MOST = 8
"""Points of one edge between its ends, at most."""
_OPPOSITE = 0.3
"""m; points of other lines so near to a line have one opposite on it."""
_BETWEEN = 0.04
"""m; points of one line that are added lie so far apart at least."""
_ROUND = np.arange(8) * (np.pi / 4)
_UPRIGHT = 0.05
"""An edge whose direction has no more than this in z is level."""


@dataclass(frozen=True, eq=False, slots=True)
class Lines:
    """Straight lines beside bodies, on which ways may turn.

    Attributes:
        starts: m. Shape (n, 3).
        ends: m. Shape (n, 3).
        outward: Unit vectors away from the body. Shape (n, 3).
        opening: A way turns at a line only where the part of its direction along `outward` is at most this. Shape (n,).
    """

    starts: Floats
    ends: Floats
    outward: Floats
    opening: Floats

    def __len__(self) -> int:
        return len(self.starts)


@dataclass(frozen=True, eq=False, slots=True)
class Bends:
    """Points at which ways may turn.

    Attributes:
        points: m. Shape (n, 3).
        outward: Unit vectors away from the body. Shape (n, 3).
        opening: A way turns there only where the part of its direction along `outward` is at most this. Shape (n,).
        starts: One end of the line on which the point may be moved, m. Shape (n, 3).
        ends: The other end, m. Shape (n, 3).
    """

    points: Floats
    outward: Floats
    opening: Floats
    starts: Floats
    ends: Floats

    def __len__(self) -> int:
        return len(self.points)

    def turns(self, index: NDArray[np.int64], directions: Floats) -> NDArray[np.bool_]:
        """Return whether ways in some directions may turn at points.

        Args:
            index: Of the points. Shape (n,).
            directions: Unit vectors, either way along. Shape (n, 3).
        """
        return np.abs(np.einsum("ni,ni->n", directions, self.outward[index])) <= self.opening[index]

    def turn(self, index: int) -> Turn:
        """Return one of the points with its line."""
        return Turn(self.points[index], self.outward[index], self.starts[index], self.ends[index])


def bends(lines: Lines, solids: InflatedBodies, low: Floats, high: Floats, heights: Floats) -> Bends:
    """Return points on lines in a box, outside of solid bodies.

    Args:
        lines: Beside bodies.
        solids: What no point may lie in.
        low: Lower corner of the box, m. Shape (3,).
        high: Upper corner, m. Shape (3,).
        heights: At which there are points on lines that are not level, m. Shape (n,).
    """
    first, last = _within(lines, low, high)
    taken: list[list[tuple[float, float]]] = [[] for _ in range(len(lines))]
    segments, bodies = solids.pairs(lines.starts, lines.ends)
    for body in np.unique(bodies):
        own = segments[bodies == body]
        begin, end = solids.bodies[body].spans(lines.starts[own], lines.ends[own])
        for line, a, b in zip(own.tolist(), begin.tolist(), end.tolist(), strict=True):
            taken[line].append((a, b))
    steps = lines.ends - lines.starts
    lengths = np.maximum(np.linalg.norm(steps, axis=1), 1e-12)
    upright = np.abs(steps[:, 2]) > _UPRIGHT * lengths
    parts: list[_Part] = []
    for line in np.flatnonzero(first <= last).tolist():
        length = float(lengths[line])
        for a, b in _free(float(first[line]), float(last[line]), taken[line], BESIDE / length):
            own = _shares(lines.starts[line, 2], steps[line, 2], length, (a, b), heights)
            if upright[line]:  # the ends of a whole edge are ends of level ones as well, and the box is no body
                own = [share for share in own if share not in (first[line], last[line])] or own
            parts.append(_Part(line, a, b, own))
    _add_opposite(parts, lines, lengths)
    row = np.array([part.line for part in parts for _ in part.shares], dtype=np.intp)
    share = np.array([share for part in parts for share in part.shares])
    limit = np.array([(part.first, part.last) for part in parts for _ in part.shares]).reshape(-1, 2)
    points = lines.starts[row] + share[:, None] * steps[row]
    near_end = np.minimum(share - limit[:, 0], limit[:, 1] - share) * lengths[row] < 0.01
    opening = np.where(near_end, np.maximum(lines.opening[row], 0.8), lines.opening[row])
    return _once(
        Bends(
            points,
            lines.outward[row],
            opening,
            lines.starts[row] + limit[:, :1] * steps[row],
            lines.starts[row] + limit[:, 1:] * steps[row],
        )
    )


@dataclass(slots=True)
class _Part:
    """A part of a line that is free, from one share of it to another, and the shares at which there are points."""

    line: int
    first: float
    last: float
    shares: list[float]


def _add_opposite(parts: list[_Part], lines: Lines, lengths: Floats) -> None:
    """Add points to parts of lines that are opposite to points of other lines near by.

    In the mouth of a window between four walls no edge ends: whoever turns into it does so where the edges within are nearest.
    """
    steps = lines.ends - lines.starts
    row = np.array([part.line for part in parts for _ in part.shares], dtype=np.intp)
    points = lines.starts[row] + np.array([share for part in parts for share in part.shares])[:, None] * steps[row]
    if not len(points):
        return
    own = np.array([part.line for part in parts], dtype=np.intp)
    limits = np.array([(part.first, part.last) for part in parts])
    middles = lines.starts[own] + limits.mean(axis=1)[:, None] * steps[own]
    halves = (limits[:, 1] - limits[:, 0]) * lengths[own] / 2.0
    around = KDTree(points).query_ball_point(middles, halves + _OPPOSITE, return_sorted=True)
    which = np.repeat(np.arange(len(parts)), [len(near) for near in around])
    near = np.concatenate([np.array(each, dtype=np.intp) for each in around])
    step, offset = steps[own[which]], points[near] - lines.starts[own[which]]
    along = np.einsum("ni,ni->n", offset, step) / lengths[own[which]] ** 2
    aside = np.linalg.norm(offset - along[:, None] * step, axis=1)
    kept = (aside < _OPPOSITE) & (along > limits[which, 0]) & (along < limits[which, 1]) & (row[near] != own[which])
    for index, share in zip(which[kept].tolist(), along[kept].tolist(), strict=True):
        part = parts[index]
        if min(abs(share - other) for other in part.shares) * float(lengths[part.line]) > _BETWEEN:
            part.shares.append(share)


def lines_beside(body: InflatedBody) -> Lines:
    """Return lines just outside a body on which ways may turn: its edges, on both sides of their bevels."""
    convex = body.convex
    if len(convex.matrices) == 1 and not len(convex.normals) and np.all(np.diag(convex.matrices[0]) > 0):
        return _around_ellipsoid(convex)
    if len(convex.matrices):
        faceted = _faceted(convex)
        return _edges(faceted.normals, faceted.distances, faceted.corners(), 0.0)
    return _edges(convex.normals[: body.faces], convex.distances[: body.faces], body.corners, body.growth)


def _around_ellipsoid(convex: ConvexBody) -> Lines:
    """Points around an ellipsoid: eight at its waist, four above and four below."""
    (matrix,), (centre,), (root,) = convex.matrices, convex.centres, convex.roots
    ring = np.stack([np.cos(_ROUND), np.sin(_ROUND), np.zeros(8)], axis=1)
    slant = ring[::2] * np.sqrt(0.5)
    up = np.array([0.0, 0.0, np.sqrt(0.5)])
    ways = np.concatenate([ring, slant + up, slant - up])
    values, vectors = np.linalg.eigh(matrix)
    inverse_root = (vectors / np.sqrt(values)) @ vectors.T
    points = centre + (root / np.cos(np.pi / 8)) * ways @ inverse_root
    normals = (points - centre) @ matrix
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = points + BESIDE * normals
    return Lines(points, points, normals, np.full(len(points), 0.6))


def _faceted(convex: ConvexBody) -> ConvexBody:
    """Return a polyhedron around a body: its faces, and planes that touch its quadrics on all sides."""
    normals, distances = [convex.normals], [convex.distances]
    for matrix, centre, root in zip(convex.matrices, convex.centres, convex.roots, strict=True):
        values, vectors = np.linalg.eigh(matrix)
        axes = vectors[:, values > 1e-12 * values.max()]
        if axes.shape[1] == 2:
            ways = np.cos(_ROUND)[:, None] * axes[:, 0] + np.sin(_ROUND)[:, None] * axes[:, 1]
        else:
            ways = np.concatenate([axes.T, -axes.T])
        inverse = np.einsum("ni,ij,nj->n", ways, np.linalg.pinv(matrix), ways)
        normals.append(ways)
        distances.append(ways @ centre + root * np.sqrt(inverse))
    empty = np.zeros((0, 3))
    return ConvexBody(np.concatenate(normals), np.concatenate(distances), np.zeros((0, 3, 3)), empty, np.zeros(0), np.zeros(0))


def _edges(normals: Floats, distances: Floats, corners: Floats, growth: float) -> Lines:
    """Return the edges of a polyhedron, moved outwards a little; of upright ones that were grown, the two edges of their bevels."""
    on = np.abs(corners @ normals.T - distances) <= 1e-7 * (1.0 + np.abs(corners).max())
    pairs = np.argwhere(np.triu(on.T.astype(np.int64) @ on.astype(np.int64) >= 2, 1))
    starts, ends, outward, opening = [], [], [], []
    for i, j in pairs:
        one, other = normals[i], normals[j]
        shared, along = corners[on[:, i] & on[:, j]], np.cross(one, other)
        size, cosine = float(np.linalg.norm(along)), float(one @ other)
        places = shared @ along / max(size, 1e-12)
        if size < 1e-6 or np.ptp(places) < 1e-6:
            continue
        first, last = shared[np.argmin(places)], shared[np.argmax(places)]
        mitre, bevel = (one + other) / (1.0 + cosine), (one + other) / np.sqrt(2.0 + 2.0 * cosine)
        level = abs(along[2]) <= _UPRIGHT * size
        for side in (one, other) if growth > 0 and not level else (other,):
            sum_ = side + (bevel if growth > 0 and not level else one)
            out = sum_ / np.linalg.norm(sum_)
            half = float(np.linalg.norm(sum_)) / 2.0  # the cosine of half the angle between two faces
            aside = growth * (out / half - mitre) + BESIDE / half * out
            starts.append(first + aside - along / size * BESIDE)
            ends.append(last + aside + along / size * BESIDE)
            outward.append(out)
            opening.append(np.sqrt(max(0.0, 1.0 - half * half)) + 0.02)
    return Lines(
        np.array(starts).reshape(-1, 3), np.array(ends).reshape(-1, 3), np.array(outward).reshape(-1, 3), np.array(opening)
    )


def _within(lines: Lines, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Return from which to which share lines are in a box; the first is above the second where one is never. Shapes (n,)."""
    step = lines.ends - lines.starts
    first, last = np.zeros(len(lines)), np.ones(len(lines))
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis in range(3):
            a, b = (low[axis] - lines.starts[:, axis]) / step[:, axis], (high[axis] - lines.starts[:, axis]) / step[:, axis]
            still = np.abs(step[:, axis]) < 1e-12
            within = (lines.starts[:, axis] >= low[axis]) & (lines.starts[:, axis] <= high[axis])
            first = np.maximum(first, np.where(still, np.where(within, 0.0, 2.0), np.minimum(a, b)))
            last = np.minimum(last, np.where(still, 1.0, np.maximum(a, b)))
    return first, last


def _free(first: float, last: float, taken: list[tuple[float, float]], beside: float) -> list[tuple[float, float]]:
    """Return the parts of an interval that are left between others, a little away from them."""
    free: list[tuple[float, float]] = []
    at, bounded = first, 0.0
    for begin, end in [*sorted(taken), (last, last)]:
        until = begin - (beside if begin < last else 0.0)
        if until >= at + bounded:
            free.append((at + bounded, min(until, last)))
        if end > at:
            at, bounded = end, beside
    return free


def _shares(start: float, rise: float, length: float, limits: tuple[float, float], heights: Floats) -> list[float]:
    """Return where there are points on a line that begins at a height and rises by so much, between two shares."""
    a, b = limits
    if (b - a) * length < 0.02:
        return [(a + b) / 2.0]
    if abs(rise) <= _UPRIGHT * length:
        inner = min(_MOST, int((b - a) * length / _SPACING))
        return [a, b, *np.linspace(a, b, inner + 2)[1:-1].tolist()]
    level = [share for share in ((heights - start) / rise).tolist() if a < share < b] or [(a + b) / 2.0]
    return [a, b, *level]


def _once(found: Bends) -> Bends:
    """Leave out points that stand where others do; a way may turn in any direction at those."""
    cells = np.round(found.points / 0.01).astype(np.int64)
    _, kept, count = np.unique(cells, axis=0, return_index=True, return_counts=True)
    opening = np.where(count > 1, 1.0, found.opening[kept])
    order = np.argsort(kept)
    kept, opening = kept[order], opening[order]
    return Bends(found.points[kept], found.outward[kept], opening, found.starts[kept], found.ends[kept])
