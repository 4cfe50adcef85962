"""Orders of visits that keep a plan's meetings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from verify.data import Plan
from verify.data.plan import Meeting


def one_at_a_time(plan: Plan, *, last_first: bool = False) -> tuple[Meeting, ...]:
    """Return the plan's meetings with more of them, so that one robot after another flies to its next visit.

    What may happen at the same time may happen in any order, so the formula holds in this one too.

    Args:
        plan: Its meetings do not go round in a circle.
        last_first: Whether of robots that might all fly next the plan's last one does; by default the one whose name comes first.
    """
    import networkx as nx  # here: it takes long to load, and few plans need it

    order: nx.DiGraph[tuple[str, int]] = nx.DiGraph()
    for name, robot in plan.robots.items():
        order.add_nodes_from((name, visit) for visit in range(len(robot.visits)))
        order.add_edges_from(pairwise((name, visit) for visit in range(len(robot.visits))))
    order.add_edges_from((meeting.first, meeting.then) for meeting in plan.meetings)
    rank = {name: -number for number, name in enumerate(plan.robots)}
    turns = list(nx.lexicographical_topological_sort(order, (lambda turn: (rank[turn[0]], turn[1])) if last_first else None))
    return in_turn(plan, turns)


def in_turn(plan: Plan, turns: Sequence[tuple[str, int]]) -> tuple[Meeting, ...]:
    """Return the plan's meetings with those that let each visit be flown to when the one before has been reached.

    Args:
        plan: Whose visits they are.
        turns: (robot, visit), in this order.
    """
    more = [Meeting(first=first, then=then) for first, then in pairwise(turns) if first[0] != then[0]]
    return tuple(dict.fromkeys((*plan.meetings, *more)))
