"""Lower bounds on what a robot, or the team in all or on average, still pays before its laps and in them: shortest ways over all places.

They know what the formula forbids and what it remembers, where `lap_shares` knows that nobody can be in two places; whoever pays most pays at least as
much as either says.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.search.lassos.order_bounds import Floats
from ltlplan.search.lassos.product_search.lap_places import LapPlaces, Step

Numbers = NDArray[np.int64]


def bounds_before(places: LapPlaces, weight: float) -> Floats:
    """Return for each place what is left for each account, and on average, when laps have not begun. Shape (places, accounts + 1).

    Args:
        places: Where the team can be.
        weight: How many laps count.
    """
    accounts = places.limits.accounts
    shape = (len(places.nodes), len(places.nodes))
    lasting = [[step for step in steps if places.recurring[step[2]]] for steps in places.steps]
    ahead, sources, targets = _steps(lasting, accounts)
    before, *_ = steps = _steps(places.ways, accounts)
    found = np.empty((len(places.places), len(before)))
    for k in range(1 if len(before) == 2 else len(before)):  # the average of one is its own
        there = csr_matrix((ahead[k], (sources, targets)), shape=shape)
        found[:, k] = _before(places, k, weight * _through_each_mark(places, there), steps)
    return found if len(before) > 2 else found[:, [0, 0]]


def _through_each_mark(places: LapPlaces, there: csr_matrix) -> Floats:
    """Return a bound on laps from all nodes: the dearest of the ways round by one mark. Shape (nodes,)."""
    found, back = np.zeros(len(places.nodes)), csr_matrix(there.T)
    for mark in range(places.everything.bit_length()):
        own = [at for at, shown in enumerate(places.marks) if shown >> mark & 1 and places.recurring[at]]
        if not own:
            return np.full(len(places.nodes), np.inf)
        to, onwards = (np.asarray(dijkstra(graph, indices=own, min_only=True)) for graph in (back, there))
        found = np.maximum(found, to + onwards)
    return found


def _before(places: LapPlaces, k: int, laps: Floats, steps: tuple[Floats, Numbers, Numbers]) -> Floats:
    """Return what is left from each place with laps that are begun at some home, by way of a last point that stands for them. Shape (places,)."""
    size = len(places.places)
    costs, sources, targets = steps
    homes = np.array([place for place, (at, _) in enumerate(places.places) if places.homes[at]], dtype=np.int64)
    begun = np.array([laps[places.places[place][0]] for place in homes], dtype=np.float64)
    possible = np.isfinite(begun)
    data = np.concatenate([costs[k], begun[possible]])
    rows = np.concatenate([targets, np.full(int(possible.sum()), size)])
    columns = np.concatenate([sources, homes[possible]])
    graph = csr_matrix((data, (rows, columns)), shape=(size + 1, size + 1))
    return np.asarray(dijkstra(graph, indices=size))[:-1]


def _steps(steps: Sequence[Sequence[Step]], accounts: Sequence[int]) -> tuple[Floats, Numbers, Numbers]:
    """Return what each account pays for all steps, and all on average, and from where to where they lead."""
    every = [(accounts[robot], cost, source, target) for source, own in enumerate(steps) for robot, cost, target in own]
    number = max(accounts) + 1
    payers, paid, sources, targets = zip(*every, strict=True) if every else ((), (), (), ())
    costs = np.zeros((number + 1, len(every)))
    costs[np.array(payers, dtype=np.int64), np.arange(len(every))] = paid
    costs[number] = np.array(paid) / number
    return costs, np.array(sources, dtype=np.int64), np.array(targets, dtype=np.int64)
