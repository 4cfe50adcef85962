"""Orders of the visits that a formula asks for, and what is known of their times before any flight is refined.

A route says which robot makes which visits in which order. `Orders` lists the routes that may be in time, found by insertion with a bound: each
visit is put into some robot's route in turn, and what is late at the least by straight ways at the greatest speed stays late whatever is
put in later. So where no route is left, no flight satisfies the formula.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache

from ltlplan.systems.due_visits import DueVisit, due_visits
from ltlplan.systems.gaps import Travel, straight_travel
from ltlplan.systems.robot_systems import Systems
from verify.data import Mission, Plan
from verify.data.language.formula import TRUE, Formula

_PUT = 20_000
"""Visits that are put into routes, at most."""
_LATE = 1e-6
"""s; what is later than its deadline by less is not called late."""
_SLOWER = 3.0
"""A route that is in time where all ways take so many times longer is as good as any."""


@dataclass(frozen=True, slots=True)
class Stop:
    """A visit in a route.

    Attributes:
        robot: Who makes it.
        region: Where.
        due: What it is made for.
    """

    robot: str
    region: str
    due: DueVisit


Route = tuple[Stop, ...]
"""One robot's stops, in order."""
Routes = dict[str, Route]


def likely_travel(mission: Mission) -> Travel:
    """Return about how long each way takes: between the regions' middles, around obstacles, at the greatest speed.

    Args:
        mission: Gives regions, obstacles and limits.
    """
    systems, least = Systems(mission), straight_travel(mission)

    @cache
    def seconds(robot: str, start: str | None, region: str) -> float:
        begin = mission.agents[robot].start if start is None else start
        metres = systems.metres(robot, systems.leg(robot, begin, region)) if begin != region else 0.0
        return max(metres / mission.limits_of(robot).speed, least(robot, start, region))

    return seconds


@dataclass
class Orders:
    """Search for routes.

    Attributes:
        visits: What is asked for.
        travel: Times of ways.
        planned: Stops that robots make anyway, in the order of a plan, where visits are made at these alone.
        left: How many visits may still be put into routes; below 0 nothing that was not found is impossible.
    """

    visits: tuple[DueVisit, ...]
    travel: Travel
    planned: Routes = field(default_factory=dict[str, "Route"])
    left: int = _PUT
    _most: float = field(default=_LATE, init=False)

    @property
    def none_in_time(self) -> bool:
        """Return whether it is proved that no routes keep all deadlines."""
        return next(self.in_time(), None) is None and self.left >= 0

    def in_time(self) -> Iterator[Routes]:
        """Yield the routes that keep all deadlines."""
        self._most = _LATE
        for routes, _ in self._extended(self.planned, self._by_deadline()):
            yield routes

    def least_late(self) -> dict[Formula, float] | None:
        """Return by how much which conjuncts' deadlines are missed at the least in all, s; None where that was not found out."""
        best: dict[Formula, float] | None = None
        self._most = math.inf
        for routes, late in self._extended(self.planned, self._by_deadline()):
            self._most, best = late, self.delays(routes)
        return None if self.left < 0 else best

    def delays(self, routes: Routes, slower: float = 1.0) -> dict[Formula, float]:
        """Return by how much conjuncts' deadlines are missed, s; those that are.

        Args:
            routes: Who makes which visits.
            slower: How many times longer ways take.
        """
        found: dict[Formula, float] = {}
        for route in routes.values():
            for stop, begin in zip(route, self.begins(route, slower), strict=True):
                if begin - stop.due.end > _LATE:
                    found[stop.due.asked] = max(found.get(stop.due.asked, 0.0), begin - stop.due.end)
        return found

    def begins(self, route: Route, slower: float = 1.0) -> list[float]:
        """Return when each stop begins at the earliest, s.

        Args:
            route: One robot's.
            slower: How many times longer ways take.
        """
        begins: list[float] = []
        for number, stop in enumerate(route):
            begin = max(slower * self.travel(stop.robot, None, stop.region), stop.due.begin)
            for before, begun in zip(route[:number], begins, strict=True):
                way = self.travel(stop.robot, before.region, stop.region)
                begin = max(begin, begun + (before.due.lasts + slower * way if way > 0.0 else 0.0))
            begins.append(begin)
        return begins

    def slowest(self, routes: Routes) -> float:
        """Return how many times longer ways may take before a deadline is missed, 3 at most; 0 where one is missed already.

        Args:
            routes: Who makes which visits.
        """
        low, high = 0.0, _SLOWER
        if not self.delays(routes, high):
            return high
        while high - low > 0.01:
            middle = (low + high) / 2
            low, high = (low, middle) if self.delays(routes, middle) else (middle, high)
        return low

    def length(self, routes: Routes) -> float:
        """Return how long all ways of some routes take together, s.

        Args:
            routes: Who makes which visits.
        """
        befores = ((route, [None, *(stop.region for stop in route)]) for route in routes.values())
        return sum(
            sum(self.travel(stop.robot, before, stop.region) for before, stop in zip(places, route, strict=False))
            for route, places in befores
        )

    def _by_deadline(self) -> list[DueVisit]:
        return sorted(self.visits, key=lambda visit: (len(visit.places) > 1, visit.end, visit.begin))

    def _extended(self, routes: Routes, visits: Sequence[DueVisit]) -> Iterator[tuple[Routes, float]]:
        """Yield routes with more visits, and how late they are in all; only those that are less late than the most."""
        if not visits:
            yield routes, self._late(routes)
            return
        first, *others = visits
        ways = [
            (late, self.length(more), more) for more in self._with(routes, first) if (late := self._late(more)) < self._most
        ]
        for late, _, more in sorted(ways, key=lambda way: way[:2]):
            if late < self._most and self.left >= 0:
                yield from self._extended(more, others)

    def _with(self, routes: Routes, due: DueVisit) -> Iterator[Routes]:
        """Yield routes with one visit more, at each place of each robot that may make it."""
        for robot, region in due.places:
            route = routes.get(robot, ())
            made = [stop.due.asked == TRUE and stop.region == region for stop in route]  # anyway
            if due.apart >= 0 and any(stop.due.apart == due.apart for stop in route):
                continue
            stop = Stop(robot, region, due)
            for index in range(len(route) + 1):
                if self.planned and not (index > 0 and made[index - 1]):
                    continue
                self.left -= 1
                if self.left < 0:
                    return
                yield {**routes, robot: (*route[:index], stop, *route[index:])}

    def _late(self, routes: Routes) -> float:
        return sum(self.delays(routes).values())


def planned_routes(made: Plan) -> Routes:
    """Return the stops that a plan's robots make, for no visit that is due.

    Args:
        made: The plan.
    """
    whole = DueVisit(TRUE, (), 0.0, math.inf)
    routes = {name: tuple(Stop(name, visit.region, whole) for visit in robot.visits) for name, robot in made.robots.items()}
    return {name: route for name, route in routes.items() if route}


def soonest(made: Plan) -> dict[Formula, float]:
    """Return when each visit that is due comes at the soonest in flights of a plan's words, by straight ways, s.

    Args:
        made: The plan.
    """
    orders, routes = Orders((), straight_travel(made.mission)), planned_routes(made)
    found: dict[Formula, float] = {}
    for visit in due_visits(made.mission):
        begins = (zip(route, orders.begins(route), strict=True) for route in routes.values())
        times = [begin for each in begins for stop, begin in each if (stop.robot, stop.region) in visit.places]
        if times:
            found[visit.asked] = max(found.get(visit.asked, 0.0), min(times))
    return found
