"""Times at which a robot must be in each region, and must not; its stays there, which are its visits; and when it acts.

All of it is said of every path that stays within the margin of the robot's own at every time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from .bodies import Body
from .flights import Path
from .labels import Row, Span
from .refused import Refused
from .trees import Cell, Marks, leaves

_MARKS = {"n": "no", "m": "must", "?": "may"}
_AROUND = {"rise": ("no", "must"), "fall": ("must", "no")}


@dataclass(frozen=True, slots=True)
class Stay:
    """A time in a region: not before `start`, and not after `stop`; in it for sure in the spans `must`, and else perhaps."""

    region: str
    start: Fraction
    stop: Fraction
    must: list[Span]

    @property
    def sure(self) -> list[Span]:
        """Spans in which it is in the region for sure.

        Raises:
            Refused: There is none.
        """
        if not self.must:
            raise Refused(f"a stay in {self.region} may miss the region")
        return self.must


def spans(path: Path, body: Body, marks: Marks) -> Row:
    """Return a region's spans along a path, as its trees say.

    Args:
        path: The path.
        body: The region.
        marks: Evidence.

    Raises:
        Refused: A tree says what is not so.
    """
    found: list[tuple[Fraction, str]] = []
    for segment in path.segments:
        if body.is_far(segment):
            parts = [(segment.start, "no")]
        else:
            parts = [
                (
                    segment.time(one.start),
                    body.crossing(one.part.rows) if one.mark == "c" and isinstance(one.part, Cell) else _MARKS[one.mark],
                )
                for one in leaves(body.along(segment), marks)
            ]
        for start, mark in parts:
            if not found or found[-1][1] != mark:
                found.append((start, mark))
    stops = [*(start for start, _ in found[1:]), path.segments[-1].stop]
    return _settled([Span(start, stop, mark) for (start, mark), stop in zip(found, stops, strict=True)])


def _settled(row: list[Span]) -> Row:
    """Make a `may` of an instant that differs from what is around it, and of a change that no `no` and `must` are around; part those."""
    found: list[Span] = []
    marks = ["", *(span.mark for span in row), ""]
    for span, before, after in zip(row, marks, marks[2:], strict=False):
        mark = span.mark
        if (span.start == span.stop and len(row) > 1) or _AROUND.get(mark, (before, after)) != (before, after):
            mark = "may"
        if found and {found[-1].mark, mark} == {"no", "must"}:
            found.append(Span(span.start, span.start, "may"))
        if found and found[-1].mark == mark:
            found[-1] = Span(found[-1].start, span.stop, mark)
        else:
            found.append(Span(span.start, span.stop, mark))
    return tuple(found)


def two_laps(row: Row, knot: Fraction | None) -> Row:
    """Return the spans of a lasso's prefix and of two laps, times going on; of no lasso the spans."""
    if knot is None:
        return row
    later = row[-1].stop - knot
    again = [Span(max(span.start, knot) + later, span.stop + later, span.mark) for span in row if span.stop > knot]
    return _settled([*row, *again])


def stays(rows: Mapping[str, Row]) -> list[Stay]:
    """Return the stays in regions, in order of their starts."""
    found: list[Stay] = []
    for region, row in rows.items():
        run: list[Span] = []
        for span in (*row, Span(row[-1].stop, row[-1].stop, "no")):
            if span.mark != "no":
                run.append(span)
            elif run:
                found.append(Stay(region, run[0].start, run[-1].stop, [s for s in run if s.mark == "must"]))
                run = []
    return sorted(found, key=lambda stay: (stay.start, stay.stop, stay.region))


@dataclass(frozen=True, slots=True)
class Visits:
    """A robot's planned visits as it makes them.

    There is a stay for each planned visit. `flown` are the stays of a lasso's prefix and two laps, times going on, else the same; `lap` is
    the number of the first visit that begins in the lap, `extra` the stay in which the flight begins, where that is no visit.
    """

    stays: list[Stay]
    flown: list[Stay]
    lap: int | None
    extra: Stay | None


def visits(path: Path, rows: Mapping[str, Row]) -> Visits:
    """Hold the k-th planned visit against the k-th stay; a stay at time 0 for which there is none is where the robot starts.

    Raises:
        Refused: They differ, or a stay is nowhere in its region for sure, or laps begin with another visit.
    """
    wanted, found = [visit.region for visit in path.robot.visits], stays(rows)
    extra = found.pop(0) if found and found[0].start == 0 and len(found) == len(wanted) + 1 else None
    if [stay.region for stay in found] != wanted:
        raise Refused(f"the flight makes other visits than planned: {', '.join(stay.region for stay in found[:20]) or 'none'}")
    if missed := [stay.region for stay in found if not stay.must]:
        raise Refused(f"a visit of {missed[0]} may miss the region")
    if path.lap is None:
        return Visits(found, found, None, extra)
    flown = stays({region: two_laps(row, path.lap) for region, row in rows.items()})[(extra is not None) :]
    lap = 2 * len(wanted) - len(flown)
    if lap != path.robot.cycle_visit or [stay.region for stay in flown] != wanted + wanted[lap:]:
        raise Refused("its laps begin with another visit than planned")
    return Visits(found, flown, lap, extra)


def actions(path: Path, made: Visits) -> tuple[tuple[Fraction, frozenset[str]], ...]:
    """Check the planned changes of a robot's internal state: permitted, one after another, each in its region for sure.

    Raises:
        Refused: One is not so.
    """
    robot, state, at_lap, last = path.robot, path.robot.initial, path.robot.initial, (Fraction(-1), 0)
    for deed in robot.changes:
        stay, in_lap = made.stays[deed.visit], made.lap is not None and deed.visit >= made.lap
        if deed.before != state or (deed.before, deed.after, stay.region) not in {
            (a.before, a.after, a.at) for a in robot.actions
        }:
            raise Refused(f"{deed.before} may not become {deed.after} in {stay.region}")
        if not (deed.time > last[0] and deed.visit >= last[1]):
            raise Refused("its actions are not in the order of its visits")
        if not any(span.start <= deed.time <= span.stop for span in stay.must):
            raise Refused(f"its action at {float(deed.time):.4f} s may be outside {stay.region}")
        if path.lap is not None and not (deed.time > path.lap if in_lap else deed.time < path.lap):
            raise Refused("an action is on the wrong side of where the lap begins")
        state, last = deed.after, (deed.time, deed.visit)
        at_lap = at_lap if in_lap else state
    if path.lap is not None and at_lap != state:
        raise Refused("a lap ends in another internal state than it begins in")
    return tuple((deed.time, robot.states[deed.after]) for deed in robot.changes)


def gaps(row: list[Span]) -> list[tuple[Fraction, Fraction]]:
    """Return the times between spans."""
    return [(a.stop, b.start) for a, b in pairwise(row) if a.stop < b.start]
