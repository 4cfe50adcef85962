"""At margin 0: where a path crosses the edge of a region, each crossing in a switch of its own, by exact roots where balls do not decide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from flint import fmpq_poly

from verify.arithmetic import exact
from verify.arithmetic.balls import Balls, halves
from verify.motion.membership.bodies import Body, Mark, Span, append
from verify.motion.membership.polynomials import exact_level
from verify.motion.membership.subdivision import Leaf
from verify.motion.paths import Segment, TeamPaths


@dataclass(frozen=True, eq=False, slots=True)
class Along:
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


def spans_without_margin(spans: list[Span], along: Along, leaves: Sequence[Leaf]) -> None:
    """Append the spans of one segment at margin 0, with each simple root as a switch.

    Args:
        spans: In order, up to the segment; changed.
        along: The inequality along the segment.
        leaves: The segment's parts, as they are sorted.
    """
    segment = along.segment
    for position, (start, stop, mark) in enumerate(leaves):
        around = {leaves[i][2] for i in (position - 1, position + 1) if 0 <= i < len(leaves)}
        if mark is not None:
            append(spans, segment.time(start), segment.time(stop), mark)
        elif around == {"no", "must"} and _is_monotone(along.values, start, stop):
            append(spans, segment.time(start), segment.time(stop), "switch")
        elif segment.kind == "piece":
            _exactly(spans, along, start, stop)
        else:
            append(spans, segment.time(start), segment.time(stop), "may")


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


def _exactly(spans: list[Span], along: Along, start: float, stop: float) -> None:
    """Decide a part of a piece that balls leave open, with exact roots: ties, tangencies, roots close together."""
    segment, level = along.segment, along.exact()
    low, high = Fraction(start), Fraction(stop)

    def mark_at(place: Fraction) -> Mark:
        return "must" if level(exact.rational(place)) <= 0 else "no"

    if level.degree() < 1:  # constant: on the boundary or on one side throughout
        append(spans, segment.time(low), segment.time(high), "may" if level == 0 else mark_at(low))  # pyright: ignore[reportUnnecessaryComparison]  # flint's polynomials compare with numbers
        return
    place = low
    for root in exact.roots(level, low, high, (high - low) / 16):
        if place < root.low:
            append(spans, segment.time(place), segment.time(root.low), mark_at((place + root.low) / 2))
        simple = root.multiplicity == 1 and low < root.low and root.high < high
        append(spans, segment.time(root.low), segment.time(root.high), "switch" if simple else "may")
        place = root.high
    if place < high:
        append(spans, segment.time(place), segment.time(high), mark_at((place + high) / 2))
