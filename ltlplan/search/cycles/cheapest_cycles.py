"""The cheapest cycles of a team, by what its objective says: of robots that fly one at a time, and what no cycles at all cost less than.

The search of one lasso of product and automata, with ever more robots flying, that stood beside this one found no cheaper cycles for any of 120 random
teams, and took up to ten times as long.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.cycles.cycle_places import CyclePlaces, Limits
from ltlplan.search.cycles.reading import CycleReading, Terms
from ltlplan.search.cycles.team_cycles import Course, TeamCycles, are_apart, may_begin, moves_along, staged
from ltlplan.search.cycles.team_readers import LetterReader, Reader, team_readers
from ltlplan.search.cycles.team_system import TeamSystem, resting
from ltlplan.search.problem import TIES
from ltlplan.search.reduced_graph import staying
from ltlplan.search.team_reading import Found, least_highest
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission
from verify.data.language.word import stutter_free

MOST_PLACES = 20_000
"""Nodes of all robots, and places before their cycles, that are looked at."""

MOST_WAYS = 30_000
"""Ways that searches go on with, in all."""

MOST_PAIRS = 15
"""Pairs of robots of which cycles are looked for in which only these two fly."""

_HASTE = 4.0
"""How much bounds count where any cycles will do."""

_SHARES = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
"""Of a limit under which there are too many places."""

_ROUNDING = 1e-9  # by which sums of the same costs may differ


@dataclass(frozen=True, slots=True)
class Effort:
    """Options of a search for cycles.

    Attributes:
        at_once: Whether robots act where they come to only before others go on, so that nobody waits for an action alone.
        hasty: Whether any cycles will do.
    """

    at_once: bool = False
    hasty: bool = False


THOROUGH = Effort()


@dataclass(frozen=True, slots=True)
class Below:
    """Result of a search for cycles below a limit.

    Attributes:
        cycles: The cheapest ones; None where none are known.
        least: What no cycles at all cost less than; of a single robot alone, whose search leaves none out.
    """

    cycles: TeamCycles | None
    least: float | None = None


# six parameters: what is planned with which bounds, for less than what, and how
def cycles_below(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, below: float, effort: Effort = THOROUGH
) -> Below:
    """Return the cheapest cycles of robots that fly one at a time, if they cost less than a limit and are within reach.

    Cycles in which one or two robots fly at all come first: few places are within what these pay.

    Args:
        mission: Gives the objective, the reading, where regions are, how far robots keep apart, and how many cycles count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        below: What the robots are to pay less than in sum, or the one with the highest cost.
        effort: How cycles are searched for.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
        TooLarge: No cycles were found at all, and the search did not come to its end.
    """
    searches = _Searches(mission, budget, effort)
    readers, joint = team_readers(mission, asked, budget), mission.spec.team == "joint"
    limit, best, ended, least = below, None, False, None
    for flying in _flying(len(each)):
        system = TeamSystem([own if robot in flying else staying(own) for robot, own in enumerate(each)])
        answer = searches.within_reach(system, readers, limit)
        ended = answer is not None and answer.found.stopped is None and (bool(answer.found.states) or answer.below == limit)
        if answer is not None and len(each) == 1 and not effort.hasty:
            least = answer.least(below)
        if answer is not None and answer.found.states:
            best, limit = (system, *answer.reading.cycle(answer.found)), answer.found.cost - TIES
    if best is None:
        if ended or below < math.inf:
            return Below(None, least)
        hint = (
            f"Laps are planned over the product of all {len(each)} robots, which is for small teams: ask for fewer robots or regions, for "
            "fewer parts that happen once (`F a` doubles the states, `G F a` does not), for a finite trace, or one mission a robot."
        )
        raise TooLarge(
            "The infinite trace's product of robots and automata has", searches.expanded, "states", searches.most_places, hint
        )
    system, prefix, cycle = best
    one_at_a_time = Course(system.initial, moves_along(system, prefix), moves_along(system, cycle))
    course = staged(system, readers, one_at_a_time, joint=joint)
    prefixes, cycles = (tuple(map(stutter_free, zip(*way, strict=True))) for way in (prefix, cycle))
    return Below(TeamCycles(prefixes, cycles, course, least, ended and not effort.hasty, searches.expanded), least)


def _flying(robots: int) -> Iterator[Sequence[int]]:
    """Yield which robots fly: of three and more first single ones and pairs, and then all."""
    everyone = range(robots)
    if robots > 2:
        yield from ((robot,) for robot in everyone)
        yield from itertools.islice(itertools.combinations(everyone, 2), MOST_PAIRS)
    yield everyone


def least_of_all_cycles(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, known: float
) -> float | None:
    """Return what any cycles cost at the least, also with several robots on their way; None where that is out of reach.

    Args:
        mission: Gives the objective, the reading, and how many cycles count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        known: What cycles cost that were found: the sum, or what the robot with the highest cost pays.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
    """
    system = TeamSystem(each, together=True)
    readers = team_readers(mission, asked, budget)
    plain = [reader for reader in readers if reader.closes or (isinstance(reader, LetterReader) and reader.stays)]
    least: float | None = None
    for some in (
        (plain, readers) if len(plain) < len(readers) else (readers,)
    ):  # those that remember nothing are quick, and often enough
        answer = _Searches(mission, budget, THOROUGH).within_reach(system, some, known - TIES)
        if answer is not None:
            least = max(least or 0.0, answer.least(known - TIES))
            if least >= known - TIES:
                break
    return least


def cycles_may_exist(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, *, together: bool = False
) -> bool:
    """Tell whether there may be cycles: there are none where places that can be gone round do not show all that is asked.

    Args:
        mission: Gives the reading.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and on the places that are looked at.
        together: Whether several robots may be on their way at the same time; else one robot flies while the others rest.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
        TooLarge: There are more places.
    """
    system = TeamSystem(each, together=together)
    readers = team_readers(mission, asked, budget)
    begins = [[together or rest for rest in resting(own, alone=len(each) == 1)] for own in each]
    places = CyclePlaces(system, readers, begins, Limits(budget.lasso, math.inf, (0,) * len(each)))
    return any(places.recurring)


@dataclass(frozen=True, slots=True)
class _Answer:
    """Result of a search below a limit, and the reading that it went through."""

    found: Found
    reading: CycleReading
    below: float

    def least(self, below: float) -> float:
        """Return what no cycles cost less than, where those below a limit were asked for, of which this search may have looked at a part."""
        return min(self.found.bound - TIES, below + TIES if self.below == below else self.below)


class _Searches:
    """Searches that go on with so many ways in all.

    Attributes:
        expanded: Ways that were gone on with.
    """

    def __init__(self, mission: Mission, budget: Budget, effort: Effort) -> None:
        self._mission, self._effort = mission, effort
        self.most_places = budget.lasso if effort.hasty else min(MOST_PLACES, budget.lasso)
        self._budget = budget.of(min(MOST_WAYS, budget.states if effort.hasty else budget.states // 50))
        self.expanded = 0

    def within_reach(self, system: TeamSystem, readers: Sequence[Reader], below: float) -> _Answer | None:
        """Return what was found below a limit; where there are too many places, below the greatest share of it that can be searched."""
        answer = self._below(system, readers, below)
        for share in _SHARES if answer is None and below < math.inf else ():
            more = self._below(system, readers, share * below)
            if more is None:
                break
            answer = more
            if more.found.states or more.found.stopped is not None:
                break
        return answer

    def _below(self, system: TeamSystem, readers: Sequence[Reader], below: float) -> _Answer | None:
        """Return what was found below a limit; None where there are too many places."""
        mission, robots = self._mission, len(system.systems)
        begins = [may_begin(mission, own) for own in system.systems]
        accounts = range(robots) if mission.planner.objective == "longest" else (0,) * robots
        try:
            places = CyclePlaces(system, readers, begins, Limits(self.most_places, below, accounts))
        except TooLarge:
            return None
        homes = zip(places.homes, places.nodes, strict=True)
        apart = [home and are_apart(mission, system.systems, nodes) for home, nodes in homes]
        terms = Terms(mission.spec.repeat, apart, self._effort.at_once, _HASTE if self._effort.hasty else 1.0)
        reading = CycleReading(system, places, terms)
        found = least_highest(reading, self._budget.of(self._budget.states - self.expanded), below=below, rounding=_ROUNDING)
        self.expanded += found.explored
        return _Answer(found, reading, below)
