"""Parts of a graph in which one can go round for ever."""

from __future__ import annotations

from collections.abc import Sequence


def components(edges: Sequence[Sequence[int]]) -> list[frozenset[int]]:
    """Return the strongly connected components that hold a cycle.

    Args:
        edges: For each node, where its edges lead.
    """
    import networkx as nx  # here: it takes long to load, and few plans need it

    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(edges)))
    graph.add_edges_from((source, target) for source, targets in enumerate(edges) for target in targets)
    found = (frozenset(part) for part in nx.strongly_connected_components(graph))
    return [part for part in found if len(part) > 1 or any(node in edges[node] for node in part)]
