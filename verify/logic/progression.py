"""Our own automata, by formula progression, independent of Spot.

Progression rewrites what remains to be fulfilled while letters are read. The rest is kept as a Boolean function
of the temporal subformulas, stored as an ordered binary decision diagram: two rests that are propositionally the
same are the same number, so there are finitely many and comparing them is comparing integers.

For finite traces a rest must make sense when nothing is left to read: `F U M X[!]` are false there, `G R W X`
true. One extra variable, "there is another letter", tells `X` (weak) from `X[!]` (strong).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cached_property

from verify.data.errors import LtlplanError
from verify.data.language.formula import FALSE, TRUE, Formula
from verify.data.language.word import Letter
from verify.logic.normal_form import Normal, to_formula

State = int
"""What remains: a node of the automaton's decision diagram."""

REFUTED: State = 0
"""No continuation can satisfy the formula any more."""

SETTLED: State = 1
"""Every continuation satisfies the formula."""

MAX_VARIABLES = 250
MAX_NODES = 60_000
MAX_OPERATIONS = 600_000
MAX_VISITS = 10_000_000
"""Nodes of what remains that may be rewritten, over all letters."""


class OutOfBudget(LtlplanError):
    """A question was too large for the budget; whoever asked answers `undecided`."""


class Automaton:
    """A deterministic automaton over finite words, built as it is asked.

    Attributes:
        initial: What remains before the first letter: the whole formula.
        propositions: The names that letters are cut down to.
    """

    def __init__(self, normal: Normal) -> None:
        self.normal = normal
        self.propositions = normal.propositions
        self._diagram = _Diagram(normal)
        self._letters: dict[Letter, list[State]] = {}
        self._next: dict[tuple[State, Letter], State] = {}
        self.initial: State = self._diagram.of_entry(normal.root)

    def cut(self, letter: Letter) -> Letter:
        """Return what the formula sees of a letter."""
        return letter & self.propositions

    def step(self, state: State, letter: Letter) -> State:
        """Return what remains after one more letter (already cut down to the formula's propositions).

        Raises:
            OutOfBudget: The diagram has grown too large.
        """
        key = (state, letter)
        found = self._next.get(key)
        if found is None:
            rewritten = self._letters.get(letter)
            if rewritten is None:
                rewritten = self._letters[letter] = self._diagram.rewritten(letter)
            found = self._next[key] = self._diagram.advance(state, rewritten)
        return found

    def run(self, letters: Iterable[Letter], state: State | None = None) -> State:
        """Return what remains after several letters."""
        state = self.initial if state is None else state
        for letter in letters:
            state = self.step(state, letter & self.propositions)
        return state

    def accepts(self, state: State) -> bool:
        """Return whether the word may end here. The empty word is no trace: ask only after a letter."""
        return self._diagram.ends_well(state)

    def remains(self, state: State) -> Formula:
        """Return what remains as a formula over infinite words: there is always another letter."""
        known = {REFUTED: FALSE, SETTLED: TRUE}

        def go(node: State) -> Formula:
            if node not in known:
                level, low, high = self._diagram.nodes[node]
                if level == self._diagram.more_level:
                    known[node] = go(high)
                else:  # the function grows with this variable
                    variable = to_formula(replace(self.normal, root=self._diagram.variables[level]))
                    known[node] = Formula("|", (go(low), Formula("&", (variable, go(high)))))
            return known[node]

        return go(state)


class _Diagram:
    """Boolean functions of the normal form's literals and temporal entries, as shared decision diagrams.

    Every function grows with its variables but for the last one, `more` ("there is another letter").
    """

    def __init__(self, normal: Normal) -> None:
        self.normal = normal
        self.variables = [i for i, kind in enumerate(normal.kinds) if kind not in ("true", "false", "and", "or")]
        if len(self.variables) > MAX_VARIABLES:
            raise OutOfBudget(
                f"one part of the formula has {len(self.variables)} temporal operators and literals; {MAX_VARIABLES} is the most"
            )
        self.level = {entry: i for i, entry in enumerate(self.variables)}
        self.more_level = len(self.variables)
        # level, where false, where true; nobody asks for the level of the two constants
        self.nodes: list[tuple[int, int, int]] = [(self.more_level, 0, 0), (self.more_level, 1, 1)]
        self.operations = self.visits = 0
        self.unique: dict[tuple[int, int, int], int] = {}
        self.meets: dict[tuple[int, int], int] = {}
        self.joins: dict[tuple[int, int], int] = {}
        self.entries: dict[int, int] = {}
        self.good: dict[int, bool] = {0: False, 1: True}

    @cached_property
    def more(self) -> int:
        return self.make(self.more_level, 0, 1)

    @cached_property
    def end(self) -> int:
        return self.make(self.more_level, 1, 0)

    def make(self, level: int, low: int, high: int) -> int:
        if low == high:
            return low
        key = (level, low, high)
        node = self.unique.get(key)
        if node is None:
            if len(self.nodes) > MAX_NODES:
                raise OutOfBudget(f"what remains of the formula takes more than {MAX_NODES} nodes")
            node = self.unique[key] = len(self.nodes)
            self.nodes.append(key)
        return node

    def meet(self, a: int, b: int) -> int:
        if a == b or b == 1:
            return a
        if a == 1:
            return b
        if a == 0 or b == 0:
            return 0
        key = (a, b) if a < b else (b, a)
        found = self.meets.get(key)
        if found is None:
            self._count()
            level, (low_a, high_a), (low_b, high_b) = self._split(a, b)
            found = self.meets[key] = self.make(level, self.meet(low_a, low_b), self.meet(high_a, high_b))
        return found

    def join(self, a: int, b: int) -> int:
        if a == b or b == 0:
            return a
        if a == 0:
            return b
        if a == 1 or b == 1:
            return 1
        key = (a, b) if a < b else (b, a)
        found = self.joins.get(key)
        if found is None:
            self._count()
            level, (low_a, high_a), (low_b, high_b) = self._split(a, b)
            found = self.joins[key] = self.make(level, self.join(low_a, low_b), self.join(high_a, high_b))
        return found

    def _count(self) -> None:
        self.operations += 1
        if self.operations > MAX_OPERATIONS:
            raise OutOfBudget(f"what remains of the formula takes more than {MAX_OPERATIONS} operations on its diagram")

    def _split(self, a: int, b: int) -> tuple[int, tuple[int, int], tuple[int, int]]:
        level_a, low_a, high_a = self.nodes[a]
        level_b, low_b, high_b = self.nodes[b]
        level = min(level_a, level_b)
        return level, (low_a, high_a) if level_a == level else (a, a), (low_b, high_b) if level_b == level else (b, b)

    def of_entry(self, entry: int) -> int:
        """Return an entry as a function: temporal entries and literals are variables."""
        if not self.entries:
            for i, (kind, arguments) in enumerate(zip(self.normal.kinds, self.normal.arguments, strict=True)):
                match kind:
                    case "true" | "false":
                        self.entries[i] = int(kind == "true")
                    case "and":
                        self.entries[i] = self._fold(self.meet, [self.entries[a] for a in arguments])
                    case "or":
                        self.entries[i] = self._fold(self.join, [self.entries[a] for a in arguments])
                    case _:
                        self.entries[i] = self.make(self.level[i], 0, 1)
        return self.entries[entry]

    @staticmethod
    def _fold(operation: Callable[[int, int], int], parts: list[int]) -> int:
        while len(parts) > 1:
            paired = [operation(a, b) for a, b in zip(parts[::2], parts[1::2], strict=False)]
            parts = paired + parts[len(paired) * 2 :]
        return parts[0]

    def rewritten(self, letter: Letter) -> list[int]:
        """Return, for every entry, what remains of it after `letter`."""
        rest: list[int] = []
        for i, (kind, arguments, name) in enumerate(
            zip(self.normal.kinds, self.normal.arguments, self.normal.names, strict=True)
        ):
            match kind:
                case "true" | "false":
                    value = int(kind == "true")
                case "name":
                    value = int(name in letter)
                case "not":
                    value = int(name not in letter)
                case "and":
                    value = self._fold(self.meet, [rest[a] for a in arguments])
                case "or":
                    value = self._fold(self.join, [rest[a] for a in arguments])
                case "X":
                    value = self.join(self.end, self.of_entry(arguments[0]))
                case "X[!]":
                    value = self.meet(self.more, self.of_entry(arguments[0]))
                case "F":
                    value = self.join(rest[arguments[0]], self.of_entry(i))
                case "G":
                    value = self.meet(rest[arguments[0]], self.of_entry(i))
                case "U" | "W":
                    value = self.join(rest[arguments[1]], self.meet(rest[arguments[0]], self.of_entry(i)))
                case "R" | "M":
                    value = self.meet(rest[arguments[1]], self.join(rest[arguments[0]], self.of_entry(i)))
            rest.append(value)
        return rest

    def advance(self, state: int, rewritten: list[int]) -> int:
        """Replace every variable by what remains of it."""
        done = {0: 0, 1: 1}

        def go(node: int) -> int:
            found = done.get(node)
            if found is None:
                level, low, high = self.nodes[node]
                if level == self.more_level:
                    found = high  # a letter was read, so there was one
                else:  # the function grows with this variable: f = low or (variable and high)
                    found = self.join(go(low), self.meet(rewritten[self.variables[level]], go(high)))
                done[node] = found
            return found

        found = go(state)
        self.visits += len(done)
        if self.visits > MAX_VISITS:
            raise OutOfBudget(
                f"what remains of the formula takes more than {MAX_VISITS} visits to be rewritten, letter by letter"
            )
        return found

    def ends_well(self, state: int) -> bool:
        """Evaluate a rest where nothing is left to read."""
        found = self.good.get(state)
        if found is None:
            level, low, high = self.nodes[state]
            if level == self.more_level:
                value = False
            else:
                value = self.normal.kinds[self.variables[level]] in ("G", "R", "W", "X", "not")
            found = self.good[state] = self.ends_well(high if value else low)
        return found
