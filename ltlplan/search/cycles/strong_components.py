"""Parts of a graph in which one can go round for ever."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components


def components(graph: csr_matrix) -> list[NDArray[np.int64]]:
    """Return the nodes of each strongly connected component that holds a cycle.

    Args:
        graph: Positive where an edge leads. Shape (nodes, nodes).
    """
    if not graph.nnz:
        return []
    _, component = connected_components(graph, connection="strong")
    order = np.argsort(component, kind="stable").astype(np.int64)
    parts = np.split(order, np.flatnonzero(np.diff(component[order])) + 1)
    loops = graph.diagonal() > 0.0
    return [part for part in parts if len(part) > 1 or loops[part[0]]]


def graph_of(edges: Sequence[Sequence[int]]) -> csr_matrix:
    """Return a graph as a matrix.

    Args:
        edges: For each node, where its edges lead.
    """
    sources = np.repeat(np.arange(len(edges)), [len(own) for own in edges])
    targets = np.array([target for own in edges for target in own], dtype=np.int64)
    return csr_matrix((np.ones(len(targets)), (sources, targets)), shape=(len(edges), len(edges)))
