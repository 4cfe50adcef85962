"""One claim: what is said of a flight, whether it is proved, and what shows that it is not."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from typing import Literal

from verify.data.witness import Witness
from verify.logic.verdict import Verdict

Outcome = Literal["holds", "fails", "undecided"]

ProofWord = Literal["checked", "judged", "not covered"]
"""By whom a claim is proved: by the kernel too, by the checker alone, or by the checker where the kernel has no such claim."""


@dataclass(frozen=True, slots=True)
class Claim:
    """One part of a certificate.

    Attributes:
        name: "formula", "timing", "transitions", "visits", "passages", "ordered", "precedences", "rims", "obstacles", "workspace",
            "separation", "continuity", "parts", "tracking" or "limits." and the limit's name.
        outcome: Only "holds" is proved; "fails" is refuted; "undecided" is neither.
        sentence: One sentence for a person.
        robot: The robot concerned; None for the team.
        other: The second robot, for claims about pairs.
        unit: Unit of bound, limit and margin.
        bound: What is proved for all times, rounded to the strict side.
        limit: What is asked.
        margin: How far the bound is from the limit; negative where the claim fails.
        time: Where it is tight or broken, in s.
        witness: For a claim that does not hold, what repair and reports work with.
        proof: By whom it is proved (`verify.checked_claims` decides).
        missing: What the kernel lacks to check it, where a proof was written.
    """

    name: str
    outcome: Outcome
    sentence: str
    robot: str | None = None
    other: str | None = None
    unit: str = ""
    bound: float | None = None
    limit: float | None = None
    margin: float | None = None
    time: float | None = None
    witness: Witness | None = None
    proof: ProofWord = field(default="judged", compare=False)
    missing: str = field(default="", compare=False)


# as many parameters as a claim and its witness have parts, each by its keyword
def claim_of(
    name: str,
    outcome: Outcome,
    sentence: str,
    *,
    robot: str | None = None,
    other: str | None = None,
    unit: str = "",
    bound: float | None = None,
    limit: float | None = None,
    margin: float | None = None,
    time: float | None = None,
    region: str | None = None,
    visit: int | None = None,
    what: str = "",
    way: tuple[float, float, float] | None = None,
) -> Claim:
    """Return a claim, with a witness where it does not hold.

    Args:
        name: One of those that `Claim` lists.
        outcome: Whether it is proved, refuted or neither.
        sentence: For a person.
        robot: Name of the robot concerned.
        other: Name of the second one, for a claim about a pair.
        unit: Of bound, limit and margin.
        bound: What is proved for all times.
        limit: What is asked.
        margin: How far the bound is from the limit.
        time: Where it is tight or broken, s.
        region: Name of the region concerned, for the witness.
        visit: Index of the planned visit concerned, for the witness.
        what: What the bound measures, for the witness.
        way: Unit vector along which the robot would have to be elsewhere, for the witness.
    """
    witness = None
    if outcome != "holds":
        witness = Witness(
            claim=name, sentence=sentence, robot=robot, other=other, time=time, region=region, visit=visit,
            bound=bound, limit=limit, what=what, way=way,
        )  # fmt: skip
    return Claim(name, outcome, sentence, robot, other, unit, bound, limit, margin, time, witness)


def claim_of_verdict(verdict: Verdict) -> Claim:
    """Return a verdict on words, or on their times, as a claim; what is to spare of a time that is asked is its bound."""
    spare, witness = verdict.slack, None if verdict.outcome == "holds" else verdict.witness()
    claim = Claim(verdict.claim, verdict.outcome, verdict.sentence, robot=verdict.robot, time=verdict.time, witness=witness)
    return claim if spare is None else replace(claim, unit="s", bound=spare, limit=0.0, margin=spare)


def at_least(value: Fraction | float, digits: int = 4) -> str:
    """Write a lower bound with so many decimals, rounded down: what is printed is proved, too.

    Args:
        value: What is proved.
        digits: Decimals.
    """
    if not math.isfinite(value):
        return f"{float(value):.{digits}f}"
    return f"{Decimal(math.floor(Fraction(value) * 10**digits)).scaleb(-digits):.{digits}f}"


def at_least_asked(value: float, limit: float) -> tuple[str, str]:
    """Write a lower bound that is no less than a limit, rounded down, and the limit, with so many decimals that one sees that.

    Args:
        value: What is proved.
        limit: What is asked.
    """
    for digits in range(4, 17):
        bound, asked = at_least(value, digits), f"{limit:.{digits}f}"
        if float(bound) >= float(asked):
            return bound, asked
    return repr(value), repr(limit)


def figures(value: float, count: int, *, up: bool) -> str:
    """Write a bound with so many figures, rounded to its safe side: what is printed is proved, too.

    Args:
        value: What is proved.
        count: Figures.
        up: Whether it is a bound from above.
    """
    if not math.isfinite(value):
        return f"{value:.{count}g}"
    safe = Context(prec=count, rounding=ROUND_CEILING if up else ROUND_FLOOR).create_decimal(Decimal(value))
    return f"{float(safe):.{count}g}"


def told_apart(value: float, limit: float) -> str:
    """Write a value with enough digits to differ from a limit that it breaks.

    Args:
        value: What is proved, or reached.
        limit: What is asked.
    """
    for digits in range(5, 17):
        text = f"{value:.{digits}g}"
        if text != f"{limit:.{digits}g}":
            return text
    return repr(value)
