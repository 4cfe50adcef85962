"""The cheapest way to satisfy a formula for ever: a prefix and a cycle (2019 paper, Section III-B; Smith et al. 2011).

A lasso is a path of the product of one robot's system with the Büchi automata of the conjuncts that comes back to where
it was after each conjunct was seen to accept. The product is walked once, within a budget of states; then each of its strongly
connected components in which every conjunct accepts is searched for its cheapest round (`rounds`), so that `G F a & G F b`
costs one round, in whichever order is shorter.
"""

from __future__ import annotations

import itertools
import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.cycles.accepting_cycles import Rounds
from ltlplan.search.cycles.strong_components import components
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

State = tuple[int, ...]

_STEP, _HOVER = 1e-10, 1e-11


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
        self._search = BestFirst(begin, onwards)
        for _ in self._search:  # every place is walked over
            pass
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
