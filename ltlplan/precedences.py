"""Waits between robots: taken from the counterexamples of a refused `timed` claim, kept in the plan.

The assignment stays as it is; one robot's visit is put after another's. Waits that would go round in a circle are
refused, because no schedule can keep them. Where counterexamples name no waits, or only such, planning is asked for an order of all events.
"""

from __future__ import annotations

from collections.abc import Iterable

from verify.data import NotCertified, Plan, Unsatisfiable, Witness
from verify.data.plan import Precedence


def with_waits(plan: Plan, witnesses: Iterable[Witness]) -> Plan:
    """Return the plan with the precedences that the witnesses ask for.

    Args:
        plan: The plan whose trajectories were rejected.
        witnesses: What the checker refused; those with an `order` say which visit must be over before which.

    Raises:
        NotCertified: The waits go round in a circle; the message names it.
    """
    known = dict.fromkeys(plan.precedences)
    for witness in witnesses:
        for first, then in witness.order:
            known.setdefault(Precedence(first=first, then=then))
    if len(known) == len(plan.precedences):
        return plan
    circle = _circle(plan, known)
    if circle:
        named = " before ".join(f"{robot}'s visit of {plan.robots[robot].visits[visit].region}" for robot, visit in circle)
        raise NotCertified(f"The waits that the formula requires go round in a circle: {named}.", witnesses)
    return plan.model_copy(update={"precedences": tuple(known)})


def with_planned_waits(plan: Plan) -> Plan | None:
    """Return the plan with precedences that planning finds for its words, in the place of those that it has; None where that changes nothing.

    Args:
        plan: The plan whose trajectories were rejected, with no waits that mend them.

    Raises:
        Unsatisfiable: The words satisfy the formula under no precedences, so that other words are needed.
    """
    if plan.mission.spec.trace == "infinite" or len(plan.robots) < 2 or plan.meetings:
        return None
    from ltlplan.search.partial_orders.planned_words import precedences_for

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


def _circle(plan: Plan, precedences: Iterable[Precedence]) -> list[tuple[str, int]]:
    """Return visits that wait for each other, the first one repeated at the end; empty where there are none."""
    import networkx as nx  # here: it takes long to load, and few plans need it

    order: nx.DiGraph[tuple[str, int]] = nx.DiGraph()
    for name, robot in plan.robots.items():
        order.add_edges_from(((name, i), (name, i + 1)) for i in range(len(robot.visits) - 1))
    order.add_edges_from((precedence.first, precedence.then) for precedence in precedences)
    try:
        edges = nx.find_cycle(order)
    except nx.NetworkXNoCycle:
        return []
    return [edge[0] for edge in edges] + [edges[0][0]]
