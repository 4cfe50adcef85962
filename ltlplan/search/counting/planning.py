"""The entry to planning for formulas that count robots: plans are searched by a list of tries, and each try by a list of searches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.capacities import most_that_show
from ltlplan.search.counting.counted_plans import CountedPlan, has_room, paths_are_free, stays_apart
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.course_search import CourseSearch, Searched
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms, TeamClasses
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula
from verify.data.language.counting import Atom

_TIES = 1e-6  # m
_STATES_STAYING = 8_000
"""Of the search whether a plan would be cheaper in which robots stay where no robot can wait for them, which is seldom so."""
_STATES_APART = 4_000
"""Of a search in which robots are distinguished by their starts."""
_MOVES_HIGHEST, _FEW_HIGHEST = 400_000, 200
"""Moves tried, about, and states at the least, of a search for the lowest highest cost."""
_ANYWHERE = Rooms({}, passing=False)


@dataclass(frozen=True, slots=True)
class _Try:
    """Where robots may rest.

    Attributes:
        small: Whether small regions hold no more than they have room for; then the bound is of plans for which that is so.
        passing: Whether one robot may come to a full region while another one leaves it.
        skips: Whether rests are left out of which the formula sees nothing.
        states: That a search may look at, at most; None for the whole budget.
    """

    small: bool = False
    passing: bool = False
    skips: bool = False
    states: int | None = None


_TRIES = (
    _Try(skips=True),
    _Try(small=True, passing=True, states=40_000),
    _Try(small=True, states=10_000),
    _Try(),
)


@dataclass(frozen=True, slots=True)
class _Variant:
    """How robots are put into classes.

    Attributes:
        stays: Whether robots may stay for good where no robot can wait for them: these classes have all plans, so that their bounds hold.
        apart: Whether robots are distinguished by the costs of their first moves.
    """

    stays: bool
    apart: bool


_VARIANTS = (
    _Variant(stays=False, apart=False),
    _Variant(stays=True, apart=False),
    _Variant(stays=True, apart=True),
    _Variant(stays=False, apart=True),
)


# seven parameters: as many as a search of words has, and what small regions hold
def plan_counts(
    systems: Sequence[TransitionSystem],
    kinds: Sequence[str],
    automata: Sequence[Automaton],
    atoms: dict[str, Atom],
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
        automata: One for each conjunct; their propositions are names and the texts of `atoms`.
        atoms: The formula's propositions of the whole team.
        budget: Bounds on the search.
        rooms: The number of robots that each small region holds; other regions hold all.
        longest: Whether the highest cost of a robot counts, not the sum.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    small, found = rooms or {}, None
    for tried in _TRIES:
        if tried.small and not small:
            continue
        if tried.passing and not _may_exist(systems, kinds, roomy_marks(systems, automata, atoms, small), budget):
            return None  # even if robots could rest anywhere
        if not tried.small and found is not None:
            break
        within = Rooms(small, tried.passing) if tried.small else _ANYWHERE
        team = CountedTeam(tuple(systems), tuple(kinds), Marks(automata, atoms), within, tried.skips, longest)
        try:
            plan = _Planning(team, min(budget.states, tried.states or budget.states), small if tried.skips else None).cheapest()
        except TooLarge:
            if tried is _TRIES[-1]:
                raise
            continue
        if tried.small and plan is not None:  # where no robot may pass another one, a cheaper plan is not ruled out
            return plan if tried.passing else replace(plan, bound=0.0 if found is None else found.bound)
        if not tried.small and (plan is None or not small or paths_are_free(systems, plan, small)):
            return plan
        found = plan or found
    return found


def roomy_marks(
    systems: Sequence[TransitionSystem], automata: Sequence[Automaton], atoms: dict[str, Atom], rooms: Mapping[str, int]
) -> Marks:
    """Return the propositions of a team where counts for which small regions have no room are never true.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        atoms: The formula's propositions of the whole team.
        rooms: The number of robots that each small region holds; other regions hold all.
    """
    between: dict[str, tuple[int, int]] = {}  # of what is counted, how few and how many robots show it at once
    for counted in (atom.counted for atom in atoms.values() if not atom.robot):
        shown, not_shown = (most_that_show(asked, systems, rooms) for asked in (counted, Formula("!", (counted,))))
        few = 0 if not_shown is None else max(0, len(systems) - not_shown[0])
        between[str(counted)] = few, len(systems) if shown is None else shown[0]
    return Marks(automata, atoms, between)


def plan_hovering(team: CountedTeam, budget: Budget, roomy: Marks) -> CountedPlan | None:
    """Return a cheapest plan in which robots also wait just outside regions that they have left; None where there is none.

    Args:
        team: The robots, and the formula.
        budget: Bounds on the search.
        roomy: The propositions where counts for which small regions have no room are never true.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    for stays in (False, True):
        anywhere = TeamClasses(replace(team, rooms=_ANYWHERE, marks=roomy), stays=stays, hovers=True)
        if CourseSearch(anywhere.made()).may_exist(budget.states):
            classes = TeamClasses(team, stays=stays, hovers=True)
            course = CourseSearch(classes.made()).cheapest(budget.states).course_within(budget.states)
            if course is not None:
                plan = classes.plan(course)
                return plan if has_room(team.systems, plan, team.rooms.most) else None
    return None


def _may_exist(systems: Sequence[TransitionSystem], kinds: Sequence[str], marks: Marks, budget: Budget) -> bool:
    """Tell whether there may be a course, whatever it costs, of robots that rest, or that may also stay."""
    team = CountedTeam(tuple(systems), tuple(kinds), marks, _ANYWHERE, skips=True)
    return any(CourseSearch(TeamClasses(team, stays=stays).made()).may_exist(budget.states) for stays in (False, True))


class _Planning:
    """The searches of one try.

    To stay for good where no robot can wait for one is seldom needed, and doubles the places. Such plans are searched where there are no
    others, and beside others to know whether they would be cheaper.

    Args:
        team: The robots, and the formula.
        states: That a search may look at.
        within: The number of robots that small regions hold, where cheaper plans with robots that stay are taken; None where they are not.
    """

    def __init__(self, team: CountedTeam, states: int, within: Mapping[str, int] | None) -> None:
        self._team, self._states, self._within = team, states, within
        self._made = {stays: TeamClasses(team, stays=stays) for stays in (False, True)}
        self._needs_stays, self._staying = False, states

    def cheapest(self) -> CountedPlan | None:
        """Return a cheapest plan in which no small region is too full where robots wait for others; None where none was found.

        Raises:
            TooLarge: The states did not suffice for any plan.
        """
        best, bound = None, 0.0
        for variant in _VARIANTS:
            if variant.apart if best is None else best.cost <= bound + _TIES:
                break  # no plan exists, or none is cheaper
            classes = self._made[variant.stays]
            if variant.apart:
                classes = classes.distinguished()
            if best is None:
                self._needs_stays = variant.stays
                searched = CourseSearch(classes.made()).cheapest(self._states)
                course = searched.course_within(self._states)
                if course is not None:
                    if not variant.stays:
                        self._staying = min(_STATES_STAYING, 4 * searched.reached + 1_000, self._states)
                    best = replace(classes.plan(course), reached=searched.reached)
                    if not has_room(self._team.systems, best, self._team.rooms.most):
                        return None
            else:
                searched = self._beside(variant, classes, best, bound)
                best = self._cheaper(classes, searched, best)
            if variant.stays and (variant.apart or not self._team.longest):
                bound = max(bound, searched.bound)
        return None if best is None else replace(best, bound=min(best.cost, bound))

    def _beside(self, variant: _Variant, classes: TeamClasses, best: CountedPlan, bound: float) -> Searched:
        """Return the result of a search beside a plan; without a course where it would say no more than those before it."""
        nothing = Searched(None, bound, 0)
        if (self._needs_stays and not variant.stays) or (self._team.longest and not variant.apart):
            return nothing
        search = CourseSearch(classes.made())
        if self._team.longest:
            moves = max(1, sum(map(len, search.classes.moves)))
            return search.least_highest(tuple(classes.start), best.cost, max(_MOVES_HIGHEST // moves, _FEW_HIGHEST))
        if not variant.apart:
            return search.cheapest(self._staying)
        least, most = search.least(), min(_STATES_APART, self._states)
        alike = classes.start == self._made[variant.stays].start
        if (variant.stays and best.cost <= least + _TIES) or (alike and not (variant.stays and self._staying < most)):
            return replace(nothing, bound=max(bound, least))
        return search.cheapest(most)

    def _cheaper(self, classes: TeamClasses, searched: Searched, best: CountedPlan) -> CountedPlan:
        """Return the plan of a course that was found, if it is cheaper and may be taken; otherwise the best one so far."""
        course = searched.course
        if course is None or max(course.cost, classes.cost(course)) >= best.cost - _TIES:
            return best
        plan = replace(classes.plan(course), reached=searched.reached)
        taken = self._needs_stays or not plan.stays
        taken = taken or (self._within is not None and stays_apart(classes.systems, plan, self._within))
        return plan if taken and has_room(classes.systems, plan, self._team.rooms.most) else best
