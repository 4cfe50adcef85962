"""Visits that a formula bounded in seconds asks for: by when some robot has to be where, and for how long.

Every flight that satisfies the mission makes all of these visits; a formula may ask for more than is found here.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from verify.data import Mission
from verify.data.language.formula import Formula
from verify.data.language.relaxation import relaxed


@dataclass(frozen=True, slots=True)
class DueVisit:
    """A visit that is made in every flight that satisfies a formula.

    Attributes:
        asked: The conjunct that asks for it.
        places: Robots and regions, of which one robot is in one region.
        begin: It is there at a time no earlier than this, s.
        end: And no later than this, s; infinite for no bound.
        lasts: It stays for so long from then on, s.
        apart: Visits of one conjunct and number are made by different robots; -1 where that is not asked.
    """

    asked: Formula
    places: tuple[tuple[str, str], ...]
    begin: float
    end: float
    lasts: float = 0.0
    apart: int = -1


@dataclass(frozen=True, slots=True)
class _Time:
    """Window in which a sub-formula has to hold at a time, and for how long from then on, s."""

    begin: float = 0.0
    end: float = 0.0
    lasts: float = 0.0


def due_visits(mission: Mission) -> tuple[DueVisit, ...]:
    """Return the visits that a mission's formula surely asks for; those that follow from others are left out.

    Args:
        mission: Its formula is bounded in seconds.
    """
    found, numbers = list[DueVisit](), itertools.count()
    follows = {part for timed in mission.timed_parts for part in relaxed(timed).conjuncts()}
    untimed = [part for part in mission.formula.conjuncts() if part.operator in ("F", "U", "M") and part not in follows]
    for part in (*mission.timed_parts, *untimed):
        found += _Visits(mission, part, numbers).of(part, _Time())
    kept: list[DueVisit] = []
    for index, visit in enumerate(found):
        others = [*kept, *found[index + 1 :]]
        if not any(_follows(visit, other) for other in others):
            kept.append(visit)
    return tuple(kept)


def _follows(visit: DueVisit, other: DueVisit) -> bool:
    """Return whether each flight that makes one visit makes the other one, too."""
    within = visit.begin <= other.begin and other.end <= visit.end and visit.lasts <= other.lasts
    return within and visit.apart < 0 and set(other.places) <= set(visit.places)


@dataclass(frozen=True)
class _Visits:
    """Reader of one conjunct."""

    mission: Mission
    asked: Formula
    numbers: Iterator[int]

    def of(self, node: Formula, when: _Time) -> list[DueVisit]:
        """Return visits that are made where a formula holds at some time of a window."""
        parts = node.arguments
        match node.operator:
            case "name":
                return self._made(list(self._places(node)), when)
            case "count":
                assert node.bound is not None
                places = [place for name in self.mission.agents for place in self._places(parts[0].of(name))]
                made, number = self._made(places, replace(when, lasts=0.0)), next(self.numbers)
                return [replace(visit, apart=number) for visit in made for _ in range(node.bound[1])]
            case "&":
                return [visit for part in parts for visit in self.of(part, when)]
            case "|":
                return self._either([self.of(part, replace(when, lasts=0.0)) for part in parts])
            case "F" | "U" | "M":
                reached = parts if node.operator == "M" else parts[-1:]
                return [visit for part in reached for visit in self.of(part, _later(node, when))]
            case "G":
                low, high = (0, None) if node.window is None else node.window
                lasts = math.inf if high is None else float(high - low) + when.lasts
                first = _Time(when.begin + float(low), when.end + float(low))
                return self.of(parts[0], first if math.isinf(lasts) else replace(first, lasts=lasts))
            case _:
                return []

    def _places(self, node: Formula) -> Iterator[tuple[str, str]]:
        """Yield where a robot shows a proposition, or one of several; nothing where that says no place."""
        if node.operator == "|":
            each = [list(self._places(part)) for part in node.arguments]
            yield from (place for places in each for place in places if all(each))
        if node.operator == "name" and node.name in self.mission.all_regions:
            yield from ((name, node.name) for name in self.mission.agents if node.robot in ("", name))

    def _made(self, places: list[tuple[str, str]], when: _Time) -> list[DueVisit]:
        if not places:
            return []
        lasts = when.lasts if len(places) == 1 else 0.0  # robots may relieve each other, and change places
        return [DueVisit(self.asked, tuple(places), when.begin, when.end, lasts)]

    def _either(self, each: list[list[DueVisit]]) -> list[DueVisit]:
        """Return one visit that is made whichever of several is: to any of their places, in any of their windows."""
        if not all(each):
            return []
        first = [visits[0] for visits in each]
        places = tuple(dict.fromkeys(place for visit in first for place in visit.places))
        begin, end = min(visit.begin for visit in first), max(visit.end for visit in first)
        return [DueVisit(self.asked, places, begin, end, min(visit.lasts for visit in first))]


def _later(node: Formula, when: _Time) -> _Time:
    """Return the window in which what an operator reaches has to hold."""
    low, high = (0, None) if node.window is None else node.window
    return _Time(when.begin + float(low), math.inf if high is None else when.end + float(high))
