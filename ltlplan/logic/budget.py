"""Budgets of searches: counted in states, never in seconds, so that a result does not depend on the machine.

Only the translation of a large formula also has a clock, and that can only end it with an error.
"""

from __future__ import annotations

from dataclasses import dataclass

from verify.data import BadInput


class TooLarge(BadInput):
    """A budget was used up before there was an answer; nothing is known about satisfiability.

    Attributes:
        shortage: What was too large, as a sentence.
        used: How many were needed at least.
        limit: How many were allowed.
    """

    def __init__(self, what: str, used: int, unit: str, limit: int, hint: str = "") -> None:
        advice = hint or "Simplify the formula, write it as a conjunction of smaller parts, or raise the budget."
        self.shortage = f"{what} more than {limit:,} {unit}."
        super().__init__(f"{self.shortage} {advice}")
        self.used = used
        self.limit = limit


class StoppedEarly(BadInput):
    """A search was stopped on request before it had any plan; nothing is known about satisfiability."""

    def __init__(self, states: int) -> None:
        super().__init__(
            f"The search was stopped on request after {states:,} states, before any plan was found. Let it run for longer."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Bounds on planning.

    Attributes:
        states: States of the search that may be expanded, in all.
        courses: States of a search over interleavings that may be expanded; None for a fiftieth of `states`.
        lasso: States that an infinite trace's product of robot and automata may have.
        rounds: States that may be expanded in search of an infinite trace's cheapest round.
        candidates: Complete plans that may be tried where the first ones are rejected.
        automaton: States of one explicit automaton.
        seconds: s of processor time that the translation of one large formula may take, in a process of its own.
        megabytes: MB that this process may take.
    """

    states: int = 3_000_000
    courses: int | None = None
    lasso: int = 300_000
    rounds: int = 20_000
    candidates: int = 20_000
    automaton: int = 20_000
    seconds: float = 20.0
    megabytes: int = 2048


DEFAULT_BUDGET = Budget()
