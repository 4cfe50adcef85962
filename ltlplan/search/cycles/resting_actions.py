"""Cycles that only change internal states to and fro inside one region: no flight has such a cycle, whose visits are made anew each time."""

from __future__ import annotations

from collections.abc import Iterable

from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, parse_formula
from verify.data.language.formula import TRUE


def acts_at_rest(system: TransitionSystem, cycle: Iterable[int]) -> bool:
    """Tell whether a cycle comes to no region and yet changes what the robot shows.

    Args:
        system: What the robot can do.
        cycle: Nodes of one cycle.
    """
    nodes = [system.nodes[node] for node in cycle]
    return not any(node.flying for node in nodes) and len({node.internal for node in nodes}) > 1


def comes_anew(system: TransitionSystem) -> Formula:
    """Return what words with such cycles break, and no others: who changes something for ever leaves its region for ever, too.

    Args:
        system: What the robot can do.
    """
    asked: list[str] = []
    for region in sorted({action.at for action in system.actions}):
        if changing := _to_and_fro(system, region):
            beside = {name for label in system.labels if region in label for name in label} - {region}
            beside &= {name for node in system.nodes for name in node.regions}
            moves = [f"(G F {name} & G F !{name})" for name in sorted(beside)]
            settled = " & ".join(f"(F G {name} | F G !{name})" for name in sorted(changing))
            asked.append(" | ".join([f"G F !{region}", *moves, f"({settled})"]))
    return parse_formula(" & ".join(f"({each})" for each in asked)) if asked else TRUE


def _to_and_fro(system: TransitionSystem, region: str) -> set[str]:
    """Return the propositions that can change for ever inside one region."""
    import networkx  # here: it takes long to load, and few plans need it

    graph = networkx.DiGraph((action.source, action.target) for action in system.actions if action.at == region)
    shown: dict[str, frozenset[str]] = {}
    for node, label in zip(system.nodes, system.labels, strict=True):
        shown.setdefault(node.internal, label - node.regions)
    changing = set[str]()
    for states in networkx.strongly_connected_components(graph):
        labels = [shown[state] for state in states if state in shown]
        if len(labels) > 1:
            changing |= frozenset[str]().union(*labels) - frozenset[str].intersection(*labels)
    return changing
