"""Sharing many tasks by search in large neighbourhoods (Ropke and Pisinger 2006) in its simplest form.

A round takes a few tasks out of a solution and puts them in anew, each where it costs least. What comes of it is kept while it is not much
dearer; how much is allowed falls from round to round. With n robots and m tasks a round costs some multiple of n + m, as each tour is priced
once. Insertion by regret, exchanges of tasks and cheapest orders of tours stood here as well, for less than 0.5 % of the costs of up to 50 tasks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TypeVar

import numpy as np
from numpy.random import Generator

from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.search.memoization import memoized
from ltlplan.search.tours.task_tours import Tour, Tours

Share = tuple[tuple[int, ...], ...]
"""Each robot's tasks, in order."""
Solution = TypeVar("Solution", bound=Hashable)

ROUNDS = 600
"""In which tasks are taken out and put in anew."""
_GRAIN = 1e-6  # m; costs that differ by less are the same: tiny amounts break ties between equally long ways
_MOST_TAKEN = 12
_WORSE = 0.03
"""Share by which a round may leave the objective dearer, at first."""
_SMALL = 1e-3
"""What a metre of the sum counts where the dearest robot is what counts."""


@dataclass(frozen=True, slots=True)
class Objective:
    """Objective by which a share is judged.

    Attributes:
        longest: Whether the dearest robot counts, not the sum.
    """

    longest: bool

    def __call__(self, costs: Sequence[float]) -> float:
        """Return the objective, with a little of the sum in it where that only breaks ties."""
        return max(costs) + _SMALL * sum(costs) / len(costs) if self.longest else sum(costs)

    def with_one(self, costs: Sequence[float], robot: int, cost: float) -> float:
        """Return the objective when one robot costs something else.

        Args:
            costs: Of all robots.
            robot: Whose changes.
            cost: What it then costs.
        """
        return self([*costs[:robot], cost, *costs[robot + 1 :]])


def improved(
    first: Solution, anew: Callable[[Solution], Solution | None], cost: Callable[[Solution], float], *, rounds: int
) -> list[Solution]:
    """Return the solutions that were found, the cheapest first.

    Args:
        first: To begin with.
        anew: Takes some tasks out of a solution and puts them in again; None where one cannot be put in.
        cost: What a solution costs.
        rounds: How often that is done.
    """
    now, found = first, {first: cost(first)}
    least = found[first]
    for step in range(rounds):
        other = anew(now)
        if other is None:
            continue
        if other not in found:
            found[other] = cost(other)
            least = min(least, found[other])
        if found[other] < found[now] or found[other] < least * (1.0 + _WORSE * (1.0 - step / rounds)):
            now = other
    return sorted(found, key=lambda solution: found[solution])


def least_highest(tours: Tours) -> list[Tour] | None:
    """Return a tour for each robot, so that the one with the highest cost pays little; None where none were found.

    Where no robot needs more than one task that is a bottleneck assignment (Gross 1959): no other share has a lower highest cost.

    Args:
        tours: What tours cost.
    """
    robots = range(len(tours))
    if tours.tasks and len(tours.tasks) <= len(tours):
        alone = np.array([[tours.tour(robot, (task,)).cost for task in tours.tasks] for robot in robots])
        pairs = cheapest_assignment(alone, longest=True, slack=_GRAIN)
        if pairs is not None:
            taken = {robot: (tours.tasks[column],) for robot, column in pairs}
            return [tours.tour(robot, taken.get(robot, ())) for robot in robots]
    shares = Sharing(tours, Objective(longest=True), np.random.default_rng(0)).cheapest(1)
    return [tours.tour(*own) for own in enumerate(shares[0])] if shares else None


class Sharing:
    """A search for cheap shares.

    Args:
        tours: What tours cost.
        objective: What is best.
        rng: Source of every draw.
    """

    def __init__(self, tours: Tours, objective: Objective, rng: Generator) -> None:
        self.tours, self.objective, self._rng = tours, objective, rng

    def cheapest(self, count: int) -> list[Share]:
        """Return the cheapest shares that were found, cheapest first; none where no share was found.

        Args:
            count: How many at most.
        """
        first = self._inserted([()] * len(self.tours), self.tours.tasks)
        if first is None:
            return []
        return improved(first, self._anew, self._cost, rounds=ROUNDS if self.tours.tasks else 0)[:count]

    @memoized
    def with_one(self, robot: int, tasks: tuple[int, ...], task: int) -> tuple[float, tuple[int, ...]]:
        """Return what a robot's tour costs with one more task where it costs least, and that tour.

        Args:
            robot: Whose tour.
            tasks: What it does so far.
            task: The one more.
        """
        return min(
            ((self.tours.tour(robot, longer).cost, longer) for longer in self.tours.more(tasks, task)), key=itemgetter(0)
        )

    def _cost(self, share: Share) -> float:
        return self.objective([self.tours.tour(robot, tasks).cost for robot, tasks in enumerate(share)])

    def _anew(self, share: Share) -> Share | None:
        """Take one task and those nearest to it out, and put them in again, in any order."""
        tasks = [(task, robot) for robot, own in enumerate(share) for task in dict.fromkeys(own)]
        count = int(self._rng.integers(1, min(_MOST_TAKEN, len(tasks)) + 1))
        middle, robot = tasks[int(self._rng.integers(len(tasks)))]
        away = self.tours.away(robot, middle)
        near = sorted((task for task, _ in tasks), key=lambda task: (task != middle, away.get(task, math.inf)))
        taken = self._rng.permutation(near[:count]).tolist()
        return self._inserted([tuple(task for task in own if task not in taken) for own in share], taken)

    def _inserted(self, share: Sequence[tuple[int, ...]], tasks: Iterable[int]) -> Share | None:
        """Put tasks in, one after another, each where it adds least to the objective; None where one cannot be."""
        found = list(share)
        for task in tasks:
            costs = [self.tours.tour(robot, own).cost for robot, own in enumerate(found)]
            bids = [(*self.with_one(robot, own, task), robot) for robot, own in enumerate(found)]
            worth, robot, tour = min((self.objective.with_one(costs, robot, cost), robot, tour) for cost, tour, robot in bids)
            if worth == math.inf:
                return None
            found[robot] = tour
        return tuple(found)
