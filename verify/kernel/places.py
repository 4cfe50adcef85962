"""Places of one robot: letters that it may hold, within which times, and which may follow which.

A robot's time is cut into slots in which no region changes its status. In a slot a region holds it (`must`), does not (`no`), or is
open: in `may` it is entered and left at will. A *place* is a slot with a letter that
it allows. Regions are closed and paths continuous: where one region is left and another one entered at one instant, both hold the robot
there. So from one place to the next regions only come, or only go. A change of the internal state cuts slots at its instant, at which regions may
change as well. (Coq: `flight_course`, of windows and changes as they are made here.)

Laps are unrolled: slots of the prefix, of one lap and of its copy, a lap later.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations, pairwise
from typing import NamedTuple

from .statement import ZERO, Statement, require
from .timelines import Row, Span, Timeline

MOST_OPEN = 6
"""Regions that are open at one time: 2 to this power letters are possible then."""
MOST_STATES = 100_000
"""States of a transition system that are walked, with places."""

Letter = frozenset[str]


class Slot(NamedTuple):
    """A closed time, s, in which no region that is followed changes its mark: with internal propositions, the number of their changes so far, and
    the lap, 0 in a flight or prefix, 1 in the first lap, 2 in its copy.
    """

    start: Fraction
    stop: Fraction
    marks: Mapping[str, str]
    internal: Letter
    done: int
    lap: int


class Places(NamedTuple):
    """All that one robot may do, by the numbers of its places: each has a lap, regions that hold the robot there, all that it shows there, from when
    to when it may be there, s, and places that may come next. It begins in `initial` ones; a finite flight ends in `final` ones. `shift` leads from a
    place of the first lap to that of its copy.
    """

    robot: str
    laps: Sequence[int]
    inside: Sequence[Letter]
    letters: Sequence[Letter]
    windows: Sequence[tuple[Fraction, Fraction]]
    following: Sequence[Sequence[int]]
    initial: Sequence[int]
    final: frozenset[int]
    shift: int = 0

    def changed(self, place: int, target: int) -> bool:
        """Return whether to go from one place to another one is a change of what has to be read: of the letter, or of the lap."""
        return self.letters[place] != self.letters[target] or self.laps[place] + self.laps[target] == 3


def places_of(timeline: Timeline, names: frozenset[str]) -> Places:
    """Return all places of a robot, of letters that are cut down to some names, of which some are regions."""
    slots = _slots(timeline, {name: timeline.rows[name] for name in sorted(names & timeline.rows.keys())}, names)
    every = [(slot, number, letter) for number, slot in enumerate(slots) for letter in _letters(slot)]
    inside, numbers = [letter for _, _, letter in every], [number for _, number, _ in every]
    following: list[list[int]] = []
    for place, (_, number, letter) in enumerate(every):
        near = range(bisect_left(numbers, number), bisect_right(numbers, number + 1))
        following.append([t for t in near if t != place and (letter <= inside[t] or inside[t] <= letter)])
    initial = [place for place, number in enumerate(numbers) if number == 0]
    final = frozenset(place for place, number in enumerate(numbers) if number == len(slots) - 1)
    seen, waiting = set(initial), list(initial)
    while waiting:
        new = [target for target in following[waiting.pop()] if target not in seen]
        seen.update(new)
        waiting += new
    require(seen & final, f"the labels of {timeline.robot} contradict each other")
    shown, windows = [letter | slot.internal for slot, _, letter in every], [(slot.start, slot.stop) for slot, _, _ in every]
    laps = [slot.lap for slot, _, _ in every]
    return Places(timeline.robot, laps, inside, shown, windows, following, initial, final, laps.count(1))


def _slots(timeline: Timeline, rows: Mapping[str, Row], names: frozenset[str]) -> list[Slot]:
    end, cycle, changes = timeline.duration, timeline.cycle, _changes(timeline, names)
    parts = [(0, ZERO, end)] if cycle is None else [(0, ZERO, cycle), (1, cycle, end), (2, cycle, end)]
    found: list[Slot] = []
    for lap, start, stop in parts[cycle == 0 :]:
        later = stop - start if lap == 2 else ZERO
        own = {name: [span for span in row if _meets(span, start, stop)] for name, row in rows.items()}
        inner = [*(time for time, _ in changes), *(time for row in own.values() for span in row for time in span[:2])]
        times = sorted({start, stop, *(time for time in inner if start < time < stop)})
        fine = [(start, start), *(slot for a, b in pairwise(times) for slot in ((a, b), (b, b)))]
        columns = {name: _marks(row, fine) for name, row in own.items()}
        for number, (low, high) in enumerate(fine):
            made = sum(time <= low for time, _ in changes)
            for done in range(sum(time < low for time, _ in changes) if low == high else made, made + 1):
                internal = (changes[done - 1][1] if done else timeline.internal) & names
                marks = {name: column[number] for name, column in columns.items()}
                slot = Slot(low + later, high + later, marks, internal, done, lap)
                if found and found[-1][2:] == slot[2:]:
                    slot = slot._replace(start=found.pop().start)
                found.append(slot)
    return found


def _meets(span: Span, start: Fraction, stop: Fraction) -> bool:
    return (span.start < stop and start < span.stop) or start <= span.start == span.stop <= stop


def _changes(timeline: Timeline, names: frozenset[str]) -> list[tuple[Fraction, Letter]]:
    """Return changes of the internal state that are followed, each with its instant."""
    changes = [(ZERO, timeline.internal), *timeline.actions]
    return [(time, after) for (_, before), (time, after) in pairwise(changes) if (before ^ after) & names]


def _marks(row: Sequence[Span], fine: Sequence[tuple[Fraction, Fraction]]) -> list[str]:
    """Return a region's mark in each instant and gap: `may` where spans meet that differ."""
    starts, stops = [span.start for span in row], [span.stop for span in row]
    found: list[str] = []
    for low, high in fine:
        first, last = (bisect_left, bisect_right) if low == high else (bisect_right, bisect_left)
        marks = {span.mark for span in row[first(stops, low) : last(starts, high)]}
        found.append(marks.pop() if len(marks) == 1 else "may")
    return found


def _letters(slot: Slot) -> list[Letter]:
    """Return the sets of regions that a slot allows."""
    held = frozenset(name for name, mark in slot.marks.items() if mark == "must")
    free = sorted(name for name, mark in slot.marks.items() if mark == "may")
    require(len(free) <= MOST_OPEN, f"not covered by the kernel: more than {MOST_OPEN} regions are open at one time")
    return [held.union(some) for size in range(len(free) + 1) for some in combinations(free, size)]


def check_transitions(statement: Statement, timeline: Timeline) -> str:
    """Check that every word of a robot is a trace of its transition system, whatever its labels leave open.

    Regions that are entered one after another are joined by an edge, with free flight between. A robot comes from the region that it entered last,
    and from those to which it has *gone back*: it left that region while it still was in one that an edge joins to it. All ways through the robot's
    places are walked, with the regions from which it may be taken to come. Internal states change by planned actions alone.
    """
    robot, regions = timeline.robot, frozenset(statement.regions)
    system = statement.robots[robot]
    places = places_of(timeline, regions)
    edges = dict.fromkeys(regions | {system.vertex}, regions) if system.edges is None else system.edges
    seen = {(place, frozenset({vertex})) for place in places.initial for vertex in places.inside[place] or {system.vertex}}
    waiting = list(seen)
    while waiting:
        place, vertices = waiting.pop()
        before = places.inside[place]
        closed = min(before & system.closed, default="")
        require(not before & system.closed, f"{robot} may be in {closed}, which is closed to it")
        for target in _following(places, place):
            now = places.inside[target]
            came = now - before
            if len(came) > 1:
                between = [t for t in _following(places, place) if before < places.inside[t] < now]
                one_by_one = any(target in _following(places, t) for t in between)
                require(one_by_one, f"{robot} may enter several regions at once")
                continue
            for region in came:
                joined = any(region == v or region in edges.get(v, ()) for v in vertices)
                require(joined, f"{robot} may enter {region} from {min(vertices)}, where no edge leads")
            left = vertices & before - now if system.edges is not None else ()
            after = (came or vertices).union(*(now & edges.get(v, frozenset()) for v in left))
            if (target, after) not in seen:
                require(len(seen) < MOST_STATES, f"not covered by the kernel: {robot} may go too many ways")
                seen.add((target, after))
                waiting.append((target, after))
    return f"Every word of {robot} is a trace of its transition system."


def _following(places: Places, place: int) -> list[int]:
    """Return the next places; after the copy of a lap the copy again."""
    again = places.following[place - places.shift] if places.laps[place] == 2 else ()
    return [*places.following[place], *(target for target in again if places.laps[target] == 2)]
