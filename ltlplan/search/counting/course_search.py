"""Searches for courses of a team whose robots are counted, by the sum or by the highest cost of a robot.

The cheapest course is searched by a list of tries: with bounds that are quick to make, with better ones, and then for any course.
"""

from __future__ import annotations

from dataclasses import dataclass

from ltlplan.logic.budget import TooLarge
from ltlplan.search.counting.classes import Classes
from ltlplan.search.counting.reading import CountBounds, CountReading, Course
from ltlplan.search.team_reading import UNREACHABLE, least_highest, least_sum

_TIES = 1e-6  # m
_WEIGHTS = (2.0, 5.0)
"""Of what is left, where the cheapest course is too far: among small regions, where many orders are cut off late, the dearest routes are not taken first."""
_EASY = 300
"""States of a search with bounds from conjuncts alone, which are quick to make; longer searches take the places of the robots into account."""
_GREED = 0.5
"""Weight of what is left for each robot beside the bound on the highest cost, where the states do not suffice for the lowest one."""


@dataclass(frozen=True, slots=True)
class Searched:
    """Result of a search.

    Attributes:
        course: None where there is none, or none was found.
        bound: No course costs less; infinite where there is none.
        reached: States that were seen.
        used: States that were looked at where they did not suffice for any course; None where the search came to its end.
    """

    course: Course | None
    bound: float
    reached: int
    used: int | None = None

    def course_within(self, states: int) -> Course | None:
        """Return the course; None where there is none.

        Args:
            states: That the search could look at.

        Raises:
            TooLarge: They did not suffice for any course.
        """
        if self.used is not None:
            raise TooLarge("The search for who is where needs", self.used, "states", max(1, states // 2))
        return self.course


class CourseSearch:
    """Searches over one team's classes.

    Args:
        classes: The team's abilities.
    """

    def __init__(self, classes: Classes) -> None:
        self.classes, self._bounds = classes, CountBounds(classes)

    def cheapest(self, states: int) -> Searched:
        """Return the course with the least sum, or any where the states do not suffice for that.

        Args:
            states: That may be looked at, for each half of the tries.
        """
        most, searched = states // 2, Searched(None, 0.0, 0)
        tries = [(True, min(_EASY, most), 1.0), (False, most, 1.0)]
        tries += [(False, most, weight) for weight in (_WEIGHTS if self.classes.crowds else _WEIGHTS[-1:])]
        for easy, limit, weight in tries:
            reading = CountReading(self.classes, self._bounds)
            found = least_sum(reading, limit, weight=weight, left=reading.left_of_conjuncts if easy else None)
            used = None if found.stopped is None else found.explored
            searched = Searched(reading.course(found), max(searched.bound, found.bound), reading.reached, used)
            if used is None:
                break
        return searched

    def may_exist(self, states: int) -> bool:
        """Tell whether there may be a course, at whatever cost: True also where the states do not suffice to know.

        Args:
            states: That may be looked at.
        """
        found = least_sum(CountReading(self.classes, self._bounds), states, weight=_WEIGHTS[-1])
        return found.stopped is not None or bool(found.states)

    def least(self, *, longest: bool = False) -> float:
        """Return a lower bound on the cost of any course, without a search; infinite where there is none.

        Args:
            longest: Whether the highest cost of a robot counts, not the sum.
        """
        reading = CountReading(self.classes, self._bounds)
        begin = reading.begin()
        if begin is None:
            return UNREACHABLE
        return reading.rank(begin, reading.nothing_paid(), 0.0)[0] if longest else reading.left(begin)

    def least_highest(self, starts: tuple[int, ...], below: float, states: int) -> Searched:
        """Return the course whose robot with the highest cost pays least, or any below the limit where the states do not suffice for that.

        Args:
            starts: The class of each robot.
            below: The highest cost is to be less.
            states: That may be looked at, for each course that is found.
        """
        reading = CountReading(self.classes, self._bounds, below=below - _TIES)
        found = least_highest(reading, states)
        best, bound, exhausted = reading.course(found, starts), min(below, found.bound), found.stopped is None
        while not exhausted:
            reading = CountReading(self.classes, self._bounds, below=below - _TIES, greed=_GREED)
            better = reading.course(least_highest(reading, states), starts)
            exhausted = better is None
            best, below = (best, below) if better is None else (better, better.cost)
        return Searched(best, bound, reading.reached)
