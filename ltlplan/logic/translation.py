"""From a formula to its automaton: a finite one for LTLf (2022 paper, Def. 2.2), a Büchi one for LTL (2019 paper, Def. 4).

Spot makes a small nondeterministic automaton (`small_automata`), quickly; what must be deterministic is made so in
`determinisation`, because Spot's own way can take minutes on a formula of twenty nested operators.
"""

from __future__ import annotations

import math
from typing import Literal

from ltlplan.logic.automaton import Automaton, Trace
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.logic.conjunction import Conjunction, conjunct_automata
from ltlplan.logic.determinisation import intersection, minimise
from ltlplan.logic.small_automata import small_automaton
from verify.data import BadInput, Formula, parse_formula
from verify.data.language.formula import WRITTEN_OUT, check_formula

EXPLICIT_STATES = 1024  # products of conjuncts up to which `translate` writes one automaton down


def translate(
    formula: str | Formula,
    trace: Trace = "finite",
    *,
    form: Literal["deterministic", "small"] = "deterministic",
    budget: Budget = DEFAULT_BUDGET,
) -> Automaton | Conjunction:
    """Return an automaton that accepts just the words that satisfy a formula.

    Args:
        formula: LTL, as text or value; `X` and `X[!]` are accepted.
        trace: "finite": the words are finite and not empty (LTLf). "infinite": a Büchi automaton, deterministic
            where Spot can make it so.
        form: For finite words: the smallest deterministic automaton, or a small nondeterministic one (2022 paper, Def. 2.2).
        budget: Bounds on states, time and memory.

    Returns:
        An automaton with all its states; for a large conjunction on finite words a `Conjunction`, which is used in the
        same way and makes its states as they are asked for.

    Raises:
        FormulaError: The text is no formula.
        BadInput: `trace` or `form` is none of these, or the formula says `all`, `some`, `ever` or `each` without a team.
        MissingEngine: Spot is not installed.
        TooLarge: A budget did not suffice.
    """
    value = parse_formula(formula) if isinstance(formula, str) else check_formula(formula)
    if (node := next((node for node in value.nodes() if node.operator in WRITTEN_OUT), None)) is not None:
        raise BadInput(
            f"`{node}` depends on how many robots there are; give a mission, or write it with `count(...)` or robots' names."
        )
    if trace not in ("finite", "infinite"):
        raise BadInput(f"trace must be 'finite' or 'infinite', not {trace!r}.")
    if form not in ("deterministic", "small"):
        raise BadInput(f"form must be 'deterministic' or 'small', not {form!r}.")
    if trace == "infinite" or form == "small":
        return small_automaton(value, trace, budget=budget)
    parts = conjunct_automata(value, trace, budget=budget)
    size = math.prod(len(part.states) for part in parts)
    if size > EXPLICIT_STATES or not all(part.deterministic for part in parts):
        return Conjunction(parts, budget)
    whole = parts[0]
    for part in parts[1:]:
        whole = minimise(intersection(whole, part, budget=budget))
    return whole
