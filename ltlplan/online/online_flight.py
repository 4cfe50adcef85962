"""Result of an online flight and the checker's verdict on it: the value that `fly_online` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flight.logs.log import FlightLog
from verify.data import Letter, Mission, NotCertified
from verify.data.events import WorldEvent
from verify.flight_segments import Piece
from verify.logic.verdict import Verdict

Floats = NDArray[np.float64]

NOT_CERTIFIED = (
    "Flown online, in simulation only: nothing about this flight was certified beforehand, and it cannot be exported."
)

CERTIFIED = (
    "Flown online, in simulation only, in pieces, each certified for what was left of the formula, with all that was flown "
    "before and with the slowing down after changes of the world. Such a flight cannot be exported."
)

NOT_ALL_CERTIFIED = (
    "Flown online, in simulation only, in certified pieces, but not all of the flight is certified, and it cannot be exported."
)

LIVE = (
    "Flown online over a link, in pieces, each certified for what was left of the formula, with all that was flown before and with the "
    "slowing down after changes of the world, and watched in its tube."
)

LIVE_NOT_ALL_CERTIFIED = "Flown online over a link, in certified pieces, but not all of the flight is certified:"


@dataclass(frozen=True, eq=False)
class OnlineFlight:
    """Online flight as it was flown, with the checker's verdict on it.

    Attributes:
        mission: As it was at the end.
        log: 100 Hz, with the events in it.
        verdict: The checker's, over the flown words and the mission's whole formula.
        duration: s of simulated flight.
        satisfied_at: When the formula was first satisfied, s; None where it never was.
        planned_cost: Summed cost of the courses at take-off.
        final_cost: Summed cost of the courses that were flown last.
        step_seconds: Computing time of each online step, s (not part of the flight's result). Shape (steps,).
        words: Each robot's flown word.
        certified: Whether only certified pieces were flown, slowing down included, and inside their margin.
        certificates: Digests of the certificates that were flown, in order.
        pieces: What was proved to be flown, where the flight was a certified one.
        earlier: The mission as it was before each change of the world, with the time in s of that change.
        events: What changed, each with the time at which the team came to know of it.
        measured: Whether it was measured over a link, and not simulated from within.
    """

    mission: Mission
    log: FlightLog
    verdict: Verdict
    duration: float
    satisfied_at: float | None
    planned_cost: float
    final_cost: float
    step_seconds: Floats
    words: Mapping[str, tuple[Letter, ...]]
    certified: bool = False
    certificates: tuple[str, ...] = ()
    pieces: tuple[Piece, ...] = ()
    earlier: tuple[tuple[float, Mission], ...] = ()
    events: tuple[WorldEvent, ...] = ()
    measured: bool = False

    @property
    def asked(self) -> Mission:
        """The mission as it was at take-off."""
        return self.earlier[0][1] if self.earlier else self.mission

    def require(self) -> OnlineFlight:
        """Return the flight if its words satisfy the formula.

        Raises:
            NotCertified: The verdict is not *holds*; carries the counterexample.
        """
        if not self.verdict:
            raise NotCertified(f"The flown words do not keep the formula: {self.verdict.sentence}", [self.verdict.witness()])
        return self

    def sentences(self) -> list[str]:
        """Return how long was flown and what the checker says, a sentence each."""
        done = "never" if self.satisfied_at is None else f"after {self.satisfied_at:.1f} s"
        return [
            f"{self.mission.name} flew {self.duration:.1f} s; the formula was satisfied {done}.",
            f"Verdict on the flown words: {self.verdict.outcome}. {self.verdict.sentence}",
        ]

    def summary(self) -> str:
        """Return a few sentences for a person."""
        return " ".join([*self.log.notes, *self.sentences()])
