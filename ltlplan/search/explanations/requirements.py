"""Requirements by themselves: put together, and whether any word satisfies them, whoever may show it."""

from __future__ import annotations

from collections.abc import Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget
from ltlplan.logic.conjunction import conjunct_automata
from ltlplan.logic.product_automaton import Task
from verify.data import Formula, Letter

BUDGET = Budget(states=200_000)


def satisfiable(parts: Sequence[Formula], letters: Sequence[Letter]) -> bool:
    """Tell whether some finite word over these letters satisfies all parts, as far as the budget goes."""
    task = Task(conjunct_automata(all_of(parts), "finite"), letters)
    waiting, seen = [task.initial], {task.initial}
    for state in waiting:  # grows while it is walked
        if task.is_accepting(state):
            return True
        for after in task.row(state):
            if after != DEAD and after not in seen:
                if len(seen) > BUDGET.states:
                    return True  # not known to be impossible
                seen.add(after)
                waiting.append(after)
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
