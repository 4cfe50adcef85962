"""Searches for plans that keep sets of a mission's soft parts: the formula and these parts as one formula, within bounds on all of them together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ltlplan.allocation import Allocation
from ltlplan.logic.budget import DEFAULT_BUDGET, TooLarge
from ltlplan.search.exact import assign
from ltlplan.search.explanations.max_weight_subset import Parts
from verify.data import Infeasible, Mission, Unsatisfiable

_COUNTED = "count(free) >= 0"  # holds always
_STATES = {"own": 30_000, "joint": 60_000}  # of one search; `joint` spends a tenth
_COURSES = {"own": 4_000, "joint": 1_200}
_LEAST = 16  # by how much later searches are cut down at most


class Searches:
    """Searches for the least cost of keeping sets of soft parts; each that is stopped halves what the next ones may take.

    Args:
        mission: Whose parts.

    Attributes:
        budget: Of a search in full.
        stopped: The sets whose least cost is not known.
    """

    def __init__(self, mission: Mission) -> None:
        team = mission.spec.team
        self.budget = replace(DEFAULT_BUDGET, states=_STATES[team], courses=_COURSES[team])
        self.stopped: set[Parts] = set()
        self._mission = mission
        self._found: dict[Parts, tuple[Allocation, bool]] = {}  # and whether it was searched for in full

    def cost_of(self, parts: Parts) -> float | None:
        """Return the least cost of keeping some parts, or what is found where a search is stopped; None where they cannot be kept.

        Args:
            parts: Their indices.

        Raises:
            TooLarge: A budget was used up before any plan was found.
        """
        share = min(1 << len(self.stopped), _LEAST)
        budget = replace(self.budget, states=self.budget.states // share)
        try:
            found = assign(asking(self._mission, parts), budget=budget, explained=False)
        except (Unsatisfiable, Infeasible):
            return None
        except TooLarge:
            self.stopped.add(parts)
            raise
        if not found.complete:
            self.stopped.add(parts)
        self._found[parts] = found, share == 1
        return found.cost

    def found_for(self, chosen: Parts) -> Iterator[tuple[Mission, Allocation]]:
        """Yield what need not be searched for again: complete assignments, and what a search in full found for the parts that are kept.

        Args:
            chosen: The parts that are kept.
        """
        for parts, (found, in_full) in self._found.items():
            if found.complete or (parts == chosen and in_full):
                yield asking(self._mission, parts), found


def asking(mission: Mission, parts: Parts) -> Mission:
    """Return the mission asking for its formula and some soft parts.

    Where any soft part counts robots all sets are searched for as formulas with counts are: plans whose robots meet are found for
    one set and not for a smaller one else.

    Args:
        mission: Whose parts.
        parts: Their indices.
    """
    asked = [mission.spec.formula or "true", *(mission.soft_parts[index].formula for index in sorted(parts))]
    if parts and any(mission.asking(part.formula).written.counts for part in mission.soft_parts):
        asked.append(_COUNTED)
    return mission.asking(asked[0] if len(asked) == 1 else " & ".join(f"({text})" for text in asked))
