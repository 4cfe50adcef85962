"""Time windows of legs: the times at which the limits of the way to a visit hold.

The way to a visit ends when the robot is in the region for sure. It begins with the last earlier visit that is over for sure
before the robot may be in the region, as soon as it may have left that earlier one: a visit that may last longer is around this
one, or overlaps it, and what leads there from within it leads here as well. Where there is none the way begins with the flight.
Times surely in that earlier visit do not count. An excursion out of the region and back is a way to it as well: between two
times surely in it, and after the last one wherever the nominal path itself leaves and comes back. In a lap a visit is come to
from the lap before, too.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from fractions import Fraction

from verify.motion.membership.bodies import Span
from verify.motion.visits import Matching, Stay, two_laps

Window = tuple[Fraction, Fraction]
"""From one exact time to a later one, in s."""


def ways(matching: Matching, visit: int, nominal: tuple[Span, ...], knot: Fraction | None = None) -> tuple[Window, ...]:
    """Return the times at which a robot may be on its way to a visit; none where it starts there and never leaves and returns.

    Args:
        matching: The robot's visits as stays, this one among them.
        visit: Index of the planned visit.
        nominal: The region's spans at margin 0: of the nominal path itself.
        knot: For a lasso, when its lap begins, in s. All times of a lasso are those of its prefix and first lap.
    """
    if knot is None or matching.lap is None:
        return tuple(_windows(matching.flown, visit, nominal))
    end = nominal[-1].stop
    spans = two_laps(nominal, knot)
    found = list(_windows(matching.flown, visit, spans))
    if visit >= matching.lap:
        found += _windows(matching.flown, visit + len(matching.stays) - matching.lap, spans)
    parts = [part for low, high in found for part in ((low, min(high, end)), (max(low, end) - end + knot, high - end + knot))]
    return tuple((low, high) for low, high in parts if low < high)


def _windows(stays: Sequence[Stay], visit: int, nominal: Sequence[Span]) -> Iterator[Window]:
    stay = stays[visit]
    arrival = stay.must[0][0]
    before = next((earlier for earlier in reversed(stays[:visit]) if earlier.stop < stay.start), None)
    if before is not None:
        yield from _between(before.must)
        yield before.must[-1][1], arrival
    elif arrival > 0:
        yield Fraction(0), arrival
    yield from _between(stay.must)
    yield from _excursion(stay, nominal)


def _between(must: Sequence[Window]) -> Iterator[Window]:
    """Yield the gaps between times surely in a region."""
    return ((first[1], then[0]) for first, then in itertools.pairwise(must) if first[1] < then[0])


def _excursion(stay: Stay, nominal: Sequence[Span]) -> Iterator[Window]:
    """Yield from where to where the nominal path is out of a region and back, after it was in it for sure for the last time."""
    left = [span for span in nominal if span.stop > stay.must[-1][1] and span.start < stay.stop]
    while left and left[-1].mark == "no":
        left.pop()
    if left and left[-1].mark == "switch":  # one crossing: the robot leaves
        left.pop()
    out = [span for span in left if span.mark != "must"]
    if out:
        yield max(out[0].start, stay.must[-1][1]), min(left[-1].stop, stay.stop)
