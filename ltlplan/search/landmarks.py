"""What is needed, whatever is done: the propositions that every way to acceptance shows.

Classical planning calls them landmarks (Hoffmann, Porteous and Sebastia 2004); here they are read off a conjunct's automaton.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.task import Deterministic, Task
from ltlplan.search.heuristic import MAX_TABLE
from ltlplan.search.reduced_graph import Roads
from ltlplan.search.spanning_tree import Spanning
from verify.data import Letter

MAX_GOALS = 40  # propositions that a conjunct's states are asked about


class Needs:
    """Which propositions must still be shown, whatever is done, and how far it is to show them all.

    A state of a conjunct needs a proposition where no letters without it lead on to acceptance.

    Args:
        task: What is to be done.
        roads: The team's graph.

    Attributes:
        spanning: Lower bounds for sets of needs.
    """

    def __init__(self, task: Task, roads: Roads) -> None:
        self._task = task
        shown = {letter for label in roads.label for letter in label}
        by_part = [_needs(part, task.letters, shown) for part in task.parts]
        goals = sorted({name for needs in by_part for names in needs for name in names})
        bit = {name: 1 << i for i, name in enumerate(goals)}
        self._by_part = [[sum(bit[name] for name in names) for names in needs] for needs in by_part]
        self.spanning = Spanning(roads, [{letter for letter in shown if name in task.letters[letter]} for name in goals])

    def __call__(self, state: int) -> int:
        """Return what a state of the task needs, as bits."""
        found = 0
        for at, needs in zip(self._task.state(state), self._by_part, strict=True):
            found |= needs[at] if needs else 0
        return found


def _needs(part: object, letters: Sequence[Letter], shown: Collection[int]) -> list[list[str]]:
    """Return the propositions that each state of a small conjunct needs; nothing for a large one."""
    if not isinstance(part, Deterministic) or len(part.identity) * len(part.views) > MAX_TABLE:
        return []
    names = [name for name in part.automaton.propositions if any(name in letters[letter] for letter in shown)]
    seen = {view: part.views[view] for view in {part.view[letter] for letter in shown}}
    one = {part.view[letter]: letter for letter in shown}
    needs: list[list[str]] = [[] for _ in part.identity]
    for name in names[:MAX_GOALS]:
        others = [one[view] for view, letter in seen.items() if name not in letter]
        back: list[list[int]] = [[] for _ in part.identity]
        for state in part.identity:
            row = part.row(state)
            for letter in others:
                if row[letter] != DEAD:
                    back[row[letter]].append(state)
        reached = {state for state in part.identity if part.accepting(state)}
        waiting = list(reached)
        for state in waiting:  # grows while it is walked
            for before in back[state]:
                if before not in reached:
                    reached.add(before)
                    waiting.append(before)
        for state in part.identity:
            if state not in reached:
                needs[state].append(name)
    return needs
