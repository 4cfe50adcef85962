"""The cheapest way to satisfy a formula for ever: a prefix and a cycle (2019 paper, Section III-B; Smith et al. 2011).

A lasso is a path of the product of one robot's system with the Büchi automata of the conjuncts that comes back to where
it was after each conjunct was seen to accept. Which conjuncts have accepted since the cycle began is part of the state, so
that `G F a & G F b` costs one round, in whichever order is shorter.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.automata import Automaton
from ltlplan.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.systems import TransitionSystem
from verify.data import Letter

State = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class LassoRun:
    """A path that goes on for ever.

    Attributes:
        prefix: Nodes before the cycle.
        cycle: Nodes that are repeated.
        prefix_cost: Cost of the prefix, up to the first node of the cycle.
        cycle_cost: Cost of one lap.
    """

    prefix: tuple[int, ...]
    cycle: tuple[int, ...]
    prefix_cost: float
    cycle_cost: float


class _Product:
    """The product of a system and Büchi automata, made as it is walked. A hover repeats a node at no cost."""

    def __init__(self, system: TransitionSystem, automata: Sequence[Automaton]) -> None:
        self.system = system
        self.automata = automata
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
                states = [(*s, t) for s in states for t in targets]
            found = self._after[key] = tuple(states)
        return found

    def accepted(self, state: State) -> int:
        """Return the conjuncts whose automata are in an accepting state, as bits."""
        return sum(1 << i for i, (a, at) in enumerate(zip(self.automata, state, strict=True)) if at in a.accepting)

    def begin(self) -> Iterator[tuple[int, State]]:
        start = tuple(automaton.initial for automaton in self.automata)
        for state in self.read(start, self.system.labels[self.system.initial]):
            yield (self.system.initial, state)

    def moves(self, node: int, state: State) -> Iterator[tuple[int, State, float]]:
        if self.system.final is None or node in self.system.final:
            for after in self.read(state, self.system.labels[node]):
                yield node, after, 0.0
        for target, cost in self.system.edges[node]:
            for after in self.read(state, self.system.labels[target]):
                yield target, after, cost + 1e-10


def cheapest_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], *, weight: float = 1.0, budget: Budget = DEFAULT_BUDGET
) -> LassoRun | None:
    """Return a lasso for which prefix cost + weight * cycle cost is smallest, or None.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        weight: How many laps count.
        budget: Bound on the states expanded.

    Raises:
        TooLarge: The budget was used up.
    """
    product = _Product(system, automata)
    reached, parents = _from_start(product, budget)
    best: LassoRun | None = None
    best_cost = float("inf")
    spent = len(reached)
    core = _cores(product, reached)
    for home, cost in sorted(reached.items(), key=lambda item: (item[1], item[0])):
        if cost >= best_cost:
            break
        if home not in core or not product.accepted(home[1]) & 1:
            continue
        limit = (best_cost - cost) / weight if weight > 0 else float("inf")
        found = _cycle(product, home, limit, budget.states - spent)
        spent += found.explored
        if found.places:  # the lap may begin wherever on it the robot can be soonest
            turn = min(range(len(found.places)), key=lambda i: reached[found.places[i]])
            lap = (*found.places[turn:], *found.places[:turn])
            total = reached[lap[0]] + weight * found.cost
            if total < best_cost:
                best_cost = total
                best = LassoRun(_walk(parents, lap[0])[:-1], tuple(n for n, _ in lap), reached[lap[0]], found.cost)
    return best


def lasso_exists(system: TransitionSystem, automata: Sequence[Automaton], *, budget: Budget = DEFAULT_BUDGET) -> bool:
    """Tell whether there is any lasso that all these Büchi automata accept."""
    product = _Product(system, automata)
    return bool(_cores(product, _from_start(product, budget)[0]))


_Place = tuple[int, State]


def _from_start(product: _Product, budget: Budget) -> tuple[dict[_Place, float], dict[_Place, _Place | None]]:
    best: dict[_Place, float] = {}
    parents: dict[_Place, _Place | None] = {}
    heap: list[tuple[float, _Place]] = []
    for place in product.begin():
        best[place] = 0.0
        parents[place] = None
        heap.append((0.0, place))
    heapq.heapify(heap)
    closed: dict[_Place, float] = {}
    while heap:
        cost, place = heapq.heappop(heap)
        if place in closed:
            continue
        closed[place] = cost
        if len(closed) > budget.states:
            raise TooLarge("The search needs", len(closed), "states", budget.states)
        for node, state, step in product.moves(*place):
            target = (node, state)
            if cost + step < best.get(target, float("inf")):
                best[target] = cost + step
                parents[target] = place
                heapq.heappush(heap, (cost + step, target))
    return closed, parents


def _cores(product: _Product, reached: dict[_Place, float]) -> set[_Place]:
    """Return the places that lie on a cycle in which every conjunct accepts."""
    import networkx

    graph = networkx.DiGraph((place, (n, s)) for place in reached for n, s, _ in product.moves(*place))
    everything = (1 << len(product.automata)) - 1
    core: set[_Place] = set()
    for component in networkx.strongly_connected_components(graph):
        one = next(iter(component))
        if len(component) > 1 or graph.has_edge(one, one):
            seen = 0
            for _, state in component:
                seen |= product.accepted(state)
            if seen == everything:
                core |= component
    return core


@dataclass(frozen=True, slots=True)
class _Cycle:
    """A way round in the product, from home to just before home; no places where none was found."""

    places: tuple[_Place, ...]
    cost: float
    explored: int


def _cycle(product: _Product, home: _Place, limit: float, states: int) -> _Cycle:
    """Return the cheapest way back home on which every conjunct accepts, if it is cheaper than the limit."""
    everything = (1 << len(product.automata)) - 1
    start = (home, product.accepted(home[1]))
    goal = (home, -1)
    best: dict[tuple[_Place, int], float] = {start: 0.0}
    parents: dict[tuple[_Place, int], tuple[_Place, int] | None] = {start: None}
    heap: list[tuple[float, tuple[_Place, int]]] = [(0.0, start)]
    closed: set[tuple[_Place, int]] = set()
    while heap:
        cost, key = heapq.heappop(heap)
        if cost >= limit:
            break
        if key == goal:
            places: list[_Place] = []
            at = parents[goal]
            while at is not None:
                places.append(at[0])
                at = parents[at]
            return _Cycle(tuple(reversed(places)), cost, len(closed))
        if key in closed:
            continue
        closed.add(key)
        if len(closed) > states:
            raise TooLarge("The search needs", len(closed), "states for one cycle", states)
        place, seen = key
        for node, state, step in product.moves(*place):
            target = (node, state)
            marks = seen | product.accepted(state)
            nexts = [(target, marks)]
            if target == home and marks == everything:
                nexts.append(goal)
            for following in nexts:
                if cost + step < best.get(following, float("inf")):
                    best[following] = cost + step
                    parents[following] = key
                    heapq.heappush(heap, (cost + step, following))
    return _Cycle((), float("inf"), len(closed))


def _walk(parents: dict[_Place, _Place | None], place: _Place | None) -> tuple[int, ...]:
    nodes: list[int] = []
    while place is not None:
        nodes.append(place[0])
        place = parents[place]
    return tuple(reversed(nodes))
