"""Lower bounds on what some of a team's robots still pay on average, before their laps and in them.

Whoever of a team pays most pays at least as much as any few of its robots on average. For these alone the least is found by shortest ways: of a lap
over all nodes of the robots and the marks that were shown, of what comes before it over all places, with a bound on the lap that is begun.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.search.lassos.lap_places import LapPlaces, Step
from ltlplan.search.lassos.order_bounds import Floats

MOST_POINTS = 60_000
"""Nodes times sets of marks over which laps are bounded; of more marks only the rarest are asked for."""

FEW_ROBOTS = 4
"""Up to so many all subsets of the team are bounded, of more each robot and the whole team."""


class LapBounds:
    """Lower bounds on what subsets of the robots still pay on average.

    Attributes:
        subsets: Of robots, by number; each robot, then more of them, all at last.
        begun: For each node of the robots a bound on laps that begin there, before `lap` says more. Shape (nodes, subsets).
        before: For each place what is left when laps have not begun. Shape (places, subsets).

    Args:
        places: Where the team can be.
        robots: How many it has.
        weight: How many laps count.
    """

    def __init__(self, places: LapPlaces, robots: int, weight: float) -> None:
        sizes = range(1, robots + 1) if robots <= FEW_ROBOTS else (1, robots)
        self.subsets = [some for size in sizes for some in itertools.combinations(range(robots), size)]
        self._size, self._weight = len(places.nodes), weight
        count, self._kept = places.everything.bit_length(), 0
        while self._kept < count and self._size << (self._kept + 1) <= MOST_POINTS:
            self._kept += 1
        self._marks = np.array(places.marks, dtype=np.int64) & ((1 << self._kept) - 1)
        lasting = [[step for step in steps if places.lasting[step[2]]] for steps in places.steps]
        self._robots, costs, sources, targets = _arrays(lasting)
        single = [self._costs(costs, self._robots, some) for some in self.subsets]
        shape = (self._size, self._size)
        back = [csr_matrix((own, (targets, sources)), shape=shape) for own in single]
        self._back = [self._with_marks(own, sources, targets) for own in single]
        self.begun = weight * self._through_each_mark(back, [csr_matrix(own.T) for own in back], places)
        self.before = self._left_before(places)

    def lap(self, home: int) -> Floats:
        """Return what is left of a lap from each node and set of marks, at `nodes << marks | shown` as `point` says. Shape (points, subsets).

        Args:
            home: The number of the nodes where it begins and ends.
        """
        goal = self.point(home, (1 << self._kept) - 1)
        return self._weight * np.stack([dijkstra(graph, indices=goal) for graph in self._back], axis=1)

    def point(self, at: int, shown: int) -> int:
        """Return where the bound of a lap stands.

        Args:
            at: The number of the nodes that the team has come to.
            shown: The marks that it has shown.
        """
        return at << self._kept | shown & ((1 << self._kept) - 1)

    @staticmethod
    def _costs(costs: Floats, robots: Sequence[int], some: tuple[int, ...]) -> Floats:
        return np.where(np.isin(robots, some), costs / len(some), 0.0)

    def _with_marks(self, costs: Floats, sources: Sequence[int], targets: Sequence[int]) -> csr_matrix:
        """Return the steps of laps turned round, over nodes and sets of marks."""
        sets = np.arange(1 << self._kept)
        begin = (np.array(sources, dtype=np.int64)[:, None] << self._kept) | sets
        after = np.array(targets, dtype=np.int64)
        end = (after[:, None] << self._kept) | sets | self._marks[after][:, None]
        data = np.repeat(costs, len(sets))
        size = self._size << self._kept
        return csr_matrix((data, (end.ravel(), begin.ravel())), shape=(size, size))

    def _through_each_mark(self, back: list[csr_matrix], there: list[csr_matrix], places: LapPlaces) -> Floats:
        """Return a bound on laps from all nodes: the dearest of the ways round by one mark. Shape (nodes, subsets)."""
        found = np.zeros((self._size, len(self.subsets)))
        for mark in range(places.everything.bit_length()):
            own = [at for at, shown in enumerate(places.marks) if shown >> mark & 1]
            for k in range(len(self.subsets)):
                if not own:
                    found[:, k] = np.inf
                    continue
                to, onwards = (dijkstra(graph, indices=own, min_only=True) for graph in (back[k], there[k]))
                found[:, k] = np.maximum(found[:, k], to + onwards)
        return found

    def _left_before(self, places: LapPlaces) -> Floats:
        size = len(places.places)
        robots, costs, sources, targets = _arrays(places.ways)
        homes = [place for place, (at, _) in enumerate(places.places) if places.homes[at]]
        begun = [places.places[place][0] for place in homes]
        found = np.full((size, len(self.subsets)), np.inf)
        for k, some in enumerate(self.subsets):
            lap = self.begun[begun, k]
            data = np.concatenate([self._costs(costs, robots, some), lap[np.isfinite(lap)]])
            rows = np.concatenate([targets, np.full(int(np.isfinite(lap).sum()), size)])
            columns = np.concatenate([sources, np.array(homes, dtype=np.int64)[np.isfinite(lap)]])
            graph = csr_matrix((data, (rows, columns)), shape=(size + 1, size + 1))
            found[:, k] = np.asarray(dijkstra(graph, indices=size))[:-1]
        return found


def _arrays(steps: Sequence[Sequence[Step]]) -> tuple[np.ndarray, Floats, np.ndarray, np.ndarray]:
    """Return who moves, what it pays, from where, and where to, of all steps."""
    every = [(robot, cost, source, target) for source, own in enumerate(steps) for robot, cost, target in own]
    robots, costs, sources, targets = zip(*every, strict=True) if every else ((), (), (), ())
    return (
        np.array(robots, dtype=np.int64),
        np.array(costs),
        np.array(sources, dtype=np.int64),
        np.array(targets, dtype=np.int64),
    )
