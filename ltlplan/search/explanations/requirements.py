"""Requirements by themselves: put together, and whether any word satisfies them, whoever may show it."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.product_automaton import Task
from ltlplan.search.label_setting import BestFirst
from verify.data import Formula, Letter

BUDGET = Budget(states=200_000)


def satisfiable(parts: Sequence[Formula], letters: Sequence[Letter]) -> bool:
    """Tell whether some finite word over these letters satisfies all parts, as far as the budget goes."""
    task = Task(conjunct_automata(all_of(parts), "finite"), letters)

    def onwards(state: int) -> list[tuple[int, float]]:
        return [(after, 1.0) for after in task.row(state) if after != DEAD]

    for seen, (state, _, _) in enumerate(BestFirst([task.initial], onwards, ties="first")):
        if task.is_accepting(state) or seen > BUDGET.states:
            return True  # the latter is not known to be impossible
    return False


def all_of(parts: Sequence[Formula]) -> Formula:
    """Return the conjunction of requirements."""
    formula = parts[0] if parts else Formula("true")
    for part in parts[1:]:
        formula = Formula("&", (formula, part))
    return formula


def eventually(name: str) -> Formula:
    """Return the requirement that a name is shown at some time."""
    return Formula("F", (Formula("name", (), name),))
