"""All that a team may do in spans of time, for one conjunct of a formula.

Robots are *followed*, or only counted. Of a robot that is not followed no more is used than what it may show in each span.

*Moves.* Under `own` a position of the word is one robot's letter: a robot that is followed is read, or another one is; or a robot goes on to a next
place in silence, where that changes its letter only after it was read. Letters are cut down to names of the formula and others that the proof
adds: fewer names give fewer changes, before which a robot has to be read, and so more words. Under `joint` any of the robots that are followed go on at
one instant, and the letter is that of the whole team. In each span a letter is read, for there is an instant in it, and a letter that is held may be
read again: no formula has a next.

*Spans.* Each place has a window, widened by the clock error at both ends: two clocks never differ by more. Spans are [t, t') between one
beginning of a window and the next: what is possible in between is possible at t. Where others' numbers count, spans are instants and what is between them.

*Laps.* Spans end in the middle of the second lap, where the last one hands over to the middle of the first.
"""

from __future__ import annotations

import json
import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import cache
from itertools import chain, pairwise, product
from typing import TypeVar

from .formulas import Letter, Table, Tree
from .places import Places
from .statement import ZERO, Statement, require

MOST_MOVES = 20_000
"""Ways in which robots may go on at one instant."""
MOST_LETTERS = 64
"""Letters of the team that are possible at one place."""

At = tuple[int, ...]
State = tuple[At, int]
"""Places of the robots that are followed, and who of them was read since its letter changed, as bits."""
Step = tuple[Letter | None, State]
"""What is read, if anything, and what is then."""
Event = tuple[str, int]
"""A robot, and the number of the place that it comes to."""
Find = Callable[[str, frozenset[str]], Places]
"""Returns one robot's places, of letters cut down to some names."""
_T = TypeVar("_T")


class Claim:
    """One conjunct, and the team of which it is claimed.

    `places` returns one robot's places, of letters cut down to some names; `lap` is when a lap begins and ends, None for finite flights; of two
    events that are waited for, the second one comes after the first one, not with it. `names` are asked of letters, `shown` are all names that
    robots show. `groups` has, by what is counted, and whose letter it is if not everybody's, numbers of propositions, and how many robots each
    asks for; `counted` has the tables of what is counted.
    """

    lap: tuple[Fraction, Fraction] | None = None
    waits: Sequence[tuple[Event, Event]] = ()

    def __init__(self, statement: Statement, tree: Tree, find: Find) -> None:
        self.robots, self.joint, self.places = tuple(statement.robots), statement.joint, cache(find)
        self.error = statement.clock_error if len(self.robots) > 1 else ZERO
        self.table = Table(tree, statement.regions)
        asked = self.table.propositions
        self.counted = {one.counted: Table(json.loads(one.counted), statement.regions) for one in asked}
        propositions = [p for one in self.counted.values() for p in one.propositions]
        plain = all(p.name for p in propositions) and not any(one.untils() for one in self.counted.values())
        require(plain, "what is counted is no combination of names")
        self.names = frozenset(p.name for p in propositions)
        internal = (one.states.values() for one in statement.robots.values())
        self.shown = frozenset(statement.regions).union(*chain.from_iterable(internal))
        unknown, strange = [*self.names - self.shown, ""][0], [*{p.robot for p in asked} - {"", *self.robots}, ""][0]
        require(not unknown, f"the formula names {unknown[:60]!r}, which no robot shows")
        require(not strange, f"the formula names robot {strange[:60]!r}, which there is not")
        one_by_one = all(not one.robot and one.least == 1 and one.name for one in asked)
        require(self.joint or one_by_one, "the formula counts robots that are read one by one")
        self.groups: dict[tuple[str, str], list[tuple[int, int]]] = {}
        for one, number in asked.items():
            self.groups.setdefault((one.counted, one.robot), []).append((number, one.least))


class Team:
    """All that a team may do, in spans of time.

    `names` are the robots that are followed, `more` names that letters are cut down to besides the formula's. `size` is the number of spans, `back`
    of laps the span to which the last one hands over.
    """

    def __init__(self, claim: Claim, names: Sequence[str], more: frozenset[str] = frozenset()) -> None:
        self.claim, lines = claim, {robot: claim.places(robot, claim.names | more) for robot in claim.robots}
        self.followed, others = [lines[robot] for robot in names], [lines[robot] for robot in lines if robot not in names]
        windows = [window for places in lines.values() for window in places.windows]
        lows, highs = {low - claim.error for low, _ in windows}, {high + claim.error for _, high in windows}
        fine = claim.joint and any(len(set(places.letters)) > 1 for places in others)
        begin, end = claim.lap or (ZERO, ZERO)
        middle, last = (begin + end) / 2, end + (end - begin) / 2
        require(not claim.lap or 2 * claim.error < end - begin, "two clocks may be half a lap apart")
        times = {*lows, *(highs if fine else ()), *((middle, last) if claim.lap else ())}
        ordered = sorted(time for time in times if not claim.lap or time <= last)
        spans = [(t, t) for t in ordered[:1]]
        for before, after in pairwise(ordered):
            spans += [(before, after), (after, after)] if fine else [(after, after)]
        if claim.lap:
            spans.pop()  # which begins in the middle of the second lap
        self.size, self.back = len(spans), spans.index((middle, middle)) if claim.lap else None
        self._lefts, self._rights = [left for left, _ in spans], [right for _, right in spans]
        self._when = [[self._spans_of(window) for window in places.windows] for places in self.followed]
        self._shown = [] if claim.joint else self._show(others)
        self._numbers = [self._count(text, robot, others) for text, robot in claim.groups] if claim.joint else []
        index = {robot: number for number, robot in enumerate(names)}
        both = [(a, b) for a, b in claim.waits if a[0] in index and b[0] in index]
        self._waits = [(index[first], i, index[then], j) for (first, i), (then, j) in both]

    def _spans_of(self, window: tuple[Fraction, Fraction]) -> range:
        """Return the spans in which a window, not yet widened, is open."""
        low, high = window[0] - self.claim.error, window[1] + self.claim.error
        return range(bisect_left(self._lefts, low), bisect_right(self._rights, high))

    def _show(self, others: Sequence[Places]) -> list[set[Letter]]:
        """Return for each span what others may show when they are read by themselves."""
        found: list[set[Letter]] = [set() for _ in range(self.size)]
        for places in others:
            for shown, window in zip(places.letters, places.windows, strict=True):
                for span in self._spans_of(window):
                    found[span].add(self.claim.table.letter_of(shown))
        return found

    def _count(self, text: str, robot: str, others: Sequence[Places]) -> list[tuple[int, int]]:
        """Return for each span how many others (of one robot, if it is named) must and how many may satisfy a combination."""
        found = [(0, 0)] * self.size
        for places in (one for one in others if robot in ("", one.robot)):
            may, may_not = [False] * self.size, [False] * self.size
            for shown, window in zip(places.letters, places.windows, strict=True):
                kind = may if self.claim.counted[text].is_true(shown) else may_not
                for span in self._spans_of(window):
                    kind[span] = True
            found = [(must + (not b), most + a) for (must, most), a, b in zip(found, may, may_not, strict=True)]
        return found

    def _letters(self, span: int, at: At) -> list[Letter]:
        """Return what the team may show together."""
        choices: list[list[Letter]] = []
        shown = [(places.robot, places.letters[place]) for places, place in zip(self.followed, at, strict=True)]
        for ((text, robot), levels), numbers in zip(self.claim.groups.items(), self._numbers, strict=True):
            own = sum(robot in ("", name) and self.claim.counted[text].is_true(letter) for name, letter in shown)
            least, most = numbers[span]
            require(least <= most, "the robots' labels contradict each other")
            holding = {frozenset(n for n, k in levels if total >= k): None for total in range(own + least, own + most + 1)}
            choices.append(list(holding))
        return [frozenset[int]().union(*chosen) for chosen in _bounded(choices, MOST_LETTERS)]

    def begin(self) -> list[Step]:
        """Return how the flight may begin."""
        every = _bounded([one.initial for one in self.followed], MOST_MOVES)
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
        return ((letter, (then, 0)) for then in _bounded(options, MOST_MOVES) for letter in self._letters(span, then))

    def _own_moves(self, span: int, state: State) -> Iterator[Step]:
        at, read = state
        for letter in self._shown[span]:
            yield letter, state
        for robot, (places, place) in enumerate(zip(self.followed, at, strict=True)):
            yield self.claim.table.letter_of(places.letters[place]), (at, read | 1 << robot)
            for target in places.following[place]:
                changed = places.changed(place, target)
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


def _bounded(options: Sequence[Sequence[_T]], most: int) -> Iterator[tuple[_T, ...]]:
    """Return all ways to choose one of each, which have to be few."""
    few = math.prod(map(len, options)) <= most
    require(few, "not covered by the kernel: too many robots may change their letters at one instant")
    return product(*options)
