"""One conjunct's automaton as a graph that is walked backwards: the one thing that every bound on a conjunct is read off.

A node is a state of the conjunct's automaton, with whatever else the conjunct sees (what other robots hold, how many there are). An edge
is labelled with the letter that a robot comes to, as far as the conjunct sees it: a set of propositions, as bits.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from ltlplan.logic.conjunct_automata import bits
from ltlplan.search.label_setting import distances
from ltlplan.search.numbering import closure

Node = TypeVar("Node", bound=Hashable)

MAX_LANDMARKS = 40  # propositions that a conjunct's nodes are asked about


@dataclass(frozen=True, slots=True)
class ConjunctGraph(Generic[Node]):
    """One conjunct's nodes, and which letters lead from one to another.

    Attributes:
        nodes: All of them.
        back: For each node, the nodes before it, with the letter that leads from there.
        goals: Nodes at which the conjunct is satisfied.
        mask: The propositions that the conjunct speaks of, as bits: it sees these of a letter.
        priced: Letters, as the conjunct sees them, that may bring it nearer to a goal and share the cost of a step; all others are free.
    """

    nodes: Sequence[Node]
    back: Mapping[Node, Sequence[tuple[Node, int]]]
    goals: frozenset[Node]
    mask: int
    priced: Collection[int]

    def costs(self, price: Mapping[int, float], goals: Iterable[Node]) -> dict[Node, float]:
        """Return the least sum of prices from each node to one of some goals; nodes from which there is no way are left out.

        Args:
            price: Of each letter, as the conjunct sees it.
            goals: Nodes.
        """
        return distances(goals, lambda node: ((before, price[letter]) for before, letter in self.back.get(node, ())))

    def leading_to(self, goals: Iterable[Node], allowed: Callable[[int], bool]) -> set[Node]:
        """Return the nodes from which letters that are allowed lead to one of some goals.

        Args:
            goals: Nodes.
            allowed: Whether a letter, as the conjunct sees it, may be shown.
        """
        return set(closure(goals, lambda node: (before for before, letter in self.back.get(node, ()) if allowed(letter))))

    def landmarks(self, goals: Collection[Node], shown: int) -> dict[Node, int]:
        """Return the propositions, as bits, that every way from a node to some goals shows (Hoffmann, Porteous and Sebastia 2004).

        Args:
            goals: Nodes.
            shown: Propositions that are ever shown, as bits.
        """
        found: dict[Node, int] = defaultdict(int)
        for bit in [*single_bits(self.mask & shown)][:MAX_LANDMARKS]:
            without = self.leading_to(goals, lambda letter, bit=bit: not letter & bit)
            for node in self.nodes:
                if node not in without:
                    found[node] |= bit
        return found


def single_bits(mask: int) -> Iterator[int]:
    """Yield the single bits of a mask."""
    return (1 << place for place in bits(mask))
