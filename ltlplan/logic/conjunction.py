"""A formula as the conjunction of small automata, multiplied only where a search goes.

`F p1 & ... & F p12` has 4096 states and half a million edges as one automaton, and twelve times two states as twelve.
A conjunct whose deterministic automaton would be large stays nondeterministic; of its sets of states, too, only those
that are reached are made. `task` does the same for searches, with letters and states by number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property, lru_cache

from ltlplan.logic.automaton import DEAD, Automaton, Trace, representative_letters
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.determinisation import determinise, intersection, minimise
from ltlplan.logic.small_automata import small_automaton
from verify.data import BadInput, Formula, Letter, Word

SMALL_AUTOMATON = Budget(automaton=128)


def conjuncts(formula: Formula) -> tuple[Formula, ...]:
    """Return formulas that say together what `formula` says; `G(a & b)` and `G(a -> b & c)` are taken apart as well."""
    if formula.operator == "&":
        return tuple(part for argument in formula.conjuncts() for part in conjuncts(argument))
    if formula.operator in ("G", "X"):
        inner = conjuncts(formula.arguments[0])
        return tuple(Formula(formula.operator, (part,)) for part in inner) if len(inner) > 1 else (formula,)
    if formula.operator == "!" and formula.arguments[0].operator in ("|", "->", "!"):
        inner = formula.arguments[0]
        if inner.operator == "!":
            return conjuncts(inner.arguments[0])
        left, right = inner.arguments
        first = left if inner.operator == "->" else Formula("!", (left,))
        return (*conjuncts(first), *conjuncts(Formula("!", (right,))))
    if formula.operator == "->":
        left, right = formula.arguments
        inner = conjuncts(right)
        return tuple(Formula("->", (left, part)) for part in inner) if len(inner) > 1 else (formula,)
    return (formula,)


@lru_cache(maxsize=512)
def conjunct_automaton(formula: Formula, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return a conjunct's automaton on finite words: deterministic and smallest where that is small.

    Raises:
        TooLarge: A budget did not suffice.
        MissingEngine: Spot is not installed.
    """
    automaton = small_automaton(formula, "finite", budget=budget)
    try:
        return minimise(determinise(automaton, budget=SMALL_AUTOMATON))
    except TooLarge:
        return automaton


def conjunct_automata(formula: Formula, trace: Trace, *, budget: Budget = DEFAULT_BUDGET) -> tuple[Automaton, ...]:
    """Return one automaton for each conjunct, each written only once.

    Args:
        formula: What is asked.
        trace: "finite" for automata on finite words, "infinite" for Büchi automata.
        budget: Bounds on each automaton.

    Raises:
        TooLarge: A budget did not suffice.
        MissingEngine: Spot is not installed.
    """
    parts, alone = tuple(dict.fromkeys(conjuncts(formula))), budget.alone
    if trace == "finite":
        return tuple(conjunct_automaton(part, budget=alone) for part in parts)
    return tuple(small_automaton(part, trace, budget=alone) for part in parts)


State = tuple[int | frozenset[int], ...] | int
"""A state of a `Conjunction`: for each conjunct a state, or a set of states where its automaton is nondeterministic."""


class Conjunction:
    """A deterministic automaton on finite words whose states are made as they are asked for.

    Attributes:
        parts: The conjuncts' automata.
        initial: The initial state.
        propositions: Names that matter.
        trace: Always "finite".
        deterministic: Always true.
    """

    trace: Trace = "finite"
    deterministic = True

    def __init__(self, parts: Sequence[Automaton], budget: Budget = DEFAULT_BUDGET) -> None:
        self.parts = tuple(parts)
        self.budget = budget
        self.propositions = tuple(sorted({name for part in parts for name in part.propositions}))
        self.initial: State = tuple(part.initial if part.deterministic else frozenset({part.initial}) for part in self.parts)

    @cached_property
    def letters(self) -> tuple[Letter, ...]:
        """One letter for each way in which letters act on the states."""
        return representative_letters(self.parts, budget=self.budget)

    def successor(self, state: State, letter: Iterable[str]) -> State:
        """Return the state that a letter leads to, or `DEAD`."""
        names = frozenset(letter)
        if isinstance(state, int):
            return DEAD
        after: list[int | frozenset[int]] = []
        for part, at in zip(self.parts, state, strict=True):
            if isinstance(at, int):
                target = part.successor(at, names)
                if target == DEAD:
                    return DEAD
                after.append(target)
            else:
                targets = frozenset(t for one in at for t in part.successors(one, names))
                if not targets:
                    return DEAD
                after.append(targets)
        return tuple(after)

    def is_accepting(self, state: State) -> bool:
        """Return whether a state is accepting."""
        return not isinstance(state, int) and all(
            at in part.accepting if isinstance(at, int) else not part.accepting.isdisjoint(at)
            for part, at in zip(self.parts, state, strict=True)
        )

    def accepts(self, word: Word) -> bool:
        """Return whether a finite word is accepted.

        Raises:
            BadInput: The word has a cycle.
        """
        if word.cycle is not None:
            raise BadInput("This automaton reads finite words.")
        state: State = self.initial
        for letter in word.prefix:
            state = self.successor(state, letter)
        return self.is_accepting(state)

    def multiplied(self) -> Automaton:
        """Return the smallest automaton with all states and edges written down.

        Raises:
            TooLarge: There are more states than the budget allows.
        """
        whole: Automaton | None = None
        for part in self.parts:
            one = minimise(determinise(part, budget=self.budget))
            whole = one if whole is None else minimise(intersection(whole, one, budget=self.budget))
        assert whole is not None  # a formula has at least one conjunct
        return whole

    @cached_property
    def states(self) -> tuple[State, ...]:
        """All states that letters can lead to, breadth first.

        Raises:
            TooLarge: There are more than the budget allows.
        """
        seen: dict[State, None] = {self.initial: None}
        waiting = [self.initial]
        for state in waiting:  # grows while it is walked
            for letter in self.letters:
                after = self.successor(state, letter)
                if after != DEAD and after not in seen:
                    if len(seen) >= self.budget.automaton:
                        raise TooLarge("The automaton has", len(seen) + 1, "states", self.budget.automaton)
                    seen[after] = None
                    waiting.append(after)
        return tuple(seen)

    @cached_property
    def accepting(self) -> frozenset[State]:
        """The accepting states among all."""
        return frozenset(state for state in self.states if self.is_accepting(state))
