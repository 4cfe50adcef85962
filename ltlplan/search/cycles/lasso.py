"""The cheapest way to satisfy a formula for ever: a prefix and a cycle (2019 paper, Section III-B; Smith et al. 2011).

A lasso is a path of the product of one robot's system with the Büchi automata of the conjuncts that comes back to where
it was after each conjunct was seen to accept. The product is walked once, within a budget of states; then each of its strongly
connected components in which every conjunct accepts is searched for its cheapest round (`Rounds`), so that `G F a & G F b`
costs one round, in whichever order is shorter.

A round leads from a place back to it and shows each mark (one for each conjunct) on the way, in whichever order is shorter; that
is the travelling salesman's problem over sets of places. It is solved exactly by A*, where what is surely left is bounded over
the sets alone: by all orders of them (Held and Karp 1962) where they are few, by spanning trees with tolls
(Held and Karp 1970) where they are many. Where the states of the search are used up, a round stands that the same search finds
in haste, with the bound that was proved.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.bounds.set_orders import Floats, LeastTrees, least_orders, needed
from ltlplan.search.cycles.strong_components import components
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

State = tuple[int, ...]
_STEP, _HOVER = 1e-10, 1e-11
MOST_ORDERED = 15
"""Sets of places up to which the bound is over all their orders: 2^15 subsets."""
_HASTE = ((1.1, 20_000), (5.0, np.inf))
"""How much the bound counts where the states of the search are used up, and for how many states."""
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
            least_orders(self._apart, self._after) if few else LeastTrees(self._apart, self._after).remaining
        )

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
        homewards, weight = self.distance([home]), self.weight

        def successors(state: _Lap) -> Iterator[tuple[_Lap, float]]:
            place, left, entered = state
            if not entered:
                yield (place, left, True), float(self.there[place])
            for target, step in self.edges[place]:
                still = left & ~self.shown[target]
                if target != home or still:
                    yield (target, still, entered), weight * step
                elif entered:  # one that has not begun its cycle begins it at home as well from the start
                    yield _GOAL, weight * step

        def left_of(state: _Lap) -> float:
            place, left, entered = state
            onwards = 0.0 if state == _GOAL else weight * self.remaining(place, left, homewards)
            return onwards + (0.0 if entered else self.least)

        begin = home, self.everything & ~self.shown[home], False
        search = BestFirst([begin], successors, left_of, ties="farthest")
        explored = 0
        for state, cost, bound in search:
            if bound >= limit:
                break
            if state == _GOAL:
                return self._round(search, cost, explored)
            explored += 1
            if explored > states:
                return self._in_haste(begin, successors, left_of, bound, explored)
        return Round((), np.inf, limit, explored)

    def _in_haste(
        self, begin: _Lap, successors: _Successors, left_of: Callable[[_Lap], float], bound: float, explored: int
    ) -> Round:
        """Return the first round of a search in which bounds count more, or much more where that takes long."""
        for weight, most in _HASTE:
            search = BestFirst([begin], successors, left_of, ties="farthest", weight=weight)
            for number, (state, _, _) in enumerate(search):
                if state == _GOAL:
                    return self._round(search, bound, explored)
                if number >= most:
                    break
        raise AssertionError("places of one component lead to each other")

    def _round(self, search: BestFirst[_Lap], bound: float, explored: int) -> Round:
        """Return the round that a search found, begun where that is nearest; to begin it is no step."""
        steps = list(itertools.pairwise(search.path(_GOAL)[:-1]))
        places = (steps[0][0][0], *(after[0] for before, after in steps if before[2] == after[2]))
        begun = next(before[0] for before, after in steps if before[2] != after[2])
        cost = search.costs[_GOAL] - float(self.there[begun]) + float(self.there[list(places)].min())
        return Round(places, cost, min(bound, cost), explored)

    def remaining(self, place: int, left: int, homewards: Floats) -> float:
        """Return a lower bound on what is left of a round from a place, with some sets still to come to; `homewards` leads home.

        Args:
            place: Where the round has come to.
            left: The sets still to come to, as bits.
            homewards: Cost of the cheapest way home from each place. Shape (places,).
        """
        return self._least_onwards(place, left) if left else float(homewards[place])

    @memoized
    def _least_onwards(self, place: int, left: int) -> float:
        return float(np.min(self._to[:, place] + self._left(left)))

    def at_least(self, home: int) -> float:
        """Return a lower bound on the cost of every round through a home: the way there and the weighted round.

        Args:
            home: The place where the round begins and ends.
        """
        left = self.everything & ~self.shown[home]
        onwards = self.remaining(home, left, self._around) if left else 0.0
        lap = max(min(cost for _, cost in self.edges[home]), float(self._around[home]), onwards) - _GRAIN
        # from where a round is entered it comes home, so that way there and one lap are no shorter than the way home
        return max(self.least + self.weight * lap, float(self.there[home]) - _GRAIN + (self.weight - 1.0) * lap)

    def distance(self, goals: Sequence[int]) -> Floats:
        """Return the cost of the cheapest way from each place to the nearest of some."""
        return np.asarray(dijkstra(self._back, indices=list(goals), min_only=True), dtype=np.float64)


_Lap = tuple[int, int, bool]
"""Place, sets still to come to as bits, and whether the lap has begun: at any place of a round the way there may end."""
_GOAL: _Lap = (-1, 0, True)
_Successors = Callable[[_Lap], Iterator[tuple[_Lap, float]]]


@dataclass(frozen=True, slots=True)
class LassoRun:
    """A path that goes on for ever.

    Attributes:
        prefix: Nodes before the cycle.
        cycle: Nodes that are repeated.
        prefix_cost: Cost of the prefix, up to the first node of the cycle.
        cycle_cost: Cost of one cycle.
        bound: No lasso of the product costs less, with cycles weighted as they were asked for.
    """

    prefix: tuple[int, ...]
    cycle: tuple[int, ...]
    prefix_cost: float
    cycle_cost: float
    bound: float = 0.0

    def cost(self, weight: float) -> float:
        """Return the cost of the prefix and so many cycles."""
        return self.prefix_cost + weight * self.cycle_cost


class _Product:
    """The product of a system and Büchi automata: all places that can be reached, by number, the nearest first. A hover repeats a node at next to no cost.

    Attributes:
        marks: The conjuncts that accept at each place, as bits.
        there: Cost of the cheapest way. Shape (places,).
        graph: Costs of all steps.
    """

    def __init__(self, system: TransitionSystem, automata: Sequence[Automaton], budget: Budget) -> None:
        self._system, self._automata, self._most = system, automata, min(budget.states, budget.lasso)
        self._places: Numbers[tuple[int, State]] = Numbers()
        sources, targets, costs = array("i"), array("i"), array("d")

        def onwards(number: int) -> Iterable[tuple[int, float]]:
            steps: dict[int, float] = {}
            for node, state, step in self._moves(*self._places.known[number]):
                target = self._number(node, state)
                steps[target] = min(step, steps.get(target, np.inf))
            sources.extend([number] * len(steps))
            targets.extend(steps)
            costs.extend(steps.values())
            return steps.items()

        first = tuple(automaton.initial for automaton in automata)
        begin = [self._number(system.initial, state) for state in self._read_letter(first, system.labels[system.initial])]
        self._search = BestFirst(begin, onwards).walked()
        size = len(self._places)
        self.there = np.array([self._search.costs[number] for number in range(size)])
        self.graph = csr_matrix((np.array(costs), (np.array(sources), np.array(targets))), shape=(size, size))
        self.marks = [
            sum(1 << i for i, (own, at) in enumerate(zip(automata, state, strict=True)) if at in own.accepting)
            for _, state in self._places.known
        ]

    def nodes(self, places: Iterable[int]) -> tuple[int, ...]:
        """Return the system's node of each place."""
        return tuple(self._places.known[place][0] for place in places)

    def way(self, place: int) -> tuple[int, ...]:
        """Return the nodes of the cheapest way to a place."""
        return self.nodes(self._search.path(place))

    def accepting_components(self) -> list[NDArray[np.int64]]:
        """Return the components in which a cycle passes acceptance of every conjunct, the soonest reached first."""
        everything = (1 << len(self._automata)) - 1
        found = [part for part in components(self.graph) if reduce(or_, (self.marks[place] for place in part)) == everything]
        return sorted(found, key=lambda part: (float(self.there[part].min()), int(part[0])))

    def _number(self, node: int, state: State) -> int:
        number = self._places[node, state]
        self._check(number + 1)
        return number

    @memoized
    def _read_letter(self, state: State, letter: Letter) -> tuple[State, ...]:
        targets = [self._successors(index, at, letter) for index, at in enumerate(state)]
        self._check(math.prod(map(len, targets)))
        return tuple(itertools.product(*targets))

    @memoized
    def _successors(self, index: int, at: int, letter: Letter) -> list[int]:
        return sorted(self._automata[index].successors(at, letter))

    def _check(self, states: int) -> None:
        if states > self._most:
            hint = (
                "Only the parts of a formula that are to hold again and again (`G F a`) are cheap by the dozen; each part that is to "
                "happen once (`F a`) doubles the states. Ask for less at once, or for a finite trace."
            )
            raise TooLarge("The infinite trace's product of robot and automata has", states, "states", self._most, hint)

    def _moves(self, node: int, state: State) -> Iterator[tuple[int, State, float]]:
        final, labels = self._system.final, self._system.labels
        hover = () if final is not None and node not in final else ((node, _HOVER + (final[node] if final else 0.0), 0.0),)
        for target, cost, more in (*hover, *((target, cost, _STEP) for target, cost in self._system.edges[node])):
            for after in self._read_letter(state, labels[target]):
                yield target, after, cost + more


def cheapest_lasso(
    system: TransitionSystem,
    automata: Sequence[Automaton],
    *,
    weight: float = 1.0,
    budget: Budget = DEFAULT_BUDGET,
) -> LassoRun | None:
    """Return a lasso for which prefix cost + weight * cycle cost is smallest, or None.

    Where there are so many conjuncts that their cheapest order is out of reach, it is a good lasso, and its `bound` is below its
    cost.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        weight: How many cycles count; positive.
        budget: Bounds on the product's states, and on those expanded in search of rounds.

    Raises:
        TooLarge: The product has more states than the budget allows.
    """
    product = _Product(system, automata, budget)
    best, best_cost, bound = None, np.inf, np.inf
    left = min(budget.states, budget.rounds)
    for core in product.accepting_components():
        there = product.there[core]
        if there.min() >= best_cost:
            break
        rounds = Rounds(product.graph[core][:, core], there, [product.marks[p] for p in core], len(automata), weight)
        for home in rounds.homes:
            found = rounds.through(home, best_cost, max(left, 1))
            left -= found.explored
            bound = min(bound, found.bound)
            if found.cost < best_cost:
                turn = min(range(len(found.places)), key=lambda i: there[found.places[i]])
                lap = [int(core[p]) for p in (*found.places[turn:], *found.places[:turn])]
                best_cost, reached = found.cost, float(product.there[lap[0]])
                best = LassoRun(product.way(lap[0])[:-1], product.nodes(lap), reached, (found.cost - reached) / weight)
    return None if best is None else replace(best, bound=min(bound, best_cost))


def begun_soonest(prefix: tuple[int, ...], cycle: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the same infinite path with its cycle begun as soon as it can be.

    Args:
        prefix: Nodes before the cycle.
        cycle: Nodes that are repeated.
    """
    while prefix and prefix[-1] == cycle[-1]:
        prefix, cycle = prefix[:-1], (cycle[-1], *cycle[:-1])
    return prefix, cycle
