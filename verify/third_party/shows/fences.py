"""Drones inside or outside of polygons, for all times: the hull of a piece against the edges, then exact arithmetic.

A piece lies in the hull of its control points. Seen along an edge and across it the hull is a box, and how far that is from the edge is a
bound for all of the piece; where it is far enough from all edges, the piece lies on one side of them as its first point does. What that
leaves open is halved, and what lies on a border up to rounding is cut exactly where its distance from an edge can pass the margin.
All of this is in floats up to there; `_SLACK` covers their rounding by far, as coordinates are at most 1e6.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np
from flint import fmpq, fmpq_poly
from numpy.typing import NDArray

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, halves
from verify.claims.claim import Outcome
from verify.third_party.fleet import Fleet, Indices
from verify.third_party.shows.own_limits import Fence

BLOCK = 32_768
"""Pieces that are looked at at once, which bounds the memory."""

DEEPEST = 16
"""Halvings of a piece, after which exact arithmetic takes it over."""
MOST_OPEN = 100_000
"""Parts that are halved at once; of more, those that only tell the least distance more nearly are left."""
MOST_EXACT = 2_000
"""Pieces that are decided exactly for one fence; of more it is said that they are undecided."""

NEAR = 1e-3
"""m; how nearly the least distance of all from the border is told."""

_SLACK = 1e-7
_WIDTH = Fraction(1, 2**60)


@dataclass(frozen=True, slots=True)
class Outside:
    """A drone that does not keep a fence.

    Attributes:
        drone: Index.
        outcome: "fails" where it surely passes it, else "undecided".
        depth: How far beyond the border or, nearer to it than the margin, how far from it (then negative), in m.
        time: When, in s.
    """

    drone: int
    outcome: Outcome
    depth: float
    time: float


@dataclass(slots=True)
class Kept:
    """Least distance of drones to a fence's border on the right side of it: mutable while pieces are gone through.

    Attributes:
        low: No drone comes nearer, in m.
        high: One comes so near, in m.
        drone: Which.
        time: When, in s.
    """

    low: float = np.inf
    high: float = np.inf
    drone: int = 0
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class _Parts:
    """Parts of pieces: x and y on each, as polynomials on [0, 1]; whose they are, where they begin, and how much they are of it."""

    xy: Balls
    rows: Indices
    starts: Floats
    width: float

    def of(self, kept: NDArray[np.bool_]) -> _Parts:
        return _Parts(self.xy[kept], self.rows[kept], self.starts[kept], self.width)

    def halved(self) -> _Parts:
        width = self.width / 2
        starts = np.concatenate([self.starts, self.starts + width])
        return _Parts(halves(self.xy), np.concatenate([self.rows, self.rows]), starts, width)


@np.errstate(all="ignore")
def judge_fence(fleet: Fleet, fence: Fence, margin: Fraction) -> tuple[Kept, list[Outside]]:
    """Find every drone that does not keep a fence, and how near the others come to its border.

    Args:
        fleet: The drones.
        fence: What they must keep inside of, or outside of.
        margin: How far they may be from their paths, in m.
    """
    kept, broken, doubtful = Kept(), {}, []
    for low in range(0, len(fleet.values), BLOCK):
        rows = np.arange(low, min(low + BLOCK, len(fleet.values)))
        doubtful.append(_block(fleet, fence, float(margin), rows, kept, broken))
    rows = np.concatenate(doubtful)
    for index, row in enumerate(rows.tolist()):
        drone = int(fleet.owner[row])
        if drone in broken:
            continue
        place = _passes(fleet, fence, margin, row) if index < MOST_EXACT else 0.0
        if place is not None:
            outcome: Outcome = "fails" if index < MOST_EXACT else "undecided"
            depth = float(_signed(fence, np.array([_point(fleet, row, place)]))[0])
            broken[drone] = Outside(drone, outcome, depth, fleet.at(row, place))
    if len(rows):
        kept.low = min(kept.low, float(margin))
    return kept, sorted(broken.values(), key=lambda found: (-found.depth, found.drone))


# six parameters: two are brought up to date
def _block(fleet: Fleet, fence: Fence, margin: float, rows: Indices, kept: Kept, broken: dict[int, Outside]) -> Indices:
    """Check pieces as far as floats can; return those that are left open."""
    parts = _Parts(fleet.positions(rows)[:, :2], rows, np.zeros(len(rows)), 1.0)
    for level in range(DEEPEST + 1):
        low, first, last, same = _distances(fence, parts)
        right, clear = same, low > margin + _SLACK
        sure = ((low > _SLACK) & ~right) | (np.minimum(first, last) < margin - _SLACK)
        if sure.any():
            _take_broken(fleet, fence, parts.of(sure), broken)
        _take_nearest(fleet, parts, first, last, kept, right & ~sure)
        fine = clear & right
        more = fine & (low < kept.high - NEAR)
        open_ = ~fine & ~sure
        gone = np.isin(fleet.owner[parts.rows], np.array(list(broken), dtype=np.intp)) if broken else np.zeros(len(low), bool)
        open_ &= ~gone
        more &= ~gone
        if level == DEEPEST or 2 * np.count_nonzero(more | open_) > MOST_OPEN:
            more[:] = False
        put_aside = fine & ~more & ~gone
        kept.low = min(kept.low, float(low[put_aside].min(initial=np.inf)))
        if level == DEEPEST or 2 * np.count_nonzero(open_) > MOST_OPEN:
            return np.unique(parts.rows[open_])
        parts = parts.of(open_ | more)
        if not len(parts.rows):
            break
        parts = parts.halved()
    return np.empty(0, dtype=np.intp)


def _distances(fence: Fence, parts: _Parts) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Bound how far parts are from a fence's edges.

    Returns:
        What no point of a part is nearer than, how far its first and its last point are, in m, and whether the first point is on the
        right side, which is sure only of points that are not on the border. Shape (parts,) each.
    """
    x, y = parts.xy.mid[:, 0], parts.xy.mid[:, 1]
    low, first, last = (np.full(len(x), np.inf) for _ in range(3))
    inside = np.zeros(len(x), dtype=bool)
    for (ax, ay), (bx, by) in _edges(fence):
        length = float(np.hypot(bx - ax, by - ay))
        ex, ey = (bx - ax) / length, (by - ay) / length
        dx, dy = x - ax, y - ay
        across, along = ex * dy - ey * dx, ex * dx + ey * dy
        beside = np.maximum(np.maximum(across.min(-1), -across.max(-1)), 0.0)
        beyond = np.maximum(np.maximum(along.min(-1) - length, -along.max(-1)), 0.0)
        low = np.minimum(low, np.hypot(beside, beyond))
        ends = np.hypot(across[:, [0, -1]], np.maximum(np.maximum(along[:, [0, -1]] - length, -along[:, [0, -1]]), 0.0))
        first, last = np.minimum(first, ends[:, 0]), np.minimum(last, ends[:, 1])
        if ay != by:
            inside ^= ((ay > y[:, 0]) != (by > y[:, 0])) & ((across[:, 0] > 0) == (by > ay))
    slack = _SLACK + parts.xy.rad.max((1, 2))
    return low - slack, first, last, inside == fence.inside


def _edges(fence: Fence) -> Iterator[tuple[list[float], list[float]]]:
    yield from zip(fence.corners.tolist(), np.roll(fence.corners, -1, axis=0).tolist(), strict=True)


def _take_nearest(fleet: Fleet, parts: _Parts, first: Floats, last: Floats, kept: Kept, right: NDArray[np.bool_]) -> None:
    """Take note of the point on the right side that is nearest to the border."""
    for ends, place in ((first, 0.0), (last, parts.width)):
        among = np.where(right, ends, np.inf)
        k = int(np.argmin(among))
        if among[k] < kept.high:
            row = int(parts.rows[k])
            kept.high, kept.drone, kept.time = (
                float(among[k]),
                int(fleet.owner[row]),
                fleet.at(row, float(parts.starts[k]) + place),
            )


def _take_broken(fleet: Fleet, fence: Fence, parts: _Parts, broken: dict[int, Outside]) -> None:
    """Take note of where drones are farthest beyond the border, of points on the parts that surely pass it."""
    places = np.linspace(0.0, 1.0, 9)
    points = np.stack([_on(parts.xy.mid, place) for place in places.tolist()], 1)
    depth = _signed(fence, points.reshape(-1, 2)).reshape(points.shape[:2])
    best = depth.argmax(1)
    depth = depth[np.arange(len(best)), best]
    owner = fleet.owner[parts.rows]
    order = np.argsort(-depth, kind="stable")  # the deepest of each drone comes first
    for at in order[np.unique(owner[order], return_index=True)[1]].tolist():
        drone, row = int(owner[at]), int(parts.rows[at])
        if drone in broken and broken[drone].depth >= depth[at]:
            continue
        place = float(parts.starts[at]) + parts.width * float(places[best[at]])
        broken[drone] = Outside(drone, "fails", float(depth[at]), fleet.at(row, place))


def _on(control: Floats, place: float) -> Floats:
    """Evaluate polynomials on [0, 1] from their control points. Shape (k, 2, degree + 1) to (k, 2)."""
    while control.shape[-1] > 1:
        control = control[..., :-1] + place * (control[..., 1:] - control[..., :-1])
    return control[..., 0]


def _signed(fence: Fence, points: Floats) -> Floats:
    """Return how far points are beyond a fence's border; on the right side of it negative. Shape (points, 2) to (points,)."""
    control = points[:, :, None]
    parts = _Parts(Balls(control, np.zeros_like(control)), np.zeros(len(points), dtype=np.intp), np.zeros(len(points)), 1.0)
    _, distance, _, right = _distances(fence, parts)
    return np.where(right, -distance, distance)


def _point(fleet: Fleet, row: int, place: float) -> tuple[float, float]:
    x, y, _ = (float(exact.fraction(p(exact.rational(place)))) for p in fleet.exactly(row))
    return x, y


def _passes(fleet: Fleet, fence: Fence, margin: Fraction, row: int) -> float | None:
    """Return a place of a piece, from 0 to 1, where it does not keep a fence, or None where it keeps it throughout; exact.

    Whether a point keeps it changes only where a polynomial of those below is zero, so that one point between each two zeros says it of all
    others: and at a zero it is kept when it is kept beside it, because who is on the border, or as far from it as the margin, keeps it.
    """
    x, y, _ = fleet.exactly(row)
    alone = _Parts(fleet.positions(np.array([row]))[:, :2], np.array([row]), np.zeros(1), 1.0)
    product = fmpq_poly([1])
    for start, end in _edges(fence):
        near = Fence("", fence.inside, np.array([start, end]))
        if _distances(near, alone)[0][0] > float(margin) + _SLACK:
            continue
        for p in _critical(x, y, start, end, exact.rational(margin)):
            product *= p if p.degree() > 0 else fmpq_poly([1])
    places = [Fraction(0), Fraction(1)]
    if product.degree() > 0:
        found = exact.roots(product, Fraction(0), Fraction(1), _WIDTH)
        ends = [(Fraction(0), Fraction(0)), *((r.low, r.high) for r in found), (Fraction(1), Fraction(1))]
        places += [(a[1] + b[0]) / 2 for a, b in pairwise(ends) if a[1] < b[0]]
    else:
        places.append(Fraction(1, 2))
    for place in places:
        at = exact.rational(place)
        if not _keeps(fence, x(at), y(at), exact.rational(margin)):
            return float(place)
    return None


def _critical(x: fmpq_poly, y: fmpq_poly, start: list[float], end: list[float], margin: fmpq) -> list[fmpq_poly]:
    """Return polynomials of which one is zero where a point passes an edge, or comes within the margin of it."""
    ax, ay, bx, by = (exact.rational(value) for value in (*start, *end))
    ex, ey = bx - ax, by - ay
    across, along = ex * (y - ay) - ey * (x - ax), ex * (x - ax) + ey * (y - ay)
    square = ex * ex + ey * ey
    found = [across, along, along - square]
    if margin > 0:
        found += [across * across - margin * margin * square]
        found += [(x - px) ** 2 + (y - py) ** 2 - margin * margin for px, py in ((ax, ay), (bx, by))]
    return found


def _keeps(fence: Fence, x: fmpq, y: fmpq, margin: fmpq) -> bool:
    """Return whether a point keeps a fence; its border belongs to either side. Exact."""
    inside = False
    for start, end in _edges(fence):
        ax, ay, bx, by = (exact.rational(value) for value in (*start, *end))
        ex, ey = bx - ax, by - ay
        across, along, square = ex * (y - ay) - ey * (x - ax), ex * (x - ax) + ey * (y - ay), ex * ex + ey * ey
        if along <= 0:
            distance = (x - ax) ** 2 + (y - ay) ** 2
        elif along >= square:
            distance = (x - bx) ** 2 + (y - by) ** 2
        else:
            distance = across * across / square
        if distance < margin * margin:
            return False
        if distance == 0:
            return True  # on the border, and no margin is asked
        if (ay > y) != (by > y):
            inside ^= (across > 0) == (by > ay)
    return inside == fence.inside
