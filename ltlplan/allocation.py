"""Return value of a planning method: which robot makes which visits, showing which word.

A planning method is a function from a mission to an `Allocation`. It lays no paths and makes no plan: `ltlplan.paths.nominal`
lays paths along any method's allocation, `ltlplan.paths.improvement` improves them, `ltlplan.planner` makes the plan. A method
that finds words and paths together, because it prices words by the very paths, returns those paths as part of its allocation.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.random import Generator

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from verify.data import Mission, RobotPlan, Visit, Word
from verify.data.plan import Meeting, Precedence
from verify.data.progress import Progress, silent
from verify.data.shapes.inequalities import Point

Leg = tuple[str, "Point | str", str]
"""Robot, from a position (m) or a region, to a region."""

Key = tuple[str, tuple[str, ...]]
"""A mission's formula and its robots."""


@dataclass(frozen=True, slots=True)
class Itinerary:
    """Visits of one robot.

    Attributes:
        visits: Regions in the order in which they are entered, with the actions made there. A robot that starts inside a
            region has that visit first. For a lasso: prefix, then one lap.
        word: The letters that it will show, free flight included. Its last letter says whether the robot ends inside the
            region that it visited last.
        cycle_visit: Index of the first visit of the cycle; None for a finite flight, the number of visits for a hover.
        cost: Its own cost, as the method counts; for a lasso, of the prefix and the weighted cycle.
        stops: Indices of the visits to whose middles it flies, in order, a start inside a region first; None: each visit once.
            Where regions overlap, it may be in one on its way only, or come back to the middle of one that it has not left.
    """

    visits: tuple[Visit, ...]
    word: Word
    cycle_visit: int | None = None
    cost: float = 0.0
    stops: tuple[int, ...] | None = None

    @property
    def all_stops(self) -> tuple[int, ...]:
        """Indices of the visits to whose middles it flies, in order, also where that is each visit once."""
        return tuple(range(len(self.visits))) if self.stops is None else self.stops

    @property
    def first_of_lap(self) -> int | None:
        """Index of the stop with which the cycle begins; it may come back later to visits that the prefix began."""
        stops, first = self.all_stops, self.cycle_visit
        return None if first is None else next((k for k, visit in enumerate(stops) if visit >= first), len(stops))

    def legs(self, mission: Mission, robot: str) -> frozenset[Leg]:
        """Return the legs that a robot of the mission flies by it; a lasso's closing leg too."""
        return frozenset(self.route(mission, robot))

    def route(self, mission: Mission, robot: str) -> list[Leg]:
        """Return the legs that a robot of the mission flies by it, in order; a lasso's closing leg too."""
        stops = self.all_stops
        start, regions = mission.agents[robot].start, [self.visits[stop].region for stop in stops]
        if regions and float(mission.all_regions[regions[0]].level(np.array(start))) <= 1.0:
            regions = regions[1:]  # it is there already
        places: list[Point | str] = [start, *regions]
        if (first := self.first_of_lap) is not None and first < len(stops):
            places.append(self.visits[stops[first]].region)
        return [(robot, a, b) for a, b in itertools.pairwise(places) if isinstance(b, str)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Allocation:
    """Allocation of a mission to its robots.

    Attributes:
        robots: What each of the mission's agents does, in the mission's order; idle ones too.
        cost: The objective as the method counts; of two allocations by one method the cheaper one is laid first.
        order: Robots in the order in which tasks were handed over, where the method has one.
        paths: Each robot's path, where the method has priced words by paths: what is then flown. Otherwise None, and nominal
            paths are laid and improved.
        lower_bound: No allocation has a smaller objective, where the method proves one.
        complete: Whether the method has ruled out cheaper ones.
        tried: Complete plans that were checked in every order of the robots, where the method does so.
        notes: Sentences for a person.
        meetings: Arrivals that others wait for before they set out.
        precedences: Waits under which the words satisfy the formula, where they do not in every order of the robots.
    """

    robots: Mapping[str, Itinerary]
    cost: float
    order: tuple[str, ...] = ()
    paths: Mapping[str, RobotPlan] | None = None
    lower_bound: float | None = None
    complete: bool = False
    tried: int = 1
    notes: tuple[str, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    precedences: tuple[Precedence, ...] = ()

    def legs(self, mission: Mission) -> frozenset[Leg]:
        """Return the legs that the robots fly."""
        return frozenset[Leg]().union(*(does.legs(mission, name) for name, does in self.robots.items()))


@dataclass(frozen=True, slots=True)
class Known:
    """Results of earlier searches, for the searches to come.

    Attributes:
        found: Allocations of missions that differ in their formulas alone, by `key_of`; they need not be searched for again.
        budget: Bounds on the searches for all others.
        capacities: Robots that regions hold, where refinement found no places for more. That there is then no plan proves nothing.
    """

    found: Mapping[Key, Allocation] = field(default_factory=dict[Key, Allocation])
    budget: Budget = DEFAULT_BUDGET
    capacities: Mapping[str, int] = field(default_factory=dict[str, int])


def key_of(mission: Mission) -> Key:
    """Return what tells missions apart that differ in their formulas alone."""
    return mission.spec.formula or "", tuple(mission.agents)


@dataclass(frozen=True, slots=True)
class Context:
    """Inputs of a planning method beside the mission.

    Attributes:
        rng: Source of every draw.
        progress: Receives a sentence and the share done, 0 to 1.
        blocked: Legs along which no path could be laid. A method that knows nothing of them may return the same allocation
            again; the mission is then said to be infeasible.
        known: What earlier searches and refinements found; a method may leave it aside.
    """

    rng: Generator
    progress: Progress = silent
    blocked: frozenset[Leg] = field(default=frozenset())
    known: Known = field(default_factory=Known)


class PlanningMethod(Protocol):
    """A function from a mission to an allocation."""

    def __call__(self, mission: Mission, context: Context, /) -> Allocation:
        """Share a mission among its robots.

        Args:
            mission: What is asked: formula, regions, agents, `planner` with objective and costs. It has no `sequence`.
            context: Source of draws, progress, legs that are blocked.

        Raises:
            BadInput: The method does not plan such missions.
            Unsatisfiable: No words that these robots can fly satisfy the formula.
            Infeasible: There are such words, but no way to fly them was found.
        """
        ...
