"""Precedences between events of two robots, and the times at which a robot may be on its way to a region.

Of an event before which another waits the latest time counts, of the one that waits the earliest. A region is entered for sure when the
path first must be in it, and left for sure when the stay is over; it may be entered when the stay begins, and left after the first time
in it for sure. A robot sets out for its first visit when its nominal path first leaves the start, and for a later one where it stands
still for the last time before it leaves where it is or comes to where it goes. Of a visit of every lap two laps are looked at, which all
later ones repeat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from .bodies import ZERO
from .flights import Path, Piece
from .labels import Row
from .limits import Window
from .refused import Refused
from .timelines import Stay, Visits, gaps, two_laps


@dataclass(frozen=True)
class Events:
    """One robot's visits and actions in time, of a lasso in its prefix and two laps; `end` is when the flight, or its first lap, ends."""

    path: Path
    made: Visits
    end: Fraction

    @property
    def _length(self) -> Fraction:
        """What a lap takes, s."""
        return ZERO if self.path.lap is None else self.end - self.path.lap

    def repeats(self, visit: int) -> bool:
        """Return whether every lap makes a visit."""
        return self.made.lap is not None and visit >= self.made.lap

    def _stays(self, visit: int, lap: int) -> list[tuple[Stay, Fraction]]:
        """Return the stays that a visit of a lap may be, and how much later each is: laps differ in what a stay over a seam has before it."""
        again = [(self.made.flown[len(self.made.stays) + visit - (self.made.lap or 0)], ZERO)] if lap else []
        return [(self.made.flown[visit], lap * self._length), *again]

    def done(self, visit: int, what: str, lap: int) -> Fraction:
        """Return until when an event is over, s.

        Args:
            visit: Of which visit.
            what: Which event.
            lap: 0 for the first lap, 1 for the second.

        Raises:
            Refused: It may never be.
        """
        if what == "entered":
            return max(stay.sure[0].start + later for stay, later in self._stays(visit, lap))
        stay, later = self._stays(visit, lap)[0]
        times = [deed.time + later for deed in self.path.robot.changes if deed.visit == visit]
        if what == "left" and stay.stop < self.end + self._length:
            return stay.stop + later
        if what == "left" or not times:
            raise Refused("what is waited for may never be over")
        return max(times)

    def due(self, visit: int, what: str, lap: int) -> Fraction | None:
        """Return from when an event may happen, s; None where it never does.

        Args:
            visit: Of which visit.
            what: Which event.
            lap: 0 for the first lap, 1 for the second.
        """
        if what == "sets out":
            return self._sets_out(visit, lap)
        if what == "enters":
            return self._enters(visit, lap)
        stay, later = self._stays(visit, lap)[0]
        times = [deed.time + later for deed in self.path.robot.changes if deed.visit == visit]
        return self._leaves(stay, later) if what == "leaves" else min(times, default=None)

    def _enters(self, visit: int, lap: int) -> Fraction:
        return min(stay.start + later for stay, later in self._stays(visit, lap))

    def _leaves(self, stay: Stay | None, later: Fraction) -> Fraction | None:
        if stay is None:
            return None
        begins = stay.sure[0].stop
        return None if begins >= self.end + self._length else begins + later

    def _sets_out(self, visit: int, lap: int) -> Fraction | None:
        there, seam = self._enters(visit, lap), (self.path.lap or ZERO) + lap * self._length
        opens, extra = (
            visit == self.made.lap,
            self.made.extra,
        )  # the first visit of a lap: it sets out from where the lap begins
        moves = _first_motion(self.path, 0)
        if visit == 0 and not lap and not (opens and moves is not None and moves < seam):
            left = self._leaves(extra, ZERO)
            return None if moves is None else min(moves, there, there if left is None else left)
        number, of_lap = (len(self.made.stays) - 1, 0) if lap and opens else (visit - 1, lap)
        stay, later = self._stays(number, of_lap)[0] if number >= 0 else (extra, ZERO)
        begun, left = self._enters(number, of_lap) if number >= 0 else ZERO, self._leaves(stay, later)
        if opens and stay is not None and stay.stop + later <= seam:
            left = None
        low = there if left is None else min(left, there)
        if opens and left is None and self.path.robot.cycle is not None:
            departs = _first_motion(self.path, self.path.robot.cycle)
            low = low if departs is None else min(low, departs + lap * self._length)
        stands = [stop for start, stop in self._stands() if start <= low and stop >= begun]
        return min(max(stands, default=begun), low)

    def _stands(self) -> list[Window]:
        """Return when the nominal path stands still, if only for an instant with velocity, acceleration and jerk of zero."""
        found: list[Window] = []
        for piece, start, stop in zip(self.path.pieces, self.path.knots, self.path.knots[1:], strict=False):
            if _is_still(piece, 4):
                found.append((start, stop if _is_still(piece, 8) else start))
        if self.path.lap is not None:
            found += [(a + self._length, b + self._length) for a, b in found if a >= self.path.lap]
        return found


def _is_still(piece: Piece, powers: int) -> bool:
    return not any(any(axis.numbers[1:powers]) for axis in piece.axes[:3])


def _first_motion(path: Path, since: int) -> Fraction | None:
    """Return when a path first differs from where a piece begins, s; a polynomial that is not constant leaves its value at once."""
    begin = [axis.at(0) for axis in path.pieces[since].axes[:3]]
    for number, piece in enumerate(path.pieces[since:], start=since):
        if not _is_still(piece, 8) or [axis.at(0) for axis in piece.axes[:3]] != begin:
            return path.knots[number]
    return None


def windows(made: Visits, visit: int, nominal: Row, knot: Fraction | None) -> list[Window]:
    """Return the times at which a robot may be on its way to a visit.

    The way ends when the robot must be in the region, and begins with the last earlier visit that is over before the robot may be in the
    region, once that one may have been left; without one, with the flight. Times in which it must be in either do not count, gaps between them
    do. After the last time surely in the region the nominal path's excursions count until it leaves for good.

    Args:
        made: The robot's visits.
        visit: Which.
        nominal: The region's spans at margin 0.
        knot: When its lap begins, s; all times are those of prefix and first lap. In a lap a visit is come to from the lap before, too.
    """
    end, spans = nominal[-1].stop, two_laps(nominal, knot)
    found = _windows(made.flown, visit, spans)
    if knot is None or made.lap is None:
        return found
    if visit >= made.lap:
        found += _windows(made.flown, visit + len(made.stays) - made.lap, spans)
    parts = [part for low, high in found for part in ((low, min(high, end)), (max(low, end) - end + knot, high - end + knot))]
    return [(low, high) for low, high in parts if low < high]


def _windows(stays: Sequence[Stay], visit: int, nominal: Row) -> list[Window]:
    stay = stays[visit]
    before = next((earlier for earlier in reversed(stays[:visit]) if earlier.stop < stay.start), None)
    found = gaps(stay.sure)
    found += (
        [(ZERO, stay.sure[0].start)] if before is None else [*gaps(before.sure), (before.sure[-1].stop, stay.sure[0].start)]
    )
    left = [span for span in nominal if span.stop > stay.sure[-1].stop and span.start < stay.stop]
    while left and left[-1].mark in ("no", "fall"):
        left.pop()
    if out := [span for span in left if span.mark != "must"]:
        found.append((max(out[0].start, stay.sure[-1].stop), min(left[-1].stop, stay.stop)))
    return [(low, high) for low, high in found if low < high]
