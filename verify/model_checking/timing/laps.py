"""Sets of times of laps that are flown for ever: from some time on they repeat themselves with the lap.

Letters repeat from the second lap on, later by what clocks may be late. All operators look into the future: whether a formula holds at t
depends on its parts from t on. By induction its times repeat from the same time `begin` on, with the same `period`. So a set is known by its
times before `begin + period`, and each operation is computed on as many repetitions as it looks at:

* Without a bound, what is reached at all after t is first reached before `begin + period`, or within a period where t is later. A later time
  helps nobody, as the other side has to hold until then. So `U` without a bound is `U` within `begin + period`, the fixed point of any further
  lap. A greater bound is the same.
* What lasts for `begin + period` from some time on lasts for ever.
* Times further ahead than `begin` are looked up a whole number of periods earlier.

So no operation looks further than `begin + period` ahead, whatever bounds nest and however short a lap is, and twice that is unrolled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from verify.model_checking.timeline import Change, Enclosure, InternalChange, Status, Timeline
from verify.model_checking.timing.instants import Instants, intersection, shifted, union

LAPS = 3
"""Laps of a timeline that are written out: the first may differ from the later ones, and the last ends with the timeline."""


@dataclass(frozen=True, slots=True)
class Recurrence:
    """A time from which sets of times repeat themselves, and how long one repetition lasts, in ticks."""

    begin: int
    period: int

    @property
    def reach(self) -> int:
        """The most ticks that an operation looks ahead, and the time before which a set is known."""
        return self.begin + self.period

    def later(self, ticks: int) -> Recurrence:
        """Return from when sets repeat that depend on times up to so many ticks ago."""
        return Recurrence(self.begin + ticks, self.period)

    def repeated(self, instants: Instants, end: int | None = None) -> Instants:
        """Return a set, of its times before `reach`, for longer.

        Args:
            instants: The set; what it says of later times is left out.
            end: Up to which time at least; None for twice the reach.
        """
        known, lap = (intersection(instants, (2 * low, 2 * self.reach)) for low in (0, self.begin))
        count = -(-((2 * self.reach if end is None else end) + 1 - self.reach) // self.period)
        return union(known, *(tuple(cut + 2 * number * self.period for cut in lap) for number in range(1, count + 1)))

    def ahead(self, instants: Instants, ticks: int) -> Instants:
        """Return the times t before `reach` for which t + ticks belongs to a set.

        Args:
            instants: The set, up to twice the reach.
            ticks: As many as one likes.
        """
        return shifted(instants, ticks if ticks <= self.begin else self.begin + (ticks - self.begin) % self.period)


def recurrence_of(timeline: Timeline, scale: int) -> Recurrence:
    """Return from when on what a timeline shows repeats itself, on the robot's own clock: just after its first lap.

    Args:
        timeline: With a cycle.
        scale: Ticks in a second.
    """
    assert timeline.cycle is not None
    return Recurrence(int(timeline.duration * scale) + 1, int((timeline.duration - timeline.cycle) * scale))


def unrolled(timeline: Timeline, laps: int = LAPS) -> Timeline:
    """Return prefix and laps, flown one after another without a wait, as one finite flight.

    A region that may be changing there, or with which a lap does not surely end as it begins, is open at the instant between two laps.

    Args:
        timeline: With a cycle.
        laps: How many.
    """
    assert timeline.cycle is not None
    begin, end = timeline.cycle, timeline.duration
    first, last = dict(timeline.initial), dict(timeline.initial)
    open_regions, again = set[str](), list[Change]()
    for change in timeline.changes:
        if change.time.high <= begin:
            first[change.region] = change.status
        else:
            again.append(replace(change, time=Enclosure(max(change.time.low, begin), change.time.high)))
        if change.time.low <= begin <= change.time.high or change.time.high == end:
            open_regions.add(change.region)
        last[change.region] = change.status
    open_regions |= {region for region in first.keys() | last.keys() if first.get(region, "no") != last.get(region, "no")}
    changes, actions = list(timeline.changes), list(timeline.actions)
    for number in range(1, laps):
        by = number * (end - begin)
        changes += _between(begin + by, sorted(open_regions), first)
        changes += [_moved(change, by) for change in again]
        actions += [_later(action, by) for action in timeline.actions if action.time >= begin]
    return replace(
        timeline, changes=tuple(changes), actions=tuple(actions), duration=end + (laps - 1) * (end - begin), cycle=None
    )


def _between(time: Fraction, regions: list[str], first: dict[str, Status]) -> list[Change]:
    """Return changes at the instant at which one lap ends and another begins: these regions are open there."""
    instant = Enclosure(time, time)
    opened = [Change(instant, region, "may") for region in regions]
    return opened + [Change(instant, region, first.get(region, "no")) for region in regions]


def _moved(change: Change, by: Fraction) -> Change:
    return replace(change, time=Enclosure(change.time.low + by, change.time.high + by))


def _later(action: InternalChange, by: Fraction) -> InternalChange:
    return replace(action, time=action.time + by, until=None if action.until is None else action.until + by)
