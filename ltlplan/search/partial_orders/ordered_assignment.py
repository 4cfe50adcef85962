"""A team's plan under precedences between events, as an assignment, by the sum of costs or the dearest robot's."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget
from ltlplan.search.assignment import TIES, Assignment
from ltlplan.search.itineraries import itinerary
from ltlplan.search.lagrangian_bounds import BY_WEIGHTED_SUMS, LeastSum, lower_the_dearest
from ltlplan.search.partial_orders.ordered_plans import MOST_STATES, OrderedPlan, plan_ordered, plan_ordered_for_dearest
from ltlplan.systems.robot_systems import Systems
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Mission
from verify.data.language.counting import Atom


def assign_ordered(
    mission: Mission,
    systems: Systems,
    each: list[TransitionSystem],
    automata: Sequence[Automaton],
    known: dict[str, Atom],
    budget: Budget,
) -> Assignment | None:
    """Plan words that hold under precedences between events; None where none do.

    Args:
        mission: Of several robots.
        systems: What robots can do.
        each: Every robot's system.
        automata: One for each conjunct.
        known: The formula's propositions of the whole team, where it counts.
        budget: Bounds on the search.

    Raises:
        Infeasible: There are such words, but their precedences cannot be said of visits and their actions.
        TooLarge: The budget was used up; nothing is known.
    """
    most = min(MOST_STATES, budget.states // 50 if budget.courses is None else budget.courses)

    def search(worlds: Sequence[TransitionSystem]) -> LeastSum[OrderedPlan] | None:
        found = plan_ordered(worlds, automata, known, joint=mission.spec.team == "joint", most=most)
        return None if found is None else costed(found)

    def costed(found: OrderedPlan) -> LeastSum[OrderedPlan]:
        costs = tuple(itinerary(system, path).cost for system, path in zip(each, found.paths, strict=True))
        return LeastSum(found, costs, found.paths, max(0.0, found.cost - TIES))

    best = search(each)
    if best is None:
        return None
    longest, bound = mission.planner.objective == "longest", best.least
    if longest:
        best, bound = lower_the_dearest(each, best, search)
        dearest = max(best.costs)
        if bound is None or dearest > bound + 2 * TIES:
            joint = mission.spec.team == "joint"
            plan, least = plan_ordered_for_dearest(each, automata, known, joint=joint, most=most, below=dearest - TIES)
            bound = max(bound or 0.0, least - TIES)  # what breaks ties counts in `least`
            best = best if plan is None else costed(plan)
    found = best.plan
    robots = {name: itinerary(system, path) for name, system, path in zip(mission.agents, each, found.paths, strict=True)}
    notes = [
        "No words hold in every order of the robots; these hold under the plan's precedences: every team word that keeps them satisfies "
        f"the formula. The search reached {found.reached:,} states of all robots together."
    ]
    if not longest:
        total = sum(best.costs)
        least, complete = max(0.0, total - TIES), True
    else:
        total, least = max(best.costs), bound or 0.0
        complete = total <= least + 3 * TIES
        if not complete:
            notes.append(BY_WEIGHTED_SUMS)
    said = (*notes, *systems.unclear())
    return Assignment(robots, total, least, complete, 1, said, precedences=found.precedences)
