"""Plans that keep as much weight of a mission's soft parts as can be kept beside its formula, and then cost least.

Which parts those are is found by the exact search over words, whatever method then plans: for each set of parts that is asked about, the
formula and these parts are one formula. The method is given the formula with those parts that its cheapest words do not keep anyway, so
that a part which holds anyway changes nothing. What is kept in the end is said by the certificate, which reads the parts from the mission.
`Searches` keeps within bounds on all of these searches together.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from ltlplan.allocation import Allocation, Known, key_of
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.exact import assign
from ltlplan.search.explanations.max_weight_subset import Kept, MostWeight, Parts
from verify.data import Infeasible, Mission, Plan, Unsatisfiable, Word
from verify.data.plan import Meeting
from verify.data.progress import Progress, part_of, silent

if TYPE_CHECKING:
    from verify.data.sections import SoftPart

Planner = Callable[..., Plan]
"""Plans a mission without soft parts, with what it is told of `progress` and what is `known`."""
KEPT = "Planned words keep weight"
"""How the note on what is kept begins."""
_EXPLAINED = 8  # parts that are given up of which it is said what keeping them would have cost
_COUNTED = "count(free) >= 0"  # holds always
_STATES = {"own": 30_000, "joint": 60_000}  # of one search; `joint` spends a tenth
_COURSES = {"own": 4_000, "joint": 1_200}
_LEAST = 16  # by how much later searches are cut down at most


class Searches:
    """Searches for the least cost of keeping sets of soft parts; each that is stopped halves what the next ones may take.

    Args:
        mission: Whose parts.
        beside: Budget of the search for the plan.

    Attributes:
        budget: Of a search in full.
        stopped: The sets whose least cost is not known.
    """

    def __init__(self, mission: Mission, beside: Budget) -> None:
        team = mission.spec.team
        self.budget = beside.beside(Budget(states=_STATES[team], courses=_COURSES[team]))
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
        budget = self.budget.of(self.budget.states // share)
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


def plan_with_soft_parts(mission: Mission, planned: Planner, progress: Progress = silent, known: Known | None = None) -> Plan:
    """Plan a mission so that the most weight of its soft parts is kept.

    Args:
        mission: With soft parts.
        planned: Plans a mission without soft parts, given what searches found before.
        progress: Told a sentence and the share done, 0 to 1.
        known: Carries the budget.

    Raises:
        Unsatisfiable: Not even the formula can be kept.
        Infeasible: A word exists, but no way between the hoops was found.
    """
    progress("choosing among soft parts", 0.0)
    budget = (known or Known()).budget
    searches = Searches(mission, budget)
    choices = MostWeight([part.weight for part in mission.soft_parts], searches.cost_of)
    best = choices.choose()
    if best is None:  # whoever plans the formula alone says why it cannot be kept, or finds out what was too large here
        best = Kept(frozenset(), math.inf, certain=False)
    if best.certain and searches.stopped - {best.parts}:  # what these cost at the least is not known
        best = replace(best, certain=False)
    made = _planned(mission, best.parts, searches, partial(planned, progress=part_of(progress, 0.2, 1.0)), budget)
    kept = best.parts if is_timed(mission, made.meetings) else kept_by_plan(mission, made)
    notes = (*made.notes, *_said(mission, kept, best, choices))
    return made.model_copy(update={"mission": made.mission.model_copy(update={"spec": mission.spec}), "notes": notes})


def _planned(mission: Mission, parts: Parts, searches: Searches, planned: Planner, budget: Budget) -> Plan:
    """Plan so that some parts are kept; those that the formula's cheapest words keep anyway are demanded only if they are lost then."""
    demanded, known = parts, list(searches.found_for(parts))
    if parts:
        with contextlib.suppress(TooLarge):  # without them; with them it was not
            plain = asking(mission, frozenset())
            found = assign(plain, budget=budget)
            known.append((plain, found))
            words = {name: does.word for name, does in found.robots.items()}
            demanded = (
                parts if found.precedences or is_timed(mission, found.meetings) else parts - kept_by_words(mission, words)
            )
    found_before = {key_of(asked): allocation for asked, allocation in known}
    given = Known(found=found_before, budget=searches.budget if parts else budget)
    made = planned(asking(mission, demanded), known=given)
    if demanded != parts and (is_timed(mission, made.meetings) or not parts <= kept_by_plan(mission, made)):
        made = planned(asking(mission, parts), known=given)
    return made


def is_timed(mission: Mission, meetings: Sequence[Meeting]) -> bool:
    """Tell whether what planned words keep depends on their times: robots wait for each other, or fly laps together.

    Args:
        mission: Whose parts.
        meetings: Of the plan.
    """
    return bool(meetings) or (mission.spec.trace == "infinite" and len(mission.agents) > 1)


def kept_by_plan(mission: Mission, made: Plan) -> Parts:
    """Return the soft parts, by index, that a plan's words keep in every order of the robots; or under its precedences and meetings, where the formula needs them.

    Args:
        mission: Whose parts.
        made: A plan for it, of a finite trace where robots are several.
    """
    import verify

    hard = mission.asking(mission.spec.formula).formula
    waits = made.meetings or (made.precedences and not verify.check_team(hard, made.words, team=mission.spec.team).sequential)
    if not waits:
        return kept_by_words(mission, made.words)
    asked = (mission.asking(part.formula) for part in mission.soft_parts)
    return frozenset(i for i, part in enumerate(asked) if verify.check_planned_order(made.model_copy(update={"mission": part})))


def kept_by_words(mission: Mission, words: Mapping[str, Word]) -> Parts:
    """Return the soft parts, by index, that planned words keep in every order of the robots.

    Plans whose robots meet keep more, in the order of their meetings.

    Args:
        mission: Whose parts.
        words: One for each robot.
    """
    import verify

    asked = (mission.asking(part.formula).formula for part in mission.soft_parts)
    team = mission.spec.team
    return frozenset(i for i, formula in enumerate(asked) if verify.check_team(formula, words, team=team).sequential)


def part_text(part: SoftPart) -> str:
    """Return a soft part for a person."""
    return f"`{part.formula}` (weight {part.weight:g})"


def _said(mission: Mission, kept: Parts, best: Kept, choices: MostWeight) -> list[str]:
    """Say what is kept, and of each part that is given up what keeping it would have cost."""
    parts = mission.soft_parts
    weight, whole = (math.fsum(parts[index].weight for index in those) for those in (kept, range(len(parts))))
    said = [f"{KEPT} {weight:g} of {whole:g} of the soft parts."]
    given_up = [index for index in range(len(parts)) if index not in kept]
    priced = ((part_text(parts[index]), _price(mission, index, kept, choices)) for index in given_up[:_EXPLAINED])
    said += [f"Given up: {text}; {price}." for text, price in priced]
    if given_up[_EXPLAINED:]:
        said.append(f"And {len(given_up) - _EXPLAINED} more are given up.")
    if not best.certain:
        said.append("Not all choices could be searched; a plan that keeps more weight, or costs less, may exist.")
    return said


def _price(mission: Mission, index: int, kept: Parts, choices: MostWeight) -> str:
    other = choices.choose(frozenset({index}))
    if other is None:
        known = choices.alone_impossible(index)
        return "it cannot be kept beside the formula" if known else "no plan that keeps it was found"
    lost = [part_text(mission.soft_parts[i]) for i in sorted(kept - other.parts)]
    return f"keeping it would give up {' and '.join(lost)}" if lost else f"keeping it would cost {other.cost:.3f} in all"
