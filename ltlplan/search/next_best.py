"""The cheapest words whose paths can be laid: where the way of one assignment is blocked, the next ones are tried in turn.

The search for words knows straight lines between regions, not what stands between them. Where no path can be laid along a
word, another one differs from it in a leg at least: each leg of the blocked robot is shut in turn and the words are
searched again, the cheapest first (as Lawler, "A procedure for computing the K best solutions", Management Science 18, 1972).
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ltlplan.logic.budget import TooLarge
from ltlplan.search.exact import Assignment, Itinerary, assign
from ltlplan.systems.transition_systems import Systems
from verify.data import Infeasible, Mission, RobotPlan

if TYPE_CHECKING:
    from ltlplan.systems.transition_systems import Cost, Point

_SHUT = 1e5  # m; longer than any plan, so that a shut leg is taken only where no word does without
_TRIES = 6  # assignments whose paths are tried
_SEARCHES = 60  # searches for words, at most

Leg = tuple[str, "Point | str", str]
"""Robot, from a position or a region, to a region."""


@dataclass(frozen=True, slots=True)
class LaidPlan:
    """An assignment whose paths could be laid.

    Attributes:
        robots: Each robot's path, in the mission's order.
        assignment: Who does what.
        passed_over: Why each cheaper assignment was not taken, the cheapest first.
        first: The cheapest assignment, laid or not; its bounds hold for all.
    """

    robots: dict[str, RobotPlan]
    assignment: Assignment
    passed_over: tuple[Infeasible, ...]
    first: Assignment


def lay_cheapest(mission: Mission, lay: Callable[[str, Itinerary], RobotPlan]) -> LaidPlan:
    """Share a mission among its robots by the cheapest words along which `lay` finds paths.

    Args:
        mission: With its formula.
        lay: From a robot's name and itinerary to its path; raises Infeasible where there is none.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula.
        Infeasible: No path was found along any of the words that were tried; the error is the cheapest words' own.
    """
    first = assign(mission)
    shut: frozenset[Leg] = frozenset()
    heap = [(first.cost, 0, shut, first)]
    branches = {shut}
    refused: dict[tuple[object, ...], str] = {}  # what was tried, and the robot whose path is blocked
    errors: list[Infeasible] = []
    while heap and len(errors) < _TRIES:
        _, _, shut, found = heapq.heappop(heap)
        if _key(found) not in refused:
            robots: dict[str, RobotPlan] = {}
            try:
                for name, itinerary in found.robots.items():
                    refused[_key(found)] = name
                    robots[name] = lay(name, itinerary)
            except Infeasible as error:
                errors.append(error)
            else:
                return LaidPlan(robots, found, tuple(errors), first)
        robot = refused[_key(found)]
        for leg in sorted(_legs(mission, robot, found.robots[robot]), key=str):
            without = shut | {leg}
            if without in branches or len(branches) > _SEARCHES:
                continue
            branches.add(without)
            try:
                other = assign(mission, cost=_shutting(mission, without))
            except TooLarge:
                continue  # this branch is too large to search; the others may not be
            if not any(_legs(mission, name, itinerary) & without for name, itinerary in other.robots.items()):
                heapq.heappush(heap, (other.cost, len(branches), without, other))
    raise errors[0]


def _legs(mission: Mission, robot: str, itinerary: Itinerary) -> set[Leg]:
    """Return the legs of one robot; a lasso's closing leg too."""
    places: list[Point | str] = [mission.agents[robot].start, *(visit.region for visit in itinerary.visits)]
    cycle = itinerary.cycle_visit
    if cycle is not None and cycle < len(itinerary.visits):
        places.append(itinerary.visits[cycle].region)
    return {(robot, a, b) for a, b in itertools.pairwise(places) if isinstance(b, str)}


def _shutting(mission: Mission, shut: frozenset[Leg]) -> Cost:
    straight = Systems(mission)

    def cost(robot: str, start: Point | str, region: str) -> float:
        return straight.leg(robot, start, region) + (_SHUT if (robot, start, region) in shut else 0.0)

    return cost


def _key(found: Assignment) -> tuple[object, ...]:
    return tuple(
        (robot, tuple(visit.region for visit in itinerary.visits), itinerary.cycle_visit)
        for robot, itinerary in found.robots.items()
    )
