"""The cheapest way to satisfy a formula for ever: a prefix and a cycle (2019 paper, Section III-B; Smith et al. 2011).

A lasso is a path of the product of one robot's system with the Büchi automata of the conjuncts that comes back to where
it was after each conjunct was seen to accept. The product is walked once, within a budget of states; then each of its strongly
connected components in which every conjunct accepts is searched for its cheapest round (`rounds`), so that `G F a & G F b`
costs one round, in whichever order is shorter.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.lassos.accepting_cycles import Rounds
from ltlplan.search.lassos.team_readers import Reader
from verify.data import Letter

State = tuple[int, ...]
_Node = TypeVar("_Node")

TIE = 1e-7  # m; less than this are the tiny amounts that break ties, and what they add up to
_STEP, _HOVER = 1e-10, 1e-11


class Walkable(Protocol):
    """What is asked of a system: one robot's, or a team's that is made as it is walked."""

    @property
    def labels(self) -> Sequence[Letter]:
        """The letter that each node shows."""
        ...

    @property
    def edges(self) -> Sequence[Sequence[tuple[int, float]]]:
        """For each node, pairs (target, cost)."""
        ...

    @property
    def initial(self) -> int:
        """Where it begins."""
        ...

    @property
    def final(self) -> Mapping[int, float] | None:
        """Nodes where it may stay, each with a tiny preference; None: anywhere."""
        ...


@dataclass(frozen=True, slots=True)
class LassoRun:
    """A path that goes on for ever.

    Attributes:
        prefix: Nodes before the cycle.
        cycle: Nodes that are repeated.
        prefix_cost: Cost of the prefix, up to the first node of the cycle.
        cycle_cost: Cost of one lap.
        bound: No lasso of the product costs less, with laps weighted as they were asked for.
    """

    prefix: tuple[int, ...]
    cycle: tuple[int, ...]
    prefix_cost: float
    cycle_cost: float
    bound: float = 0.0


class _Product:
    """The product of a system and Büchi automata, made as it is walked. A hover repeats a node at next to no cost."""

    def __init__(self, system: Walkable, automata: Sequence[Reader], budget: Budget) -> None:
        self.system = system
        self.automata = automata
        self._most = min(budget.states, budget.lasso)
        self._steps: list[dict[tuple[int, Letter], tuple[int, ...]]] = [{} for _ in automata]
        self._after: dict[tuple[State, Letter], tuple[State, ...]] = {}

    def read(self, state: State, letter: Letter) -> tuple[State, ...]:
        key = (state, letter)
        found = self._after.get(key)
        if found is None:
            states: list[State] = [()]
            for automaton, memo, at in zip(self.automata, self._steps, state, strict=True):
                targets = memo.get((at, letter))
                if targets is None:
                    targets = memo[at, letter] = tuple(sorted(automaton.successors(at, letter)))
                self.check(len(states) * len(targets))
                states = [(*s, t) for s in states for t in targets]
            found = self._after[key] = tuple(states)
        return found

    def check(self, states: int) -> None:
        """Raise where there are more states than the budget allows."""
        if states > self._most:
            hint = (
                "Only the parts of a formula that are to hold again and again (`G F a`) are cheap by the dozen; each part that is to "
                "happen once (`F a`) doubles the states. Ask for less at once, or for a finite trace."
            )
            raise TooLarge("The infinite trace's product of robot and automata has", states, "states", self._most, hint)

    def accepted(self, state: State) -> int:
        """Return the conjuncts whose automata are in an accepting state, as bits."""
        return sum(1 << i for i, (a, at) in enumerate(zip(self.automata, state, strict=True)) if at in a.accepting)

    def begin(self) -> Iterator[tuple[int, State]]:
        start = tuple(automaton.initial for automaton in self.automata)
        for state in self.read(start, self.system.labels[self.system.initial]):
            yield (self.system.initial, state)

    def moves(self, node: int, state: State) -> Iterator[tuple[int, State, float]]:
        final = self.system.final
        if final is None or node in final:
            for after in self.read(state, self.system.labels[node]):
                yield node, after, _HOVER + (0.0 if final is None else final[node])
        for target, cost in self.system.edges[node]:
            for after in self.read(state, self.system.labels[target]):
                yield target, after, cost + _STEP


@dataclass(frozen=True, eq=False, slots=True)
class _Walked:
    """All places of a product that can be reached, by number.

    Attributes:
        nodes: The system's node of each place.
        marks: The conjuncts that accept there, as bits.
        there: Cost of the cheapest way. Shape (places,).
        parents: The place before on that way; -1 at the beginning.
        graph: Costs of all steps.
    """

    nodes: list[int]
    marks: list[int]
    there: NDArray[np.float64]
    parents: list[int]
    graph: csr_matrix

    def way(self, place: int) -> tuple[int, ...]:
        nodes = []
        while place >= 0:
            nodes.append(self.nodes[place])
            place = self.parents[place]
        return tuple(reversed(nodes))


def cheapest_lasso(
    system: Walkable,
    automata: Sequence[Reader],
    *,
    weight: float = 1.0,
    budget: Budget = DEFAULT_BUDGET,
    limit: float = np.inf,
) -> LassoRun | None:
    """Return a lasso for which prefix cost + weight * cycle cost is smallest, or None.

    Where there are so many conjuncts that their cheapest order is out of reach, it is a good lasso, and its `bound` is below its
    cost.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        weight: How many laps count; positive.
        budget: Bounds on the product's states, and on those expanded in search of rounds.
        limit: A lasso that costs more is not looked for.

    Raises:
        TooLarge: The product has more states than the budget allows.
    """
    walked = _walk(_Product(system, automata, budget), limit)
    best, best_cost, bound = None, limit, limit
    left = min(budget.states, budget.rounds)
    for core in _accepting_components(walked, len(automata)):
        there = walked.there[core]
        if there.min() >= best_cost:
            break
        rounds = Rounds(walked.graph[core][:, core], there, [walked.marks[p] for p in core], len(automata), weight)
        for home in rounds.homes:
            found = rounds.through(home, best_cost, max(left, 1))
            left -= found.explored
            bound = min(bound, found.bound)
            if found.cost < best_cost:
                turn = min(range(len(found.places)), key=lambda i: there[found.places[i]])
                lap = [int(core[p]) for p in (*found.places[turn:], *found.places[:turn])]
                best_cost, reached = found.cost, float(walked.there[lap[0]])
                best = LassoRun(
                    walked.way(lap[0])[:-1], tuple(walked.nodes[p] for p in lap), reached, (found.cost - reached) / weight
                )
    return None if best is None else replace(best, bound=min(bound, best_cost))


def begun_soonest(prefix: Sequence[_Node], cycle: Sequence[_Node]) -> tuple[list[_Node], list[_Node]]:
    """Return the same infinite path with its cycle begun as soon as it can be.

    Args:
        prefix: Nodes before the cycle.
        cycle: Nodes that are repeated.
    """
    once, again = list(prefix), list(cycle)
    while once and once[-1] == again[-1]:
        again = [once.pop(), *again[:-1]]
    return once, again


def lasso_exists(system: Walkable, automata: Sequence[Reader], *, budget: Budget = DEFAULT_BUDGET) -> bool:
    """Tell whether there is any lasso that all these Büchi automata accept.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        budget: Bounds on the product's states.

    Raises:
        TooLarge: The product has more states than the budget allows.
    """
    return bool(_accepting_components(_walk(_Product(system, automata, budget)), len(automata)))


def _walk(product: _Product, limit: float = np.inf) -> _Walked:
    """Walk over all of a product that can be come to within a limit on costs, the nearest places first."""
    numbers: dict[tuple[int, State], int] = {}
    places: list[tuple[int, State]] = []
    sources, targets, costs = array("i"), array("i"), array("d")

    def number_of(place: tuple[int, State]) -> int:
        number = numbers.get(place)
        if number is None:
            number = numbers[place] = len(places)
            product.check(number + 1)
            places.append(place)
        return number

    def successors(number: int) -> Iterable[tuple[int, float]]:
        steps: dict[int, float] = {}
        left = limit - search.costs[number]
        for node, state, step in product.moves(*places[number]):
            if step > left:
                continue
            target = number_of((node, state))
            steps[target] = min(step, steps.get(target, np.inf))
        sources.extend([number] * len(steps))
        targets.extend(steps)
        costs.extend(steps.values())
        return steps.items()

    search = BestFirst([number_of(place) for place in product.begin()], successors)
    for _ in search:  # every place is walked over
        pass
    size = len(places)
    there = np.array([search.costs[number] for number in range(size)])
    parents = [search.parents.get(number, -1) for number in range(size)]
    graph = csr_matrix((np.array(costs), (np.array(sources), np.array(targets))), shape=(size, size))
    marks = [product.accepted(state) for _, state in places]
    return _Walked([node for node, _ in places], marks, there, parents, graph)


def _accepting_components(walked: _Walked, count: int) -> list[NDArray[np.int64]]:
    """Return the components in which a cycle passes acceptance of every conjunct, the soonest reached first."""
    if not walked.nodes:
        return []
    _, component = connected_components(walked.graph, connection="strong")
    order = np.argsort(component, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(component[order])) + 1)
    loops = walked.graph.diagonal() > 0.0
    everything = (1 << count) - 1
    found = []
    for part in parts:
        if len(part) > 1 or loops[part[0]]:
            seen = 0
            for place in part:
                seen |= walked.marks[place]
            if seen == everything:
                found.append(np.asarray(part, dtype=np.int64))
    return sorted(found, key=lambda part: (float(walked.there[part].min()), int(part[0])))
