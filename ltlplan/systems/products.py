"""The planning automaton P (2022 paper, Def. 4.4) and the team automaton T (Defs. 4.6, 4.7), made as they are walked.

`ltlplan.search` walks the same graphs with numbers in the place of these readable states. Here they are for looking at, drawing and
counting, and for planners that choose their own way through T.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import Conjunction
from ltlplan.logic.decomposition import decomposes
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import BadInput

if TYPE_CHECKING:
    import networkx

Switches = Literal["decomposition", "anywhere"]

MAX_STATES = 200_000


@dataclass(frozen=True, eq=False)
class PlanningAutomaton:
    """P: what a robot does and what it has achieved, as pairs (state of the automaton, node of its system).

    The automaton has read the letter of the node. A nondeterministic automaton gives several pairs for one step.

    Attributes:
        system: What the robot can do.
        automaton: What is asked.
    """

    system: TransitionSystem
    automaton: Automaton | Conjunction

    def initial(self) -> tuple[tuple[Any, int], ...]:
        """Return the pairs in which it begins."""
        node = self.system.initial
        return tuple((state, node) for state in _read(self.automaton, self.automaton.initial, self.system, node))

    def successors(self, state: tuple[Any, int]) -> Iterator[tuple[tuple[Any, int], float]]:
        """Yield the next pairs with the cost of the step."""
        at, node = state
        for target, cost in self.system.edges[node]:
            for after in _read(self.automaton, at, self.system, target):
                yield (after, target), cost

    def is_accepting(self, state: tuple[Any, int]) -> bool:
        """Tell whether the robot may end here with everything done (finite words), or the automaton accepts here."""
        at, node = state
        return self.automaton.is_accepting(at) and (self.system.final is None or node in self.system.final)

    def to_networkx(self) -> networkx.DiGraph[Any]:
        """Return all that can be reached; nodes carry `initial` and `accepting`, edges `cost`."""
        import networkx

        graph: networkx.DiGraph[Any] = networkx.DiGraph(robot=self.system.robot)
        for state, following in walk(self.initial(), self.successors):
            graph.add_node(state, initial=state in self.initial(), accepting=self.is_accepting(state))
            for target, cost in following:
                graph.add_edge(state, target, cost=cost)
        return graph


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
        if not self.automaton.deterministic or self.automaton.trace != "finite":
            raise BadInput("A team automaton needs a deterministic automaton on finite words.")
        if not self.order:
            object.__setattr__(self, "order", tuple(range(len(self.systems))))
        if sorted(self.order) != list(range(len(self.systems))):
            raise BadInput(f"order must name each of the {len(self.systems)} robots once, not {self.order}.")

    def initial(self) -> tuple[tuple[int, Any, int], ...]:
        """Return the triple in which it begins, or nothing where the first letter already loses the task."""
        robot = self.order[0]
        node = self.systems[robot].initial
        return tuple((robot, s, node) for s in _read(self.automaton, self.automaton.initial, self.systems[robot], node))

    def successors(self, state: tuple[int, Any, int]) -> Iterator[tuple[tuple[int, Any, int], float]]:
        """Yield the next triples with the cost of the step."""
        robot, at, node = state
        system = self.systems[robot]
        for target, cost in system.edges[node]:
            for after in _read(self.automaton, at, system, target):
                yield (robot, after, target), cost
        place = self.order.index(robot)
        if place + 1 < len(self.order) and self._may_end(robot, node) and self.may_switch(at):
            following = self.order[place + 1]
            first = self.systems[following].initial
            for after in _read(self.automaton, at, self.systems[following], first):
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
        import networkx

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
                for after in _read(automaton, at, system, target):
                    yield (after, (*nodes[:index], target, *nodes[index + 1 :])), cost

    states: list[Any] = [automaton.initial]
    for system in systems:
        states = [after for at in states for after in _read(automaton, at, system, system.initial)]
    start = [(at, tuple(system.initial for system in systems)) for at in states]
    return sum(1 for _ in walk(start, following, limit=limit))


def walk(starts: Iterable[Any], successors: Any, *, limit: int = MAX_STATES) -> Iterator[tuple[Any, list[tuple[Any, float]]]]:
    """Yield every state that can be reached, breadth first, with its successors.

    Raises:
        TooLarge: There are more than `limit`.
    """
    waiting = list(starts)
    seen = set(waiting)
    for state in waiting:  # grows while it is walked
        following = list(successors(state))
        yield state, following
        for target, _ in following:
            if target not in seen:
                if len(seen) >= limit:
                    raise TooLarge("The graph has", len(seen) + 1, "states", limit)
                seen.add(target)
                waiting.append(target)


def _read(automaton: Automaton | Conjunction, state: Any, system: TransitionSystem, node: int) -> tuple[Any, ...]:
    """Return the states after the letter of a node."""
    letter = system.labels[node]
    if isinstance(automaton, Automaton) and not automaton.deterministic:
        return tuple(sorted(automaton.successors(state, letter)))
    after = automaton.successor(state, letter)
    return () if after == DEAD else (after,)
