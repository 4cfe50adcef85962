"""A region as the checker sees it: exact inequalities, and what their answers at one time come to.

A robot is out of a region for sure where every part has an inequality that is broken by the margin, and in it for sure where all
inequalities of one convex body within the region are kept by the margin: of a part, or of one that reaches across the faces that
parts share (`verify.data.shapes.conditions.covers`).
"""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Literal

from verify.data.shapes.conditions import Condition, condition
from verify.data.shapes.covers import covers
from verify.data.shapes.inequalities import Inequality, Parts, Point
from verify.data.shapes.region import Region
from verify.model_checking.timeline import Status

Mark = Literal["no", "may", "must", "switch"]


@dataclass(frozen=True, slots=True)
class Span:
    """A part of one path with one status; "switch" holds exactly one crossing of the boundary."""

    start: Fraction
    stop: Fraction
    mark: Mark


@dataclass(frozen=True, slots=True)
class Body:
    """A region's inequalities, each once.

    Attributes:
        centre: m, world frame; the inequalities are around it.
        inequalities: As they are stored.
        conditions: The same, as they are asked of points.
        parts: For each part the indices of its inequalities.
        covers: For each convex body within the region the indices of its inequalities.
    """

    centre: Point
    inequalities: tuple[Inequality, ...]
    conditions: tuple[Condition, ...]
    parts: tuple[tuple[int, ...], ...]
    covers: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, region: Region) -> Body:
        """Take centre and inequalities of a region or hoop.

        Raises:
            BadInput: An inequality is none that is understood.
        """
        return _body(region.center, region.body)

    def status(self, marks: Sequence[Mark]) -> Status:
        """Return what is known of the region where so much is known of each inequality: "must" keeps it, "no" breaks it."""
        if any(all(marks[k] == "must" for k in cover) for cover in self.covers):
            return "must"
        return "no" if all(any(marks[k] == "no" for k in part) for part in self.parts) else "may"


@lru_cache(maxsize=4096)
def _body(centre: Point, parts: Parts) -> Body:
    around = covers(parts)
    every = tuple(dict.fromkeys(one for cover in (*parts, *around) for one in cover))
    number = {one: k for k, one in enumerate(every)}
    return Body(
        centre,
        every,
        tuple(map(condition, every)),
        tuple(tuple(number[one] for one in part) for part in parts),
        tuple(tuple(number[one] for one in cover) for cover in around),
    )


def append(spans: list[Span], start: Fraction, stop: Fraction, mark: Mark) -> None:
    """Add a part of a path to its spans, as one with the last where both have one status.

    Args:
        spans: In order; changed.
        start: Where the last one ends.
        stop: Where the part ends.
        mark: Its status.
    """
    if spans and spans[-1].mark == mark != "switch":
        spans[-1] = Span(spans[-1].start, stop, mark)
    else:
        spans.append(Span(start, stop, mark))


def region_spans(body: Body, rows: Sequence[Sequence[Span]]) -> list[Span]:
    """Return a region's spans from those of its inequalities, over the same times.

    Instants at which anything changes and the times between them are looked at in turn. A span with exactly one crossing of one
    inequality is one of the region where no other inequality changes meanwhile and the region changes with this one.

    Args:
        body: The region.
        rows: For each inequality its spans, in order and without gaps.
    """
    times = sorted({time for row in rows for span in row for time in (span.start, span.stop)})
    slots: list[list[Mark]] = [_slots(row, times) for row in rows]
    columns: list[tuple[Mark, ...]] = list(zip(*slots, strict=True))
    marks: list[Mark] = [body.status(column) for column in columns]
    for number, row in enumerate(rows):
        for span in row:
            if span.mark != "switch":
                continue
            first, last = bisect.bisect_left(times, span.start), bisect.bisect_left(times, span.stop)
            at = first + last  # of the instant, or of the time between two that follow each other
            if last - first > 1 or marks[at] != "may":
                continue
            around = columns[at]
            if (_with(body, around, number, "must"), _with(body, around, number, "no")) == ("must", "no"):
                marks[at] = "switch"
    return _joined(marks, times)


def _with(body: Body, marks: Sequence[Mark], number: int, mark: Mark) -> Status:
    """Return what is known of a region where one inequality's mark is another one."""
    changed: list[Mark] = [mark if k == number else other for k, other in enumerate(marks)]
    return body.status(changed)


def _slots(row: Sequence[Span], times: Sequence[Fraction]) -> list[Mark]:
    """Return an inequality's marks at each time and between each and the next, in turn. At an instant between two closed spans both hold."""
    place = {time: k for k, time in enumerate(times)}
    marks: list[Mark] = ["may"] * (2 * len(times) - 1)
    for span in row:
        first, last = 2 * place[span.start], 2 * place[span.stop]
        for k in range(first + 1, last):
            marks[k] = span.mark
        if span.mark in ("no", "must"):
            marks[first] = marks[last] = span.mark
    for span in row:
        if span.start == span.stop:
            marks[2 * place[span.start]] = span.mark
    return marks


def _joined(marks: Sequence[Mark], times: Sequence[Fraction]) -> list[Span]:
    """Join marks into spans; an instant's is kept only where it is another one than "no" and "must" beside it allow."""
    spans: list[Span] = []
    for k, mark in enumerate(marks):
        start, stop = times[k // 2], times[(k + 1) // 2]
        if k % 2 == 0:
            beside = {marks[i] for i in (k - 1, k + 1) if 0 <= i < len(marks)}
            if mark in beside:
                continue  # a closed span beside it holds here too
            if mark != "switch":
                mark = "may"
        append(spans, start, stop, mark)
    return spans
