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
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import accumulate, pairwise, product
from typing import TypeVar

from .formulas import Letter, Table, Tree
from .labels import Relations, Timeline
from .places import Places, places_of
from .refused import Refused
from .statement import Statement

MOST_MOVES = 20_000
"""Ways in which robots may go on at one instant."""

MOST_LETTERS = 64
"""Letters of the team that are possible at one place."""

At = tuple[int, ...]
Step = tuple[Letter | None, At, int]
"""What is read, if anything; then where the robots are, and who was read, as bits."""

_T = TypeVar("_T")


class Claim:
    """One conjunct, and the team of which it is claimed.

    Args:
        statement: Has the regions, and how words are read.
        timelines: One for each robot.
        relations: Letters that they exclude are left out.
        tree: The conjunct.

    Attributes:
        table: Its negation.
        robots: All robots' names.
        names: Names that it asks of letters.
        groups: By what is counted, and whose letter it is if not everybody's: numbers of propositions, and how many robots each asks for.
    """

    def __init__(self, statement: Statement, timelines: Mapping[str, Timeline], relations: Relations, tree: Tree) -> None:
        self.statement, self.relations = statement, relations
        self.timelines = timelines
        self.robots = tuple(statement.robots)
        self.joint = statement.joint
        self.regions = frozenset(statement.regions)
        self.table = Table(tree, self.regions)
        self._counted = {one.counted: Table(json.loads(one.counted), self.regions) for one in self.table.propositions}
        if not all(one.is_combination for one in self._counted.values()):
            raise Refused("what is counted is no combination of names")
        self.names = frozenset(p.name for one in self._counted.values() for p in one.propositions)
        internal = {name for robot in statement.robots.values() for shown in robot.states.values() for name in shown}
        if unknown := self.names - self.regions - internal:
            raise Refused(f"the formula names {min(unknown)[:60]!r}, which no robot shows")
        if strange := {p.robot for p in self.table.propositions} - {"", *self.robots}:
            raise Refused(f"the formula names robot {min(strange)[:60]!r}, which there is not")
        if not self.joint and any(one.robot or one.least != 1 or not one.name for one in self.table.propositions):
            raise Refused("the formula counts robots that are read one by one")
        if set(timelines) != set(self.robots) or len({(line.duration, line.cycle) for line in timelines.values()}) != 1:
            raise Refused("the robots' flights do not last equally long")
        if any((line.cycle is not None) != statement.lasso for line in timelines.values()):
            raise Refused("the trace is infinite, and flights have no laps, or the other way round")
        self.groups: dict[tuple[str, str], list[tuple[int, int]]] = {}
        for number, one in enumerate(self.table.propositions):
            self.groups.setdefault((one.counted, one.robot), []).append((number, one.least))
        self._places: dict[tuple[str, frozenset[str]], Places] = {}

    def satisfies(self, shown: frozenset[str], counted: str) -> bool:
        """Return whether one robot's letter satisfies what a proposition counts."""
        return self._counted[counted].is_true(shown)

    def places(self, robot: str, names: frozenset[str]) -> Places:
        """Return one robot's places, of letters cut down to some names."""
        if (robot, names) not in self._places:
            self._places[robot, names] = places_of(self.timelines[robot], names, self.regions, self.relations)
        return self._places[robot, names]

    def team(self, followed: Sequence[str], more: frozenset[str] = frozenset()) -> Team:
        """Return the team's moves, with some robots followed.

        Args:
            followed: Their names.
            more: Names that letters are cut down to besides the formula's.
        """
        error = self.statement.clock_error if len(self.robots) > 1 else Fraction(0)
        places = {robot: self.places(robot, self.names | more) for robot in self.robots}
        return self.made([places[robot] for robot in followed], [p for r, p in places.items() if r not in followed], error)

    def made(self, followed: Sequence[Places], others: Sequence[Places], error: Fraction) -> Team:
        """Return the moves of a team.

        Args:
            followed: Places of robots that are followed.
            others: Places of all others.
            error: How far two clocks may be apart, s.
        """
        return Team(self, followed, others, error)


class Team:
    """All that a team may do, in spans of time.

    Attributes:
        claim: What is claimed of it.
        followed: Places of the robots that are followed.
        size: Number of spans.
        back: Of laps the span to which the last one hands over.
    """

    def __init__(self, claim: Claim, followed: Sequence[Places], others: Sequence[Places], error: Fraction) -> None:
        self.claim, self.followed = claim, tuple(followed)
        lines = [*followed, *others]
        lows = {low - error for places in lines for low, _ in places.windows}
        highs = {high + error for places in lines for _, high in places.windows}
        self._fine = claim.joint and any(len(set(places.letters)) > 1 for places in others)
        times = lows | highs if self._fine else lows
        lap: tuple[Fraction, Fraction] | None = None
        line = next(iter(claim.timelines.values()))
        if line.cycle is not None:
            length = line.duration - line.cycle
            if 2 * error >= length:
                raise Refused("two clocks may be half a lap apart")
            lap = line.cycle + length / 2, line.duration + length / 2
            times |= set(lap)
        ordered = sorted(time for time in times if lap is None or time <= lap[1])
        spans = [(t, t) for t in ordered[:1]]
        for before, after in pairwise(ordered):
            spans += [(before, after), (after, after)] if self._fine else [(after, after)]
        if lap is not None:
            spans.pop()  # which begins in the middle of the second lap
        self.size = len(spans)
        self.back = None if lap is None else spans.index((lap[0], lap[0]))
        self._lefts, self._rights = [left for left, _ in spans], [right for _, right in spans]
        self._error = error
        self._when = [[self._spans_of(low, high) for low, high in places.windows] for places in self.followed]
        self._shown = [] if claim.joint else self._show(others)
        self._numbers = [self._count(text, robot, others) for text, robot in claim.groups] if claim.joint else []

    def _spans_of(self, low: Fraction, high: Fraction) -> tuple[int, int]:
        """Return the first and the last span in which a window, not yet widened, is open."""
        return bisect_left(self._lefts, low - self._error), bisect_right(self._rights, high + self._error) - 1

    def _show(self, others: Sequence[Places]) -> list[set[Letter]]:
        """Return for each span what others may show when they are read by themselves."""
        found: list[set[Letter]] = [set() for _ in range(self.size)]
        for places in others:
            for shown, window in zip(places.letters, places.windows, strict=True):
                first, last = self._spans_of(*window)
                for here in found[first : last + 1]:
                    here.add(self.claim.table.letter_of(shown))
        return found

    def _count(self, text: str, robot: str, others: Sequence[Places]) -> list[tuple[int, int]]:
        """Return for each span how many others (of one robot, if it is named) must and how many may satisfy a combination."""
        counted = [places for places in others if robot in ("", places.robot)]
        must, may = [len(counted), *[0] * self.size], [0] * (self.size + 1)
        for places in counted:
            for wanted, change, sign in ((True, may, 1), (False, must, -1)):
                shown = zip(places.letters, places.windows, strict=True)
                open_ = [self._spans_of(*window) for letter, window in shown if self.claim.satisfies(letter, text) == wanted]
                for first, last in _joined(open_):
                    change[first] += sign
                    change[last + 1] -= sign
        return list(zip(accumulate(must), accumulate(may), strict=True))

    def _letters(self, span: int, at: At) -> list[Letter]:
        """Return what the team may show together."""
        choices: list[list[Letter]] = []
        shown = [(places.robot, places.letters[place]) for places, place in zip(self.followed, at, strict=True)]
        for ((text, robot), levels), numbers in zip(self.claim.groups.items(), self._numbers, strict=True):
            own = sum(robot in ("", name) and self.claim.satisfies(letter, text) for name, letter in shown)
            least, most = numbers[span]
            if least > most:
                raise Refused("the robots' labels contradict each other")
            holding = {frozenset(n for n, k in levels if total >= k): None for total in range(own + least, own + most + 1)}
            choices.append(list(holding))
        return [frozenset[int]().union(*chosen) for chosen in _bounded(choices, MOST_LETTERS)]

    def _is_open(self, robot: int, place: int, span: int) -> bool:
        """Return whether a robot may be at a place in a span."""
        first, last = self._when[robot][place]
        return first <= span <= last

    def begin(self) -> Iterator[Step]:
        """Yield how the flight may begin."""
        for at in _bounded([places.initial for places in self.followed], MOST_MOVES):
            yield from self._entered(0, tuple(at), 0)

    def _entered(self, span: int, at: At, read: int) -> Iterator[Step]:
        if all(self._is_open(robot, place, span) for robot, place in enumerate(at)):
            if not self.claim.joint:
                yield None, at, read
            else:
                for letter in self._letters(span, at):
                    yield letter, at, read

    def moves(self, span: int, at: At, read: int) -> Iterator[Step]:
        """Yield what may happen within a span.

        Args:
            span: Its number.
            at: Where the robots that are followed are.
            read: Who of them was read since its letter changed, as bits.
        """
        if self.claim.joint:
            options: list[list[int]] = []
            for robot, (places, place) in enumerate(zip(self.followed, at, strict=True)):
                options.append([place, *(t for t in places.following[place] if self._is_open(robot, t, span))])
            for then in _bounded(options, MOST_MOVES):
                for letter in self._letters(span, tuple(then)):
                    yield letter, tuple(then), 0
            return
        for letter in self._shown[span]:
            yield letter, at, read
        for robot, (places, place) in enumerate(zip(self.followed, at, strict=True)):
            yield self.claim.table.letter_of(places.letters[place]), at, read | 1 << robot
            for target in places.following[place]:
                changed = places.changed(place, target)
                if self._is_open(robot, target, span) and (not changed or read >> robot & 1):
                    then = (*at[:robot], target, *at[robot + 1 :])
                    yield None, then, read & ~(1 << robot) if changed else read

    def handed(self, span: int, at: At, read: int) -> tuple[int, list[Step]]:
        """Return the next span, of the last one of laps that in the lap before, and how a configuration comes there.

        Args:
            span: The span before.
            at: Where the robots that are followed are.
            read: Who of them was read since its letter changed, as bits.
        """
        if span + 1 < self.size:
            return span + 1, list(self._entered(span + 1, at, read))
        assert self.back is not None
        if any(places.slots[place].lap != 2 for places, place in zip(self.followed, at, strict=True)):
            return self.back, []
        at = tuple(place - places.shift for places, place in zip(self.followed, at, strict=True))
        return self.back, list(self._entered(self.back, at, read))

    def may_end(self, at: At, read: int) -> bool:
        """Return whether the flight may end so."""
        everyone = self.claim.joint or read == (1 << len(self.followed)) - 1
        return everyone and all(place in places.final for places, place in zip(self.followed, at, strict=True))


def _joined(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return ranges put together where they touch; without those that are empty."""
    found: list[tuple[int, int]] = []
    for first, last in sorted(span for span in spans if span[0] <= span[1]):
        if found and first <= found[-1][1] + 1:
            found[-1] = found[-1][0], max(last, found[-1][1])
        else:
            found.append((first, last))
    return found


def _bounded(options: Sequence[Sequence[_T]], most: int) -> Iterator[tuple[_T, ...]]:
    """Yield all ways to choose one of each.

    Raises:
        Refused: They are too many.
    """
    count = 1
    for choices in options:
        count *= len(choices)
    if count > most:
        raise Refused("not covered by the kernel: too many robots may change their letters at one instant")
    return product(*options)
