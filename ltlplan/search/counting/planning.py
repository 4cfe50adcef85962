"""The entry to planning for formulas that count robots: plans are searched by a list of tries, and each try by a list of searches.

`CourseSearch` looks for courses, by the sum or by the highest cost of a robot. The cheapest course is searched first, and then any course.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.search.bounds.goal_cover import GoalCover
from ltlplan.search.counting.capacities import laws_of_rooms, most_that_show
from ltlplan.search.counting.classes import Classes
from ltlplan.search.counting.counted_plans import CountedPlan, has_room, paths_are_free, stays_apart
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.reading import CountReading, Course
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms, TeamClasses
from ltlplan.search.team_reading import UNREACHABLE, least_highest, least_sum
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula

_TIES = 1e-6  # m
_STATES_STAYING = 8_000
"""Of the search whether a plan would be cheaper in which robots stay where no robot can wait for them, which is seldom so."""
_STATES_APART = 4_000
"""Of a search in which robots are distinguished by their starts."""
_MOVES_HIGHEST, _FEW_HIGHEST = 400_000, 200
"""Moves tried, about, and states at the least, of a search for the lowest highest cost."""
_ANYWHERE = Rooms({}, passing=False)
_BESIDE = ((True, False), (True, True), (False, True))
"""Beside a plan: whether robots may stay for good where no robot can wait for them, and whether they are told apart by their first moves."""
_IN_ROOMS = ((True, 40_000), (False, 10_000))
"""Whether one robot may come to a full region while another one leaves it, and states that a search may look at then."""
_WEIGHTS = (2.0, 5.0)
"""Of what is left, where the cheapest course is too far: among small regions, where many orders are cut off late, the dearest routes are not taken first."""
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


class CourseSearch:
    """Searches over one team's classes.

    Args:
        classes: The team's abilities.
        budget: Carries the watch; each search says how many states it may look at.
    """

    def __init__(self, classes: Classes, budget: Budget = DEFAULT_BUDGET) -> None:
        self.classes, self._cover, self._budget = classes, GoalCover(classes), budget

    def cheapest(self, states: int) -> Searched:
        """Return the course with the least sum, or any where the states do not suffice for that.

        Args:
            states: That may be looked at, for each half of the tries.
        """
        budget, searched = self._budget.of(states // 2), Searched(None, 0.0, 0)
        for weight in (1.0, *(_WEIGHTS if self.classes.crowds else _WEIGHTS[-1:])):
            reading = CountReading(self.classes, self._cover)
            found = least_sum(reading, budget, weight=weight)
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
        found = least_sum(CountReading(self.classes, self._cover), self._budget.of(states), weight=_WEIGHTS[-1])
        return found.stopped is not None or bool(found.states)

    def least(self, *, longest: bool = False) -> float:
        """Return a lower bound on the cost of any course, without a search; infinite where there is none.

        Args:
            longest: Whether the highest cost of a robot counts, not the sum.
        """
        reading = CountReading(self.classes, self._cover)
        begin = reading.begin()
        if begin is None:
            return UNREACHABLE
        return reading.rank(begin, (0.0,) * reading.kept_apart, 0.0)[0] if longest else reading.left(begin)

    def least_highest(self, starts: tuple[int, ...], below: float, states: int) -> Searched:
        """Return the course whose robot with the highest cost pays least, or any below the limit where the states do not suffice for that.

        Args:
            starts: The class of each robot.
            below: The highest cost is to be less.
            states: That may be looked at, for each course that is found.
        """
        reading, budget = CountReading(self.classes, self._cover, below=below - _TIES), self._budget.of(states)
        found = least_highest(reading, budget)
        best, bound, exhausted = reading.course(found, starts), min(below, found.bound), found.stopped is None
        while not exhausted:
            reading = CountReading(self.classes, self._cover, below=below - _TIES, greed=_GREED)
            better = reading.course(least_highest(reading, budget), starts)
            exhausted = better is None
            best, below = (best, below) if better is None else (better, better.cost)
        return Searched(best, bound, reading.reached)


def plan_counts(
    systems: Sequence[TransitionSystem],
    kinds: Sequence[str],
    marks: Marks,
    budget: Budget,
    *,
    rooms: Mapping[str, int] | None = None,
    longest: bool = False,
) -> CountedPlan | None:
    """Return a cheapest plan for a formula that counts robots, or None where there is none.

    Small regions hold no more robots at rest than they have room for. Where no such plan is found, and it is not sure either that there
    is none, the plan is one without regard to that: refinement may find places where they were not expected.

    Args:
        systems: One for each robot.
        kinds: For each robot a key that robots have in common which can do the same.
        marks: What the formula sees.
        budget: Bounds on the search.
        rooms: The number of robots that each small region holds; other regions hold all.
        longest: Whether the highest cost of a robot counts, not the sum.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    small = rooms or {}

    def planned(within: Rooms = _ANYWHERE, states: int = budget.states, *, skips: bool = False) -> CountedPlan | None:
        team = CountedTeam(tuple(systems), tuple(kinds), marks, within, skips, longest)
        return _Planning(team, budget.of(min(budget.states, states)), small if skips else None).cheapest()

    anywhere = None
    with suppress(TooLarge):
        anywhere = planned(skips=True)
        if anywhere is None or not small or paths_are_free(systems, anywhere, small):
            return anywhere
    if small:
        roomy = CountedTeam(tuple(systems), tuple(kinds), roomy_marks(systems, marks, small), _ANYWHERE, skips=True)
        teams = (TeamClasses(roomy, stays=stays).made() for stays in (False, True))
        if not any(CourseSearch(team, budget).may_exist(budget.states) for team in teams):
            return None  # even if robots could rest anywhere
    for passing, states in _IN_ROOMS if small else ():
        with suppress(TooLarge):
            plan = planned(Rooms(small, passing), states)
            if plan is not None:  # where no robot may pass another one, a cheaper plan is not ruled out
                return plan if passing else replace(plan, bound=0.0 if anywhere is None else anywhere.bound)
    return planned() if anywhere is None else anywhere


def roomy_marks(systems: Sequence[TransitionSystem], marks: Marks, rooms: Mapping[str, int]) -> Marks:
    """Return the propositions of a team where counts and robots by name for which small regions have no room are never true.

    Args:
        systems: One for each robot.
        marks: What the formula sees where there is room for all.
        rooms: The number of robots that each small region holds; other regions hold all.
    """
    between: dict[str, tuple[int, int]] = {}  # of what is counted, how few and how many robots show it at once
    for counted in (atom.counted for atom in marks.atoms.values() if not atom.robot):
        shown, not_shown = (most_that_show(asked, systems, rooms) for asked in (counted, Formula("!", (counted,))))
        few = 0 if not_shown is None else max(0, len(systems) - not_shown[0])
        between[str(counted)] = few, len(systems) if shown is None else shown[0]
    laws = laws_of_rooms(marks.atoms.values(), rooms)
    return marks.where(between, [automaton for law in laws for automaton in conjunct_automata(law, "finite")])


class _Planning:
    """The searches of one try.

    To stay for good where no robot can wait for one is seldom needed, and doubles the places. Such plans are searched where there are no
    others, and beside others to know whether they would be cheaper.

    Args:
        team: The robots, and the formula.
        budget: Bound on the states that a search may look at.
        within: The number of robots that small regions hold, where cheaper plans with robots that stay are taken; None where they are not.
    """

    def __init__(self, team: CountedTeam, budget: Budget, within: Mapping[str, int] | None) -> None:
        self._team, self._budget, self._states, self._within = team, budget, budget.states, within
        self._made = {stays: TeamClasses(team, stays=stays) for stays in (False, True)}

    def cheapest(self) -> CountedPlan | None:
        """Return a cheapest plan in which no small region is too full where robots wait for others; None where none was found.

        Raises:
            TooLarge: The states did not suffice for any plan.
        """
        for needs_stays in (False, True):
            classes = self._made[needs_stays]
            searched = CourseSearch(classes.made(), self._budget).cheapest(self._states)
            if searched.used is not None:
                raise TooLarge("The search for who is where needs", searched.used, "states", max(1, self._states // 2))
            if searched.course is not None:
                best = replace(classes.plan(searched.course), reached=searched.reached)
                return self._proved(best, searched.bound, needs_stays=needs_stays) if self._has_room(best) else None
        return None

    def _proved(self, best: CountedPlan, bound: float, *, needs_stays: bool) -> CountedPlan:
        """Search beside a plan until it is known to be the cheapest, or for as long as that is worth it.

        Only classes in which robots may stay have all plans, so that bounds on their courses hold for all.
        """
        longest, known = self._team.longest, bound if needs_stays and not self._team.longest else 0.0
        staying = self._states if needs_stays else min(_STATES_STAYING, 4 * best.reached + 1_000, self._states)
        for stays, apart in [(True, True)] if needs_stays else _BESIDE:
            if best.cost <= known + _TIES:
                break  # none is cheaper
            if longest and not apart:
                continue  # what robots pay is not known
            classes = self._made[stays].distinguished() if apart else self._made[stays]
            search = CourseSearch(classes.made(), self._budget)
            if longest:
                moves = max(1, sum(map(len, search.classes.moves)))
                searched = search.least_highest(tuple(classes.start), best.cost, max(_MOVES_HIGHEST // moves, _FEW_HIGHEST))
            elif apart:
                searched = self._apart(search, classes.start == self._made[stays].start, stays, staying, best.cost)
            else:
                searched = search.cheapest(staying)
            best = self._cheaper(classes, searched, best, takes_stays=needs_stays)
            if stays:
                known = max(known, searched.bound)
        return replace(best, bound=min(best.cost, known))

    def _apart(self, search: CourseSearch, alike: bool, stays: bool, staying: int, cost: float) -> Searched:
        """Search with robots told apart by their starts; only return a bound where the search would say no more."""
        least, most = search.least(), min(_STATES_APART, self._states)
        if (stays and cost <= least + _TIES) or (alike and not (stays and staying < most)):
            return Searched(None, least, 0)
        return search.cheapest(most)

    def _cheaper(self, classes: TeamClasses, searched: Searched, best: CountedPlan, *, takes_stays: bool) -> CountedPlan:
        """Return the plan of a course that was found, if it is cheaper and may be taken; otherwise the best one so far."""
        course = searched.course
        if course is None or max(course.cost, classes.cost(course)) >= best.cost - _TIES:
            return best
        plan = replace(classes.plan(course), reached=searched.reached)
        taken = takes_stays or not plan.stays or (self._within is not None and stays_apart(classes.systems, plan, self._within))
        return plan if taken and self._has_room(plan) else best

    def _has_room(self, plan: CountedPlan) -> bool:
        return has_room(self._team.systems, plan, self._team.rooms.most)
