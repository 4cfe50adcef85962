"""Times at which a Boolean combination surely holds, whatever a team does within its tubes and its clocks' error.

What is combined is evaluated on all letters that the team may show at a time, not name by name: `a | !a` holds where nothing is known of a.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from verify.data.language.formula import Formula
from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import TeamLetters, is_shown
from verify.model_checking.robot_letters import MAX_OPEN, cut_timeline
from verify.model_checking.timeline import Relations, Timeline
from verify.model_checking.timing.instants import Instants, at, intervals, shows, union

MOST_LETTERS = 5_000
"""Combinations of robots' letters that are looked at for one time."""


@dataclass(frozen=True)
class Clocks:
    """Error of clocks: how much earlier and later than planned a letter may be shown, on the reference clock, in ticks."""

    early: int
    late: int


@dataclass(frozen=True)
class TeamInstants:
    """Letters that a team may show, by time.

    Attributes:
        cuts: Where the letters change; those of `letters[i]` may be shown from `cuts[i]` on.
        letters: All letters of the team that its robots' letters can come to; None where nothing at all is known.
    """

    cuts: tuple[int, ...]
    letters: tuple[frozenset[Letter] | None, ...]
    _known: dict[tuple[int, bool], Instants] = field(default_factory=dict, repr=False)
    _kept: list[Formula] = field(default_factory=list, repr=False)

    @classmethod
    def of(cls, reading: TeamLetters, planned: Sequence[Mapping[Letter, Instants]], clocks: Clocks) -> TeamInstants:
        """Put robots' letters together on the reference clock.

        Args:
            reading: What is asked of the robots' letters.
            planned: For each robot when it may show which letter, on its own clock (`robot_instants`).
            clocks: How far the robots' clocks may be off.

        Raises:
            OutOfBudget: Too many letters of several robots are open at one time.
        """
        robots = [{letter: _moved(instants, clocks) for letter, instants in shown.items()} for shown in planned]
        begins: dict[int, list[tuple[int, Letter, bool]]] = {0: []}
        for index, shown in enumerate(robots):
            for letter, instants in shown.items():
                for number, cut in enumerate(instants):
                    begins.setdefault(cut, []).append((index, letter, number % 2 == 0))
        now: list[set[Letter]] = [set() for _ in robots]
        cuts, found = sorted(begins), list[frozenset[Letter] | None]()
        united: dict[tuple[frozenset[Letter], ...], frozenset[Letter]] = {}
        for cut in cuts:
            for index, letter, begun in begins[cut]:
                (now[index].add if begun else now[index].discard)(letter)
            held = tuple(frozenset(letters) for letters in now)
            if held not in united:
                united[held] = _together(reading, held)
            found.append(united[held] or None)  # none at all: the labels contradict themselves, so nothing is sure
        return cls(tuple(cuts), tuple(found))

    def until(self, tick: int) -> TeamInstants:
        """Return the letters up to a time, that one included; of later times nothing is known."""
        count = bisect_left(self.cuts, 2 * tick + 1)
        return TeamInstants((*self.cuts[:count], 2 * tick + 1), (*self.letters[:count], None))

    def sure(self, formula: Formula, *, negated: bool) -> Instants:
        """Return when a Boolean combination of propositions, or its negation, surely holds.

        Args:
            formula: Without temporal operators.
            negated: Whether its negation is asked.
        """
        key = (id(formula), negated)
        if key not in self._known:
            self._kept.append(formula)  # so that no other one gets its identity
            always = formula.operator in ("true", "false") and (formula.operator == "true") != negated
            answers: dict[frozenset[Letter] | None, bool] = {None: always}
            cuts: list[int] = []
            for cut, letters in zip(self.cuts, self.letters, strict=True):
                if letters is not None and letters not in answers:
                    answers[letters] = all(is_shown(formula, letter, team=True) != negated for letter in letters)
                if answers[letters] != (len(cuts) % 2 == 1):
                    cuts.append(cut)
            self._known[key] = tuple(cuts)
        return self._known[key]


def ticks_per_second(times: Iterable[Fraction]) -> int:
    """Return how many ticks a second has, so that each of the times is a whole number of them."""
    return math.lcm(*{time.denominator for time in times})


def times_of(timeline: Timeline) -> set[Fraction]:
    """Return all times that a timeline names, s."""
    found = {timeline.duration, *(() if timeline.cycle is None else (timeline.cycle,))}
    for change in timeline.changes:
        found |= {change.time.low, change.time.high}
    for action in timeline.actions:
        found |= {action.time, action.time if action.until is None else action.until}
    return found


def _together(reading: TeamLetters, held: tuple[frozenset[Letter], ...]) -> frozenset[Letter]:
    if math.prod(len(letters) for letters in held) > MOST_LETTERS:
        raise OutOfBudget(f"the robots' labels leave more than {MOST_LETTERS} letters of the team open at one time")
    return frozenset(reading.together((letter, 1) for letter in letters) for letters in itertools.product(*held))


def robot_instants(
    reading: TeamLetters, robot: str, timeline: Timeline, relations: Relations, scale: int
) -> dict[Letter, Instants]:
    """Return when a robot may show each letter, as the formula sees it, on its own clock.

    Args:
        reading: What is asked of the robots' letters.
        robot: Its name.
        timeline: What it may show.
        relations: What is proved of the regions at large.
        scale: Ticks in a second; every time of the timeline is a whole number of them.

    Raises:
        OutOfBudget: Too many regions are open at one time.
    """
    timeline = cut_timeline(timeline, reading.names_of(robot))
    relations = relations.among({*timeline.initial, *(change.region for change in timeline.changes)})
    inside, outside = _possible(timeline, scale)
    internal = _internal(timeline, scale)
    cuts = sorted({0, *itertools.chain(*inside.values(), *outside.values(), *internal.values())})
    found: dict[Letter, list[Instants]] = {}
    for cut, following in itertools.zip_longest(cuts, cuts[1:]):
        here: Instants = (cut,) if following is None else (cut, following)
        sure = frozenset(name for name in inside if not shows(outside[name], cut))
        doubtful = [name for name in inside if shows(inside[name], cut) and shows(outside[name], cut)]
        if len(doubtful) > MAX_OPEN:
            raise OutOfBudget(f"{robot} may be in any of {len(doubtful)} regions at one time")
        seen = set[Letter]()
        for count in range(len(doubtful) + 1):
            for more in itertools.combinations(doubtful, count):
                regions = sure.union(more)
                if relations.allows(regions):
                    seen.update(reading.own(robot, regions | shown) for shown, times in internal.items() if shows(times, cut))
        for letter in seen:
            found.setdefault(letter, []).append(here)
    return {letter: union(*pieces) for letter, pieces in found.items()}


def _moved(instants: Instants, clocks: Clocks) -> Instants:
    """Return the times on the reference clock that may stand for planned ones."""
    if not clocks.early and not clocks.late:
        return instants
    return union(
        *(
            (max(0, low - 2 * clocks.early), *(() if high is None else (high + 2 * clocks.late,)))
            for low, high in intervals(instants)
        )
    )


def _possible(timeline: Timeline, scale: int) -> tuple[dict[str, Instants], dict[str, Instants]]:
    """Return when a robot may be in each region, and when it may be out of it."""
    inside: dict[str, list[int]] = {}
    outside: dict[str, list[int]] = {}
    status = dict(timeline.initial)
    for region, first in status.items():
        inside[region], outside[region] = [0] if first != "no" else [], [0] if first != "must" else []
    for change in timeline.changes:
        low, high = (int(time * scale) for time in (change.time.low, change.time.high))
        first, last = status.get(change.region, "no"), change.status
        into, out = inside.setdefault(change.region, []), outside.setdefault(change.region, [0])
        # a region is closed: the instant at which its boundary is crossed belongs to it
        if first == "no" and last != "no":
            into.append(2 * low)
        if last == "no" and first != "no":
            into.append(2 * high + 1)
        if first == "must" and last != "must":
            out.append(2 * low + 1 if low == high and last == "no" else 2 * low)
        if last == "must" and first != "must":
            crossed = first == "no" and (low == high or change.time.high == timeline.duration)
            out.append(2 * high if crossed else 2 * high + 1)
        status[change.region] = last
    end = int(timeline.duration * scale)
    return {name: _held(cuts, end) for name, cuts in inside.items()}, {name: _held(cuts, end) for name, cuts in outside.items()}


def _held(cuts: list[int], end: int) -> Instants:
    """Return a set of its cuts; where the flight's last instant belongs to it, so do all times after that."""
    instants = _ordered(cuts)
    return union(instants, (2 * end,)) if at(instants, end) else instants


def _ordered(cuts: list[int]) -> Instants:
    """Return a set of its cuts in their order; one that ends where it begins again goes on."""
    begun = [(low, *high) for low, *high in (cuts[index : index + 2] for index in range(0, len(cuts), 2))]
    return union(*(piece for piece in begun if len(piece) == 1 or piece[0] < piece[1]))


def _internal(timeline: Timeline, scale: int) -> dict[Letter, Instants]:
    """Return when a robot may show each set of internal propositions."""
    found: dict[Letter, list[Instants]] = {}
    shown, since = timeline.internal, 0
    for action in timeline.actions:
        first, last = int(action.time * scale), int((action.time if action.until is None else action.until) * scale)
        found.setdefault(shown, []).append((since, 2 * last + 1))
        shown, since = action.propositions, 2 * first
    found.setdefault(shown, []).append((since,))
    return {letter: union(*pieces) for letter, pieces in found.items()}
