"""How much is surely left to fly: an admissible heuristic, from each conjunct by itself.

A leg into a region costs at least what the shortest leg into it costs. That much is shared out among the conjuncts whose
automata the region's letter can change, so the amounts that the conjuncts need, each found in its own small automaton,
may be added up without counting a leg twice (cost partitioning; Katz and Domshlak 2010). The sum never exceeds the true
rest, and a state from which some conjunct can never accept with these letters is known to be dead.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.conjunct_automata import Deterministic
from ltlplan.logic.product_automaton import Task
from ltlplan.search.label_setting import distances

UNREACHABLE = float("inf")
MAX_TABLE = 50_000  # states times letters of a conjunct that is looked at


class TaskHeuristic:
    """Lower bounds on the cost from each state of a task to its acceptance.

    Args:
        task: What is to be done.
        entering: For each letter, the smallest cost of any step to a node that shows it.
    """

    def __init__(self, task: Task, entering: Sequence[float]) -> None:
        self.task = task
        tables = [_table(part, len(entering)) for part in task.parts]
        sharers = [0] * len(entering)
        for table in tables:
            for letter in {letter for row in table for letter, _ in row}:
                sharers[letter] += 1
        prices = [cost / max(count, 1) for cost, count in zip(entering, sharers, strict=True)]
        self._rest = [_distances(part, table, prices) for part, table in zip(task.parts, tables, strict=True)]
        self._tables, self._prices = tables, prices
        self._to: dict[tuple[int, frozenset[int]], list[float] | None] = {}
        self._known: list[float | None] = []

    def __call__(self, state: int) -> float:
        """Return a lower bound for a state of the task; `UNREACHABLE` where it cannot be accepted any more."""
        known = self._known
        while len(known) <= state:
            known.append(None)
        found = known[state]
        if found is None:
            found = 0.0
            for at, rest in zip(self.task.state(state), self._rest, strict=True):
                if rest is not None:
                    found += rest[at]
            known[state] = found
        return found

    def knows(self, part: int) -> bool:
        """Tell whether anything is known of a conjunct, by index."""
        return self._rest[part] is not None

    def distances_to(self, part: int, goals: frozenset[int]) -> list[float] | None:
        """Return lower bounds on the cost from each state of a conjunct to some of its states; None where nothing is known.

        Args:
            part: The conjunct, by index.
            goals: States of its automaton.
        """
        key = part, goals
        if key not in self._to:
            self._to[key] = _distances(self.task.parts[part], self._tables[part], self._prices, goals)
        return self._to[key]


def _table(part: object, letters: int) -> list[list[tuple[int, int]]]:
    """Return, for each state of a small conjunct, the letters that change it and what to."""
    if not isinstance(part, Deterministic) or len(part.identity) * letters > MAX_TABLE:
        return []
    return [
        [(letter, target) for letter, target in enumerate(part.row(state)) if target not in (state, DEAD)]
        for state in part.identity
    ]


def _distances(
    part: object, table: list[list[tuple[int, int]]], prices: Sequence[float], goals: Collection[int] | None = None
) -> list[float] | None:
    """Return the smallest sum of prices from each state to an accepting one, or a goal; None where nothing is known."""
    if not isinstance(part, Deterministic) or not table:
        return None
    back: list[list[tuple[int, float]]] = [[] for _ in table]
    for state, row in enumerate(table):
        for letter, target in row:
            back[target].append((state, prices[letter]))
    ends = [state for state in part.identity if part.accepting(state)] if goals is None else sorted(goals)
    found = distances(ends, back.__getitem__)
    return [found.get(state, UNREACHABLE) for state in part.identity]
