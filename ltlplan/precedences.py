"""Precedences between robots for words that are planned already: what a flight that breaks the formula is given to keep.

The assignment stays as it is; one robot's event is put after another's.
"""

from __future__ import annotations

from verify.data import Plan, Unsatisfiable


def with_planned_waits(plan: Plan) -> Plan | None:
    """Return the plan with precedences that planning finds for its words, in the place of those that it has; None where that changes nothing.

    Args:
        plan: The plan whose trajectories were rejected.

    Raises:
        Unsatisfiable: The words satisfy the formula under no precedences, so that other words are needed.
    """
    if plan.mission.spec.trace == "infinite" or len(plan.robots) < 2 or plan.meetings:
        return None
    from ltlplan.search.orders.planned_words import precedences_for

    found = precedences_for(plan)
    if not found or set(found) <= set(plan.precedences):
        return None
    return plan.model_copy(update={"precedences": found})


def hold_under_precedences(plan: Plan) -> bool:
    """Tell whether a plan's words may satisfy the formula under some precedences; if not, no flight of them does.

    Args:
        plan: The plan whose trajectories were refused.
    """
    try:
        with_planned_waits(plan)
    except Unsatisfiable:
        return False
    return True
