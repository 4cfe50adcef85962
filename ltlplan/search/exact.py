"""From a mission to words: who visits what, in which order, at the smallest cost.

`assign` is exact: it returns a cheapest plan among all whose words keep the formula in every order of the robots, over the
letters that will really be flown, or says that there is none and why. Nothing here knows about time; a later check of the
timed claim may still add waits.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from types import MappingProxyType

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.product_automaton import Task
from ltlplan.search.assignment import TIES, Assignment, NoWords, asked_of, in_units_of
from ltlplan.search.counting.capacities import small_rooms
from ltlplan.search.counting.conflicting_conjuncts import no_counted_plan
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import plan_counts, plan_hovering, roomy_marks
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms
from ltlplan.search.counting.synchronisation import HoversOutside, precedences_of, waits_of
from ltlplan.search.endurance import over_endurance, require_endurance
from ltlplan.search.itineraries import itinerary, word_along
from ltlplan.search.joint.team_words import plan_joint, plan_joint_makespan
from ltlplan.search.lassos.laps import assign_lasso
from ltlplan.search.lassos.team_laps import assign_team_laps
from ltlplan.search.makespan import Rule, plan_makespan
from ltlplan.search.partial_orders.ordered_assignment import assign_ordered
from ltlplan.search.reduced_graph import Team
from ltlplan.search.relevant_places import places_that_matter
from ltlplan.search.team_search import PlanningOutcome, plan_team
from ltlplan.systems.region_labels import Layout
from ltlplan.systems.robot_systems import Systems, interchangeable
from ltlplan.systems.transition_systems import Cost, TransitionSystem
from verify.data import Formula, Infeasible, Mission, Unsatisfiable, Word
from verify.data.language.counting import Atom, atoms

_HOVERING_STATES = 20_000
"""Of the search for plans in which robots also wait outside regions."""


def assign(
    mission: Mission,
    *,
    cost: Cost | None = None,
    metre: Mapping[str, float] | None = None,
    budget: Budget = DEFAULT_BUDGET,
    capacities: Mapping[str, int] = MappingProxyType({}),
    explained: bool = True,
) -> Assignment:
    """Share a mission among its robots at the smallest cost.

    Args:
        mission: With its formula, regions, environment, internal states and agents.
        cost: Cost of a leg, (robot, from a position or a region, to a region) -> float; where None, straight lines by the mission's
            weights of length and time (by metres, where some robot has neither).
        metre: What a metre costs each robot on the way to its end, where `cost` counts more than metres; endurance is not kept then.
        budget: Bounds on the search.
        capacities: Robots that regions hold, where refinement found no places for more; kept by formulas that count.
        explained: Whether it is found out why there is no plan, which takes many more searches.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula; the message says which parts of it cannot
            hold together, and which to leave out.
        Infeasible: No way to share it brings all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    try:
        found = _assign(mission, cost, metre, _Bounds(budget, capacities))
    except NoWords as error:
        raise (error.why() if explained else error) from None
    return in_units_of(mission, found) if cost is None else found


def assign_under_precedences(
    mission: Mission, *, cost: Cost | None = None, budget: Budget = DEFAULT_BUDGET
) -> Assignment | None:
    """Share a finite mission by the cheapest words that hold under precedences, also where dearer or other words hold in every order.

    Args:
        mission: Of several robots.
        cost: Cost of a leg, as for `assign`.
        budget: Bounds on the search.

    Returns:
        None where there are no such words.

    Raises:
        Infeasible: It brings not all back before a vehicle's endurance ends.
        TooLarge: A budget was used up before an answer was found.
    """
    layout = Layout(mission)
    systems = Systems(mission, cost, places=places_that_matter(mission, layout), layout=layout)
    each = [systems.of(name) for name in mission.agents]
    asked = asked_of(mission, each)
    automata = conjunct_automata(asked, "finite", budget=budget)
    found = assign_ordered(mission, systems, each, automata, atoms(asked), budget)
    if found is None:
        return None
    require_endurance(mission, systems, found.robots)
    return in_units_of(mission, found) if cost is None else found


def _cheapest(mission: Mission) -> float | None:
    """Return what the cheapest plan costs; None where there is none."""
    try:
        return assign(mission, budget=Budget(states=50_000), explained=False).cost
    except (Unsatisfiable, Infeasible):
        return None


@dataclass(frozen=True, slots=True)
class _Bounds:
    """What a search may take, and what its plans have to keep beyond the mission.

    Attributes:
        budget: Bounds on the search.
        capacities: Robots that regions hold, where refinement found no places for more.
    """

    budget: Budget
    capacities: Mapping[str, int]


def _assign(mission: Mission, cost: Cost | None, metre: Mapping[str, float] | None, bounds: _Bounds) -> Assignment:
    budget = bounds.budget
    layout = Layout(mission)
    systems = Systems(mission, cost, places=places_that_matter(mission, layout), layout=layout, metre=metre)
    each = [systems.of(name) for name in mission.agents]
    if mission.spec.trace == "infinite":
        lasso = (
            assign_team_laps(mission, systems, each, budget, _cheapest)
            if len(each) > 1
            else assign_lasso(mission, systems, each[0], budget, _cheapest)
        )
        require_endurance(mission, systems, lasso.robots)
        return lasso
    asked = asked_of(mission, each)
    if len(each) > 1 and mission.written.counts:
        counted = _assign_counted(mission, systems, each, asked, bounds)
        require_endurance(mission, systems, counted.robots)
        return counted
    automata = conjunct_automata(asked, "finite", budget=budget)
    joint = mission.spec.team == "joint" and len(each) > 1
    longest, most = mission.planner.objective == "longest" and len(each) > 1, systems.most_costs()
    bound, exhausted = 0.0, False  # on the bottleneck's cost, where that is what counts
    if joint:
        if longest:
            found, bound, exhausted = plan_joint_makespan(each, automata, budget, most)
        else:
            found = plan_joint(each, automata, budget, most)
        if found.run is None and found.first is not None and most is not None and found.refused is None:
            raise over_endurance(
                mission, systems, _assignment(mission, each, replace(found, run=found.first), 0.0, False).robots
            )
    else:
        team = Team(each)
        task = Task(automata, team.letters, team.walls)
        if longest or most is not None:
            found, bound, exhausted = plan_makespan(team, task, budget, Rule(longest, most))
            if found.run is None and most is not None:
                found, bound = plan_team(team, task, budget), 0.0  # is it the endurance, or the formula?
                if found.run is not None:
                    raise over_endurance(mission, systems, _assignment(mission, each, found, 0.0, False).robots)
        else:
            found = plan_team(team, task, budget)
    if found.run is None:
        ordered = None if len(each) == 1 else _assign_in_order(mission, systems, each, automata, asked, bounds)
        if ordered is not None:
            require_endurance(mission, systems, ordered.robots)
            return ordered
        raise NoWords(lambda: _no_plan(mission, systems, each, asked, found))
    plan = _assignment(mission, each, found, bound, exhausted)
    require_endurance(mission, systems, plan.robots)
    return replace(plan, notes=(*plan.notes, *_sizes(each, automata, found), *systems.unclear()))


def _assign_counted(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    asked: Formula,
    bounds: _Bounds,
) -> Assignment:
    """Plan a formula that counts robots or names them: words, and who waits for whom."""
    kinds, known, budget = list(interchangeable(mission).values()), atoms(asked), bounds.budget
    rooms = small_rooms(mission, each, bounds.capacities)
    automata = conjunct_automata(asked, "finite", budget=budget)
    longest = mission.planner.objective == "longest" and len(each) > 1
    found = plan_counts(each, kinds, automata, known, budget, rooms=rooms, longest=longest)
    if found is None:
        hovering = _assign_hovering(mission, systems, each, automata, known, rooms)
        if hovering is not None:
            return hovering
        from ltlplan.search.explanations.relaxation import relaxed

        raise NoWords(lambda: relaxed(mission, no_counted_plan(mission, each, kinds, asked, rooms), _cheapest))
    try:
        waits, precedences = waits_of(each, found)
    except HoversOutside:  # but flights may be timed so that nobody has to, or it waits there
        with contextlib.suppress(TooLarge, Infeasible):
            ordered = assign_ordered(mission, systems, each, automata, known, budget)
            if ordered is not None:
                return ordered
        events = precedences_of(each, found)
        if events is None:
            raise
        waits, precedences = [], events
    robots = {name: itinerary(system, path) for name, system, path in zip(mission.agents, each, found.paths, strict=True)}
    costs = [robot.cost for robot in robots.values()]
    total = max(costs) if longest else sum(costs)
    complete = total <= found.bound + TIES
    notes = [f"The search reached {found.reached:,} states: how many robots rest where, and what is done."]
    if not complete:
        notes.append(
            "A cheaper plan was not ruled out, one in which robots end just outside regions or where they act included."
        )
    if waits or precedences:
        notes.append(
            f"Robots wait for each other: the plan has {len(found.stages)} stages, each begun when the one before has ended."
        )
    said = (*notes, *systems.unclear())
    return Assignment(robots, total, min(found.bound, total), complete, 1, said, tuple(waits), tuple(precedences))


def _assign_hovering(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    automata: Sequence[Automaton],
    known: dict[str, Atom],
    small: Mapping[str, int],
) -> Assignment | None:
    """Plan counts with robots that also wait just outside regions; None where no such plan is found."""
    budget, rooms = Budget(states=_HOVERING_STATES), Rooms(small, passing=True)
    kinds = tuple(interchangeable(mission).values())
    with contextlib.suppress(TooLarge):
        team = CountedTeam(tuple(each), kinds, Marks(automata, known), rooms, skips=True)
        found = plan_hovering(team, budget, roomy_marks(each, automata, known, rooms.most))
        if found is None:
            return None
        waits = precedences_of(each, found)
        if waits is None:
            return assign_ordered(mission, systems, each, automata, known, budget)
        robots = {name: itinerary(system, path) for name, system, path in zip(mission.agents, each, found.paths, strict=True)}
        costs = [robot.cost for robot in robots.values()]
        total = sum(costs) if mission.planner.objective == "sum" else max(costs)
        note = (
            f"The search reached {found.reached:,} states. Robots wait for each other, also outside regions that they have left; a cheaper "
            "plan was not ruled out."
        )
        return Assignment(robots, total, None, False, 1, (note, *systems.unclear()), precedences=tuple(waits))
    return None


def _assign_in_order(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    automata: Sequence[Automaton],
    asked: Formula,
    bounds: _Bounds,
) -> Assignment | None:
    """Plan words that hold under precedences, or where these would wait for actions that nobody can wait for, stage by stage."""
    try:
        return assign_ordered(mission, systems, each, automata, atoms(asked), bounds.budget)
    except Infeasible:
        if mission.spec.team == "joint":
            with contextlib.suppress(TooLarge, NoWords, HoversOutside):
                return _assign_counted(mission, systems, each, asked, bounds)
        raise


def _sizes(systems: list[TransitionSystem], automata: Sequence[Automaton], found: PlanningOutcome) -> Iterator[str]:
    """Say, for a team, how many states were reached beside how many the product of all robots has."""
    if len(systems) > 1 and found.run is not None:
        size = math.prod(len(a.edges) for a in automata) * math.prod(len(system.labels) for system in systems)
        many = f"{size:,}" if size < 1_000_000 else f"{Decimal(size):.1e}"
        yield f"The search reached {found.run.reached:,} states of the team automaton; the product of all robots has {many}."


def _assignment(
    mission: Mission, systems: list[TransitionSystem], found: PlanningOutcome, bound: float, exhausted: bool
) -> Assignment:
    """Return what the robots do; `bound` and `exhausted` are of a search for the cheapest bottleneck, if any."""
    assert found.run is not None
    robots = {
        name: itinerary(system, path) for name, system, path in zip(mission.agents, systems, found.run.paths, strict=True)
    }
    total, bottleneck = sum(robot.cost for robot in robots.values()), max(robot.cost for robot in robots.values())
    least = total if found.stopped is None else max(0.0, found.bound - TIES)
    notes: list[str] = []
    if found.tried > 1:
        notes.append(f"{found.tried} plans were tried; the cheaper ones hold in some orders of the robots, but not in all.")
    if found.stopped is not None:
        notes.append(f"{found.stopped.shortage} This plan holds in every order of the robots; a cheaper one may exist.")
    if mission.planner.objective == "sum" or len(robots) == 1:
        return Assignment(robots, total, least, found.stopped is None, found.tried, tuple(notes))
    if not exhausted:
        notes.append(
            "Finding the cheapest dearest robot takes too many states; a plan whose dearest robot costs less may exist."
        )
    return Assignment(robots, bottleneck, bottleneck if exhausted else bound, exhausted, found.tried, tuple(notes))


def _no_plan(
    mission: Mission, systems: Systems, each: list[TransitionSystem], asked: Formula, found: PlanningOutcome
) -> Unsatisfiable:
    """Return the error that says why there is no plan."""
    from ltlplan.search.explanations.no_plan import no_plan

    order: list[tuple[str, Word]] = []
    if found.first is not None:
        names, words = tuple(mission.agents), [word_along(s, p) for s, p in zip(each, found.first.paths, strict=True)]
        order = [(names[i], words[i]) for i in found.refused or range(len(names))]
    return no_plan(mission, systems, each, asked, order, _cheapest)
