"""Lower bounds on the costs that each robot of a team, or the team in all, pays for its share of what cycles are to show.

Each mark is shown by some robots, each at some of its nodes. Whatever the cycles, every mark falls to such robots, and each of them comes to its
nodes in its own system and then home. So the least is found over all ways to share the marks out, with ways of single robots alone.

`bounds_before` takes shortest ways over all places of the team, before its cycles and in them. It knows what the formula forbids and what it remembers, where shares know that nobody can be in two places. Without it searches for cycles of three and
four robots take a fifth longer.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import reduce
from operator import or_

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.search.bounds.set_orders import Floats
from ltlplan.search.cycles.cycle_places import CyclePlaces
from ltlplan.search.cycles.team_system import Nodes, TeamSystem
from ltlplan.search.memoization import memoized
from ltlplan.systems.transition_systems import TransitionSystem

MOST_SHARES = 512
"""Ways to share marks out that are compared; of more the marks come in that are shown at the fewest nodes."""
MOST_ERRANDS = 8
"""Sets of its nodes that one robot may have to come to; marks that bring more are left out."""
_Option = tuple[tuple[int, frozenset[int]], ...]
"""Robots that show a mark together, each with the nodes where it does so."""


class CycleShares:
    """Lower bounds on what each account still pays, for every way to share out the marks that are left.

    Args:
        system: The team's.
        places: Where the team can be.
        weight: How many cycles count.
    """

    def __init__(self, system: TeamSystem, places: CyclePlaces, weight: float) -> None:
        self._robots, self._everything, self._accounts = len(system.systems), places.everything, places.limits.accounts
        self._errands: list[list[frozenset[int]]] = [[] for _ in range(self._robots)]  # of each robot
        self._options: dict[int, list[tuple[int, ...]]] = {}  # by mark: for each option the errands of every robot, as bits
        self._choose(places)
        self._own = [
            _Robot(own, system.rests[robot], errands, weight)
            for robot, (own, errands) in enumerate(zip(system.systems, self._errands, strict=True))
        ]

    def of_cycle(self, home: Nodes, nodes: Nodes, shown: int) -> Floats:
        """Return what each account still pays in a cycle. Shape (shares, accounts).

        Args:
            home: Where the cycle begins and ends.
            nodes: Where the robots have come to.
            shown: The marks that they have shown, as bits.
        """
        shares = self._share_out(self._everything & ~shown)
        return self._by_account(
            [own.cycle(h)[n][shares[:, k]] for k, (own, h, n) in enumerate(zip(self._own, home, nodes, strict=True))]
        )

    def before(self, nodes: Nodes) -> Floats:
        """Return what each account still pays when cycles have not begun. Shape (shares, accounts).

        Args:
            nodes: Where the robots have come to.
        """
        shares = self._share_out(self._everything)
        return self._by_account([own.before[n][shares[:, k]] for k, (own, n) in enumerate(zip(self._own, nodes, strict=True))])

    def _by_account(self, costs: Sequence[Floats]) -> Floats:
        """Return what accounts pay, of what each robot does, for each share; only the least where all pay from one."""
        paid = np.zeros((len(costs[0]), max(self._accounts) + 1))
        for account, own in zip(self._accounts, costs, strict=True):
            paid[:, account] += own
        return paid if paid.shape[1] > 1 else paid.min(axis=0, keepdims=True)

    def _choose(self, places: CyclePlaces) -> None:
        """Find out how marks may be shown, for as many as can be shared out."""
        count = 1
        for mark in range(places.everything.bit_length()):  # those at the fewest nodes come first
            options = _options(places, mark, self._robots)
            missing = [
                {nodes for option in options for robot, nodes in option if robot == k} - set(self._errands[k])
                for k in range(self._robots)
            ]
            if not options or count * len(options) > MOST_SHARES:
                continue
            if any(len(own) + len(more) > MOST_ERRANDS for own, more in zip(self._errands, missing, strict=True)):
                continue
            count *= len(options)
            for own, more in zip(self._errands, missing, strict=True):
                own.extend(sorted(more, key=sorted))
            self._options[mark] = [
                tuple(
                    sum(1 << self._errands[k].index(nodes) for robot, nodes in option if robot == k)
                    for k in range(self._robots)
                )
                for option in options
            ]

    @memoized
    def _share_out(self, left: int) -> NDArray[np.int64]:
        """Return the errands of each robot, as bits, for every way to share marks out. Shape (shares, robots)."""
        some = [options for mark, options in self._options.items() if left >> mark & 1]
        rows = {tuple(reduce(or_, errands) for errands in zip(*chosen, strict=True)) for chosen in itertools.product(*some)}
        return np.array(sorted(rows) if some else [(0,) * self._robots], dtype=np.int64)


class _Robot:
    """Least costs of one robot for errands.

    Attributes:
        before: For each node and set of errands, by bits, what it pays before cycles and in them. Shape (nodes, sets).
    """

    def __init__(
        self, system: TransitionSystem, rests: Sequence[bool], errands: Sequence[frozenset[int]], weight: float
    ) -> None:
        self._sets, self._weight = 1 << len(errands), weight
        size = len(system.labels)
        self._done = np.array([sum(1 << k for k, own in enumerate(errands) if node in own) for node in range(size)])
        self._back = self._graph(system)
        homes = [node for node in range(size) if rests[node]]
        cycle = np.stack([self.cycle(home)[home] for home in homes])
        ways = np.stack([self._to(home)[:, -1] for home in homes], axis=1)  # with all errands done: the way alone
        self.before: Floats = (ways[:, :, None] + cycle[None, :, :]).min(axis=1)

    @memoized
    def cycle(self, home: int) -> Floats:
        """Return what is left of a cycle from each node for each set of errands, by bits. Shape (nodes, sets)."""
        to, sets = self._to(home), np.arange(self._sets)
        done = (self._sets - 1 - sets)[None, :] | self._done[:, None]
        return self._weight * np.take_along_axis(to, done, axis=1)

    def _graph(self, system: TransitionSystem) -> csr_matrix:
        """Return the steps turned round, over nodes and sets of errands that were done."""
        steps: dict[tuple[int, int], float] = {}
        for source, edges in enumerate(system.edges):
            for target, cost in edges:
                steps[source, target] = min(cost, steps.get((source, target), np.inf))
        sources, targets = (np.array([step[k] for step in steps], dtype=np.int64) for k in (0, 1))
        sets = np.arange(self._sets)
        begin = sources[:, None] * self._sets + sets
        end = targets[:, None] * self._sets + (sets | self._done[targets][:, None])
        data = np.repeat(np.array(list(steps.values()), dtype=np.float64), self._sets)
        size = len(system.labels) * self._sets
        return csr_matrix((data, (end.ravel(), begin.ravel())), shape=(size, size))

    def _to(self, home: int) -> Floats:
        """Return the cost of the cheapest way home from each node and set of errands that were done. Shape (nodes, sets)."""
        found = dijkstra(self._back, indices=home * self._sets + self._sets - 1)
        return np.asarray(found).reshape(-1, self._sets)


def _options(places: CyclePlaces, mark: int, robots: int) -> list[_Option]:
    """Return by whom a mark may be shown: few robots each at some nodes, so that each time that it is shown such robots are there."""
    lasting = [
        (nodes, shown >> mark & 1)
        for nodes, shown, stays in zip(places.nodes, places.marks, places.recurring, strict=True)
        if stays
    ]
    left = {nodes for nodes, shown in lasting if shown}
    found: list[_Option] = []
    for size in range(1, robots + 1):
        for some in itertools.combinations(range(robots), size):
            never = {tuple(nodes[k] for k in some) for nodes, shown in lasting if not shown}
            own = {nodes for nodes in left if tuple(nodes[k] for k in some) not in never}
            if own:
                found.append(tuple((k, frozenset(nodes[k] for nodes in own)) for k in some))
        left -= {nodes for nodes in left for option in found if all(nodes[k] in own for k, own in option)}
    return found


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
