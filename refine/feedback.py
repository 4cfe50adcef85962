"""Feedback from the checker's witnesses to the next attempt: limits tightened, clearances widened, waits added."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from refine.limits.limits import LIMIT_NAMES
from verify.data import Plan, Witness
from verify.data.plan import Meeting, Precedence


@dataclass(frozen=True)
class Feedback:
    """Changes that the witnesses of a rejected certificate require of the next attempt.

    Attributes:
        limits: (robot, limit): factor in (0, 1] by which it is tightened.
        clearance: Robot: m on top of the margin.
        distance: m on top of the separation.
        precedences: Waits: those of the plan, its meetings, and more.
    """

    limits: dict[tuple[str, str], float]
    clearance: dict[str, float]
    distance: float
    precedences: tuple[Precedence | Meeting, ...]


def feedback_of(plan: Plan, witnesses: tuple[Witness, ...]) -> Feedback:
    """Return what all witnesses so far ask for together."""
    limits: dict[tuple[str, str], float] = {}
    clearance: Counter[str] = Counter()
    distance, precedences = 0.0, list(plan.precedences)
    for witness in witnesses:
        names = list(plan.robots) if witness.robot is None else [witness.robot]
        limit = witness.claim.removeprefix("limits.")
        if witness.claim == "separation":
            short = max(0.0, (witness.limit or 0.0) - (witness.bound or 0.0))
            distance += short + 5e-3
        elif limit in LIMIT_NAMES:
            for name in names:
                limits[name, limit] = limits.get((name, limit), 1.0) * _tightening(limit, witness)
        elif limit == "endurance":
            continue  # no other flight of the same plan is shorter
        elif witness.order:
            precedences += [Precedence(first=first, then=then) for first, then in witness.order]
        else:
            clearance.update(dict.fromkeys(names, 1))
    return Feedback(
        limits,
        {name: 5e-3 * count for name, count in clearance.items()},
        distance,
        (*dict.fromkeys(precedences), *plan.meetings),
    )


def _tightening(limit: str, witness: Witness) -> float:
    """Return the factor by which a limit that was broken by a known amount is tightened."""
    if witness.bound is None or witness.limit is None or not witness.bound > 0:
        return 0.98
    over = (
        witness.limit / witness.bound if not limit.endswith("min") else witness.bound / witness.limit if witness.limit else 0.98
    )
    return float(np.clip(over, 0.8, 0.998)) * 0.998
