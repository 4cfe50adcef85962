"""Take-off and landing that a file leaves to the autopilot: straight up and down, as columns on which a drone may be anywhere at any time.

A column is met where another drone, or another column, may come too near to any of its points while its own drone may be on it: before the
path begins, or from the landing on. How fast a drone climbs or lands is not known, so that nothing depends on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np
from flint import fmpq_poly
from numpy.typing import NDArray
from scipy.spatial import KDTree

from verify.arithmetic import exact
from verify.arithmetic.balls import Floats
from verify.third_party.distances import Separation
from verify.third_party.fleet import Column, Fleet, Indices

BLOCK = 65_536
"""Pieces that are looked at at once, which bounds the memory."""
MOST_MET = 20_000
"""Columns and pieces that are too near; of more the rest is not listed."""

_SLACK = 1e-9
"""m by which floats may be off, by far."""
_WIDTH = Fraction(1, 2**60)
_SAMPLES = 33


@dataclass(frozen=True, slots=True)
class TooNear:
    """A column to which another drone may come too near.

    Attributes:
        column: The column.
        other: Index of the other drone.
        beside: The other drone's own column; None where its path is too near.
        limit: What was asked, in m.
        distance: To the nearest point of the column, about, in m.
        time: When, in s.
        sure: Whether the two come too near however fast they climb and land.
    """

    column: Column
    other: int
    beside: Column | None
    limit: float
    distance: float
    time: float
    sure: bool


def covered_rows(fleet: Fleet) -> NDArray[np.bool_]:
    """Return which rows are rests in the air in place of which a column is checked. Shape (rows,)."""
    found = np.zeros(len(fleet.values), dtype=bool)
    for column in fleet.columns:
        last = int(fleet.first[column.drone + 1]) - 1
        if column.since is None:
            found[int(fleet.first[column.drone])] |= fleet.rests[column.drone][0]
        elif column.since == fleet.start(last):
            found[last] |= fleet.rests[column.drone][1]
    return found


def is_still(fleet: Fleet, rows: Indices) -> NDArray[np.bool_]:
    """Tell on which rows a drone rests, by its control points. Shape (rows,)."""
    if fleet.basis == "power":
        return np.logical_not(fleet.values[rows, :, 1:].reshape(len(rows), -1).any(-1))
    inner = np.arange(fleet.degree + 1) <= fleet.degrees[rows, None]
    moved = (fleet.values[rows] != fleet.values[rows, :, :1]) & inner[:, None]
    return np.logical_not(moved.reshape(len(rows), -1).any(-1))


@np.errstate(all="ignore")
def judge_columns(fleet: Fleet, asked: Separation) -> list[TooNear]:
    """Find every column to which another drone may come too near.

    Args:
        fleet: The drones with their columns.
        asked: What pairs must keep.
    """
    columns = [column for column in fleet.columns if asked.above is None or column.high >= asked.above]
    found: list[TooNear] = []
    if columns:
        places = np.array([[float(x) for x in column.place] for column in columns])
        tree = KDTree(places)
        found += _among(asked, columns, tree)
        for met in _beside_paths(fleet, asked, columns, tree):
            found.append(met)
            if len(found) >= MOST_MET:
                break
    return _worst(found)


def _needed(asked: Separation, one: int, other: int) -> tuple[float, Fraction]:
    """Return what two drones must keep, and that with their steps between pieces, in m."""
    limit = float(asked.limits(np.array([one]), np.array([other]))[0])
    return limit, Fraction(limit) + Fraction(float(asked.steps[one])) + Fraction(float(asked.steps[other]))


def _low(column: Column, asked: Separation) -> float:
    return column.low if asked.above is None else max(column.low, asked.above)


def _among(asked: Separation, columns: Sequence[Column], tree: KDTree) -> Iterator[TooNear]:
    """Yield pairs of columns that are too near to each other, between times at which both may be flown."""
    for a, b in sorted(tree.query_pairs(asked.most + 2 * float(asked.steps.max(initial=0.0)) + _SLACK)):
        one, other = columns[a], columns[b]
        since = max((c.since for c in (one, other) if c.since is not None), default=None)
        until = min((c.until for c in (one, other) if c.until is not None), default=None)
        if one.drone == other.drone or (since is not None and until is not None and until < since):
            continue
        limit, needed = _needed(asked, one.drone, other.drone)
        level = sum(((x - y) ** 2 for x, y in zip(one.place, other.place, strict=True)), Fraction(0))
        over = max(
            Fraction(_low(one, asked)) - Fraction(other.high), Fraction(_low(other, asked)) - Fraction(one.high), Fraction(0)
        )
        if (square := level + (asked.weight * over) ** 2) >= needed**2:
            continue
        feet = level + (asked.weight * (Fraction(one.low) - Fraction(other.low))) ** 2
        above = asked.above is not None and min(one.low, other.low) < asked.above
        sure = one.kind == other.kind and feet < Fraction(limit) ** 2 and not above
        time = since if since is not None else Fraction(0)
        yield TooNear(one, other.drone, other, limit, float(np.sqrt(float(square))), float(time), sure)


def _beside_paths(fleet: Fleet, asked: Separation, columns: Sequence[Column], tree: KDTree) -> Iterator[TooNear]:
    """Yield columns and pieces of others that are too near to them."""
    weight, covered = float(asked.weight), covered_rows(fleet)
    reach = asked.most + 2 * float(asked.steps.max(initial=0.0)) + _SLACK
    top = max(column.high for column in columns) + reach / min(weight, 1.0)
    known: dict[tuple[object, ...], bool] = {}
    for first in range(0, len(fleet.values), BLOCK):
        rows = np.arange(first, min(first + BLOCK, len(fleet.values)))
        table = fleet.positions(rows)
        low, high = table.low.min(-1), table.high.max(-1)
        kept = np.flatnonzero((low[:, 2] <= top) & ~covered[rows])
        middle, half = (low[kept, :2] + high[kept, :2]) / 2, np.hypot(*((high[kept, :2] - low[kept, :2]) / 2).T)
        near = tree.query(middle)[0] <= half + reach
        kept, middle, half = kept[near], middle[near], half[near]
        if not len(kept):
            continue
        beside = tree.query_ball_point(middle, half + reach + _SLACK)
        for at, found in zip(kept.tolist(), beside, strict=True):
            for index in sorted(found):
                if (met := _met(fleet, asked, columns[index], int(rows[at]), (low[at], high[at]), known)) is not None:
                    yield met


# six parameters: a column, a piece and what is known of both
def _met(
    fleet: Fleet, asked: Separation, column: Column, row: int, box: tuple[Floats, Floats], known: dict[tuple[object, ...], bool]
) -> TooNear | None:
    """Check a column beside one piece of another drone."""
    other = int(fleet.owner[row])
    begin = fleet.start(row) if column.since is None else max(fleet.start(row), column.since)
    end = fleet.stop(row) if column.until is None else min(fleet.stop(row), column.until)
    if other == column.drone or begin > end:
        return None
    limit, needed = _needed(asked, column.drone, other)
    x, y = (float(value) for value in column.place)
    gaps = np.maximum(np.maximum(box[0] - (x, y, column.high), (x, y, _low(column, asked)) - box[1]), 0.0)
    if float(np.hypot(np.hypot(gaps[0], gaps[1]), gaps[2] * float(asked.weight))) > float(needed) + _SLACK:
        return None
    upright = not (fleet.values[row, :2] != fleet.values[row, :2, :1])[:, : int(fleet.degrees[row]) + 1].any()
    key = (*column.place, *fleet.values[row, :2, 0].tolist(), needed)
    if upright and fleet.basis == "bernstein":
        if key not in known:
            at = zip(column.place, fleet.values[row, :2, 0].tolist(), strict=True)
            known[key] = sum(((c - Fraction(p)) ** 2 for c, p in at), Fraction(0)) >= needed**2
        if known[key]:
            return None
    length = fleet.stop(row) - fleet.start(row)
    share = (begin - fleet.start(row)) / length, (end - fleet.start(row)) / length
    path = [
        exact.on_unit_interval(p, *share) if begin < end else fmpq_poly([p(exact.rational(share[0]))])
        for p in fleet.exactly(row)
    ]
    if _keeps(path, column, needed, asked):
        return None
    places = np.linspace(0.0, 1.0, _SAMPLES)
    points = np.array([[float(exact.fraction(p(exact.rational(place)))) for p in path] for place in places.tolist()])
    over = np.maximum(np.maximum(points[:, 2] - column.high, _low(column, asked) - points[:, 2]), 0.0) * float(asked.weight)
    distance = np.hypot(np.hypot(points[:, 0] - x, points[:, 1] - y), over)
    distance[points[:, 2] < (-np.inf if asked.above is None else asked.above)] = np.inf
    least = int(np.argmin(distance))
    time = float(begin + (end - begin) * Fraction(float(places[least])))
    sure = float(distance[least]) < limit - _SLACK and _is_there_all_along(fleet, column, row)
    return TooNear(column, other, None, limit, min(float(distance[least]), limit), time, sure)


def _keeps(path: Sequence[fmpq_poly], column: Column, needed: Fraction, asked: Separation) -> bool:
    """Return whether a path on [0, 1] keeps a distance from a column; exact. False where that is not shown."""
    x, y, z = path
    level = (x - exact.rational(column.place[0])) ** 2 + (y - exact.rational(column.place[1])) ** 2 - exact.rational(needed**2)
    if exact.nonnegative(level, Fraction(0), Fraction(1)):
        return True
    ends = Fraction(_low(column, asked)), Fraction(column.high)
    weight = exact.rational(asked.weight)
    below, above = (level + (weight * (z - exact.rational(end))) ** 2 for end in ends)
    lowest = None if asked.above is None else Fraction(asked.above)
    spans: list[tuple[Fraction, Fraction]] = []
    for height in {*ends, *(() if lowest is None else (lowest,))}:
        apart = z - exact.rational(height)
        if apart.degree() > 0:
            spans += [(r.low, r.high) for r in exact.roots(apart, Fraction(0), Fraction(1), _WIDTH)]
    spans = sorted([(Fraction(0), Fraction(0)), *spans, (Fraction(1), Fraction(1))])
    if not all(exact.nonnegative(level, *span) or _is_lower(z, span, lowest) for span in spans[1:-1] if span[0] < span[1]):
        return False
    for (_, low), (high, _) in pairwise(spans):
        if low >= high:
            continue
        at = exact.fraction(z(exact.rational((low + high) / 2)))
        if lowest is not None and at < lowest:
            continue
        if not exact.nonnegative(below if at < ends[0] else above if at > ends[1] else level, low, high):
            return False
    return True


def _is_lower(z: fmpq_poly, span: tuple[Fraction, Fraction], lowest: Fraction | None) -> bool:
    """Return whether a path is surely below a height throughout."""
    if lowest is None:
        return False
    apart = exact.rational(lowest) - z
    return exact.nonnegative(apart, *span) and all(apart(exact.rational(end)) > 0 for end in span)


def _is_there_all_along(fleet: Fleet, column: Column, row: int) -> bool:
    """Return whether a drone rests on a row while all of a column is flown, and does not take off or land by itself then."""
    other = int(fleet.owner[row])
    if any(c.drone == other and c.kind == column.kind for c in fleet.columns) or not is_still(fleet, np.array([row]))[0]:
        return False
    if column.since is not None:
        return row == int(fleet.first[other + 1]) - 1 and fleet.start(row) <= column.since and fleet.stop(row) == fleet.end
    return row == int(fleet.first[other]) and column.until is not None and fleet.stop(row) >= column.until


def _worst(found: Sequence[TooNear]) -> list[TooNear]:
    """Return for each column and each drone what is nearest, surest first."""
    best: dict[tuple[int, str, object, int], TooNear] = {}
    for met in found:
        key = (met.column.drone, met.column.kind, met.column.since, met.other)
        known = best.get(key)
        if known is None or (not met.sure, met.distance) < (not known.sure, known.distance):
            best[key] = met
    return sorted(best.values(), key=lambda met: (not met.sure, met.distance - met.limit, met.column.drone, met.other))
