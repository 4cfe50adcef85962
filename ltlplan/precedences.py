"""Waits between robots: taken from the counterexamples of a refused `timed` claim, kept in the plan.

The assignment stays as it is; one robot's visit is put after another's. Waits that would go round in a circle are
refused, because no schedule can keep them. Where counterexamples name no waits, or only such, planning is asked for an order of all events.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from typing import TypeVar

from verify.data import NotCertified, Plan, Unsatisfiable, Witness
from verify.data.plan import Precedence

Robot = TypeVar("Robot", bound=Hashable)


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
    visits = {name: len(robot.visits) for name, robot in plan.robots.items()}
    if round_trip := circle(visits, ((wait.first, wait.then) for wait in known)):
        named = " before ".join(f"{robot}'s visit of {plan.robots[robot].visits[visit].region}" for robot, visit in round_trip)
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


def circle(
    visits: Mapping[Robot, int], waits: Iterable[tuple[tuple[Robot, int], tuple[Robot, int]]]
) -> list[tuple[Robot, int]]:
    """Return visits that wait for each other, the first one repeated at the end; empty where there are none.

    Args:
        visits: How many each robot makes, one after another.
        waits: Pairs of visits of which the first is over before the second begins.
    """
    import networkx as nx  # here: it takes long to load, and few plans need it

    order: nx.DiGraph[tuple[Robot, int]] = nx.DiGraph(waits)
    for robot, count in visits.items():
        order.add_edges_from(((robot, i), (robot, i + 1)) for i in range(count - 1))
    try:
        edges = nx.find_cycle(order)
    except nx.NetworkXNoCycle:
        return []
    return [edge[0] for edge in edges] + [edges[0][0]]
