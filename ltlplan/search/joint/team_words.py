"""Plans for `team: joint`, where a formula speaks of what all robots show together.

A plan must hold when one robot flies at a time, in every order, while the others hold their first or last letters. So the
robots' product is walked along one order of the robots only (who flies, where, what the others hold), which is far
smaller than all their positions at once. What somebody holds is forgotten as soon as no unfinished conjunct asks for it.
Where the cheapest run breaks a conjunct in another order, the search begins again and also remembers what each robot's word
does to that conjunct, for everything that the others may hold meanwhile (`ltlplan.search.joint.conjuncts`).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import Budget
from ltlplan.search.joint.joint_states import JointTask
from ltlplan.search.makespan import Rule, allowed_by, best_by_rule, too_many_states
from ltlplan.search.team_search import PlanningOutcome, SearchSpace, refined_until_kept, search_team
from ltlplan.systems.transition_systems import TransitionSystem


def plan_joint(
    systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget, most: Sequence[float] | None = None
) -> PlanningOutcome:
    """Return the cheapest plan that keeps the formula, read over unions of letters, in every order of the robots.

    A tenth of the budget of states is spent on each search.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        budget: Bounds on the search.
        most: What each robot may cost at most; None for no limit. The cheapest plan within it is returned; where there is none, only
            the `first` one is, which goes beyond it.

    Raises:
        TooLarge: A budget was used up before any plan was found.
    """
    joint = JointTask(systems, automata)
    share = replace(budget, states=max(1, budget.states // 10))

    def space(flying: Collection[int]) -> SearchSpace:
        within = joint.flown_by(flying)
        return SearchSpace(within.graph, within.search_states)

    found = refined_until_kept(space, len(systems), joint.broken, joint.failing_order, share)
    if found.run is None or most is None or allowed_by(rule := Rule(longest=False, most=most), joint.team, found.run):
        return found
    within, exhausted = best_by_rule(joint.graph, joint.search_states, joint.broken, joint.failing_order, budget, rule)
    if not exhausted:
        raise too_many_states(budget)
    return within if within.run is not None else replace(within, first=found.run, refused=None)


def plan_joint_makespan(
    systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget, most: Sequence[float] | None = None
) -> tuple[PlanningOutcome, float, bool]:
    """Return the plan whose dearest robot costs least, a lower bound on that, and whether the search was exhausted.

    Where it was not, the plan is the one with the smallest sum of costs.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        budget: Bounds on the search.
        most: What each robot may cost at most, as in `plan_joint`.

    Raises:
        TooLarge: A budget was used up before any plan was found.
    """
    by_sum = plan_joint(systems, automata, budget, most)
    if by_sum.run is None:
        return by_sum, 0.0, False
    joint = JointTask(systems, automata)
    found, exhausted = best_by_rule(
        joint.graph, joint.search_states, joint.broken, joint.failing_order, budget, Rule(longest=True, most=most)
    )
    return (found if exhausted else by_sum), found.bound, exhausted


def joint_possible(systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget) -> bool:
    """Tell whether any plan keeps the formula in the systems' order.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.
        budget: Bound on the states.

    Raises:
        TooLarge: The budget was used up.
    """
    joint = JointTask(systems, automata)
    found = search_team(joint.graph, joint.search_states(()), budget)
    if found.stopped is not None:
        raise found.stopped
    return found.run is not None
