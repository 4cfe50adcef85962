"""Conditions on letters, as shared decision diagrams (Bryant 1986).

The edges of an automaton carry Boolean conditions over propositions. Spot keeps them in a library of its own whose values
may not leave `spot_engine`; here they are plain integers into a table of "if this proposition then ... else ..." nodes, so
that an automaton is a value that can be walked, split and copied without its engine.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ltlplan.logic.budget import TooLarge
from verify.data import Letter

FALSE, TRUE = 0, 1

MAX_NODES = 2_000_000


class DecisionDiagrams:
    """A growing table of conditions over an ordered list of propositions. Equal conditions are equal integers.

    Attributes:
        propositions: In the order in which the diagrams ask for them.
    """

    def __init__(self, propositions: Sequence[str]) -> None:
        self.propositions = tuple(propositions)
        self._index = {name: i for i, name in enumerate(self.propositions)}
        self._nodes: list[tuple[int, int, int]] = [(len(propositions), 0, 0), (len(propositions), 1, 1)]
        self._unique: dict[tuple[int, int, int], int] = {}
        self._conjunctions: dict[tuple[int, int], int] = {}
        self._negations: dict[int, int] = {FALSE: TRUE, TRUE: FALSE}

    def node(self, variable: int, low: int, high: int) -> int:
        """Return the condition "if proposition number `variable` then `high` else `low`".

        Args:
            variable: Which proposition, by number; before any that `low` and `high` ask for.
            low: The condition where it is false.
            high: The condition where it is true.

        Raises:
            TooLarge: The table is full.
        """
        if low == high:
            return low
        key = (variable, low, high)
        found = self._unique.get(key)
        if found is None:
            if len(self._nodes) >= MAX_NODES:
                raise TooLarge("The automaton's conditions need", len(self._nodes), "decision nodes", MAX_NODES)
            found = self._unique[key] = len(self._nodes)
            self._nodes.append(key)
        return found

    def parts(self, guard: int) -> tuple[int, int, int]:
        """Return a condition's topmost proposition (by number) and the conditions where it is false and true."""
        return self._nodes[guard]

    def conjunction(self, first: int, second: int) -> int:
        """Return the condition that holds where both hold."""
        if first == second or second == TRUE:
            return first
        if first == TRUE:
            return second
        if first == FALSE or second == FALSE:
            return FALSE
        key = (first, second) if first < second else (second, first)
        found = self._conjunctions.get(key)
        if found is None:
            (v, low, high), (w, other_low, other_high) = self._nodes[first], self._nodes[second]
            top = min(v, w)
            if v > top:
                low = high = first
            if w > top:
                other_low = other_high = second
            found = self.node(top, self.conjunction(low, other_low), self.conjunction(high, other_high))
            self._conjunctions[key] = found
        return found

    def negation(self, guard: int) -> int:
        """Return the condition that holds where `guard` does not."""
        found = self._negations.get(guard)
        if found is None:
            variable, low, high = self._nodes[guard]
            found = self._negations[guard] = self.node(variable, self.negation(low), self.negation(high))
            self._negations[found] = guard
        return found

    def disjunction(self, first: int, second: int) -> int:
        """Return the condition that holds where either holds."""
        return self.negation(self.conjunction(self.negation(first), self.negation(second)))

    def holds(self, guard: int, letter: Letter) -> bool:
        """Return whether a letter meets a condition; names that are no propositions here do not matter."""
        while guard > TRUE:
            variable, low, high = self._nodes[guard]
            guard = high if self.propositions[variable] in letter else low
        return guard == TRUE

    def example(self, guard: int) -> Letter:
        """Return a letter with few names that meets a satisfiable condition."""
        names: set[str] = set()
        while guard > TRUE:
            variable, low, high = self._nodes[guard]
            if low == FALSE:
                names.add(self.propositions[variable])
            guard = low if low != FALSE else high
        return frozenset(names)

    def split(self, edges: Iterable[tuple[int, int]]) -> dict[frozenset[int], int]:
        """Sort letters by the set of targets whose edges they meet.

        Args:
            edges: Pairs (condition, target).

        Returns:
            For each set of targets that some letter leads to, the condition of just those letters.
        """
        by_target: dict[int, int] = {}
        for guard, target in edges:
            by_target[target] = self.disjunction(by_target.get(target, FALSE), guard)
        pieces: dict[frozenset[int], int] = {frozenset(): TRUE}
        for target, guard in sorted(by_target.items()):
            finer: dict[frozenset[int], int] = {}
            for targets, region in pieces.items():
                inside = self.conjunction(region, guard)
                outside = region if inside == FALSE else self.conjunction(region, self.negation(guard))
                for key, value in ((targets | {target}, inside), (targets, outside)):
                    if value != FALSE:
                        finer[key] = self.disjunction(finer[key], value) if key in finer else value
            pieces = finer
        return pieces

    def condition(self, name: str, low: int, high: int) -> int:
        """Return "if `name` then `high` else `low`", wherever `name` stands in the order.

        Args:
            name: One of the propositions.
            low: The condition where it is false.
            high: The condition where it is true.

        Raises:
            TooLarge: The table is full.
        """
        variable = self._index[name]
        positive = self.node(variable, FALSE, TRUE)
        return self.disjunction(self.conjunction(positive, high), self.conjunction(self.negation(positive), low))

    def given(self, guard: int, name: str, *, holds: bool) -> int:
        """Return what a condition comes to where a proposition is known; the result no longer asks for it.

        Args:
            guard: The condition.
            name: The proposition that is known.
            holds: What it is known to be.

        Raises:
            TooLarge: The table is full.
        """
        variable = self._index.get(name)
        if variable is None:
            return guard
        known = self.node(variable, FALSE, TRUE) if holds else self.node(variable, TRUE, FALSE)
        memo: dict[int, int] = {}

        def without(at: int) -> int:
            if at > TRUE and at not in memo:
                top, low, high = self._nodes[at]
                memo[at] = self.disjunction(low, high) if top == variable else self.node(top, without(low), without(high))
            return memo.get(at, at)

        return without(self.conjunction(guard, known))

    def copy_from(self, other: DecisionDiagrams, guard: int, memo: dict[int, int]) -> int:
        """Return another table's condition in this one; `memo` may be kept for further conditions of that table.

        Args:
            other: The table of the condition; its propositions are among this one's.
            guard: The condition there.
            memo: What was copied from that table before; grows.

        Raises:
            TooLarge: This table is full.
        """
        if guard <= TRUE:
            return guard
        found = memo.get(guard)
        if found is None:
            variable, low, high = other.parts(guard)
            low, high = self.copy_from(other, low, memo), self.copy_from(other, high, memo)
            found = memo[guard] = self.condition(other.propositions[variable], low, high)
        return found

    def text(self, guard: int) -> str:
        """Return a condition as text: a disjunction of conjunctions, `true` or `false`."""
        if guard == TRUE:
            return "true"
        cubes: list[str] = []
        stack: list[tuple[int, tuple[str, ...]]] = [(guard, ())]
        while stack:
            at, literals = stack.pop()
            if at == TRUE:
                cubes.append(" & ".join(literals))
            elif at != FALSE:
                variable, low, high = self._nodes[at]
                name = self.propositions[variable]
                # where one branch is simply true, the other one need not repeat the proposition: a | b, not a | !a & b
                stack.append((low, literals if high == TRUE else (*literals, "!" + name)))
                stack.append((high, literals if low == TRUE else (*literals, name)))
        return " | ".join(cubes) or "false"
