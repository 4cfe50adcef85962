"""One robot's flight: when it must be in each region, and must not; its stays there, which are its visits; its actions, passages and waits.

All of it is said of every path that stays within the margin of the robot's own at every time. Of a lasso, rows of spans are *unrolled* where visits
are compared: prefix and three laps, times going on. The first two laps show all that the later ones repeat.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import groupby, pairwise
from operator import itemgetter
from typing import NamedTuple

from .flights import Path, Segment
from .limits import kept
from .statement import ZERO, Limit, Statement, Visit, Wait, at_least, require
from .trees import Cell, Evidence, leaves
from .zones import Hoop, along, opening, region

LAPS = 3
Window = tuple[Fraction, Fraction]
Leaf = tuple[Fraction, Fraction, str, Cell]  # from when to when, s, with which mark, and what is known there


class Span(NamedTuple):
    """A closed time, in all of which, ends included, `no` or `must` holds; in `may` anything happens, in `out` nobody comes in who has gone out."""

    start: Fraction
    stop: Fraction
    mark: str


Row = tuple[Span, ...]  # spans over a whole flight, one after another


class Timeline(NamedTuple):
    """Labels of one robot until the flight, or the first lap, which begins at `cycle`, ends: of regions, and internal ones, which change at instants."""

    robot: str
    duration: Fraction
    rows: Mapping[str, Row]
    internal: frozenset[str]
    actions: tuple[tuple[Fraction, frozenset[str]], ...]
    cycle: Fraction | None


class Stay(NamedTuple):
    """A time in a region: not before `start`, and not after `stop`; in it for sure in the spans `must`."""

    start: Fraction
    stop: Fraction
    region: str
    must: list[Span]

    def surely_holds(self, start: Fraction, stop: Fraction) -> bool:
        """Return whether it is in the region for sure all the while."""
        return any(span.start <= start and stop <= span.stop for span in self.must)


def joined(row: Iterable[Span]) -> Row:
    """Join neighbours that are alike."""
    found: list[Span] = []
    for span in row:
        start = found.pop().start if found and found[-1].mark == span.mark else span.start
        found.append(Span(start, span.stop, span.mark))
    return tuple(found)


def stays(rows: Mapping[str, Row]) -> list[Stay]:
    """Return the stays in regions."""
    found: list[Stay] = []
    for name, row in rows.items():
        for is_out, run in ((is_out, [*run]) for is_out, run in groupby(row, lambda span: span.mark == "no")):
            if not is_out:
                found.append(Stay(run[0].start, run[-1].stop, name, [span for span in run if span.mark == "must"]))
    return found


def planned_stays(planned: Sequence[Visit], found: list[Stay]) -> tuple[list[Stay], list[Stay]]:
    """Return the stay in which a robot begins, if that is no visit, and then the stay of each planned visit."""
    wanted = [visit.region for visit in planned]
    begins = int(bool(found) and found[0].start == 0 and len(found) == len(wanted) + 1)
    shown = ", ".join(stay.region for stay in found[:20]) or "none"
    require([stay.region for stay in found[begins:]] == wanted, f"it makes other visits than planned: {shown}")
    return found[:begins], found[begins:]


def event(what: str, made: tuple[Stay, Sequence[Fraction], Fraction]) -> Fraction | None:
    """Return when an event of a stay, with its actions, is surely over, or may first happen; never, where it lasts until all does, or none is there.
    It is surely entered when the robot must be in the region, and left when the stay is over; it may be left after the first *must*.
    """
    stay, acts, last = made
    left, leaves = (time if time < last else None for time in (stay.stop, stay.must[0].stop))
    over = {"entered": stay.must[0].start, "left": left, "acted": max(acts, default=None)}
    return (over | {"enters": stay.start, "leaves": leaves, "acts": min(acts, default=None)})[what]


class Course:
    """One robot's path, and what follows from it and the evidence."""

    def __init__(self, statement: Statement, path: Path, evidence: Evidence) -> None:
        self.statement, self.path, self.evidence = statement, path, evidence
        self.name, self.robot, self.lap = path.name, path.robot, path.lap
        self.end = path.segments[-1].stop
        self.length = ZERO if path.lap is None else self.end - path.lap
        self._last = self.end + (LAPS - 1) * self.length

    def _along(self, key: str, segments: Sequence[Segment], cells: Iterable[Cell]) -> list[Leaf]:
        """Return the leaves of trees along segments of the path."""
        marks, found = self.evidence.marks(key), list[tuple[Fraction, str, Cell]]()
        for one, cell in zip(segments, cells, strict=True):
            found += [(one.start + u * (one.stop - one.start), mark, part) for u, mark, part in leaves(cell, marks)]
        stops = [*(start for start, *_ in found[1:]), segments[-1].stop]
        return [(start, stop, mark, part) for (start, mark, part), stop in zip(found, stops, strict=True)]

    def row(self, kind: str, name: str) -> Row:
        """Return spans of a region: `inside` it at the margin, or of the `nominal` path."""
        rules = region(self.statement.regions[name], self.statement.margin if kind == "inside" else ZERO)
        marks = {"n": "no", "m": "must", "o": "out" if kind == "nominal" else "may"}
        row = [leaf[:3] for leaf in self._along(f"{kind}/{self.name}/{name}", self.path.segments, along(self.path, rules))]
        require(kind != "inside" or self._are_whole(row), f"it may leave {name} and come back in what is taken for one stay")
        return joined(Span(start, stop, marks.get(mark, "may")) for start, stop, mark in row)

    def _are_whole(self, row: Sequence[tuple[Fraction, Fraction, str]]) -> bool:
        """Return whether it comes and goes once between spans surely outside, over a lap's seam too (Coq: `one_stay`, `comes_joined`)."""
        lasting = [(start, mark) for start, stop, mark in row if mark != "n" or start < stop]
        again = [mark for start, mark in lasting if self.lap is not None and start >= self.lap]
        return not re.search(r"\?|o[^n]*i", "".join([*(mark for _, mark in lasting), *again]))

    @cached_property
    def rows(self) -> dict[str, Row]:
        """Spans of each region."""
        return {name: self.row("inside", name) for name in self.statement.regions}

    def unrolled(self, row: Row) -> Row:
        """Return the spans of a lasso's prefix and laps; of no lasso the spans."""
        found = list(row)
        for k in range(1, LAPS if self.lap is not None else 1):
            begin, later = self.lap or ZERO, k * self.length
            found += [Span(max(start, begin) + later, stop + later, mark) for start, stop, mark in row if stop > begin]
        return joined(found)

    @cached_property
    def _begun_and_stays(self) -> tuple[list[Stay], list[Stay]]:
        begun, made = planned_stays(self.robot.visits, sorted(stays(self.rows)))
        missed = [stay.region for stay in made if not stay.must]
        require(not missed, f"a visit of {', '.join(missed)} may miss the region")
        return begun, made

    @property
    def stays(self) -> list[Stay]:
        """A stay for each planned visit, held against it in order."""
        return self._begun_and_stays[1]

    @cached_property
    def flown(self) -> list[Stay]:
        """Stays of a lasso's prefix and laps."""
        first, found = self.stays, sorted(stays({name: self.unrolled(row) for name, row in self.rows.items()}))
        cycle = len(first) if self.robot.cycle_visit is None else self.robot.cycle_visit
        found, wanted = found[len(self._begun_and_stays[0]) :], [stay.region for stay in first]
        alike = [stay.region for stay in found] == wanted + wanted[cycle:] * (LAPS - 1) and all(stay.must for stay in found)
        require(alike, "its laps begin with another visit than planned")
        return found

    def _in_lap(self, visit: int) -> bool:
        """Return whether every lap makes a visit."""
        return self.robot.cycle_visit is not None and visit >= self.robot.cycle_visit

    def _number(self, visit: int, lap: int) -> int:
        """Return which of those that are flown a visit is in some lap, the first one 0; one before the laps is there once."""
        return visit + lap * self._in_lap(visit) * (len(self.stays) - (self.robot.cycle_visit or 0))

    def _is_aside(self, start: Fraction, stop: Fraction, visit: int) -> bool:
        """Return whether something of a visit is on the right side of where the lap begins."""
        return self.lap is None or (start > self.lap if self._in_lap(visit) else stop < self.lap)

    @cached_property
    def timeline(self) -> Timeline:
        """Labels over time; its changes of the internal state are permitted, in order, each in its region for sure."""
        state = at_lap = self.robot.initial
        last: tuple[Fraction, int] = (Fraction(-1), 0)
        permitted = {(action.before, action.after, action.at) for action in self.robot.actions}
        flown = self.flown  # which are the planned visits
        for before, after, visit, time in self.robot.changes:
            stay = flown[visit]
            allowed = before == state and (before, after, stay.region) in permitted
            require(allowed, f"{before} may not become {after} in {stay.region}")
            require(time > last[0] and visit >= last[1], "its actions are not in the order of its visits")
            within = self.stays[visit].surely_holds(time, time)
            require(within, f"its action at {float(time):.4f} s may be outside {stay.region}")
            require(self._is_aside(time, time, visit), "an action is on the wrong side of where the lap begins")
            state, last = after, (time, visit)
            at_lap = at_lap if self._in_lap(visit) else state
        require(self.lap is None or at_lap == state, "a lap ends in another internal state than it begins in")
        states = self.robot.states
        actions = tuple((deed.time, states[deed.after]) for deed in self.robot.changes)
        return Timeline(self.name, self.end, self.rows, states[self.robot.initial], actions, self.lap)

    # Passages of openings. A passage is a time in which the path is inside the opening by the margin and the radius, and flies from more than the
    # margin on one side of the opening's plane to the other side. Where it is more than the margin beyond the plane it flies on, so that it passes
    # once (Coq: `passes_once`). At other times no point within the margin is in the opening.

    def passages(self) -> str:
        """Return all passages, which have to be the planned ones, in order, each while its visit must be in the region, and those of the sequence."""
        every = sorted(one for name, shape in self.statement.regions.items() if shape.ring for one in self._passages(name))
        shown = " ".join(hoop + way for _, _, hoop, way in every) or "none"
        wanted = [(number, visit) for number, visit in enumerate(self.robot.visits) if visit.direction]
        planned = [(hoop, way) for _, _, hoop, way in every] == [(visit.region, visit.direction) for _, visit in wanted]
        require(planned, f"it passes {shown[:200]}, which is not planned")
        require(all(a[1] < b[0] for a, b in pairwise(every)), "two of its passages cannot be told apart in time")
        words: tuple[list[tuple[str, str]], list[tuple[str, str]]] = ([], [])
        for (number, _), (start, stop, hoop, way) in zip(wanted, every, strict=True):
            require(self.stays[number].surely_holds(start, stop), f"its visit of {hoop} may not contain the passage")
            require(self._is_aside(start, stop, number), "a passage is on the wrong side of where the lap begins")
            words[self._in_lap(number)].append((hoop, way))
        if self.statement.sequence is not None:
            wanted = [list(part or ()) for part in self.statement.sequence]
            size = sum(map(len, (*words, *wanted)))  # words that agree so far are one (Fine and Wilf)
            first = [[*prefix, *cycle * size][:size] for prefix, cycle in (words, wanted)]
            alike = first[0] == first[1] and bool(words[1]) == bool(wanted[1])
            require(alike, f"it passes {shown[:200]}, which is not the mission's sequence")
        return shown

    def _passages(self, name: str) -> Iterator[tuple[Fraction, Fraction, str, str]]:  # from when to when, which hoop and way
        shape = self.statement.regions[name]
        hoop, rules = Hoop(shape), opening(shape, (self.statement.margin, self.robot.radius))
        every = self._along(f"openings/{self.name}/{name}", self.path.segments, along(self.path, rules))
        for mark, (first, *more) in groupby(every, key=itemgetter(2)):
            require(mark != "?", f"the path may be near the opening of {name} and not inside it")
            if mark in hoop.ways:
                last, far = [first, *more][-1], self.statement.margin * hoop.high
                begin, end = first[3].row(hoop.ways[mark]), last[3].row(hoop.ways[mark])
                passes = begin.numbers[0] < -far * begin.unit and far * end.unit < end.numbers[-1]
                require(passes, f"the path may enter the opening of {name} without passing it")
                yield first[0], last[1], name, mark

    def windows(self, visit: int) -> list[Window]:
        """Return the times at which it may be on its way to a visit, in prefix and first lap.

        The way ends when the robot must be in the region. It begins with the last earlier visit that is over before the robot may be in the region,
        once that one may have been left; without one, with the flight. Times in which it must be in either do not count, gaps between them do. After
        the last time surely in the region the nominal path's excursions count until it leaves for good.
        """
        nominal, found = self.unrolled(self.row("nominal", self.stays[visit].region)), list[Window]()
        for number in {self._number(visit, lap) for lap in (0, 1)}:
            stay = self.flown[number]
            before = next((earlier.must for earlier in reversed(self.flown[:number]) if earlier.stop < stay.start), [])
            begin, last = before[-1].stop if before else ZERO, stay.must[-1].stop
            found.append((begin, stay.must[0].start))
            found += [(a.stop, b.start) for must in (before, stay.must) for a, b in pairwise(must)]
            left = [span for span in nominal if span.stop > last and span.start < stay.stop]
            while left and left[-1].mark in ("no", "out"):
                left.pop()
            if out := [span for span in left if span.mark != "must"]:
                found.append((max(out[0].start, last), min(left[-1].stop, stay.stop)))
        laps = [(k * self.length, (self.lap or ZERO) if k else ZERO) for k in range(LAPS if self.length else 1)]
        folded = [(max(low - later, begin), min(high - later, self.end)) for low, high in found for later, begin in laps]
        return [(low, high) for low, high in folded if low < high]

    def leg(self, visit: int, limit: tuple[Limit, Fraction]) -> str:
        """Check trees of a limit on the way to a visit, which leave open only what is not on it."""
        key, ways, name = f"legs/{limit[0]}/{self.name}/{visit}", self.windows(visit), self.robot.visits[visit].region
        for start, stop, mark, _ in self._along(key, self.path.pieces, kept(self.path, limit)):
            aside = mark != "?" or all(stop <= low or high <= start for low, high in ways)
            require(aside, f"the proof's {key} leaves something open")
        return f"{self.name}'s path keeps the {limit[0]} limit {float(limit[1])} on the way to visit {visit}, of {name}."

    # Waits. A robot sets out for its first visit when its nominal path first leaves the start, and for a later one where it stands still for the
    # last time before it leaves where it is or comes to where it goes.

    def waits(self, wait: Wait, first: "Course") -> str:
        """Check that an event of another robot is over before its own may happen, however their clocks differ: in the first lap, 0, and the second."""
        found: list[Fraction] = []
        for lap in (0, 1) if self._in_lap(wait.then[1]) else (0,):
            if (due := self._event(wait.due, wait.then[1], lap)) is not None:
                done = first._event(wait.done, wait.first[1], lap)
                require(done is not None, "what is waited for may never be over")
                found.append(due - (done or ZERO))
        least = min(found, default=None)
        by = "which never happens" if least is None else f"by at least {at_least(least - self.statement.clock_error)} s"
        require(least is None or least > self.statement.clock_error, f"that is proved {by}, as clocks may differ")
        return f"{first.name} has {wait.done} at its visit {wait.first[1]} before {self.name} {wait.due} at its visit {wait.then[1]}, {by}."

    def _event(self, what: str, visit: int, lap: int) -> Fraction | None:
        if what == "sets out":
            return self._sets_out(visit, lap)
        later = lap * self._in_lap(visit) * self.length
        acts = [deed.time + later for deed in self.robot.changes if deed.visit == visit]
        return event(what, (self.flown[self._number(visit, lap)], acts, self._last))

    def _sets_out(self, visit: int, lap: int) -> Fraction | None:
        number = self._number(visit, lap)
        opens = visit == self.robot.cycle_visit  # a lap's first visit sets out from where it begins
        there, seam = self.flown[number].start, (self.lap or ZERO) + lap * self.length
        before, moves = [*self._begun_and_stays[0], *self.flown[:number]][-1:], self._first_motion(0)
        require(all(stay.must for stay in before), "the stay in which it begins may miss the region")
        left = event("leaves", (before[0], [], self._last)) if before else None
        if number == 0 and not (opens and moves is not None and moves < seam):
            return None if moves is None else min(moves, there, there if left is None else left)
        left = None if opens and before and before[0].stop <= seam else left
        low = there if left is None else min(left, there)
        departs = self._first_motion(self.robot.cycle or 0) if opens and left is None else None
        low = low if departs is None else min(low, departs + lap * self.length)
        begun = before[0].start if number else ZERO
        return min(max((stop for start, stop in self._stands() if start <= low and stop >= begun), default=begun), low)

    def _stands(self) -> list[Window]:
        """Return when the nominal path stands still, if only for an instant with velocity, acceleration and jerk of zero."""
        found = [(one.start, one.stop if _is_still(one, 8) else one.start) for one in self.path.pieces if _is_still(one, 4)]
        return found + [(a + self.length, b + self.length) for a, b in found if self.lap is not None and a >= self.lap]

    def _first_motion(self, since: int) -> Fraction | None:
        """Return when a path first differs from where a piece begins, s; a polynomial that is not constant leaves its value at once."""
        pieces = self.path.pieces[since:]
        begin = pieces[0].ends()[0][:3]
        return next((one.start for one in pieces if not _is_still(one, 8) or one.ends()[0][:3] != begin), None)


def _is_still(piece: Segment, powers: int) -> bool:
    return not any(any(axis.numbers[1:powers]) for axis in piece.axes[:3])
