"""The team automaton T (2022 paper, Defs. 4.6 and 4.7) and the product of all robots, written down: to hold the search against."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import networkx

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.conjunction import Conjunction
from ltlplan.logic.decomposition import decomposes
from ltlplan.systems.products import MAX_STATES, states_after, walk
from ltlplan.systems.transition_systems import TransitionSystem

Switches = Literal["decomposition", "anywhere"]


@dataclass(frozen=True, eq=False)
class TeamAutomaton:
    """T: the robots' planning automata one after another, as triples (robot, state of the automaton, node).

    A switch hands the rest of the task to the next robot of the order at no cost; the next robot's first letter is then
    read, so every robot of the order takes part, if only by hovering where it starts.

    Attributes:
        systems: One for each robot.
        automaton: Deterministic, on finite words.
        order: In which robots fly, as indices of `systems`; Def. 4.7 has them as they come.
        switches: "decomposition": only in states of the decomposition set (Def. 4.7). "anywhere": in every state; whether
            a plan then holds in all orders must be asked of its words.
        alphabet: Letters for the decomposition set; None for all.
    """

    systems: Sequence[TransitionSystem]
    automaton: Automaton | Conjunction
    order: tuple[int, ...] = ()
    switches: Switches = "decomposition"
    alphabet: Collection[frozenset[str]] | None = None
    _decomposes: dict[Hashable, bool] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not self.order:
            object.__setattr__(self, "order", tuple(range(len(self.systems))))

    def initial(self) -> tuple[tuple[int, Any, int], ...]:
        """Return the triple in which it begins, or nothing where the first letter already loses the task."""
        robot = self.order[0]
        node = self.systems[robot].initial
        return tuple((robot, s, node) for s in states_after(self.automaton, self.automaton.initial, self.systems[robot], node))

    def successors(self, state: tuple[int, Any, int]) -> Iterator[tuple[tuple[int, Any, int], float]]:
        """Yield the next triples with the cost of the step."""
        robot, at, node = state
        system = self.systems[robot]
        for target, cost in system.edges[node]:
            for after in states_after(self.automaton, at, system, target):
                yield (robot, after, target), cost
        place = self.order.index(robot)
        if place + 1 < len(self.order) and self._may_end(robot, node) and self.may_switch(at):
            following = self.order[place + 1]
            first = self.systems[following].initial
            for after in states_after(self.automaton, at, self.systems[following], first):
                yield (following, after, first), 0.0

    def may_switch(self, state: Any) -> bool:
        """Tell whether the rest may be handed over in a state of the automaton."""
        if self.switches == "anywhere":
            return True
        found = self._decomposes.get(state)
        if found is None:
            found = self._decomposes[state] = decomposes(self.automaton, state, self.alphabet)
        return found

    def is_accepting(self, state: tuple[int, Any, int]) -> bool:
        """Tell whether the last robot may end here with everything done."""
        robot, at, node = state
        return robot == self.order[-1] and self.automaton.is_accepting(at) and self._may_end(robot, node)

    def _may_end(self, robot: int, node: int) -> bool:
        final = self.systems[robot].final
        return final is None or node in final

    def size(self) -> int:
        """Return how many triples can be reached."""
        return sum(1 for _ in walk(self.initial(), self.successors))

    def to_networkx(self) -> networkx.DiGraph[Any]:
        """Return all that can be reached; nodes carry `initial` and `accepting`, edges `cost` and `switch`."""
        graph: networkx.DiGraph[Any] = networkx.DiGraph(order=self.order)
        for state, following in walk(self.initial(), self.successors):
            graph.add_node(state, initial=state in self.initial(), accepting=self.is_accepting(state))
            for target, cost in following:
                graph.add_edge(state, target, cost=cost, switch=target[0] != state[0])
        return graph


def full_product_size(systems: Sequence[TransitionSystem], automaton: Automaton | Conjunction) -> int:
    """Return the number of states of the product of all robots with the automaton, which is never built."""
    return len(automaton.states) * math.prod(len(system.labels) for system in systems)


def full_product(systems: Sequence[TransitionSystem], automaton: Automaton | Conjunction, *, limit: int = MAX_STATES) -> int:
    """Walk the product of all robots, one moving at a time, and return how many states were reached. For comparison only.

    Raises:
        TooLarge: There are more than `limit`.
    """

    def following(state: tuple[Any, tuple[int, ...]]) -> Iterator[tuple[tuple[Any, tuple[int, ...]], float]]:
        at, nodes = state
        for index, system in enumerate(systems):
            for target, cost in system.edges[nodes[index]]:
                for after in states_after(automaton, at, system, target):
                    yield (after, (*nodes[:index], target, *nodes[index + 1 :])), cost

    states: list[Any] = [automaton.initial]
    for system in systems:
        states = [after for at in states for after in states_after(automaton, at, system, system.initial)]
    start = [(at, tuple(system.initial for system in systems)) for at in states]
    return sum(1 for _ in walk(start, following, limit=limit))
