"""From polynomials to label timelines: for all times, in which regions a robot must, may or must not be.

With r the path and q <= b one of the inequalities that a region is made of, q(r(t)) is a polynomial on each piece, of degree 14,
or 7 for a half-space. For a point within the margin d of r the bound moves to the safe side (`verify.data.shapes.conditions`):
of an ellipsoid, with s^2 a bound on its matrix's greatest eigenvalue, q <= (1 - s d)^2 means *must*, q > (1 + s d)^2 means *no*, and
what is neither proved is *may*. At margin 0 the two thresholds are one, and an interval that holds exactly one simple root
is one switch. `bodies` says what the inequalities' answers come to for a region, `switches` finds such switches.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from verify.arithmetic.balls import Balls, concatenate
from verify.arithmetic.bounds import Indices
from verify.data.shapes.conditions import Quadric
from verify.model_checking.timeline import Change, Enclosure, Status
from verify.motion.membership.bodies import Body, Mark, Span, append, region_spans
from verify.motion.membership.boundary_crossings import Along, spans_without_margin
from verify.motion.membership.polynomials import MembershipPolynomials
from verify.motion.membership.subdivision import CODES, Leaf, Thresholds, classified
from verify.motion.paths import TeamPaths

DEPTH_WITH_MARGIN = 20
"""Halvings of a piece before what is not proved yet counts as *may*: a millionth of its duration."""

DEPTH_WITHOUT = 34
"""At margin 0 an enclosure of a switch is this many halvings of its piece."""


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
    clear = {name: near.never_in(paths) for name, near in leaves.items()}
    result: dict[str, dict[str, tuple[Span, ...]]] = {}
    of_robot: list[list[int]] = [[] for _ in paths.robots]
    for index, segment in enumerate(paths.segments):
        of_robot[segment.robot].append(index)
    for robot, name in enumerate(paths.robots):
        result[name] = {}
        whole = paths.segments[of_robot[robot][0]].start, paths.segments[of_robot[robot][-1]].stop
        for region in found.bodies:
            if region not in leaves or clear[region][robot]:
                result[name][region] = (Span(*whole, "no"),)
                continue
            near = leaves[region]
            rows = [near.spans(found.paths, k, of_robot[robot], margin) for k in range(len(near.body.conditions))]
            result[name][region] = _settled(
                rows[0] if len(rows) == 1 else region_spans(near.body, [_settled(row) for row in rows])
            )
    return result


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
    if not columns:
        return set()
    out = np.all(found.extent(found.bodies[next(iter(scales))].conditions[0])[0][:, columns] > outside, axis=0)
    return {name for name, sure in zip(scales, out.tolist(), strict=True) if sure}


@dataclass(frozen=True, eq=False, slots=True)
class _RegionLeaves:
    """One region's inequalities along all segments, in parts that are sorted.

    Attributes:
        body: The region.
        values: For each inequality its polynomials. Shape (segments, degree + 1) each.
        thresholds: For each inequality.
        broken: For each inequality the segments on the whole of which it is proved to be broken. Shape (segments,) each.
        open: For each inequality the segments that have to be halved, as the whole of them decides neither it nor the region.
        leaves: For each inequality and segment.
    """

    body: Body
    values: list[Balls]
    thresholds: list[Thresholds]
    broken: list[NDArray[np.bool_]]
    open: list[Indices]
    leaves: list[list[Sequence[Leaf]]]

    @classmethod
    def of(cls, found: MembershipPolynomials, name: str, body: Body, margin: Fraction) -> _RegionLeaves | None:
        """Look at whole segments; None where all robots are proved to be out of the region at all times."""
        values = [found.values(one)[:, column] for one, column in zip(body.conditions, found.columns[name], strict=True)]
        thresholds = [Thresholds.of(one, margin) for one in body.conditions]
        low, high = (
            [found.extent(one)[side][:, column] for one, column in zip(body.conditions, found.columns[name], strict=True)]
            for side in (0, 1)
        )
        broken = [row > bounds.outside[1] for row, bounds in zip(low, thresholds, strict=True)]
        out = _all(_any(broken[k] for k in part) for part in body.parts)
        if bool(np.all(out)):
            return None
        kept = [row <= bounds.inside[0] for row, bounds in zip(high, thresholds, strict=True)]
        clear = out | _any(_all(kept[k] for k in cover) for cover in body.covers)
        opened = [np.flatnonzero(~(clear | no | must)) for no, must in zip(broken, kept, strict=True)]
        leaves: list[list[Sequence[Leaf]]] = []
        for no, must in zip(broken, kept, strict=True):
            marks: list[Mark] = [CODES[code] or "may" for code in np.select([no, must], [0, 2], 1).tolist()]
            leaves.append([_WHOLE[mark] for mark in marks])
        return cls(body, values, thresholds, broken, opened, leaves)

    def never_in(self, paths: TeamPaths) -> NDArray[np.bool_]:
        """Tell for each robot whether one inequality of every part is broken on all of its segments. Shape (robots,)."""
        robots = len(paths.robots)
        always = [np.bincount(paths.owner, ~row, robots) == 0 for row in self.broken]
        return _all(_any(always[k] for k in part) for part in self.body.parts)

    def spans(self, paths: TeamPaths, k: int, indices: Sequence[int], margin: Fraction) -> list[Span]:
        """Return the spans of one inequality along one robot's segments."""
        spans: list[Span] = []
        for index in indices:
            segment, parts = paths.segments[index], self.leaves[k][index]
            if len(parts) == 1 and parts[0][2] is not None:
                append(spans, segment.start, segment.stop, parts[0][2])
            elif margin == 0:
                spans_without_margin(spans, Along(paths, index, self.body, k, self.values[k][index]), parts)
            else:
                for start, stop, mark in parts:
                    append(spans, segment.time(start), segment.time(stop), mark or "may")
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
        found = iter(classified(table, inside, outside, depth))
        for near, k in chosen:
            for index in near.open[k].tolist():
                near.leaves[k][index] = next(found)


def _settled(spans: list[Span]) -> tuple[Span, ...]:
    """Turn switches that do not part "no" from "must" into "may", and part the two where nothing does."""
    result: list[Span] = []
    for index, span in enumerate(spans):
        mark = span.mark
        if mark == "switch":
            around = {spans[i].mark for i in (index - 1, index + 1) if 0 <= i < len(spans)}
            mark = "switch" if around == {"no", "must"} else "may"
        if result and {result[-1].mark, mark} == {"no", "must"}:
            append(result, span.start, span.start, "may")
        append(result, span.start, span.stop, mark)
    return tuple(result)
