"""The planning automaton P (2022 paper, Def. 4.4), made as it is walked, for looking at and drawing.

`ltlplan.search` walks the same graph, and the team automaton T (Defs. 4.6, 4.7), with numbers in the place of these readable states.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunction import Conjunction
from ltlplan.systems.transition_systems import TransitionSystem

if TYPE_CHECKING:
    import networkx

MAX_STATES = 200_000
State = Any  # of whichever automaton was given: an `Automaton` counts its states, a `Conjunction` has tuples
Node = TypeVar("Node", bound=Hashable)


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

    def initial(self) -> tuple[tuple[State, int], ...]:
        """Return the pairs in which it begins."""
        node = self.system.initial
        return tuple((state, node) for state in states_after(self.automaton, self.automaton.initial, self.system, node))

    def successors(self, state: tuple[State, int]) -> Iterator[tuple[tuple[State, int], float]]:
        """Yield the next pairs with the cost of the step."""
        at, node = state
        for target, cost in self.system.edges[node]:
            for after in states_after(self.automaton, at, self.system, target):
                yield (after, target), cost

    def is_accepting(self, state: tuple[State, int]) -> bool:
        """Return whether the robot may end here with everything done (finite words), or the automaton accepts here."""
        at, node = state
        return self.automaton.is_accepting(at) and (self.system.final is None or node in self.system.final)

    def to_networkx(self) -> networkx.DiGraph[State]:
        """Return all that can be reached; nodes carry `initial` and `accepting`, edges `cost`."""
        import networkx

        graph: networkx.DiGraph[State] = networkx.DiGraph(robot=self.system.robot)
        for state, following in walk(self.initial(), self.successors):
            graph.add_node(state, initial=state in self.initial(), accepting=self.is_accepting(state))
            for target, cost in following:
                graph.add_edge(state, target, cost=cost)
        return graph


def walk(
    starts: Iterable[Node], successors: Callable[[Node], Iterable[tuple[Node, float]]], *, limit: int = MAX_STATES
) -> Iterator[tuple[Node, list[tuple[Node, float]]]]:
    """Yield every state that can be reached, breadth first, with its successors.

    Args:
        starts: Where to begin.
        successors: Pairs (next state, cost) for each state.
        limit: Most states.

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


def states_after(automaton: Automaton | Conjunction, state: State, system: TransitionSystem, node: int) -> tuple[State, ...]:
    """Return the states after the letter of a node.

    Args:
        automaton: What is asked.
        state: Its state before.
        system: What the robot can do.
        node: The node whose letter is read.
    """
    letter = system.labels[node]
    if isinstance(automaton, Automaton) and not automaton.deterministic:
        return tuple(sorted(automaton.successors(state, letter)))
    after = automaton.successor(state, letter)
    return () if after == DEAD else (after,)
