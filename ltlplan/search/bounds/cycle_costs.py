"""A lower bound on what a team still pays before its cycles and in them: shortest ways over all places.

It knows what the formula forbids and what it remembers, where `cycle_shares` knows that nobody can be in two places. Without it searches for cycles of three and
four robots take a fifth longer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.search.bounds.set_orders import Floats
from ltlplan.search.cycles.cycle_places import CyclePlaces


def bounds_before(places: CyclePlaces, weight: float) -> Floats:
    """Return for each place the least sum that is left when cycles have not begun. Shape (places,).

    Args:
        places: Where the team can be.
        weight: How many cycles count.
    """
    cycles = weight * _through_each_mark(places)
    size = len(places.places)
    back = [(cost, target, source) for source, own in enumerate(places.ways) for _, cost, target in own]
    # one more point stands for cycles that are begun at some home
    begun = [(float(cycles[at]), size, place) for place, (at, _) in enumerate(places.places) if places.homes[at]]
    return np.asarray(dijkstra(_graph([*back, *begun], size + 1), indices=size))[:-1]


def _through_each_mark(places: CyclePlaces) -> Floats:
    """Return a bound on cycles from all nodes: the highest of the ways round by one mark. Shape (nodes,)."""
    lasting = places.recurring
    steps = ((cost, source, target) for source, own in enumerate(places.steps) for _, cost, target in own if lasting[target])
    there = _graph(list(steps), len(places.nodes))
    found = np.zeros(len(places.nodes))
    for mark in range(places.everything.bit_length()):
        own = [at for at, shown in enumerate(places.marks) if shown >> mark & 1 and lasting[at]]
        if not own:
            return np.full(len(places.nodes), np.inf)
        found = np.maximum(found, sum(np.asarray(dijkstra(graph, indices=own, min_only=True)) for graph in (there.T, there)))
    return found


def _graph(edges: Sequence[tuple[float, int, int]], size: int) -> csr_matrix:
    """Return the costs of edges, each with where it leads from and to; without those that are endless."""
    found = np.array([edge for edge in edges if edge[0] < np.inf]).reshape(-1, 3)
    return csr_matrix((found[:, 0], tuple(found[:, 1:].T.astype(np.int64))), shape=(size, size))
