"""Sharing many tasks: insertion by regret, then some tasks taken out again and again and put in anew where they cost least.

That is adaptive search in large neighbourhoods (Ropke and Pisinger 2006) in its simplest form. A round takes out a few tasks, chosen by
chance, for lying near each other, or as all that one robot does, and inserts them by regret: first the one that would lose most by not
getting its best robot. What comes of it is kept while it is not much dearer; how much is allowed falls from round to round. With n robots and
m tasks a round costs some multiple of n + m, as the best place of each task in each robot's tour is remembered until that tour changes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from ltlplan.search.least_cost_matching import cheapest_assignment
from ltlplan.search.tours.task_tours import Tour, Tours

Share = tuple[tuple[int, ...], ...]
"""Each robot's tasks, in order."""

ROUNDS = 400
"""In which tasks are taken out and put in anew."""

_REFINED = 60
"""Rounds in which cheapest orders count."""

_EPSILON = 1e-9
_GRAIN = 1e-6  # m; costs that differ by less are the same: tiny amounts break ties between equally long ways
_MOST_TAKEN = 12
_RAISED = (0.0, 0.1, 0.5)
"""Shares by which bids are raised by chance at the most, so that the same tasks do not always come back to where they were."""

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


def least_highest(tours: Tours) -> list[Tour] | None:
    """Return a tour for each robot, so that the one with the highest cost pays little; None where none were found.

    Where no robot needs more than one task that is a bottleneck assignment (Gross 1959): no other share has a lower highest cost. Else tasks are
    inserted by regret, and the robot with the highest cost gives its tasks away or exchanges them for as long as that helps.

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
    sharing = Sharing(tours, Objective(longest=True))
    share = sharing.inserted([()] * len(tours), tours.tasks)
    if share is not None and max(tours.flight(*own).cost for own in enumerate(share)) > tours.dearest_alone() + _GRAIN:
        share = sharing.exchanged(share)
    return None if share is None else [tours.flight(*own) for own in enumerate(share)]


class Sharing:
    """A search for cheap shares.

    Args:
        tours: What tours cost.
        objective: What is best.
    """

    def __init__(self, tours: Tours, objective: Objective) -> None:
        self.tours, self.objective = tours, objective
        self._places: dict[tuple[int, tuple[int, ...], int], tuple[float, int]] = {}

    def cheapest(self, count: int, rng: Generator) -> list[Share]:
        """Return the cheapest shares that were found, cheapest first; none where no share was found.

        Args:
            count: How many at most.
            rng: Source of every draw.
        """
        now = self.inserted([()] * len(self.tours), self.tours.tasks)
        if now is None:
            return []
        best: dict[Share, float] = {now: self.cost(now)}
        cost = least = best[now]
        for step in range(ROUNDS if self.tours.tasks else 0):
            other = self._anew(now, rng)
            if other is None or other == now:
                continue
            found = self.cost(other)
            if found < cost or found < least * (1.0 + _WORSE * (1.0 - step / ROUNDS)):
                now, cost = other, found
            if other not in best:
                best[other] = found
                least = min(least, found)
                if len(best) > 4 * count:
                    best = dict(sorted(best.items(), key=lambda entry: entry[1])[:count])
        return sorted(best, key=lambda share: best[share])[:count]

    def refined(self, shares: Sequence[Share], count: int, rng: Generator) -> list[Share]:
        """Return cheaper shares, in which each robot does its tasks in the cheapest order, cheapest first.

        Args:
            shares: To begin with.
            count: How many at most.
            rng: Source of every draw.
        """
        best = {share: self.flown(share) for share in map(self.exchanged, shares)}
        now = min(best, key=lambda share: best[share])
        for _ in range(_REFINED):
            if self.tours.states_left <= 0:
                break
            other = self._anew(now, rng)
            if other is not None:
                other = self.exchanged(other)
                best[other] = self.flown(other)
                if best[other] <= best[now] * (1.0 + _WORSE):
                    now = other
        return sorted(best, key=lambda share: best[share])[:count]

    def flown(self, share: Share) -> float:
        """Return the objective of a share when each robot does its tasks in the cheapest order, ties broken."""
        return self.objective([self.tours.flight(robot, tasks).cost for robot, tasks in enumerate(share)])

    def exchanged(self, share: Share) -> Share:
        """Return a share from which no task can be given away or exchanged for less, as far as cheapest flights are found.

        Args:
            share: To begin with.
        """
        while True:
            costs = [self.tours.flight(robot, tasks).cost for robot, tasks in enumerate(share)]
            better = next(self._exchanges(share, costs), None)
            if better is None or self.tours.states_left <= 0:
                return share
            share = better

    def _exchanges(self, share: Share, costs: Sequence[float]) -> Iterator[Share]:
        """Yield cheaper shares: one task given to another robot, or exchanged for one of its tasks."""
        now = self.objective(costs)
        dearest = max(range(len(costs)), key=lambda robot: costs[robot])
        givers = [dearest] if self.objective.longest else range(len(costs))
        moves = [
            (giver, task, taker) for giver in givers for task in share[giver] for taker in range(len(share)) if taker != giver
        ]
        given = ((*move, None) for move in moves)
        swapped = ((*move, back) for move in moves if self.objective.longest or move[0] < move[2] for back in share[move[2]])
        for giver, task, taker, back in itertools.chain(given, swapped):
            mine = self._changed(giver, share[giver], task, back)
            least = max(self.tours.tour(taker, (task,)).cost, costs[taker] if back is None else 0.0)
            costs_then = [*costs[:giver], mine.cost, *costs[giver + 1 :]]
            if self.objective.with_one(costs_then, taker, least) >= now - _EPSILON:
                continue  # whatever the other robot flies, it costs no less than that
            theirs = self._changed(taker, share[taker], back, task)
            if self.objective.with_one(costs_then, taker, theirs.cost) < now - _EPSILON:
                found = list(share)
                found[giver], found[taker] = mine.tasks, theirs.tasks
                yield tuple(found)

    def _changed(self, robot: int, own: tuple[int, ...], without: int | None, more: int | None) -> Tour:
        """Return a robot's flight without one of its tasks, and with another one, at its best place."""
        left = tuple(task for task in own if task != without)
        if more is None:
            return self.tours.flight(robot, left)
        tour = self.tours.tour(robot, left)
        place = self.place(robot, tour, more)[1] if tour.cost < math.inf else 0
        return self.tours.flight(robot, (*left[:place], more, *left[place:]))

    def cost(self, share: Share) -> float:
        """Return the objective of a share, ties broken; infinite where some robot has no way."""
        return self.objective([self.tours.tour(robot, tasks).cost for robot, tasks in enumerate(share)])

    def place(self, robot: int, tour: Tour, task: int) -> tuple[float, int]:
        """Return about what a tour costs with one more task at its best place, and that place.

        Args:
            robot: Whose tour.
            tour: What it does so far.
            task: The one more.
        """
        key = (robot, tour.tasks, task)
        if key not in self._places:
            self._places[key] = min(self.tours.insertions(robot, tour, task), default=(math.inf, 0))
        return self._places[key]

    def _anew(self, share: Share, rng: Generator) -> Share | None:
        """Take some tasks out and put them in again, bids being raised by chance."""
        kept, taken = self._without(share, rng)
        raised = _RAISED[int(rng.integers(len(_RAISED)))]
        factors = 1.0 + raised * rng.random((len(share), len(taken)))
        return self.inserted(
            kept,
            taken,
            {(robot, task): float(factors[robot, i]) for robot in range(len(share)) for i, task in enumerate(taken)},
        )

    def inserted(
        self, share: Sequence[tuple[int, ...]], tasks: Iterable[int], factors: Mapping[tuple[int, int], float] | None = None
    ) -> Share | None:
        """Put tasks in, each time the one that would lose most by not getting its best robot; None where one cannot be.

        Args:
            share: What robots do so far.
            tasks: The tasks.
            factors: By how much bids are raised, by robot and task.
        """
        tours = [self.tours.tour(robot, own) for robot, own in enumerate(share)]
        left = list(tasks)
        while left:
            costs = [tour.cost for tour in tours]
            chosen, most = None, -1.0
            for task in left:
                bids: list[tuple[float, int, int]] = []
                for robot, tour in enumerate(tours):
                    cost, place = self.place(robot, tour, task)
                    if cost < math.inf:
                        worth = self._worth(costs, robot, cost)
                        bids.append((worth if factors is None else worth * factors[robot, task], robot, place))
                if not bids:
                    return None
                first, *second = sorted(bids)
                regret = second[0][0] - first[0] if second else math.inf
                if chosen is None or regret > most:
                    chosen, most = (task, *first[1:]), regret
            assert chosen is not None  # there is a task left
            task, robot, place = chosen
            own = tours[robot].tasks
            tours[robot] = self.tours.tour(robot, (*own[:place], task, *own[place:]))
            if tours[robot].cost == math.inf:
                return None
            left.remove(task)
        return tuple(tour.tasks for tour in tours)

    def _worth(self, costs: Sequence[float], robot: int, cost: float) -> float:
        """Return what a bid adds to the objective, or stands at where the dearest robot counts."""
        more = cost - costs[robot]
        return max(max(costs), cost) + _SMALL * more if self.objective.longest else more

    def _without(self, share: Share, rng: Generator) -> tuple[list[tuple[int, ...]], list[int]]:
        """Take tasks out of a share; return what is left of it, and the tasks."""
        tasks = [task for own in share for task in own]
        most = min(_MOST_TAKEN, len(tasks))
        count = int(rng.integers(1, most + 1))
        kind = int(rng.integers(3))
        if kind == 0:
            taken = set(rng.permutation(tasks)[:count].tolist())
        else:
            busy = [robot for robot, own in enumerate(share) if own]
            robot = busy[int(rng.integers(len(busy)))]
            if self.objective.longest and rng.random() < 0.5:
                robot = max(busy, key=lambda one: self.tours.tour(one, share[one]).cost)
            own, place = share[robot], int(rng.integers(len(share[robot])))
            if kind == 1:
                away = self.tours.away(robot, self.tours.tour(robot, own).places[place + 1])
                near = sorted(tasks, key=lambda task: (task != own[place], away.get(task, math.inf)))
                taken = set(near[:count])
            else:
                taken = set(own[place : place + count])
        return [tuple(task for task in own if task not in taken) for own in share], sorted(taken)
