"""Size of a formula's automaton, counted in steps before it is made.

A tableau reads one letter after another and keeps the sets of subformulas that must still be met (Gerth, Peled, Vardi and
Wolper 1995; Couvreur 1999), as Spot's translation does. Letters are left out here: what a Boolean subformula needs of them
counts as possible, so that what is counted is about what would be made, and no more than the budget is walked.
"""

from __future__ import annotations

from functools import lru_cache

from verify.logic.normal_form import Normal
from verify.logic.progression import OutOfBudget

MOST_EDGES = 50_000
"""Edges that the tableau may have."""

MOST_STEPS = 2_000_000
"""Unions of sets of subformulas that may be made to count them."""

MOST_NODES = 20_000
"""Operators and names of a formula that is written out without sharing."""

_TEMPORAL = ("F", "G", "U", "W", "R", "M", "X", "X[!]")


def tableau_states(normal: Normal) -> int:
    """Return about how many states an automaton for a formula has.

    Raises:
        OutOfBudget: Its text or its tableau would be too large; says which budget it takes more than.
    """
    answer = _counted(normal)
    if isinstance(answer, str):
        raise OutOfBudget(answer)
    return answer


@lru_cache(maxsize=256)
def _counted(normal: Normal) -> int | str:
    """Return the number of states, or which budget they take more than."""
    nodes: list[int] = []
    for arguments in normal.arguments:
        nodes.append(1 + sum(nodes[a] for a in arguments))
    if nodes[normal.root] > MOST_NODES:
        return f"one part of the formula, written out, has more than {MOST_NODES} operators and names"
    try:
        return _Count(normal).states()
    except OutOfBudget as error:
        return str(error)


class _Count:
    """One walk over the sets of subformulas that can remain, as bits."""

    def __init__(self, normal: Normal) -> None:
        self.normal = normal
        self.steps = 0
        self.ways: list[frozenset[int]] = []

    def states(self) -> int:
        """Visit every set that can remain, and return how many there are."""
        self._ways()
        start = 1 << self.normal.root
        seen, stack, edges = {start}, [start], 0
        while stack:
            state = stack.pop()
            reached: frozenset[int] = frozenset([0])
            entry = 0
            while state >> entry:
                if state >> entry & 1:
                    reached = self._both(reached, self.ways[entry])
                entry += 1
            edges += len(reached)
            if edges > MOST_EDGES:
                raise OutOfBudget(f"the tableau of one part of the formula has more than {MOST_EDGES} edges")
            stack.extend(reached - seen)
            seen |= reached
        return len(seen)

    def _ways(self) -> None:
        """Say for each entry which sets may remain of it after one letter."""
        nothing = frozenset([0])
        plain: list[bool] = []
        for i, (kind, arguments) in enumerate(zip(self.normal.kinds, self.normal.arguments, strict=True)):
            below = [self.ways[a] for a in arguments]
            plain.append(kind not in _TEMPORAL and all(plain[a] for a in arguments))
            again = frozenset([1 << i])
            if plain[i]:
                way = nothing
            elif kind == "and":
                way = nothing
                for part in below:
                    way = self._both(way, part)
            elif kind == "or":
                way = frozenset[int]().union(*below)
            elif kind in ("X", "X[!]"):
                way = frozenset([1 << arguments[0]])
            elif kind == "F":
                way = below[0] | again
            elif kind == "G":
                way = self._both(below[0], again)
            elif kind in ("U", "W"):
                way = below[1] | self._both(below[0], again)
            else:
                way = self._both(below[1], below[0] | again)
            self.ways.append(way)

    def _both(self, first: frozenset[int], second: frozenset[int]) -> frozenset[int]:
        self.steps += len(first) * len(second)
        if self.steps > MOST_STEPS:
            raise OutOfBudget(f"the tableau of one part of the formula takes more than {MOST_STEPS} steps to be counted")
        return frozenset(a | b for a in first for b in second)
