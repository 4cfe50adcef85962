"""Plans for formulas that count robots, in stages: what is flown at once, and who waits for whom before the next stage begins.

`plan_stages` is tried first; `plan_waiting_outside` also lets robots wait just outside regions.
"""

from __future__ import annotations

import contextlib

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.counting.capacities import small_rooms
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.counting.planning import plan_counts, plan_hovering, roomy_marks
from ltlplan.search.counting.symmetry_classes import CountedTeam, Rooms
from ltlplan.search.counting.synchronisation import HoversOutside, precedences_of, waits_of
from ltlplan.search.orders import planning as orders
from ltlplan.search.problem import TIES, NoWords, Problem
from ltlplan.systems.robot_systems import interchangeable
from verify.data import Infeasible, Unsatisfiable

_HOVERING_STATES = 20_000
"""Of the search for plans in which robots also wait outside regions."""


def plan_stages(problem: Problem) -> Allocation:
    """Plan a formula that counts robots or names them: words, and who waits for whom.

    Raises:
        NoWords: There are none; it finds out why.
        HoversOutside: Robots would wait outside regions.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    mission, each = problem.mission, problem.each
    kinds, rooms = list(interchangeable(mission).values()), small_rooms(mission, each, problem.capacities)
    found = plan_counts(each, kinds, problem.automata, problem.known, problem.budget, rooms=rooms, longest=problem.longest)
    if found is None:
        from ltlplan.search.counting.conflicting_conjuncts import no_counted_plan
        from ltlplan.search.explanations.relaxation import relaxed

        raise NoWords(lambda: relaxed(mission, no_counted_plan(mission, each, kinds, problem.asked, rooms), problem.cheapest))
    try:
        waits, precedences = waits_of(each, found)
    except HoversOutside:  # but flights may be timed so that nobody has to, or it waits there
        with contextlib.suppress(TooLarge, Infeasible):
            ordered = orders.plan(problem)
            if ordered is not None:
                return ordered
        events = precedences_of(each, found)
        if events is None:
            raise
        waits, precedences = [], events
    robots = problem.itineraries(found.paths)
    total = (max if problem.longest else sum)(robot.cost for robot in robots.values())
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
    said = (*notes, *problem.systems.unclear())
    return Allocation(
        robots=robots, cost=total, lower_bound=min(found.bound, total), complete=complete, notes=said, meetings=tuple(waits),
        precedences=tuple(precedences),
    )  # fmt: skip


def plan_waiting_outside(problem: Problem) -> Allocation:
    """Plan counts with robots that also wait just outside regions.

    Raises:
        NoWords: There are no such plans, or a budget was used up.
    """
    mission, each = problem.mission, problem.each
    rooms = Rooms(small_rooms(mission, each, problem.capacities), passing=True)
    with contextlib.suppress(TooLarge):
        team = CountedTeam(
            tuple(each), tuple(interchangeable(mission).values()), Marks(problem.automata, problem.known), rooms, skips=True
        )
        marks = roomy_marks(each, problem.automata, problem.known, rooms.most)
        found = plan_hovering(team, Budget(states=_HOVERING_STATES), marks)
        waits = None if found is None else precedences_of(each, found)
        ordered = orders.plan(problem) if found is not None and waits is None else None
        if ordered is not None:
            return ordered
        if found is not None and waits is not None:
            robots = problem.itineraries(found.paths)
            total = (max if problem.longest else sum)(robot.cost for robot in robots.values())
            note = (
                f"The search reached {found.reached:,} states. Robots wait for each other, also outside regions that they have left; a "
                "cheaper plan was not ruled out."
            )
            said = (note, *problem.systems.unclear())
            return Allocation(robots=robots, cost=total, notes=said, precedences=tuple(waits))
    raise NoWords(lambda: Unsatisfiable("No plan was found in which robots also wait just outside regions."))
