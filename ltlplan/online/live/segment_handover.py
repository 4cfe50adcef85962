"""Handover to the next flight segment: planned while the team slows down and hovers, checked with all that was flown, begun at the instant that was checked."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf

from flight.link.live_executive import PATIENCE, STEP
from flight.link.phases import FLIGHT, Part, Stage, Watched
from flight.link.preflight_checks import at_start
from ltlplan.online.live.executors import Answer, judgement, next_piece
from ltlplan.online.live.flight_session import InAir, exact_instant, result_of
from ltlplan.online.segments.segment_planning import Found, Left, WholeFlight
from ltlplan.pipeline import Certified
from verify.data import LtlplanError, NotCertified

LEAD = 0.15
"""s from asking for a judgement to where the piece begins, at first."""
AHEAD = 0.06
"""s before its beginning at which a piece is started: three looks."""
LATEST = 10.0
"""s after an answer is asked for at which its piece begins at the latest, as far as endurances are counted."""
SOON = 4.0
"""The same at first where the formula has bounds in seconds, s: they are planned so that any beginning until then is in time."""


@dataclass
class WhatFollows:
    """Progress of the next segment.

    Attributes:
        air: The team.
        due: A proved piece that waits for its instant.
        refused_at: When nothing was proved of what is left, s of the link's clock; None where that was not so, or the world changed since.
    """

    air: InAir
    due: Watched | None = None
    refused_at: float | None = None
    _lead: float = LEAD
    _within: float = SOON
    _left: Left | None = None
    _found: Found | None = None
    _whole: WholeFlight | None = None
    _part: Part | None = None
    _patient: float = inf

    def forget(self) -> None:
        """Give up what was found for a world that is no more."""
        self.due = self._whole = self._found = self._left = None

    def ask(self) -> None:
        """Ask for a certified flight of what will be left when all have come to rest."""
        try:
            within = self._within if self.air.team.mission.timed_parts else LATEST
            self._left = self.air.team.what_will_be_left(exact_instant(self.air.now + within, ceil))
        except LtlplanError as error:
            self.refuse(error)
            return
        self.air.ask(next_piece, self._left, self._piece_found)

    def go_on(self) -> None:
        """Begin the next piece where it is time for it."""
        if self.due is not None and self._whole is not None and self.air.now >= float(self._whole.last.start) - AHEAD:
            self._begin(self.due, self._whole)

    def refuse(self, error: LtlplanError | None) -> None:
        """Hover, as nothing is proved of what is left.

        Args:
            error: Why; None where the team says so itself.
        """
        if error is not None:
            self.air.team.refuse(error)
        self.refused_at = self.air.link.now()
        self.air.note(self.air.team.holding or "", None, "reaction")

    def _piece_found(self, answer: Answer) -> None:
        try:
            self._found = result_of(answer)
        except LtlplanError as error:
            self.refuse(error)
            return
        self._patient = self.air.now + PATIENCE
        self._ask_judgement()

    def _ask_judgement(self) -> None:
        """Ask whether all is proved if the piece begins in a moment, when all hover and nobody is on the way down."""
        air = self.air
        assert self._left is not None and self._found is not None, "it was found"  # noqa: PT018
        down = max((leaving.down or 0.0 for leaving in air.leaving), default=0.0) - air.began
        start = exact_instant(max(air.now + self._lead + AHEAD, float(air.present.end), down), ceil)
        if start > self._left.latest:
            self._within *= 2
            self.ask()
            return
        self._whole = air.team.with_next(self._left, self._found, start)
        air.ask(judgement, self._whole, self._judged)

    def _judged(self, answer: Answer) -> None:
        """Take the piece, or refuse it; where it should have begun by now, ask for a later beginning."""
        air = self.air
        try:
            result_of(answer)
        except LtlplanError as error:
            self.refuse(error)
            return
        if air.answered[-1].proved is None:
            air.took(proved=air.link.now() - air.known)
        assert self._whole is not None and self._found is not None, "it was judged"  # noqa: PT018
        if air.now > float(self._whole.last.start) - STEP / 2 or any(leaving.down is None for leaving in air.leaving):
            self._lead *= 2
            self._ask_judgement()
            return
        stage = stage_of(self._found.certified)
        self.due, self._part = stage.watched(air.link.accuracy), stage.parts[0]

    def _begin(self, watched: Watched, whole: WholeFlight) -> None:
        """Begin a proved piece at the very instant with which it was checked."""
        air = self.air
        if air.now > float(whole.last.start):
            self.due = None
            self._ask_judgement()
            return
        assert self._found is not None, "it was judged"
        if faults := self._off_start():
            self.due = None
            if air.now > self._patient:
                self.refuse(NotCertified(f"tracking is not proved from where robots are: {'; '.join(faults)}."))
            else:
                self._ask_judgement()
            return
        air.number = air.flying.store(watched.paths)
        air.watch = air.flying.begin(watched, air.number, air.began + float(whole.last.start))
        air.team.take_over(whole.last, self._found)
        air.took(begun=air.began + float(whole.last.start) - air.known)
        air.note(f"A certified piece for what is left begins at {float(whole.last.start):.2f} s.", None, "reaction")
        self.forget()

    def _off_start(self) -> list[str]:
        """Return a sentence on each robot that is not where the proof of tracking lets the piece begin, where there is one."""
        if self._part is None or self._part.start is None:
            return []
        return [check.sentence for check in at_start(self.air.link, self._part) if not check.passed]


def stage_of(certified: Certified) -> Stage:
    """Return a certified flight as a link flies it."""
    return Stage(FLIGHT, certified.plan, certified.team, certified.certificate)
