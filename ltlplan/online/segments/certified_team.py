"""Online flight that is certified as it goes: robots fly only pieces that were proved for what is left of the formula.

At take-off the whole mission is planned, refined and certified; nobody moves before that has succeeded. When the world
changes, the certificate no longer speaks of what is flown. Robots come to rest by pieces that are checked first (`segmented_flight`)
and hold their positions until two things are proved:

* a certificate of what is left, an ordinary mission: it begins where the robots hover, with each one's internal state and the
  region that it visited last, and its formula is what is left of the whole one in every way to read the letters so far
  (`formula_progression`);
* the whole formula on the whole flight (`verify.flight_segments`): the label timelines of all that was flown, slowing down included,
  each in the world as it then was, with the new piece at the end. Between the two, robots only hover.

So what was shown is part of the claim with all that it may have been within the margin, whatever the cameras saw. Where a proof
fails nothing is handed to a robot: the team goes on holding its position and says why.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from ltlplan.online.segments.segment_planning import (
    Found,
    Left,
    WholeFlight,
    find_piece,
    piece_of,
    require_proved,
    with_endurance_left,
)
from ltlplan.online.segments.segmented_flight import TeamInPieces, exact_step
from ltlplan.online.segments.time_left import Flown, with_times_left
from ltlplan.online_mtac.path_blending import ORDERS
from ltlplan.online_mtac.team_in_flight import Desired
from ltlplan.pipeline import Certified
from verify.data import LtlplanError, Mission, NotCertified
from verify.data.shapes.inequalities import Point, point_of
from verify.flight_segments import Piece

_FORESEEN = 0.04
"""s between the places on nominal paths where it is foreseen what robots will show."""


class CertifiedTeam(TeamInPieces):
    """A team that flies certified trajectories and holds position whenever it has none.

    Attributes:
        certified: What was certified last, with its plan.
        certificates: Digests of all certificates that were flown, in order.
    """

    def __init__(self, mission: Mission, *, seed: int) -> None:
        """Certify the whole mission at its starts.

        Args:
            mission: What is asked.
            seed: Source of every draw.

        Raises:
            BadInput: The trace is infinite, or the mission has a sequence.
            Unsatisfiable: Nothing that these robots can fly satisfies the formula.
            Infeasible: Refinement found no trajectory within the limits.
            NotCertified: The proof was rejected.
        """
        super().__init__(mission)
        self.seed = seed
        self.certified: Certified | None = None
        self.certificates: tuple[str, ...] = ()
        self._left: Mission | None = None
        self._counts_from: Fraction | None = None
        self.allocate()

    @property
    def cost(self) -> float:
        """Summed length of the certified trajectories, m."""
        total = 0.0
        for track in self._tracks.values():
            at = track.evaluate(np.linspace(0.0, track.duration, 400))[:, :3]
            total += float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        return total

    def allocate(self) -> None:
        """Plan, refine and certify what is left; on success `holding` is None.

        Raises:
            Unsatisfiable: Nothing that is left satisfies the formula.
            Infeasible: No trajectory keeps the limits.
            NotCertified: A proof was rejected, or what was flown is not certified itself.
        """
        try:
            left = self.what_is_left(self._now)
            answer = find_piece(left)
            flight = self.with_next(left, answer, self._now)
            require_proved(flight)
        except LtlplanError as error:
            self.refuse(error)
            raise
        self.take_over(flight.last, answer)

    def what_is_left(self, latest: Fraction) -> Left:
        """Return what is left to be flown from where robots hover, as a question that can be asked elsewhere.

        Args:
            latest: Flight time at which its answer is flown at the latest, exact, in s.

        Raises:
            Unsatisfiable: Nothing that comes can make the formula true.
            NotCertified: What was flown is not certified itself.
        """
        if self.lost is not None:
            raise NotCertified(self.lost)
        if not self.certificates:
            return Left(self.mission, self.seed, latest)
        self._left = None
        left, self._counts_from = self.left(), None
        if self.mission.timed_parts:
            flown = Flown.of(self.mission, self.all_pieces, self._now, latest)
            left, self._counts_from = with_times_left(left, self.mission, flown), flown.latest
        self._left = with_endurance_left(left, latest)
        return Left(self._left, self.seed, latest)

    def what_will_be_left(self, latest: Fraction) -> Left:
        """Return what will be left when everybody has come to rest, if until then is shown what nominal paths show.

        It may be asked while robots slow down. Whatever they show then, a piece that comes of it is checked with all that they may have shown.

        Args:
            latest: As for `what_is_left`.

        Raises:
            Unsatisfiable: As for `what_is_left`.
            NotCertified: As for `what_is_left`.
        """
        belief, shown = self.belief, self.shown
        where = {name: pilot.where for name, pilot in self.pilots.items()}
        begin, end = (0.0, 0.0) if self.present is None else (float(self.present.start), float(self.present.end))
        self.shown = [*shown]
        try:
            for time in np.arange(float(self._now), end, _FORESEEN):
                self._show(
                    float(time),
                    {name: point_of(track.evaluate(max(time - begin, 0.0))[:3]) for name, track in self._tracks.items()},
                )
            for pilot in self.pilots.values():
                self.root(pilot, end)
            self._show(end, {name: pilot.where.position for name, pilot in self.pilots.items()})
            return self.what_is_left(latest)
        finally:
            self.belief, self.shown = belief, shown
            for name, pilot in self.pilots.items():
                pilot.where = where[name]

    def with_next(self, left: Left, answer: Found, start: Fraction) -> WholeFlight:
        """Return all that was flown with what was found behind it, to be checked.

        Args:
            left: The question.
            answer: What was found.
            start: Flight time at which it is to begin, exact, in s.

        Raises:
            NotCertified: That is later than was said when it was asked.
        """
        if start > left.latest:
            raise NotCertified(
                f"what is left was certified to begin by {float(left.latest):.2f} s, not at {float(start):.2f} s."
            )
        return WholeFlight(self.mission, (*self.all_pieces, piece_of(left.mission, answer.certified, start)))

    def take_over(self, piece: Piece, answer: Found) -> None:
        """Fly a piece from now on that was checked together with all that was flown before.

        Args:
            piece: It begins where everybody hovers.
            answer: What it was made of.
        """
        self.fly(piece, answer.ways)
        self.certificates = (*self.certificates, answer.certified.certificate.digest())
        self.holding = None
        self.certified = answer.certified

    def refuse(self, error: LtlplanError) -> None:
        """Hold positions, as there is nothing certified to fly.

        Args:
            error: Why.
        """
        self.holding = f"No certified pieces for what is left, so the robots hold their positions: {error}"
        if self._left is not None and self._counts_from is not None:
            since = float(self._counts_from)
            self.holding += f" Times and bounds count from {since:.2f} s of the flight." + self.deadlines.refused(
                self._left, since
            )

    def step(self, now: float, positions: Mapping[str, Point]) -> Desired:
        """Go on along the certified trajectories, or hover at their ends."""
        self._now = exact_step(now)
        self._keep_watch(positions)
        self.observe(now, positions)
        self.share_again(now)
        flat = np.zeros((ORDERS, 4, len(self.pilots)))
        for j, name in enumerate(self.pilots):
            track, time = self._tracks[name], self._time
            for order in range(ORDERS):
                flat[order, :, j] = track.evaluate(time, order)
        self.steps += 1
        satisfied = self.satisfied
        finished = satisfied and self.holding is None and self.ended
        return Desired(flat, satisfied, finished, self.holding, self.deadlines.news())
