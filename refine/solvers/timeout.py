"""Engines' clocks: they only ever end a run with an error, so that a slow machine gives the same answer or none.

Budgets of iterations may shape an answer, since they run out at the same place everywhere. Whoever goes on after an engine
that did not converge must let `ClockRanOut` pass.
"""

from __future__ import annotations

from verify.data import Infeasible


class ClockRanOut(Infeasible):
    """An engine used up its seconds before its iterations; another machine might have found an answer.

    Attributes:
        engine: Its name.
        seconds: Its budget, s.
    """

    def __init__(self, engine: str, seconds: float) -> None:
        super().__init__(
            f"{engine} did not finish within its {seconds:g} s. Nothing is concluded from that: run again on a machine that "
            "is faster or less busy, or ask for a smaller problem."
        )
        self.engine = engine
        self.seconds = seconds
