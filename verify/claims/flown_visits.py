"""Times of one robot's events, enclosed: when it enters and leaves regions, acts, and sets out for its next visit.

A region is entered from when the path may be in it until it is for sure, and left from when the path may be out of it again until it is
for sure. A robot sets out for its first visit at the first instant at which its nominal path differs from its start; for a later one, where
it stands still for the last time before it leaves the visit before, or comes to the new one. Where it never stands still there, it has been
on its way since it came to the visit before. For the first visit of a lap it sets out from where the lap begins, which need be no visit, or
where it stood still before that; where it rests later in the lap it has set out already. Laps
are alike: an event of a lap's visit comes again one lap later.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.data.plan import Meeting, Precedence
from verify.data.trajectory import Trajectory
from verify.model_checking.timeline import Enclosure, Timeline
from verify.motion.standing import Standstill, first_motion, standstills
from verify.motion.visits import Matching, Stay

Wait = Precedence | Meeting


@dataclass(frozen=True, slots=True)
class FlownVisits:
    """One robot's visits as they are flown: once, or in a prefix and two laps.

    Attributes:
        matching: Its planned visits and their stays.
        timeline: Its actions, and when the flight or the first lap ends.
        length: s that a lap takes; 0 for a finite flight.
        moves: The first instant at which its nominal path differs from its start, s; None where it never does.
        departs: The first instant at which it differs from where its first lap begins, s; None where it never does, or has no laps.
        stands: When its nominal path stands still, in order.
    """

    matching: Matching
    timeline: Timeline
    length: Fraction
    moves: Fraction | None
    departs: Fraction | None
    stands: tuple[Standstill, ...]

    @classmethod
    def of(cls, matching: Matching, timeline: Timeline, trajectory: Trajectory, knots: Sequence[Fraction]) -> FlownVisits:
        """Read when a path moves and stands still.

        Args:
            matching: Its planned visits and their stays.
            timeline: Its actions, and when the flight ends.
            trajectory: What is flown.
            knots: Exact start of each piece and end of the last, s.
        """
        stands = tuple(standstills(trajectory, knots))
        length = Fraction(0) if timeline.cycle is None else timeline.duration - timeline.cycle
        if timeline.cycle is not None:
            again = [stand for stand in stands if stand.start >= timeline.cycle]
            stands += tuple(Standstill(stand.start + length, stand.stop + length) for stand in again)
        departs = None if trajectory.cycle is None else first_motion(trajectory, knots, trajectory.cycle)
        return cls(matching, timeline, length, first_motion(trajectory, knots), departs, stands)

    def makes(self, visit: int) -> bool:
        """Return whether it is proved that a planned visit is made, of laps in which lap."""
        known = self.timeline.cycle is None or not self.matching.fault
        return known and visit < len(self.matching.stays)

    def repeats(self, visit: int) -> bool:
        """Return whether a visit is made in every lap."""
        return self.matching.lap is not None and visit >= self.matching.lap

    def done(self, visit: int, wait: Wait, lap: int = 0) -> Enclosure | None:
        """Return when what is waited for happens, in s; None where it never does.

        Args:
            visit: Index of a planned visit.
            wait: Says what it is.
            lap: 0 for the first lap, 1 for the second.
        """
        if isinstance(wait, Meeting) or wait.done == "entered":
            return self._entered(visit, lap)
        return self._left(visit, lap) if wait.done == "left" else self._acted(visit, -1, lap)

    def due(self, visit: int, wait: Wait, lap: int = 0) -> Enclosure | None:
        """Return when what has to wait happens, in s; None where it never does.

        Args:
            visit: Index of a planned visit.
            wait: Says what it is.
            lap: 0 for the first lap, 1 for the second.
        """
        if isinstance(wait, Meeting):
            return self._set_out(visit, lap)
        if wait.due == "enters":
            return self._entered(visit, lap)
        return self._left(visit, lap) if wait.due == "leaves" else self._acted(visit, 0, lap)

    def _stay(self, visit: int) -> Stay:
        return self.matching.flown[visit]

    def _entered(self, visit: int, lap: int) -> Enclosure:
        found = self._enclosed(self._stay(visit))
        if not lap:
            return found
        again = self._enclosed(self._stay(len(self.matching.stays) + visit - (self.matching.lap or 0)))
        return Enclosure(min(found.low + self.length, again.low), max(found.high + self.length, again.high))

    def _enclosed(self, stay: Stay) -> Enclosure:
        return Enclosure(stay.start, stay.must[0][0] if stay.must else stay.stop)

    def _left(self, visit: int, lap: int) -> Enclosure | None:
        return self._leaves(self._stay(visit), lap * self.length)

    def _leaves(self, stay: Stay, later: Fraction) -> Enclosure | None:
        """Return when a region is left: after the first time in it for sure, for the path may go to and fro at its boundary."""
        begins = stay.must[0][1] if stay.must else stay.start
        return None if begins >= self.timeline.duration + self.length else Enclosure(begins + later, stay.stop + later)

    def _acted(self, visit: int, which: int, lap: int) -> Enclosure | None:
        times = [action.time + lap * self.length for action in self.timeline.actions if action.visit == visit]
        return Enclosure(times[which], times[which]) if times else None

    def _set_out(self, visit: int, lap: int) -> Enclosure | None:
        """Return when it sets out for a visit; no later than it may leave where it is, or come to where it goes."""
        there, seam = self._entered(visit, lap), (self.timeline.cycle or Fraction(0)) + lap * self.length
        opens = visit == self.matching.lap  # the first visit of a lap: it sets out from where the lap begins
        if visit == 0 and not lap and not (opens and self.moves is not None and self.moves < seam):
            if self.moves is None:
                return None
            extra = self.matching.extra
            left = None if extra is None else self._leaves(extra, Fraction(0))
            low = there.low if left is None else min(left.low, there.low)
            return Enclosure(min(self.moves, low), min(self.moves, there.high))
        begun, left = self._before(visit, lap)
        if opens and left is not None and left.high <= seam:
            left = None
        low, high = (there.low, there.high) if left is None else (min(left.low, there.low), min(left.high, there.high))
        if opens and left is None and self.departs is not None:
            low = min(low, self.departs + lap * self.length)
        stands = [stand.stop for stand in self.stands if stand.start <= low and stand.stop >= begun]
        return Enclosure(min(stands[-1], low), min(stands[-1], high)) if stands else Enclosure(min(begun, low), high)

    def _before(self, visit: int, lap: int) -> tuple[Fraction, Enclosure | None]:
        """Return from when the visit before lasts, and when it is left; of the first visit of a later lap that is the lap's last one."""
        number, of_lap = (len(self.matching.stays) - 1, 0) if lap and visit == self.matching.lap else (visit - 1, lap)
        if number >= 0:
            return self._entered(number, of_lap).low, self._left(number, of_lap)
        extra = self.matching.extra
        return Fraction(0), None if extra is None else self._leaves(extra, Fraction(0))
