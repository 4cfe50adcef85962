"""Places of one robot: letters that it may hold, within which times, and which may follow which.

A robot's time is cut into slots in which no region changes its status. In a slot a region holds it (`must`), does not (`no`), or is
open: in `may` it is entered and left at will, in `rise` it is entered once, in `fall` left once. A *place* is a slot with a letter that
it allows. Regions are closed and paths continuous: where one region is left and another one entered at one instant, both hold the robot
there. So from one place to the next regions only come, or only go. A change of the internal state cuts slots at its instant, at which regions may
change as well. (Coq: `flight_course`, of windows and changes as they are made here.)

Laps are unrolled: slots of the prefix, of one lap and of its copy, a lap later.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, pairwise

from .labels import Relations, Row, Timeline
from .refused import Refused

MOST_OPEN = 10
"""Regions that are open at one time: 2 to this power letters are looked at."""

MOST_LETTERS = 64
"""Letters that are possible in one slot."""

Letter = frozenset[str]


@dataclass(frozen=True, slots=True)
class Slot:
    """A closed time in which no region changes its status.

    Attributes:
        start: s.
        stop: s.
        marks: Each region's, in the order of the names that are followed.
        internal: Internal propositions.
        done: How many changes of the internal state were made.
        lap: 0 in a flight or prefix, 1 in the first lap, 2 in its copy.
    """

    start: Fraction
    stop: Fraction
    marks: tuple[str, ...]
    internal: Letter
    done: int
    lap: int


@dataclass(frozen=True, slots=True)
class Places:
    """All that one robot may do, by the numbers of its places.

    Attributes:
        robot: Name.
        slots: Each place's slot.
        inside: The regions that hold the robot there.
        letters: All that it shows there.
        windows: From when to when it may be there, s.
        following: Places that may come next.
        initial: Where it may begin.
        final: Where it may end; of laps none.
        shift: From a place of the first lap to that of its copy.
        length: How long a lap lasts, s.
    """

    robot: str
    slots: tuple[Slot, ...]
    inside: tuple[Letter, ...]
    letters: tuple[Letter, ...]
    windows: tuple[tuple[Fraction, Fraction], ...]
    following: tuple[tuple[int, ...], ...]
    initial: tuple[int, ...]
    final: frozenset[int]
    shift: int = 0
    length: Fraction = Fraction(0)

    def changed(self, place: int, target: int) -> bool:
        """Return whether to go from one place to another one is a change of what has to be read: of the letter, or of the lap."""
        return self.letters[place] != self.letters[target] or self.slots[place].lap + self.slots[target].lap == 3


def places_of(timeline: Timeline, names: frozenset[str] | None, regions: frozenset[str], relations: Relations) -> Places:
    """Return all places of a robot, of letters that are cut down to some names.

    Args:
        timeline: What is proved of the robot.
        names: Names that are followed; None follows all, and each change of the internal state.
        regions: All regions.
        relations: Letters that they exclude are left out.

    Raises:
        Refused: The timeline lacks a region or is none, too many regions are open, or the timeline contradicts itself.
    """
    followed = tuple(sorted(regions if names is None else names & regions))
    slots = _slots(timeline, followed, names)
    spread = [_letters(slot, followed, relations) for slot in slots]
    slot_of = tuple(slot for slot, choices in zip(slots, spread, strict=True) for _ in choices)
    inside = tuple(letter for choices in spread for letter in choices)
    begins = [0]
    for choices in spread:
        begins.append(begins[-1] + len(choices))
    ranges = [range(a, b) for a, b in pairwise(begins)]
    following: list[tuple[int, ...]] = []
    for number, (slot, here) in enumerate(zip(slots, ranges, strict=True)):
        then = ranges[number + 1] if number + 1 < len(slots) else range(0)
        after = slots[number + 1] if then else slot
        for place in here:
            targets = [
                other for other in here if other != place and _may_change(inside[place], inside[other], (slot,), followed)
            ]
            targets += [other for other in then if _may_change(inside[place], inside[other], (slot, after), followed)]
            following.append(tuple(targets))
    falling = {name for name, mark in zip(followed, slots[0].marks, strict=True) if mark == "fall"}
    rising = {name for name, mark in zip(followed, slots[-1].marks, strict=True) if mark == "rise"}
    found = Places(
        timeline.robot,
        slot_of,
        inside,
        tuple(letter | slot.internal for letter, slot in zip(inside, slot_of, strict=True)),
        tuple((slot.start, slot.stop) for slot in slot_of),
        tuple(following),
        tuple(place for place in ranges[0] if falling <= inside[place]),
        frozenset(place for place in ranges[-1] if rising <= inside[place]),
        0 if timeline.cycle is None else sum(slot.lap == 1 for slot in slot_of),
        Fraction(0) if timeline.cycle is None else timeline.duration - timeline.cycle,
    )
    _require_a_way(found)
    return found


def _require_a_way(places: Places) -> None:
    """Refuse a timeline that leaves no way from its beginning to its end."""
    seen = set(places.initial)
    waiting = list(seen)
    while waiting:
        new = [target for target in places.following[waiting.pop()] if target not in seen]
        seen.update(new)
        waiting += new
    if not seen & places.final:
        raise Refused(f"the labels of {places.robot} contradict each other")


def _slots(timeline: Timeline, followed: tuple[str, ...], names: frozenset[str] | None) -> list[Slot]:
    rows = [_row(timeline, region) for region in followed]
    changes = _changes(timeline, names)
    end = timeline.duration
    parts = [(0, Fraction(0), end, Fraction(0))]
    if timeline.cycle is not None:
        if not 0 <= timeline.cycle < end:
            raise Refused(f"the lap of {timeline.robot} does not end after it begins")
        length = end - timeline.cycle
        parts = [
            (0, Fraction(0), timeline.cycle, Fraction(0)),
            (1, timeline.cycle, end, Fraction(0)),
            (2, timeline.cycle, end, length),
        ]
    found: list[Slot] = []
    for lap, start, stop, later in parts:
        if lap == 0 and timeline.cycle == 0:
            continue
        times = {start, stop, *(time for time, _ in changes if start <= time <= stop)}
        times.update(time for row in rows for span in row for time in (span.start, span.stop) if start < time < stop)
        ordered = sorted(times)
        fine = [(t, t) for t in ordered[:1]]
        for before, after in pairwise(ordered):
            fine += [(before, after), (after, after)]
        marks = [_marks(row, fine, start, stop) for row in rows]
        for number, (low, high) in enumerate(fine):
            here = tuple(column[number] for column in marks)
            made = sum(time <= low for time, _ in changes)
            for done in range(sum(time < low for time, _ in changes) if low == high else made, made + 1):
                internal = timeline.internal if not done else changes[done - 1][1]
                internal = internal if names is None else internal & names
                slot = Slot(low + later, high + later, here, internal, done, lap)
                if found and (found[-1].marks, found[-1].internal, found[-1].done, found[-1].lap) == (
                    here,
                    internal,
                    done,
                    lap,
                ):
                    found[-1] = Slot(found[-1].start, slot.stop, here, internal, done, lap)
                else:
                    found.append(slot)
    return found


def _changes(timeline: Timeline, names: frozenset[str] | None) -> list[tuple[Fraction, Letter]]:
    """Return changes of the internal state that are followed, each with its instant."""

    def differ(one: Letter, other: Letter) -> bool:
        return names is None or not (one ^ other).isdisjoint(names)

    found: list[tuple[Fraction, Letter]] = []
    last, before = Fraction(-1), timeline.internal
    for time, internal in timeline.actions:
        if not last < time <= timeline.duration or time == timeline.cycle:
            raise Refused(f"the actions of {timeline.robot} are not in order")
        if differ(internal, before):
            found.append((time, internal))
        last, before = time, internal
    if timeline.cycle is not None:
        at_lap = [timeline.internal, *(internal for time, internal in timeline.actions if time < timeline.cycle)]
        if before != at_lap[-1]:
            raise Refused(f"a lap of {timeline.robot} ends in another internal state than it begins in")
    return found


def _row(timeline: Timeline, region: str) -> Row:
    """Return a region's spans, which have to cover the whole flight."""
    row = timeline.rows.get(region)
    if row is None:
        raise Refused(f"nothing is proved of {timeline.robot} and {region}")
    ends = [Fraction(0), *(span.stop for span in row)]
    whole = bool(row) and [span.start for span in row] == ends[:-1] and ends[-1] == timeline.duration and sorted(ends) == ends
    if not whole or any(span.mark not in ("no", "may", "must", "rise", "fall") for span in row):
        raise Refused(f"the labels of {timeline.robot} in {region} do not cover its flight")
    return row


def _marks(row: Row, fine: list[tuple[Fraction, Fraction]], start: Fraction, stop: Fraction) -> list[str]:
    """Return a region's mark in each instant and gap: where spans meet that differ, what leaves more open."""
    spans = [span for span in row if (span.start < stop and start < span.stop) or start <= span.start == span.stop <= stop]
    found: list[str] = []
    at = 0
    for low, high in fine:
        while spans[at].stop < low or (low < high and spans[at].stop <= low):
            at += 1
        marks = {spans[at].mark}
        for span in spans[at + 1 :]:
            if span.start > low or low < high:
                break
            marks.add(span.mark)
        open_ = marks - {"no", "must"}
        found.append(marks.pop() if len(marks) == 1 else open_.pop() if len(open_) == 1 else "may")
    return found


def _letters(slot: Slot, followed: tuple[str, ...], relations: Relations) -> list[Letter]:
    """Return the sets of regions that a slot allows."""
    held = frozenset(name for name, mark in zip(followed, slot.marks, strict=True) if mark == "must")
    free = [name for name, mark in zip(followed, slot.marks, strict=True) if mark not in ("must", "no")]
    if len(free) > MOST_OPEN:
        raise Refused(f"not covered by the kernel: more than {MOST_OPEN} regions are open at one time")
    choices = [held.union(some) for size in range(len(free) + 1) for some in combinations(free, size)]
    known = frozenset(followed)
    found = [letter for letter in choices if relations.allow(letter, known)]
    if len(found) > MOST_LETTERS:
        raise Refused(f"not covered by the kernel: more than {MOST_LETTERS} letters are possible at one time")
    return found


def _may_change(before: Letter, after: Letter, slots: tuple[Slot, ...], followed: tuple[str, ...]) -> bool:
    """Return whether regions may come or go so, within one slot or from one to the next."""
    if not (before <= after or after <= before):
        return False
    ways = ("may", "rise") if before <= after else ("may", "fall")
    moved = before ^ after
    return all(
        any(mark in ways for mark in marks)
        for name, *marks in zip(followed, *(slot.marks for slot in slots), strict=True)
        if name in moved
    )
