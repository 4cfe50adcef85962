"""The cheapest laps of a team, by what its objective says: of robots that fly one at a time, and what no laps at all cost less than."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.assignment import TIES
from ltlplan.search.lassos.concurrent_cycle_steps import staged
from ltlplan.search.lassos.product_search.lap_places import LapPlaces, Limits
from ltlplan.search.lassos.product_search.lap_search import CheapestLaps, Terms, cheapest_laps
from ltlplan.search.lassos.team_lassos import TeamLasso, are_apart, can_begin, course_of, ways_of
from ltlplan.search.lassos.team_readers import AnyReader, LetterReader, team_readers
from ltlplan.search.lassos.team_system import TeamSystem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission

MOST_PLACES = 20_000
"""Nodes of all robots, and places before their laps, that are looked at."""

MOST_WAYS = 30_000
"""Ways that searches go on with, in all."""

MOST_PAIRS = 15
"""Pairs of robots of which laps are looked for in which only these two fly."""


_SHARES = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
"""Of a limit under which there are too many places."""


# six parameters: what is planned with which bounds, for less than what, and of which laps
def laps_below(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, below: float, *, at_once: bool = False
) -> TeamLasso | None:
    """Return the cheapest laps of robots that fly one at a time, if they cost less than a limit and are within reach.

    Laps in which one or two robots fly at all come first: few places are within what these pay.

    Args:
        mission: Gives the objective, the reading, where regions are, how far robots keep apart, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        below: What the robots are to pay less than in sum, or the dearest of them.
        at_once: Whether robots act where they come to only before others go on, so that nobody waits for an action alone.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
    """
    searches = _Searches(mission, budget, at_once=at_once)
    best: _Found | None = None
    ended = False
    for flying in _flying(len(each)):
        some = [own if robot in flying else replace(own, edges=tuple(() for _ in own.edges)) for robot, own in enumerate(each)]
        system = TeamSystem(some)
        readers = team_readers(mission, asked, system.letters, budget)
        laps, limit = searches.within_reach(system, readers, below)
        ended = laps is not None and laps.ended and (bool(laps.lap) or limit == below)
        if laps is not None and laps.lap:
            best, below = _Found(system, readers, laps), laps.bound - TIES
    if best is None:
        return None
    prefix, lap = best.laps.prefix, best.laps.lap
    course = course_of(best.system, prefix, lap)
    course = staged(best.system, best.readers, course, joint=mission.spec.team == "joint", seams=True)
    return TeamLasso(ways_of(len(each), prefix), ways_of(len(each), lap), course, None, ended, searches.expanded)


def _flying(robots: int) -> Iterator[Sequence[int]]:
    """Yield which robots fly: of three and more first single ones and pairs, and then all."""
    everyone = range(robots)
    if robots > 2:
        yield from ((robot,) for robot in everyone)
        yield from itertools.islice(itertools.combinations(everyone, 2), MOST_PAIRS)
    yield everyone


def least_of_all_laps(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, known: float
) -> float | None:
    """Return what any laps cost at the least, also with several robots on their way; None where that is out of reach.

    Args:
        mission: Gives the objective, the reading, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        known: What laps cost that were found: the sum, or what the dearest robot pays.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
    """
    system = TeamSystem(each, together=True)
    readers = team_readers(mission, asked, system.letters, budget)
    plain = [reader for reader in readers if reader.closes or (isinstance(reader, LetterReader) and reader.stays)]
    below = known - TIES
    least: float | None = None
    for some in (
        (plain, readers) if len(plain) < len(readers) else (readers,)
    ):  # those that remember nothing are quick, and often enough
        found, limit = _Searches(mission, budget).within_reach(system, some, below)
        if found is not None:
            least = max(least or 0.0, min(found.bound - TIES, known if limit == below else limit))
            if least >= known - TIES:
                break
    return least


@dataclass(frozen=True, slots=True)
class _Found:
    """Laps, with the product in which they were found and how it is read."""

    system: TeamSystem
    readers: Sequence[AnyReader]
    laps: CheapestLaps


class _Searches:
    """Searches that go on with so many ways in all.

    Attributes:
        expanded: Ways that were gone on with.
    """

    def __init__(self, mission: Mission, budget: Budget, *, at_once: bool = False) -> None:
        self._mission, self._places, self._at_once = mission, min(MOST_PLACES, budget.lasso), at_once
        self._most, self.expanded = min(MOST_WAYS, budget.states // 50), 0

    def within_reach(self, system: TeamSystem, readers: Sequence[AnyReader], below: float) -> tuple[CheapestLaps | None, float]:
        """Return what was found below a limit, and that; where there are too many places, below the greatest share of it that can be searched."""
        found, limit = self._below(system, readers, below), below
        if found is not None or below == math.inf:
            return found, limit
        for share in _SHARES:
            more = self._below(system, readers, share * below)
            if more is None:
                break
            found, limit = more, share * below
            if found.lap or not found.ended:
                break
        return found, limit

    def _below(self, system: TeamSystem, readers: Sequence[AnyReader], below: float) -> CheapestLaps | None:
        """Return what was found below a limit; None where there are too many places."""
        robots = len(system.systems)
        accounts = range(robots) if self._mission.planner.objective == "longest" else (0,) * robots
        limits = Limits(self._places, below, accounts)
        try:
            places = LapPlaces(system, readers, lambda nodes: can_begin(self._mission, system, nodes), limits)
        except TooLarge:
            return None
        apart = [
            home and are_apart(self._mission, system, nodes) for home, nodes in zip(places.homes, places.nodes, strict=True)
        ]
        terms = Terms(self._mission.spec.repeat, below, self._most - self.expanded, apart, self._at_once)
        found = cheapest_laps(system, places, terms)
        self.expanded += found.expanded
        return found
