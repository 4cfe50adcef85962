"""MTAC-E for many tasks: tours by straight lines, then the very paths of those that may be cheapest.

The walk over the team automaton (`beam_search`) looks at sets of tasks that are done, of which n tasks have 2^n, and its decomposition set at
pairs of them. From `MANY` tasks on tasks are shared in tours instead (`task_tours`, `shared_tours`). The beam is one of whole shares then: the
paths of the cheapest few are priced by cross-entropy, each robot's once, and what these prices say is better, one task moved from
one tour to another, is priced next, in the order of what it should cost, until nothing promises more or as many paths were priced as there
are tasks and robots. Of 64 random missions that makes two cheaper, one of them by 5 %.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass

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
from ltlplan.search.tours.task_tours import Tours
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
        width: How many shares are priced first.
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
    best = _Pricing(asked, sharing, paths).cheapest(shares)
    if best is None:
        return None
    tours = [sharing.tours.tour(robot, tasks) for robot, tasks in enumerate(best)]
    names = asked.problem.mission.agents
    return {name: asked.itinerary(i, tour.nodes) for i, (name, tour) in enumerate(zip(names, tours, strict=True))}


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


class _Pricing:
    """Shares by what their robots' very paths cost."""

    def __init__(self, asked: ManyTasks, sharing: Sharing, paths: PricedPaths) -> None:
        self._asked, self._sharing, self._paths = asked, sharing, paths
        self._names = tuple(asked.problem.mission.agents)

    def cheapest(self, shares: list[Share]) -> Share | None:
        """Return the cheapest share that was found; None where none can be flown."""
        priced = {share: self._price(share) for share in shares}
        best = min(priced, key=lambda share: priced[share])
        most = len(self._paths.tried) + len(self._sharing.tours.tasks) + len(self._names)
        improved = math.isfinite(priced[best])
        while improved:
            improved = False
            for guess, share in sorted(self._neighbours(best), key=lambda pair: pair[0]):
                if guess >= priced[best] or len(self._paths.tried) >= most:
                    break
                if share not in priced and not _broken(self._asked, self._sharing, share):
                    priced[share] = self._price(share)
                    if priced[share] < priced[best]:
                        best, improved = share, True
                        break
        return best if math.isfinite(priced[best]) else None

    def _price(self, share: Share) -> float:
        """Return the objective by the robots' paths; infinite where one cannot be flown."""
        return team_cost(self._asked.problem.mission, [self._path(robot, tasks) for robot, tasks in enumerate(share)])

    def _path(self, robot: int, tasks: tuple[int, ...]) -> float:
        tour = self._sharing.tours.tour(robot, tasks)
        if tour.cost == math.inf:
            return math.inf
        return self._paths.cost(self._names[robot], tour.nodes, lambda: self._asked.itinerary(robot, tour.nodes))

    def _neighbours(self, share: Share) -> Iterator[tuple[float, Share]]:
        """Yield shares in which one task is moved, each with what it should cost: as much more as its ways are longer."""
        tours = self._sharing.tours
        flown = [tours.tour(robot, tasks).cost for robot, tasks in enumerate(share)]
        prices = [self._path(robot, tasks) for robot, tasks in enumerate(share)]
        usual = sum(prices) / sum(flown) if sum(flown) > 0 else 1.0
        rates = [price / cost if cost > 0 else usual for price, cost in zip(prices, flown, strict=True)]
        for giver, own in enumerate(share):
            for task in dict.fromkeys(own):
                less = tuple(other for other in own if other != task)
                given = tours.tour(giver, less).cost
                for taker in range(len(share)):
                    cost, longer = self._sharing.with_one(taker, less if taker == giver else share[taker], task)
                    if math.inf not in (given, cost):
                        moved, costs = list(share), list(prices)
                        moved[giver], costs[giver] = less, rates[giver] * given
                        moved[taker], costs[taker] = longer, rates[taker] * cost
                        yield team_cost(self._asked.problem.mission, costs), tuple(moved)
