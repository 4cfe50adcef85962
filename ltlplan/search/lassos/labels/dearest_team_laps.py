"""Laps of a team by its dearest robot: the cheapest of robots that fly one at a time, and what no laps at all cost less than."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.assignment import TIES
from ltlplan.search.lassos.labels.dearest_laps import DearestLaps, Terms, laps_of_least_dearest
from ltlplan.search.lassos.labels.lap_places import LapPlaces, Limits
from ltlplan.search.lassos.team_lassos import TeamLasso, are_apart, can_begin, course_of, ways_of
from ltlplan.search.lassos.team_readers import AnyReader, LetterReader, team_readers
from ltlplan.search.lassos.team_stages import staged
from ltlplan.search.lassos.team_system import TeamSystem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission

MOST_PLACES = 20_000
"""Nodes of all robots, and places before their laps, that are looked at."""

MOST_WAYS = 30_000
"""Ways that a search goes on with."""


def laps_for_dearest(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, below: float
) -> TeamLasso | None:
    """Return laps of robots that fly one at a time whose dearest robot pays least, if that is below a limit and within reach.

    Args:
        mission: Gives the reading, where regions are, how far robots keep apart, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        below: What the dearest robot is to pay less than.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
    """
    system = TeamSystem(each)
    readers = team_readers(mission, asked, system.letters, budget)
    found = _searched(mission, system, readers, budget, below)
    if found is None or not found.lap:
        return None
    course = course_of(system, found.prefix, found.lap)
    course = staged(system, readers, course, joint=mission.spec.team == "joint", seams=True)
    return TeamLasso(ways_of(len(each), found.prefix), ways_of(len(each), found.lap), course, None, True, found.expanded)


def least_for_dearest(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, known: float
) -> float | None:
    """Return what the dearest robot pays at the least in any laps, also of several robots on their way; None where that is out of reach.

    Args:
        mission: Gives the reading, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the automata, and with its states on the search.
        known: What it pays in laps that were found.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
    """
    system = TeamSystem(each, together=True)
    readers = team_readers(mission, asked, system.letters, budget)
    plain = [reader for reader in readers if reader.closes or (isinstance(reader, LetterReader) and reader.stays)]
    least: float | None = None
    for some in (
        (plain, readers) if len(plain) < len(readers) else (readers,)
    ):  # those that remember nothing are quick, and often enough
        found = _searched(mission, system, some, budget, known - TIES)
        if found is not None:
            least = max(least or 0.0, min(found.bound - TIES, known))
            if least >= known - TIES:
                break
    return least


def _searched(
    mission: Mission, system: TeamSystem, readers: Sequence[AnyReader], budget: Budget, below: float
) -> DearestLaps | None:
    """Return what a search found; None where there are too many places."""
    limits = Limits(min(MOST_PLACES, budget.lasso), below)
    try:
        places = LapPlaces(system, readers, lambda nodes: can_begin(mission, system, nodes), limits)
    except TooLarge:
        return None
    apart = [home and are_apart(mission, system, nodes) for home, nodes in zip(places.homes, places.nodes, strict=True)]
    terms = Terms(mission.spec.repeat, below, min(MOST_WAYS, budget.states // 50), apart)
    return laps_of_least_dearest(system, places, terms)
