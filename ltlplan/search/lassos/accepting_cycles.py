"""The cheapest round that shows every mark, through one place: generalised Büchi acceptance within one component.

A round leads from a place back to it and shows each mark (one for each conjunct) on the way, in whichever order is shorter; that
is the travelling salesman's problem over sets of places. It is solved exactly by A*, where what is surely left is bounded over
the sets alone: by all orders of them (Held and Karp 1962) where they are few, by spanning trees with tolls
(Held and Karp 1970) where they are many. Where the states of the search are used up, the best round of a local search stands, with the
bound that was proved.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.search.lassos.order_bounds import Floats, LeastTrees, least_orders, needed

MOST_ORDERED = 15
"""Sets of places up to which the bound is over all their orders: 2^15 subsets."""
_GRAIN = 1e-9  # m; bounds that differ by less are ties, in which the search goes on with the longest way


@dataclass(frozen=True, slots=True)
class Round:
    """A way round, from home to just before home; no places where none is known.

    Attributes:
        places: In order.
        cost: Way there and the weighted round; infinite where none is known.
        bound: No round through this home costs less.
        explored: States that were expanded.
    """

    places: tuple[int, ...]
    cost: float
    bound: float
    explored: int


class Rounds:
    """The rounds of one strongly connected component.

    Attributes:
        homes: Places at least one of which is on every round.
        there, weight, edges: What was given; the steps from each place as pairs (target, cost).
        least: Cost of the cheapest way to any place.
        everything: All sets to come to, as bits; the homes' own is none of them.
        shown: The sets that each place is in, as bits.

    Args:
        graph: Costs of steps between the component's places, all positive.
        there: Cost of the cheapest way to each place. Shape (places,).
        marks: What each place shows, as bits.
        count: How many marks there are; each is shown somewhere.
        weight: How many times a round's own cost counts.
    """

    def __init__(self, graph: csr_matrix, there: Floats, marks: Sequence[int], count: int, weight: float) -> None:
        self.there, self.weight, self.least = there, weight, float(there.min())
        self._back = csr_matrix(graph.T)
        self.edges = [
            list(zip(graph.indices[a:b].tolist(), graph.data[a:b].tolist(), strict=True))
            for a, b in itertools.pairwise(list(graph.indptr))
        ]
        sets = needed([frozenset(p for p, shown in enumerate(marks) if shown >> mark & 1) for mark in range(count)])
        home, *self._sets = sorted(sets or [frozenset(range(len(marks)))], key=lambda each: (len(each), min(each)))
        self.homes = sorted(home, key=lambda place: (there[place], place))
        self.shown = [sum(1 << k for k, own in enumerate(self._sets) if place in own) for place in range(len(marks))]
        self.everything = (1 << len(self._sets)) - 1
        self._to = np.array([self.distance(sorted(own)) for own in self._sets]).reshape(len(self._sets), len(marks))
        homewards = self.distance(self.homes)
        count = len(self._sets)
        self._apart = np.array([[to[sorted(own)].min() for to in self._to] for own in self._sets]).reshape(count, count)
        self._after = np.array([homewards[sorted(own)].min() for own in self._sets], dtype=np.float64)
        back = [np.asarray(dijkstra(graph, indices=sorted(own), min_only=True), dtype=np.float64) for own in self._sets]
        self._around = np.max([np.zeros(len(marks)), *(to + after for to, after in zip(self._to, back, strict=True))], axis=0)
        few = count <= MOST_ORDERED
        self._left: Callable[[int], Floats] = (
            least_orders(self._apart, self._after) if few else LeastTrees(self._apart, self._after)
        )
        self._known: dict[tuple[int, int], float] = {}

    def through(self, home: int, limit: float, states: int) -> Round:
        """Return the round through one home for which way there + weight * round is least, if that is below the limit.

        Where the states do not suffice, it is the best one known.

        Args:
            home: The place where the round begins and ends.
            limit: The cost to be below.
            states: How many states may be expanded.
        """
        if self.at_least(home) >= limit:
            return Round((), np.inf, limit, 1)
        search = _Search(self, home, limit)
        explored = 0
        while search.heap:
            bound, cost, state = search.pop()
            if state == _GOAL:
                return Round(search.way(), cost, cost, explored)
            if cost > search.best[state]:
                continue
            explored += 1
            if explored > states:
                known = self._by_local_search(home, search.homewards)
                return Round(known, self._cost(known), min(bound, self._cost(known)), explored)
            search.expand(state, cost)
        return Round((), np.inf, limit, explored)

    def remaining(self, place: int, left: int, homewards: Floats) -> float:
        """Return a lower bound on what is left of a round from a place, with some sets still to come to; `homewards` leads home.

        Args:
            place: Where the round has come to.
            left: The sets still to come to, as bits.
            homewards: Cost of the cheapest way home from each place. Shape (places,).
        """
        if not left:
            return float(homewards[place])
        key = (place, left)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = float(np.min(self._to[:, place] + self._left(left)))
        return found

    def at_least(self, home: int) -> float:
        """Return a lower bound on the cost of every round through a home: the way there and the weighted round.

        Args:
            home: The place where the round begins and ends.
        """
        left = self.everything & ~self.shown[home]
        onwards = self.remaining(home, left, self._around) if left else 0.0
        lap = max(min(cost for _, cost in self.edges[home]), float(self._around[home]), onwards) - _GRAIN
        entered = self.least + self.weight * lap
        if self.weight < 1.0:
            return entered
        # from where a round is entered it comes home, so that way there and one lap are no shorter than the way home
        return max(entered, float(self.there[home]) - _GRAIN + (self.weight - 1.0) * lap)

    def distance(self, goals: Sequence[int]) -> Floats:
        """Return the cost of the cheapest way from each place to the nearest of some."""
        return np.asarray(dijkstra(self._back, indices=list(goals), min_only=True), dtype=np.float64)

    def _cost(self, places: Sequence[int]) -> float:
        steps = itertools.pairwise((*places, places[0]))
        lap = sum(min(cost for target, cost in self.edges[a] if target == b) for a, b in steps)
        return float(self.there[list(places)].min()) + self.weight * lap

    def _by_local_search(self, home: int, homewards: Floats) -> tuple[int, ...]:
        """Return a good round: sets in an order that no move of up to three neighbours and no reversal makes shorter."""
        start = np.array([to[home] for to in self._to])
        order: list[int] = []
        while len(order) < len(self._sets):
            near = start if not order else self._apart[order[-1]]
            order.append(min((k for k in range(len(self._sets)) if k not in order), key=lambda k: (near[k], k)))
        length = self._length(order, start)
        improving = True
        while improving:
            improving = False
            for other in _neighbours(order):
                shorter = self._length(other, start)
                if shorter < length - _GRAIN:
                    order, length, improving = other, shorter, True
                    break
        places, left = [home], self.everything & ~self.shown[home]
        for k in order:
            if left >> k & 1:
                for place in self._way(places[-1], self._sets[k]):
                    places.append(place)
                    left &= ~self.shown[place]
        if len(places) == 1:
            places.append(min(self.edges[home], key=lambda edge: (edge[1] + homewards[edge[0]], edge[0]))[0])
        places.extend(self._way(places[-1], (home,)))
        return tuple(places[:-1])

    def _length(self, order: Sequence[int], start: Floats) -> float:
        if not order:
            return 0.0
        return float(start[order[0]] + self._apart[order[:-1], order[1:]].sum() + self._after[order[-1]])

    def _way(self, place: int, goals: Iterable[int]) -> list[int]:
        """Return the cheapest way from a place to the nearest of some, without the place itself.

        Its steps are remembered, not told from costs that are left: next to large ones the tiny cost of a hover is none.
        """
        costs, before = dijkstra(self._back.T, indices=place, return_predecessors=True)
        way = [min(goals, key=lambda goal: (costs[goal], goal))]
        while way[-1] != place:
            way.append(int(before[way[-1]]))
        return way[-2::-1]


_State = tuple[int, int, bool]
"""Place, sets still to come to as bits, and whether the lap has begun: at any place of a round the way there may end."""
_GOAL: _State = (-1, 0, True)


class _Search:
    """A* for one round: what is open, the least costs so far and where they come from.

    Not a `BestFirst`: bounds are equal within a grain, of which the farthest on its way comes first and may come again.
    """

    def __init__(self, rounds: Rounds, home: int, limit: float) -> None:
        self.rounds, self.home, self.limit = rounds, home, limit
        self.homewards = rounds.distance([home])
        self.best: dict[_State, float] = {}
        self.parents: dict[_State, _State] = {}
        self.heap: list[tuple[float, float, _State]] = []
        self._push(None, (home, rounds.everything & ~rounds.shown[home], False), 0.0)

    def pop(self) -> tuple[float, float, _State]:
        """Return bound, cost and state of what is open with the least bound; of several, the farthest on its way."""
        bound, minus, state = heapq.heappop(self.heap)
        return bound, -minus, state

    def expand(self, state: _State, cost: float) -> None:
        """Open what follows a state."""
        place, left, entered = state
        rounds = self.rounds
        if not entered:
            self._push(state, (place, left, True), cost + rounds.there[place])
        for target, step in rounds.edges[place]:
            total, still = cost + rounds.weight * step, left & ~rounds.shown[target]
            if (
                target == self.home and not still
            ):  # round; one that has not begun its lap begins it at home as well from the start
                if entered:
                    self._push(state, _GOAL, total)
                continue
            self._push(state, (target, still, entered), total)

    def way(self) -> tuple[int, ...]:
        """Return the places from home to just before the goal; to begin the lap is no step."""
        states = [_GOAL]
        while states[-1] in self.parents:
            states.append(self.parents[states[-1]])
        states.reverse()
        return (self.home, *(after[0] for before, after in itertools.pairwise(states[:-1]) if before[2] == after[2]))

    def _push(self, source: _State | None, state: _State, cost: float) -> None:
        if cost >= self.best.get(state, np.inf):
            return
        place, left, entered = state
        bound = cost if state == _GOAL else cost + self.rounds.weight * self.rounds.remaining(place, left, self.homewards)
        bound += 0.0 if entered else self.rounds.least
        if bound < self.limit:
            self.best[state] = cost
            if source is not None:
                self.parents[state] = source
            heapq.heappush(self.heap, (float(np.floor(bound / _GRAIN)) * _GRAIN, -cost, state))


def _neighbours(order: list[int]) -> list[list[int]]:
    """Return orders with one stretch turned round, or up to three sets moved elsewhere."""
    found = []
    for a, b in itertools.combinations(range(len(order) + 1), 2):
        found.append([*order[:a], *reversed(order[a:b]), *order[b:]])
        if b - a <= 3:
            rest = [*order[:a], *order[b:]]
            found += [[*rest[:at], *order[a:b], *rest[at:]] for at in range(len(rest) + 1) if at != a]
    return found
