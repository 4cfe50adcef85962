"""Engines' clocks: they end a run with an error, but where a flight that holds is there already: that one stands, with a note.

Budgets of iterations may shape an answer, since they run out at the same place everywhere. A time-out is no kind of `Infeasible`:
whoever goes on after an engine that found nothing lets it pass.
"""

from __future__ import annotations

from verify.data import LtlplanError


class SolverTimeout(LtlplanError):
    """An engine used up its seconds before its iterations; another machine might have found an answer.

    Attributes:
        engine: Its name.
        seconds: Its budget, s.
    """

    exit_code = 4  # as for what is infeasible: there is no trajectory to go on with

    def __init__(self, engine: str, seconds: float) -> None:
        super().__init__(
            f"{engine} did not finish within its {seconds:g} s. Nothing is concluded from that: run again on a machine that "
            "is faster or less busy, or ask for a smaller problem."
        )
        self.engine = engine
        self.seconds = seconds
