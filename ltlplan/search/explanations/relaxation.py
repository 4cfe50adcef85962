"""The cheapest way to relax a formula that no plan satisfies: which of its parts to leave out so that the rest can be planned."""

from __future__ import annotations

from ltlplan.logic.conjunction import conjuncts
from ltlplan.search.explanations.max_weight_subset import MostWeight, Parts
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from ltlplan.search.problem import Problem
from verify.data import parse_formula

_SEARCHES = 40
_PARTS = 40  # more are not tried


def relaxed(problem: Problem, error: NoPlan) -> NoPlan:
    """Return the error with what to leave out of the formula: the fewest parts, for each of them counts 1.

    Args:
        problem: Whose formula cannot be met.
        error: Says why.
    """
    mission = problem.mission
    written = parse_formula(mission.spec.formula or "true", mission.propositions, robots=mission.agents)
    parts = tuple(dict.fromkeys(conjuncts(written)))
    if not 1 < len(parts) <= _PARTS:
        return error

    def cost_of(kept: Parts) -> float | None:
        return problem.cheapest(mission.asking(" & ".join(f"({parts[index]})" for index in sorted(kept)))) if kept else 0.0

    best = MostWeight([1.0] * len(parts), cost_of, searches=_SEARCHES).choose()
    if best is None or not best.parts:
        return error
    left_out = [str(part) for index, part in enumerate(parts) if index not in best.parts]
    return NoPlan(error.core, error.reasons, error.edges, left_out, least=best.certain)
