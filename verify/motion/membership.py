"""From polynomials to label timelines: for all times, in which regions a robot must, may or cannot be.

With r the path and q <= b one of the inequalities that a region is made of, q(r(t)) is a polynomial on each piece, of degree 14,
or 7 for a half-space. For a point within the margin d of r the bound moves to the safe side (`verify.data.shapes.conditions`):
of an ellipsoid, with s^2 a bound on its matrix's greatest eigenvalue, q <= (1 - s d)^2 means *must*, q > (1 + s d)^2 means *no*, and
what is neither proved is *may*. At margin 0 the two thresholds are one, and an interval that holds exactly one simple root
is one switch. `verify.motion.bodies` says what the inequalities' answers come to for a region.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import fmpq_poly
from numpy.typing import NDArray

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, Floats, concatenate, constants, dot, gamma, halves, nearest
from verify.arithmetic.bounds import Indices
from verify.behaviour.timeline import Change, Enclosure, Status
from verify.data.shapes.conditions import Condition, HalfSpace, Quadric
from verify.data.shapes.inequalities import Inequality, Point
from verify.motion.bodies import Body, Mark, Span, region_spans
from verify.motion.paths import Segment, TeamPaths

DEPTH_WITH_MARGIN = 20
"""Halvings of a piece before what is not proved yet counts as *may*: a millionth of its duration."""

DEPTH_WITHOUT = 34
"""At margin 0 an enclosure of a switch is this many halvings of its piece."""

MAX_OPEN = 64
"""A piece with more open parts than this (it runs along a boundary) is left to exact arithmetic, or to *may*."""

_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class MembershipPolynomials:
    """What every region's inequalities are along all segments, computed once for any margin.

    Attributes:
        paths: The team.
        bodies: By region, in the mission's order.
        columns: For each region the columns of its inequalities in `quadrics` or, for half-spaces, in `planes`.
        quadrics: Quadratic forms. Shape (segments, quadrics, 15).
        planes: Of half-spaces, normal . (r - c). Shape (segments, half-spaces, 8).
    """

    paths: TeamPaths
    bodies: dict[str, Body]
    columns: dict[str, tuple[int, ...]]
    quadrics: Balls
    planes: Balls

    def values(self, one: Condition) -> Balls:
        """Return the table that an inequality has its column in."""
        return self.planes if isinstance(one, HalfSpace) else self.quadrics


@np.errstate(all="ignore")
def membership_polynomials(paths: TeamPaths) -> MembershipPolynomials:
    """Compute the membership polynomials of a team."""
    bodies = {name: Body.of(region) for name, region in paths.mission.all_regions.items()}
    columns: dict[str, tuple[int, ...]] = {}
    planes: list[tuple[Body, int]] = []
    quadrics: list[tuple[Body, int]] = []
    for name, body in bodies.items():
        row: list[int] = []
        for k, one in enumerate(body.conditions):
            listed = planes if isinstance(one, HalfSpace) else quadrics
            row.append(len(listed))
            listed.append((body, k))
        columns[name] = tuple(row)
    tables: list[Balls] = []
    for listed, width in ((quadrics, 15), (planes, 8)):
        mid = np.empty((len(paths.segments), len(listed), width))
        rad = np.empty_like(mid)
        for column, (body, k) in enumerate(listed):
            for first in range(0, len(paths.segments), _CHUNK):
                part = slice(first, first + _CHUNK)
                values = _along(paths.positions[part], body, k)
                mid[part, column], rad[part, column] = values.mid, values.rad
        tables.append(Balls(mid, rad))
    return MembershipPolynomials(paths, bodies, columns, *tables)


def _along(positions: Balls, body: Body, k: int) -> Balls:
    """Return what one of a region's inequalities bounds, as polynomials. Shape (segments, 3, 8) to (segments, degree + 1)."""
    one = body.conditions[k]
    if isinstance(one, HalfSpace):
        normal = constants(np.array(body.inequalities[k].linear)).reshape(1, 3, 1)
        return dot(normal, positions - constants(np.array(body.centre)).reshape(1, 3, 1))
    if any(one.centre):
        pairs = [nearest(Fraction(c) + own) for c, own in zip(body.centre, one.centre, strict=True)]
        centre = constants(np.array([value for value, _ in pairs]), np.array([error for _, error in pairs]))
    else:
        centre = constants(np.array(body.centre))
    offset = positions - centre.reshape(1, 3, 1)
    return dot(offset, _turned(np.array(body.inequalities[k].quadratic), offset))


@dataclass(frozen=True, eq=False, slots=True)
class _Thresholds:
    """Of one inequality, between which floats lie its greatest value where the ball is inside, and where it is not outside."""

    inside: tuple[float, float]
    outside: tuple[float, float]

    @classmethod
    def of(cls, one: Condition, margin: Fraction) -> _Thresholds:
        within, beyond = one.bounds(margin)
        return cls((-np.inf, -np.inf) if within is None else _bracket(within), _bracket(beyond))


@np.errstate(all="ignore")
def statuses(found: MembershipPolynomials, margin: Fraction) -> dict[str, dict[str, tuple[Span, ...]]]:
    """Return for each robot and region the spans of its path, in order and without gaps.

    Args:
        found: The team's membership polynomials.
        margin: Within how many metres of the path the status must hold, exact.
    """
    paths = found.paths
    far = _far(found, margin)
    leaves = {
        name: near
        for name, body in found.bodies.items()
        if name not in far and (near := _RegionLeaves.of(found, name, body, margin)) is not None
    }
    _classify(leaves.values(), DEPTH_WITHOUT if margin == 0 else DEPTH_WITH_MARGIN)
    result: dict[str, dict[str, tuple[Span, ...]]] = {}
    of_robot: list[list[int]] = [[] for _ in paths.robots]
    for index, segment in enumerate(paths.segments):
        of_robot[segment.robot].append(index)
    for robot, name in enumerate(paths.robots):
        result[name] = {}
        whole = paths.segments[of_robot[robot][0]].start, paths.segments[of_robot[robot][-1]].stop
        for region in found.bodies:
            if region not in leaves:
                result[name][region] = (Span(*whole, "no"),)
                continue
            near = leaves[region]
            rows = [near.spans(found.paths, k, of_robot[robot], margin) for k in range(len(near.body.conditions))]
            result[name][region] = _settled(
                rows[0] if len(rows) == 1 else region_spans(near.body, [_settled(row) for row in rows])
            )
    return result


def _far(found: MembershipPolynomials, margin: Fraction) -> set[str]:
    """Return ellipsoids that all robots are proved to be out of at all times, by the least coefficients alone.

    Thresholds are rounded upwards by a thousand times what their floats are off.
    """
    scales: dict[str, float] = {}
    for name, body in found.bodies.items():
        first, *more = body.conditions
        if not more and isinstance(first, Quadric) and first.square == 1:
            scales[name] = float(first.scale)
    outside = (1.0 + np.array(list(scales.values())) * float(margin) * (1 + 2.0**-40)) ** 2 * (1 + 2.0**-40)
    columns = [found.columns[name][0] for name in scales]
    out = np.all(found.quadrics.low[:, columns].min(-1) > outside, axis=0)
    return {name for name, sure in zip(scales, out.tolist(), strict=True) if sure}


Leaf = tuple[float, float, Mark | None]
"""From one place of a segment to another, with its status; None where nothing could be proved."""


@dataclass(frozen=True, eq=False, slots=True)
class _RegionLeaves:
    """One region's inequalities along all segments, in parts that are sorted.

    Attributes:
        body: The region.
        values: For each inequality its polynomials. Shape (segments, degree + 1) each.
        thresholds: For each inequality.
        open: For each inequality the segments that have to be halved, as the whole of them decides neither it nor the region.
        leaves: For each inequality and segment.
    """

    body: Body
    values: list[Balls]
    thresholds: list[_Thresholds]
    open: list[Indices]
    leaves: list[list[Sequence[Leaf]]]

    @classmethod
    def of(cls, found: MembershipPolynomials, name: str, body: Body, margin: Fraction) -> _RegionLeaves | None:
        """Look at whole segments; None where all robots are proved to be out of the region at all times."""
        values = [found.values(one)[:, column] for one, column in zip(body.conditions, found.columns[name], strict=True)]
        thresholds = [_Thresholds.of(one, margin) for one in body.conditions]
        low, high = [row.low.min(-1) for row in values], [row.high.max(-1) for row in values]
        broken = [row > bounds.outside[1] for row, bounds in zip(low, thresholds, strict=True)]
        out = _all(_any(broken[k] for k in part) for part in body.parts)
        if bool(np.all(out)):
            return None
        kept = [row <= bounds.inside[0] for row, bounds in zip(high, thresholds, strict=True)]
        clear = out | _any(_all(kept[k] for k in cover) for cover in body.covers)
        opened = [np.flatnonzero(~(clear | no | must)) for no, must in zip(broken, kept, strict=True)]
        leaves: list[list[Sequence[Leaf]]] = []
        for no, must in zip(broken, kept, strict=True):
            marks: list[Mark] = [_CODES[code] or "may" for code in np.select([no, must], [0, 2], 1).tolist()]
            leaves.append([_WHOLE[mark] for mark in marks])
        return cls(body, values, thresholds, opened, leaves)

    def spans(self, paths: TeamPaths, k: int, indices: Sequence[int], margin: Fraction) -> list[Span]:
        """Return the spans of one inequality along one robot's segments."""
        spans: list[Span] = []
        for index in indices:
            segment, parts = paths.segments[index], self.leaves[k][index]
            if len(parts) == 1 and parts[0][2] is not None:
                _append(spans, segment.start, segment.stop, parts[0][2])
            elif margin == 0:
                _without_margin(spans, _Along(paths, index, self.body, k, self.values[k][index]), parts)
            else:
                for start, stop, mark in parts:
                    _append(spans, segment.time(start), segment.time(stop), mark or "may")
        return spans


_WHOLE: dict[Mark, tuple[Leaf, ...]] = {"no": ((0.0, 1.0, "no"),), "may": ((0.0, 1.0, "may"),), "must": ((0.0, 1.0, "must"),)}


def _any(rows: Iterator[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    return np.logical_or.reduce(list(rows))


def _all(rows: Iterator[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    return np.logical_and.reduce(list(rows))


def _classify(regions: Iterable[_RegionLeaves], depth: int) -> None:
    """Halve what is open of all regions, polynomials of one degree at once."""
    rows = [(near, k) for near in regions for k in range(len(near.values)) if len(near.open[k])]
    for degree in sorted({near.values[k].degree for near, k in rows}):
        chosen = [(near, k) for near, k in rows if near.values[k].degree == degree]
        table = concatenate([near.values[k][near.open[k]] for near, k in chosen])
        counts = [len(near.open[k]) for near, k in chosen]
        inside = np.repeat([near.thresholds[k].inside for near, k in chosen], counts, axis=0)
        outside = np.repeat([near.thresholds[k].outside for near, k in chosen], counts, axis=0)
        found = iter(_classified(table, inside, outside, depth))
        for near, k in chosen:
            for index in near.open[k].tolist():
                near.leaves[k][index] = next(found)


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


def _bracket(value: Fraction) -> tuple[float, float]:
    number, error = nearest(value)
    if error == 0.0:
        return number, number
    return float(np.nextafter(number, -np.inf)), float(np.nextafter(number, np.inf))


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


@dataclass(frozen=True, eq=False, slots=True)
class _Along:
    """One inequality of a region along one segment.

    Attributes:
        paths: The team.
        index: Of the segment.
        body: The region.
        k: Of the inequality.
        values: What it bounds, as balls.
    """

    paths: TeamPaths
    index: int
    body: Body
    k: int
    values: Balls

    @property
    def segment(self) -> Segment:
        """The segment."""
        return self.paths.segments[self.index]

    def exact(self) -> fmpq_poly:
        """Return what must not be above 0, as an exact polynomial in u, from 0 to 1."""
        return exact_level(self.paths, self.index, self.body.centre, self.body.inequalities[self.k])


def _without_margin(spans: list[Span], along: _Along, leaves: Sequence[Leaf]) -> None:
    """Append the spans of one segment at margin 0, with each simple root as a switch."""
    segment = along.segment
    for position, (start, stop, mark) in enumerate(leaves):
        around = {leaves[i][2] for i in (position - 1, position + 1) if 0 <= i < len(leaves)}
        if mark is not None:
            _append(spans, segment.time(start), segment.time(stop), mark)
        elif around == {"no", "must"} and _is_monotone(along.values, start, stop):
            _append(spans, segment.time(start), segment.time(stop), "switch")
        elif segment.kind == "piece":
            _exactly(spans, along, start, stop)
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


def _exactly(spans: list[Span], along: _Along, start: float, stop: float) -> None:
    """Decide a part of a piece that balls leave open, with exact roots: ties, tangencies, roots close together."""
    segment, level = along.segment, along.exact()
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


def exact_level(paths: TeamPaths, index: int, centre: Point, inequality: Inequality) -> fmpq_poly:
    """Return by how much a segment breaks an inequality, as an exact polynomial in u, from 0 to 1.

    Args:
        paths: The team.
        index: Of the segment, among all of the team's.
        centre: The region's, m.
        inequality: One of the region's.
    """
    offset = [p - exact.rational(c) for p, c in zip(paths.exact_position(index), centre, strict=True)]
    total = fmpq_poly([-exact.rational(inequality.bound)])
    for i in range(3):
        total += offset[i] * exact.rational(inequality.linear[i])
        for j in range(3):
            total += offset[i] * offset[j] * exact.rational(inequality.quadratic[i][j])
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
