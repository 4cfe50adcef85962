"""MTAC-E for many tasks: tours by straight lines, then the very paths of those that may be cheapest.

The walk over the team automaton (`beam_search`) looks at sets of tasks that are done, of which n tasks have 2^n, and its decomposition set at
pairs of them. From `MANY` tasks on tasks are shared in tours instead (`task_tours`, `shared_tours`). The beam is one of whole shares then: the
paths of the cheapest few are priced by cross-entropy, each robot's once, and the cheapest share is taken. To move single tasks from tour to
tour by these prices made one of 32 random missions 2.5 % cheaper, and no other.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import partial

from numpy.random import Generator

from ltlplan.allocation import Itinerary
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.mtac.priced_paths import PricedPaths
from ltlplan.paths.costs import team_cost
from ltlplan.search.itineraries import itinerary
from ltlplan.search.own.reading import OwnTask
from ltlplan.search.problem import TIES, Problem
from ltlplan.search.tours.shared_tours import Objective, Share, Sharing
from ltlplan.search.tours.task_tours import Tour, Tours
from ltlplan.systems.robot_systems import unit_cost
from verify.data import Mission
from verify.data.progress import Progress

MANY = 6
"""Tasks from which on they are shared in tours; where the dearest of several robots counts, it is `MANY_FOR_LONGEST`."""

MANY_FOR_LONGEST = 2
"""The walk's bound on the dearest robot's cost spreads what is left evenly over all robots, and says little from two tasks on."""


@dataclass(frozen=True, slots=True)
class ManyTasks:
    """A mission's tasks, and the graph that they are done on.

    Attributes:
        problem: The mission, and what its robots can do.
        own: The same as the exact search reads it.
    """

    problem: Problem
    own: OwnTask

    @property
    def longest(self) -> bool:
        """Return whether the highest cost of a robot counts, not the sum."""
        return self.problem.mission.planner.objective == "longest"

    def itinerary(self, robot: int, nodes: tuple[int, ...]) -> Itinerary:
        """Return what a robot does on a tour.

        Args:
            robot: Which one.
            nodes: That matter.
        """
        return itinerary(self.problem.each[robot], self.own.graph.expand(robot, nodes))

    def least(self) -> float:
        """Return what no share costs less than, by the same ways."""
        return max(0.0, self.own.least(longest=self.longest) - TIES) * unit_cost(self.problem.mission)


def many_tasks(mission: Mission) -> ManyTasks | None:
    """Return a mission's tasks where there are many of them; None where the walk over the team automaton does.

    Args:
        mission: What is asked.
    """
    if mission.spec.team != "own" or mission.spec.trace == "infinite":
        return None
    many = MANY_FOR_LONGEST if mission.planner.objective == "longest" and len(mission.agents) > 1 else MANY
    problem = Problem(mission)
    try:
        if len(conjunct_automata(mission.formula, "finite")) < many:
            return None
        found = ManyTasks(problem, OwnTask(problem.each, problem.automata))
    except TooLarge:
        return None
    return found if len(found.own.kinds().free) >= many else None


def share_many(
    asked: ManyTasks, paths: PricedPaths, *, rng: Generator, width: int, progress: Progress
) -> dict[str, Itinerary] | None:
    """Return what each robot does where many tasks are shared so that the paths of those who fly cost little.

    Args:
        asked: The tasks.
        paths: Prices of paths.
        rng: Source of every draw.
        width: How many shares are priced.
        progress: Told a sentence and the share done, 0 to 1.

    Returns:
        None where none was found.
    """
    progress("MTAC-E: sharing tasks by straight lines", 0.1)
    found = _by_straight_lines(asked, rng, width)
    if found is None:
        return None
    sharing, shares = found
    progress("MTAC-E: pricing shares by their paths", 0.3)
    mission, names = asked.problem.mission, tuple(asked.problem.mission.agents)

    def flown(share: Share) -> dict[str, Tour]:
        return {name: sharing.tours.tour(robot, share[robot]) for robot, name in enumerate(names)}

    def price(robot: int, name: str, tour: Tour) -> float:
        walked = partial(asked.itinerary, robot, tour.nodes)
        return math.inf if tour.cost == math.inf else paths.cost(name, tour.nodes, walked)

    def prices(share: Share) -> list[float]:
        return [price(robot, *tour) for robot, tour in enumerate(flown(share).items())]

    best = min(shares, key=lambda share: team_cost(mission, prices(share)))
    if math.inf in prices(best):
        return None
    return {name: asked.itinerary(i, tour.nodes) for i, (name, tour) in enumerate(flown(best).items())}


def _by_straight_lines(asked: ManyTasks, rng: Generator, width: int) -> tuple[Sharing, list[Share]] | None:
    """Return the cheapest shares whose words keep the formula in every order of the robots."""
    lost = frozenset[int]()
    while True:
        kinds, most = asked.own.kinds(lost), asked.problem.systems.most_costs()
        sharing = Sharing(Tours(asked.own.graph, asked.own.task, kinds, most), Objective(asked.longest), rng)
        shares = sharing.cheapest(width)
        broken = {part for share in shares for part in _broken(asked, sharing, share)}
        if not broken:
            return (sharing, shares) if shares else None
        if not broken <= set(kinds.free):
            return None
        lost |= broken


def _broken(asked: ManyTasks, sharing: Sharing, share: Share) -> Collection[int]:
    """Return the conjuncts that some order of the robots breaks."""
    tours = [sharing.tours.tour(robot, tasks) for robot, tasks in enumerate(share)]
    return asked.own.failing_orders([asked.own.graph.expand(robot, tour.nodes) for robot, tour in enumerate(tours)])
