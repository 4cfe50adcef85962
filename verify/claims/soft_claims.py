"""Verdicts of a certificate on each soft specification: proved, refuted or undecided, by the checker of formulas. None makes a certificate fail.

The parts are the mission's own. Which of them a plan meant to keep is not asked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from verify.claims.claim import Outcome
from verify.data.mission import Mission
from verify.data.witness import Witness
from verify.logic.verdict import Verdict


@dataclass(frozen=True, slots=True)
class SoftClaim:
    """Verdict on one soft specification of a mission, for all times and within the margin.

    Attributes:
        formula: As the mission writes it.
        weight: As the mission weighs it.
        outcome: Only "holds" is proved, and only its weight counts.
        sentence: For a person.
        witness: Where it does not hold, what breaks it and what would mend it.
    """

    formula: str
    weight: float
    outcome: Outcome
    sentence: str
    witness: Witness | None = None


def soft_claims(mission: Mission, judged: Callable[[Mission], Verdict]) -> tuple[SoftClaim, ...]:
    """Check each soft specification by itself, as if it were the mission's formula.

    Args:
        mission: Whose parts.
        judged: The checker of a mission's formula.
    """
    found: list[SoftClaim] = []
    for part in mission.soft_parts:
        verdict = judged(mission.asking(part.formula))
        witness = None if verdict.outcome == "holds" else verdict.witness()
        found.append(SoftClaim(part.formula, part.weight, verdict.outcome, verdict.sentence, witness))
    return tuple(found)
