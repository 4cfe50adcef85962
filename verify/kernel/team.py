"""All that a team may do in spans of time, for one conjunct of a formula: places of each robot, and moves.

*Places.* A robot's time is cut into slots in which no region changes its status. In a slot a region holds it (`must`), does not (`no`), or is open:
in `may` it is entered and left at will. A *place* is a slot with a letter that it allows. Regions are closed and paths continuous: where one region
is left and another one entered at one instant, both hold the robot there. So from one place to the next regions only come, or only go. A change of
the internal state cuts slots at its instant, at which regions may change as well. (Coq: `flight_course`, of windows and changes as they are made
here.) Laps are unrolled: slots of the prefix, of one lap and of its copy, a lap later.

Robots are *followed*, or only counted. Of a robot that is not followed no more is used than what it may show in each span.

*Moves.* Under `own` a position of the word is one robot's letter. A robot that is followed is read, or another one is. Or a robot goes on to a next
place in silence, where that changes its letter only after it was read. Letters are cut down to names of the formula and others that the proof adds.
Fewer names give fewer changes, before which a robot has to be read, and so more words. Under `joint` any of the robots that are followed go on at one
instant; the letter is the whole team's. In each span, which has an instant, a letter is read. One that is held may be read again: there is no next.

*Spans.* Each place has a window, widened by the clock error at both ends: two clocks never differ by more. Spans are the instants at which windows
begin or end, and what is between them. Those of laps end in the middle of the second lap, where the last one hands over to the middle of the first.
"""

import json
import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import chain, combinations, pairwise, product
from typing import NamedTuple, TypeVar

from .formulas import Letter, Table, Tree
from .statement import ZERO, Statement, few, require
from .timelines import Row, Timeline

Shown = frozenset[str]  # all that a robot shows, or those regions of it that hold it there


Slot = tuple[Fraction, Fraction, Mapping[str, str], Shown, int, int]
"""From when to when no region that is followed changes its mark; marks, internal propositions, how often they have changed, and the lap."""


class Places(NamedTuple):
    """All that one robot may do, by the numbers of its places. Each has a lap, 0 in a flight or prefix, 1 in the first lap, 2 in its copy. It has
    regions that hold the robot there, all that it shows there, from when to when it may be there, s, and places that may come next. A robot begins in
    `initial` ones; a finite flight ends in `final` ones. `shift` leads from a place of the first lap to that of its copy.
    """

    robot: str
    laps: Sequence[int]
    inside: Sequence[Shown]
    letters: Sequence[Shown]
    windows: Sequence[tuple[Fraction, Fraction]]
    following: Sequence[Sequence[int]]
    initial: Sequence[int]
    final: frozenset[int]
    shift: int = 0


def places_of(timeline: Timeline, names: frozenset[str]) -> Places:
    """Return all places of a robot, of letters that are cut down to some names, of which some are regions."""
    slots = _slots(timeline, {name: timeline.rows[name] for name in sorted(names & timeline.rows.keys())}, names)
    inside, numbers, following = list[Shown](), list[int](), list[list[int]]()
    for number, (_, _, marks, *_) in enumerate(slots):
        held = frozenset(name for name, mark in marks.items() if mark == "must")
        free = sorted(name for name, mark in marks.items() if mark == "may")
        few(len(free), "regions open at one time")
        inside += [held.union(some) for size in range(len(free) + 1) for some in combinations(free, size)]
        numbers += [number] * 2 ** len(free)
    for place, (number, letter) in enumerate(zip(numbers, inside, strict=True)):
        near = range(bisect_left(numbers, number), bisect_right(numbers, number + 1))
        following.append([t for t in near if t != place and (letter <= inside[t] or inside[t] <= letter)])
    initial = [place for place, number in enumerate(numbers) if number == 0]
    final = frozenset(place for place, number in enumerate(numbers) if number == len(slots) - 1)
    windows, laps = [slots[number][:2] for number in numbers], [slots[number][-1] for number in numbers]
    shown = [letter | slots[number][3] for number, letter in zip(numbers, inside, strict=True)]
    return Places(timeline.robot, laps, inside, shown, windows, following, initial, final, laps.count(1))


def _slots(timeline: Timeline, rows: Mapping[str, Row], names: frozenset[str]) -> list[Slot]:
    end, cycle, changes = timeline.duration, timeline.cycle, timeline.actions
    parts = [(0, ZERO, end)] if cycle is None else [(0, ZERO, cycle), (1, cycle, end), (2, cycle, end)]
    found: list[Slot] = []
    for lap, start, stop in parts[cycle == 0 :]:
        later = stop - start if lap == 2 else ZERO
        inner = [*(time for time, _ in changes), *(time for row in rows.values() for span in row for time in span[:2])]
        times = sorted({start, stop, *(time for time in inner if start < time < stop)})
        for low, high in instants_and_gaps(times):
            made = sum(time <= low for time, _ in changes)
            near = {name: {span.mark for span in row if span.start <= low and high <= span.stop} for name, row in rows.items()}
            marks = {name: min(some) if len(some) == 1 else "may" for name, some in near.items()}  # spans that differ may meet
            for done in range(sum(time < low for time, _ in changes) if low == high else made, made + 1):
                internal = (changes[done - 1][1] if done else timeline.internal) & names
                is_new = not found or found[-1][2:] != (marks, internal, done, lap)
                found.append((low + later if is_new else found.pop()[0], high + later, marks, internal, done, lap))
    return found


def instants_and_gaps(times: Sequence[Fraction]) -> list[tuple[Fraction, Fraction]]:
    """Return some times, and what is between them, from when to when."""
    return [(times[0], times[0]), *(slot for a, b in pairwise(times) for slot in ((a, b), (b, b)))]


def check_transitions(statement: Statement, timeline: Timeline) -> str:
    """Check that every word of a robot is a trace of its transition system, whatever its labels leave open.

    Regions that are entered one after another are joined by an edge, with free flight between. A robot comes from the region that it entered last,
    and from those to which it has *gone back*: it left that region while it still was in one that an edge joins to it. All ways through the robot's
    places are walked, with the regions from which it may be taken to come. Internal states change by planned actions alone.
    """
    robot, regions, system = timeline.robot, frozenset(statement.regions), statement.robots[timeline.robot]
    places = places_of(timeline, regions)
    edges = dict.fromkeys(regions | {system.vertex}, regions) if system.edges is None else system.edges
    seen = {(place, frozenset({vertex})) for place in places.initial for vertex in places.inside[place] or {system.vertex}}
    waiting = list(seen)
    while waiting:
        place, vertices = waiting.pop()
        before = places.inside[place]
        closed = before & system.closed
        require(not closed, f"{robot} may be in {min(closed, default='')}, which is closed to it")
        for target in _following(places, place):
            now = places.inside[target]
            came = now - before
            if len(came) > 1:
                between = [t for t in _following(places, place) if before < places.inside[t] < now]
                require(any(target in _following(places, t) for t in between), f"{robot} may enter several regions at once")
                continue
            for region in came:
                joined = any(region == v or region in edges.get(v, ()) for v in vertices)
                require(joined, f"{robot} may enter {region} from {min(vertices)}, where no edge leads")
            left = vertices & before - now if system.edges is not None else ()
            after = (came or vertices).union(*(now & edges.get(v, frozenset()) for v in left))
            if (target, after) not in seen:
                few(len(seen), "states of a transition system")
                seen.add((target, after))
                waiting.append((target, after))
    return f"Every word of {robot} is a trace of its transition system."


def _following(places: Places, place: int) -> list[int]:
    """Return the next places; after the copy of a lap the copy again."""
    again = places.following[place - places.shift] if places.laps[place] == 2 else ()
    return [*places.following[place], *(target for target in again if places.laps[target] == 2)]


At = tuple[int, ...]
State = tuple[At, int]  # places of the robots that are followed, and who of them was read since its letter changed, as bits
Step = tuple[Letter | None, State]  # what is read, if anything, and what is then
Lap = tuple[Fraction, Fraction] | None
Wait = tuple[tuple[str, int], tuple[str, int]]
"""Two events, each a robot and the number of the place that it comes to: the second comes after the first."""
Find = Callable[[str, frozenset[str]], Places]  # returns one robot's places, of letters cut down to some names
_T = TypeVar("_T")


class Claim:
    """One conjunct, and the team of which it is claimed.

    `places` returns one robot's places, of letters cut down to some names; `lap` is when a lap begins and ends. Of two events that are waited for,
    the second comes after the first, not with it. `names` are asked of letters, `shown` are all. `counted` has the tables of what is counted.
    """

    def __init__(self, statement: Statement, tree: Tree, find: Find, lap: Lap = None, waits: Sequence[Wait] = ()) -> None:
        self.robots, self.joint, self.places = tuple(statement.robots), statement.joint, cache(find)
        self.lap, self.waits = lap, waits
        self.error = statement.clock_error if len(self.robots) > 1 else ZERO
        self.table = Table(tree, statement.regions)
        asked = self.table.propositions
        self.counted = {one.counted: Table(json.loads(one.counted), statement.regions) for one in asked}
        propositions = [p for one in self.counted.values() for p in one.propositions]
        inner = {sign for one in self.counted.values() for sign, _ in one.nodes}
        require(all(p.name for p in propositions) and inner <= {"holds", "and"}, "what is counted is no combination of names")
        self.names = frozenset(p.name for p in propositions)
        internal = (one.states.values() for one in statement.robots.values())
        self.shown = frozenset(statement.regions).union(*chain.from_iterable(internal))
        unknown, strange = [*self.names - self.shown, ""][0], [*{p.robot for p in asked} - {"", *self.robots}, ""][0]
        require(not unknown, f"the formula names {unknown[:60]!r}, which no robot shows")
        require(not strange, f"the formula names robot {strange[:60]!r}, which there is not")
        one_by_one = all(one.name for one in asked)
        require(self.joint or one_by_one, "the formula counts robots that are read one by one")
        self.spans = cache(self._spans)

    def _spans(self, more: frozenset[str]) -> tuple[list[tuple[Fraction, Fraction]], int | None]:
        """Return from when to when each span is, and to which one the last hands over."""
        windows = [window for robot in self.robots for window in self.places(robot, self.names | more).windows]
        times = {time for low, high in windows for time in (low - self.error, high + self.error)}
        if not self.lap:
            return instants_and_gaps(sorted(times)), None
        (begin, end), length = self.lap, self.lap[1] - self.lap[0]
        middle, last = begin + length / 2, end + length / 2
        require(2 * self.error < length, "two clocks may be half a lap apart")
        spans = instants_and_gaps(sorted({middle, last, *(time for time in times if time <= last)}))
        return spans[:-1], spans.index((middle, middle))  # the last one begins in the middle of the second lap


class Team:
    """All that a team may do, in spans of time.

    `names` are the robots that are followed, `more` names in letters besides the formula's. Of `size` spans the last one of laps hands over to `back`.
    """

    def __init__(self, claim: Claim, names: Sequence[str], more: frozenset[str] = frozenset()) -> None:
        self.claim, lines = claim, {robot: claim.places(robot, claim.names | more) for robot in claim.robots}
        self.followed, others = [lines[robot] for robot in names], [lines[robot] for robot in lines if robot not in names]
        spans, self.back = claim.spans(more)
        self.size, self._lefts, self._rights = len(spans), [left for left, _ in spans], [right for _, right in spans]
        self._when = [[self._spans_of(window) for window in places.windows] for places in self.followed]
        self._others = [(places.robot, self._seen(places)) for places in others]
        letters = zip(*(seen for _, seen in self._others), strict=True) if others else [()] * self.size
        self._shown = [set(map(claim.table.letter_of, set[Shown]().union(*seen))) for seen in letters]
        index = {robot: number for number, robot in enumerate(names)}
        self._waits = [(index[a], i, index[b], j) for (a, i), (b, j) in claim.waits if {a, b} <= index.keys()]

    def _spans_of(self, window: tuple[Fraction, Fraction]) -> range:
        """Return the spans in which a window, not yet widened, is open."""
        low, high = window[0] - self.claim.error, window[1] + self.claim.error
        return range(bisect_left(self._lefts, low), bisect_right(self._rights, high))

    def _seen(self, places: Places) -> list[set[Shown]]:
        """Return all that a robot may show in each span."""
        found: list[set[Shown]] = [set() for _ in range(self.size)]
        for shown, window in zip(places.letters, places.windows, strict=True):
            for span in self._spans_of(window):
                found[span].add(shown)
        return found

    def _letters(self, span: int, at: At) -> list[Letter]:
        """Return what the team may show together, whatever the others show: of a proposition that may hold, both (Coq: `counted_letters`)."""
        every = [(one.robot, {one.letters[place]}) for one, place in zip(self.followed, at, strict=True)]
        every += [(robot, seen[span]) for robot, seen in self._others]
        options: list[list[Letter]] = []
        for one, number in self.claim.table.propositions.items():
            is_true = self.claim.counted[one.counted].is_true
            kinds = [set(map(is_true, shown)) for robot, shown in every if one.robot in ("", robot)]
            holds = {sum(False not in kind for kind in kinds) >= one.least, sum(True in kind for kind in kinds) >= one.least}
            options.append([frozenset({number}) if so else frozenset() for so in sorted(holds)])
        return [frozenset[int]().union(*chosen) for chosen in _bounded(options, "letters of a team at one place")]

    def begin(self) -> list[Step]:
        """Return how the flight may begin."""
        every = _bounded([one.initial for one in self.followed], "ways to go on at one instant")
        return [step for at in every for step in self._entered(0, (at, 0))]

    def _entered(self, span: int, state: State) -> list[Step]:
        if not all(span in when[place] for when, place in zip(self._when, state[0], strict=True)):
            return []
        return [(letter, state) for letter in (self._letters(span, state[0]) if self.claim.joint else [None])]

    def moves(self, span: int, state: State) -> Iterator[Step]:
        """Yield what may happen within a span; who waits comes to its place when what it waits for was over before."""
        at = state[0]
        for step in (self._joint_moves if self.claim.joint else self._own_moves)(span, state):
            if not any(at[then] < j == step[1][0][then] and at[first] < i for first, i, then, j in self._waits):
                yield step

    def _joint_moves(self, span: int, state: State) -> Iterator[Step]:
        every = zip(self.followed, self._when, state[0], strict=True)
        options = [[place, *(t for t in places.following[place] if span in when[t])] for places, when, place in every]
        for then in _bounded(options, "ways to go on at one instant"):
            yield from ((letter, (then, 0)) for letter in self._letters(span, then))

    def _own_moves(self, span: int, state: State) -> Iterator[Step]:
        at, read = state
        for letter in self._shown[span]:
            yield letter, state
        for robot, (places, place) in enumerate(zip(self.followed, at, strict=True)):
            yield self.claim.table.letter_of(places.letters[place]), (at, read | 1 << robot)
            for target in places.following[place]:
                changed = places.letters[place] != places.letters[target] or {places.laps[place], places.laps[target]} == {1, 2}
                if span in self._when[robot][target] and (not changed or read >> robot & 1):
                    yield None, ((*at[:robot], target, *at[robot + 1 :]), read & ~(1 << robot) if changed else read)

    def handed(self, span: int, state: State) -> tuple[int, list[Step]]:
        """Return the next span, of the last one of laps that in the lap before, and how a state comes there."""
        if span + 1 < self.size or self.back is None:
            return span + 1, self._entered(span + 1, state)
        if any(places.laps[place] != 2 for places, place in zip(self.followed, state[0], strict=True)):
            return self.back, []
        before = tuple(place - places.shift for places, place in zip(self.followed, state[0], strict=True))
        return self.back, self._entered(self.back, (before, state[1]))

    def may_end(self, state: State) -> bool:
        """Return whether the flight may end so."""
        everyone = self.claim.joint or state[1] == (1 << len(self.followed)) - 1
        return everyone and all(place in places.final for places, place in zip(self.followed, state[0], strict=True))


def _bounded(options: Sequence[Sequence[_T]], what: str) -> Iterator[tuple[_T, ...]]:
    """Return all ways to choose one of each, which have to be few."""
    few(math.prod(map(len, options)), what)
    return product(*options)
