"""Stays of a refined flight: when robots surely, and possibly, show a proposition, as functions of pace and hovers.

A flight that is flown `stretch` times slower, with more hovers, comes to each event at `stretch * time` and the hovers before it. The judge
decides the flight that is refined so; here times are only chosen.

Laps are written out one after another, as many as bounds look ahead: a hover within a lap counts once for each that was begun before an event.
A team's laps begin together: each is as much longer as the robot hovers in it that hovers longest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from verify.data import Plan
from verify.model_checking.timeline import Timeline
from verify.model_checking.timing.laps import unrolled

HoverPlace = tuple[str, int]
"""A robot, and where it hovers: -1 at its start, the index of a visit, the number of its visits at its end."""

_MOST_LAPS = 6
"""Laps that are written out: bounds of many laps leave more than enough time, or ask for what has to hold in each."""


@dataclass(frozen=True, slots=True)
class Instant:
    """Time of an event: `moving * stretch` and the hovers before it, each with its share.

    Attributes:
        moving: s of flight before it, hovers left out.
        hovers: For each place: which share of a hover there lies before it; of a team those of earlier laps are left out.
        laps: How many laps of a team are over.
    """

    moving: float
    hovers: Mapping[HoverPlace, float]
    laps: int = 0


@dataclass(frozen=True, slots=True)
class Stay:
    """A span of time in which a robot shows a proposition; None where it began, or goes on, beyond the flight."""

    begin: Instant | None
    end: Instant | None


@dataclass(frozen=True, slots=True)
class Presence:
    """Stays of one robot, by proposition.

    Attributes:
        sure: For each proposition the stays in which it surely shows it, in order.
        possible: The same of those in which it may show it.
        end: When its flight ends, or the laps that are written out.
        lap: When its first lap ends: what is asked for ever is asked up to then. None of a finite flight.
        again: Where one of a team may hover in its laps.
    """

    sure: Mapping[str, tuple[Stay, ...]]
    possible: Mapping[str, tuple[Stay, ...]]
    end: Instant
    lap: Instant | None = None
    again: tuple[HoverPlace, ...] = ()


def laps_ahead(timelines: Mapping[str, Timeline], seconds: float) -> int:
    """Return how many laps are written out for bounds of so many seconds in all; 1 for a finite flight.

    Args:
        timelines: One for each robot.
        seconds: All bounds together.
    """
    first = next(iter(timelines.values()))
    if first.cycle is None:
        return 1
    return min(2 + math.ceil(seconds / float(first.duration - first.cycle)), _MOST_LAPS)


def presence_of(plan: Plan, robot: str, timeline: Timeline, lasts: float, laps: int = 1) -> Presence:
    """Return what one robot of a refined flight shows.

    Args:
        plan: With the hovers that the flight has.
        robot: Its name.
        timeline: What it may show, as the judge has it.
        lasts: Its own flight's duration, s; the team's may be longer.
        laps: How many are written out.
    """
    clock, lap = _Clock.of(plan, robot, timeline), None
    if timeline.cycle is not None:
        lap, timeline = clock.instant(float(timeline.duration)), unrolled(timeline, laps)
        clock, lasts = clock.repeated(plan.robots[robot].cycle_visit or 0, laps), float(timeline.duration)
    sure: dict[str, tuple[Stay, ...]] = {}
    possible: dict[str, tuple[Stay, ...]] = {}
    for region in timeline.initial.keys() | {change.region for change in timeline.changes}:
        sure[region] = tuple(clock.stay(*span) for span in _spans(timeline, region, sure=True))
        possible[region] = tuple(clock.stay(*span) for span in _spans(timeline, region, sure=False))
    times = [None, *(float(action.time) for action in timeline.actions), None]
    internal = [timeline.internal, *(action.propositions for action in timeline.actions)]
    for name in sorted(frozenset[str]().union(*internal)):
        spans = (span for span, names in zip(itertools.pairwise(times), internal, strict=True) if name in names)
        sure[name] = possible[name] = tuple(clock.stay(*span) for span in spans)
    return Presence(sure, possible, clock.instant(lasts, last=lap is None), lap, clock.again)


def _spans(timeline: Timeline, region: str, *, sure: bool) -> Iterator[tuple[float | None, float | None]]:
    """Yield when a robot surely is, or may be, in a region, s; None for the flight's begin and end."""
    inside = ("must",) if sure else ("must", "may")
    status, since = timeline.initial.get(region, "no"), None
    for change in timeline.changes:
        if change.region != region:
            continue
        was, now = status in inside, change.status in inside
        if now and not was:
            since = float(change.time.high if sure else change.time.low)
        if was and not now:
            yield since, float(change.time.low if sure else change.time.high)
        status = change.status
    if status in inside:
        yield since, None


@dataclass(frozen=True)
class _Clock:
    """The times at which one robot rests at its visits, by which other times are told as flight and hovers.

    Attributes:
        robot: Its name.
        rests: Visits, and when it rests there, s.
        held: For how long it hovers in this flight, s, by visit.
        last: How many visits it makes.
        period: How long a lap lasts, s.
        laps: When a team's laps begin, s, the first visit of one robot's, and how much longer they are for their hovers, s; None of others.
    """

    robot: str
    rests: tuple[tuple[int, float], ...]
    held: Mapping[int, float]
    last: int
    period: float
    laps: tuple[float, int, float] | None = None

    @classmethod
    def of(cls, plan: Plan, robot: str, timeline: Timeline) -> _Clock:
        rests: list[tuple[int, float]] = []
        after = -1.0
        for number, visit in enumerate(plan.robots[robot].visits):
            spans = [
                (a or 0.0, float(timeline.duration) if b is None else b) for a, b in _spans(timeline, visit.region, sure=True)
            ]
            begin, end = next((span for span in spans if sum(span) / 2 > after), (after, after))
            after = (begin + end) / 2
            rests.append((number, after))
        held: dict[int, float] = {}
        for hover in plan.hovers:
            if hover.robot == robot:
                held[hover.visit] = held.get(hover.visit, 0.0) + hover.seconds
        cycle, laps = timeline.cycle, None
        if cycle is not None and len(plan.robots) > 1:
            begins = {name: other.cycle_visit or 0 for name, other in plan.robots.items()}
            longer = [sum(h.seconds for h in plan.hovers if h.robot == name and h.visit >= at) for name, at in begins.items()]
            laps = float(cycle), begins[robot], max(longer)
            rests = [
                (v, rest) for v, rest in rests if v >= begins[robot] or rest < cycle
            ]  # a team that waits to begin hovers there
        return cls(
            robot,
            tuple(rests),
            held,
            len(plan.robots[robot].visits),
            0.0 if cycle is None else float(timeline.duration - cycle),
            laps,
        )

    @property
    def again(self) -> tuple[HoverPlace, ...]:
        """Places in laps at which one of a team may hover."""
        return () if self.laps is None else tuple((self.robot, visit) for visit, _ in self.rests if visit >= self.laps[1])

    def repeated(self, cycle_visit: int, laps: int) -> _Clock:
        """Return the clock of laps that are written out, each with its rests.

        Args:
            cycle_visit: The first visit of a lap.
            laps: How many.
        """
        if self.laps is not None:
            return self
        again = [(visit, rest + number * self.period) for number in range(1, laps) for visit, rest in self.rests[cycle_visit:]]
        return replace(self, rests=(*self.rests, *again))

    def stay(self, begin: float | None, end: float | None) -> Stay:
        return Stay(None if begin is None else self.instant(begin), None if end is None else self.instant(end))

    def instant(self, time: float, *, last: bool = False) -> Instant:
        """Return a time of the flight as flight and hovers before it; `last` for its end."""
        number, longer, local = 0, 0.0, time
        if self.laps is not None:
            begin, _, longer = self.laps
            number = max(math.floor((time - begin + 1e-6) / self.period), 0)
            local = time - number * self.period
        before = {} if self.laps is not None and self.laps[1] == 0 else {(self.robot, -1): 1.0}
        for visit, rest in self.rests:
            if rest < local + 1e-6:
                share = 0.5 if abs(local - rest) < 1e-6 else 1.0
                before[self.robot, visit] = before.get((self.robot, visit), 0.0) + share
        if last:
            before |= {(self.robot, visit): 1.0 for visit in range(-1, self.last + 1)}
        moving = time - sum(share * self.held.get(place[1], 0.0) for place, share in before.items()) - number * longer
        return Instant(max(moving, 0.0), before, number)
