"""Plans with counts: from numbers of robots to what each of them does, and who waits for whom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.capacities import most_that_show
from ltlplan.search.counting.counter_search import NumberSearch, UsedUp
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.minmax_search import cheapest_dearest
from ltlplan.search.counting.moves import RobotMoves
from ltlplan.search.counting.symmetry_classes import CountedPlan, CountedTeam, Rooms, TeamClasses
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula
from verify.data.language.counting import Atom

_TIES = 1e-6  # m
_STATES_STAYING = 8_000
"""Of the search whether a plan would be cheaper in which robots stay where nobody can be waited for, which is seldom so."""
_STATES_ROOMY = {True: 40_000, False: 10_000}
"""Of a search in which small regions are no fuller than they may be, where robots pass each other in them and where they do not: it proves nothing."""
_STATES_APART = 4_000
"""Of a search in which robots are told apart by where they start."""
_STATES_DEAREST, _FEW_DEAREST = 400_000, 200
"""Moves tried, about, and states at the least, of a search for the cheapest dearest robot."""


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
        rooms: How many robots small regions hold; others hold all.
        longest: Whether the dearest robot's cost counts, not the sum.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    marks = Marks(automata, atoms)

    def team(small: Rooms, *, skips: bool = False) -> CountedTeam:
        return CountedTeam(tuple(systems), tuple(kinds), marks, small, skips, longest)

    found, anywhere = None, Rooms({}, passing=False)
    with suppress(TooLarge):
        found = _plan(team(anywhere, skips=True), budget, within=rooms or {})
        if found is None or not rooms or _ways_are_free(systems, found, rooms):
            return found
    roomy = roomy_marks(systems, automata, atoms, rooms or {})
    if rooms and not _possible(replace(team(anywhere, skips=True), marks=roomy), budget):
        return None
    for passing in (True, False) if rooms else ():
        try:
            parted = _plan(team(Rooms(rooms or {}, passing)), Budget(states=min(budget.states, _STATES_ROOMY[passing])))
        except TooLarge:
            continue
        if parted is not None:  # where nobody may pass another one, a cheaper plan is not ruled out
            return parted if passing else replace(parted, bound=0.0 if found is None else found.bound)
    return found or _plan(team(anywhere), budget)


def roomy_marks(
    systems: Sequence[TransitionSystem], automata: Sequence[Automaton], atoms: dict[str, Atom], rooms: Mapping[str, int]
) -> Marks:
    """Return what a formula sees of a team where counts for which small regions have no room are never true.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        atoms: The formula's propositions of the whole team.
        rooms: How many robots small regions hold; others hold all.
    """
    return Marks(automata, atoms, _between(systems, atoms, rooms))


def plan_hovering(team: CountedTeam, budget: Budget, roomy: Marks) -> CountedPlan | None:
    """Return a cheapest plan in which robots also wait just outside regions that they have left; None where there is none.

    Args:
        team: Who there is, and what is asked.
        budget: Bounds on the search.
        roomy: What the formula sees where counts for which small regions have no room are never true.

    Raises:
        TooLarge: The budget was used up before any plan was found.
    """
    for stays in (False, True):
        robots = [
            RobotMoves(system, partial(team.marks.of, system.robot), stays=stays, skips=team.skips, hovers=True)
            for system in team.systems
        ]
        anywhere = TeamClasses(replace(team, rooms=Rooms({}, passing=False), marks=roomy), stays=stays, robots=robots)
        if not NumberSearch(anywhere.made()).possible(budget):
            continue
        classes = TeamClasses(team, stays=stays, robots=robots)
        course = NumberSearch(classes.made()).cheapest(budget)
        if course is not None:
            plan = classes.plan(course)
            return plan if _has_room(team.systems, plan, team.rooms.most) else None
    return None


def _plan(team: CountedTeam, budget: Budget, *, within: Mapping[str, int] | None = None) -> CountedPlan | None:
    """Return a cheapest plan in which no small region is too full where robots wait for others; None where none was found.

    To stay for good where nobody can be waited for is seldom needed, and doubles the places: such plans are looked for where there are no
    others, and beside others to see whether they would be cheaper.

    Args:
        team: Who there is, and what is asked.
        budget: Bounds on the search.
        within: How many robots small regions hold, where such plans are taken; None where they are not.
    """
    resting, staying = (TeamClasses(team, stays=stays) for stays in (False, True))
    course = NumberSearch(resting.made()).cheapest(budget)
    needed = course is None
    if needed:
        course = NumberSearch(staying.made()).cheapest(budget)
    if course is None:
        return None
    plan = (staying if needed else resting).plan(course)
    if not _has_room(team.systems, plan, team.rooms.most):
        return None

    def taken(cheaper: CountedPlan) -> bool:
        return needed or not cheaper.stays or (within is not None and _stays_apart(team.systems, cheaper, within))

    if team.longest:
        return _with_cheapest_dearest(plan, (staying,) if needed else (staying, resting), taken)
    beside = budget.states if needed else min(_STATES_STAYING, 4 * plan.reached + 1_000, budget.states)
    if not needed:
        plan = _beside(plan, staying, beside, taken)
    if plan.cost <= plan.bound + _TIES:
        return plan
    apart, most = staying.told_apart(), min(_STATES_APART, budget.states)
    bound = max(plan.bound, min(plan.cost, NumberSearch(apart.made()).least()))
    if plan.cost > bound + _TIES and (beside < most or apart.start != staying.start):  # the same search says no more
        plan = _beside(plan, apart, most, taken)
        bound = max(bound, plan.bound)
    parted = resting.told_apart()
    if plan.cost > bound + _TIES and not needed and parted.start != resting.start:
        plan = _beside(plan, parted, most, taken)
    return replace(plan, bound=bound)


def _with_cheapest_dearest(
    plan: CountedPlan, variants: Sequence[TeamClasses], taken: Callable[[CountedPlan], bool]
) -> CountedPlan:
    """Return a plan whose dearest robot costs as little as was found, with a bound on that from the first variant, which has all ends."""
    bounds: list[float] = []
    for classes in variants:
        apart = classes.told_apart()
        search = NumberSearch(apart.made())
        ways = max(1, sum(map(len, search.ways)))  # none, where nobody shows anything else that matters
        most = max(_STATES_DEAREST // ways, _FEW_DEAREST)
        found = cheapest_dearest(search, apart.start, plan.cost, most)
        bounds.append(found.bound)
        if found.course is not None:
            cheaper = apart.plan(found.course)
            if taken(cheaper) and _has_room(classes.systems, cheaper, classes.team.rooms.most):
                plan = cheaper
        if plan.cost <= bounds[0] + _TIES:
            break
    return replace(plan, bound=min(plan.cost, bounds[0]))


def _beside(plan: CountedPlan, classes: TeamClasses, states: int, taken: Callable[[CountedPlan], bool]) -> CountedPlan:
    """Return a plan with the bound of another search, or a cheaper one that it finds, if that is taken."""
    try:
        course = NumberSearch(classes.made()).cheapest(Budget(states=states))
    except UsedUp as spent:
        return replace(plan, bound=min(plan.cost, spent.bound))
    if course is None:
        return plan
    if course.cost < plan.cost - _TIES and classes.cost(course) < plan.cost - _TIES:
        cheaper = classes.plan(course)
        if taken(cheaper) and _has_room(classes.systems, cheaper, classes.team.rooms.most):
            return cheaper
    return replace(plan, bound=min(plan.cost, course.bound))


def _stays_apart(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether nobody waits for another, and no small region has too many in it or just outside it in the end.

    Where to hover outside regions beside others, and to wait there, is not planned.
    """
    if len(plan.stages) != 1 or not _ways_are_free(systems, plan, rooms):
        return False
    ends = Counter(system.nodes[path[-1]].place for system, path in zip(systems, plan.paths, strict=True))
    return all(ends[region] <= most for region, most in rooms.items())


def _possible(team: CountedTeam, budget: Budget) -> bool:
    """Tell whether there may be a course, whatever it costs, of robots that rest, or that may also stay."""
    return any(NumberSearch(TeamClasses(team, stays=stays).made()).possible(budget) for stays in (False, True))


def _between(
    systems: Sequence[TransitionSystem], atoms: dict[str, Atom], rooms: Mapping[str, int]
) -> dict[str, tuple[int, int]]:
    """Return for what is counted, by its text, how few and how many robots show it at once, as far as small regions say so."""
    found: dict[str, tuple[int, int]] = {}
    for counted in (atom.counted for atom in atoms.values() if not atom.robot):
        shown, not_shown = (most_that_show(asked, systems, rooms) for asked in (counted, Formula("!", (counted,))))
        few = 0 if not_shown is None else max(0, len(systems) - not_shown[0])
        found[str(counted)] = few, len(systems) if shown is None else shown[0]
    return found


def _has_room(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them between two stages, and at the end."""
    at = [path[0] for path in plan.paths]
    for stage in plan.stages if rooms else ():
        for robot, _, after in (plan.turns[turn] for turn in stage):
            at[robot] = plan.paths[robot][after - 1]
        resting = Counter(region for system, node in zip(systems, at, strict=True) for region in system.nodes[node].regions)
        if any(resting[region] > most for region, most in rooms.items()):
            return False
    return True


def _ways_are_free(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them, and nobody flies through one that those who wait fill."""
    at = [path[0] for path in plan.paths]
    for stage in plan.stages:
        moving = {plan.turns[turn][0] for turn in stage}
        waiting = Counter(
            region for robot, node in enumerate(at) if robot not in moving for region in systems[robot].nodes[node].regions
        )
        for robot, before, after in (plan.turns[turn] for turn in stage):
            on_the_way = {region for node in plan.paths[robot][before:after] for region in systems[robot].nodes[node].regions}
            if any(waiting[region] >= rooms[region] for region in on_the_way & rooms.keys()):
                return False
            at[robot] = plan.paths[robot][after - 1]
    return _has_room(systems, plan, rooms)
