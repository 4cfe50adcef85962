"""Online flight that is certified as it goes: robots fly only pieces that were proved for what is left of the formula.

At take-off the whole mission is planned, refined and certified; nobody moves before that has succeeded. When the world
changes, the certificate no longer speaks of what is flown. Robots come to rest by pieces that are judged first (`online.braking`)
and hold their positions until two things are proved:

* a certificate of what is left, an ordinary mission: it begins where the robots hover, with each one's internal state and the
  region that it visited last, and its formula is what is left of the whole one in every way to read the letters so far
  (`sharing.residual`);
* the whole formula on the whole flight (`verify.pieces`): the label timelines of all that was flown, slowing down included,
  each in the world as it then was, with the new piece at the end. Between the two, robots only hover.

So what was shown is part of the claim with all that it may have been within the margin, whatever the cameras saw. Where a proof
fails nothing is handed to a robot: the team goes on holding its position and says why. If robots cannot be brought to rest in a
way that the judge accepts (a rim has moved into their way), they stop as soon as they can, which is said, and hold for good.
A robot that fails or leaves is outside every claim from then on, but for the letter that it held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ltlplan.online.braking import Stop, StoppingManoeuvre, Ways, come_to_rest
from ltlplan.online.next_piece import Found, Left, WholeFlight, find_piece, piece_of, require_proved, with_endurance_left
from ltlplan.pipeline import Certified
from ltlplan.sharing.gliding_path import ORDERS
from ltlplan.sharing.team_in_flight import PERIOD, Desired, LocatedRobot, TeamInFlight
from verify.behaviour.timeline import InternalChange
from verify.data import LtlplanError, Mission, NotCertified, Trajectory
from verify.data.events import WorldEvent
from verify.data.sections import Action, Agent
from verify.data.shapes.inequalities import Point
from verify.pieces import Piece

Floats = NDArray[np.float64]


_FORESEEN = 0.04
"""s between the places on nominal paths where it is foreseen what robots will show."""


class CertifiedTeam(TeamInFlight[LocatedRobot]):
    """A team that flies certified trajectories and holds position whenever it has none.

    Attributes:
        pieces: What was flown before the present piece.
        present: What is flown now; None where nobody is in the air.
        certified: What was certified last, with its plan.
        certificates: Digests of all certificates that were flown, in order.
        lost: Why the flight is not certified in all its parts any more, or None.
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
            NotCertified: The proof was refused.
        """
        super().__init__(mission, lambda _mission, _world, name, where: LocatedRobot(name, where))
        self.seed = seed
        self.pieces: tuple[Piece, ...] = ()
        self.present: Piece | None = None
        self.certified: Certified | None = None
        self.certificates: tuple[str, ...] = ()
        self.lost: str | None = None
        self._now = Fraction(0)
        self._acted: dict[str, int] = {}
        self._braking = False
        self._ways: Ways = {}
        self._proved_count: int | None = None
        self.allocate()

    @property
    def cost(self) -> float:
        """Summed length of the certified trajectories, m."""
        total = 0.0
        for track in self._tracks.values():
            at = track.evaluate(np.linspace(0.0, track.duration, 400))[:, :3]
            total += float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        return total

    @property
    def all_pieces(self) -> tuple[Piece, ...]:
        """What is proved of the flight, the present piece last; a stop that was refused ends it."""
        every = self.pieces if self.present is None else (*self.pieces, self.present)
        return every[: self._proved_count]

    @property
    def _tracks(self) -> Mapping[str, Trajectory]:
        return {} if self.present is None else self.present.team

    def allocate(self) -> None:
        """Plan, refine and certify what is left; on success `holding` is None.

        Raises:
            Unsatisfiable: Nothing that is left satisfies the formula.
            Infeasible: No trajectory keeps the limits.
            NotCertified: A proof was refused, or what was flown is not certified itself.
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
        left = with_endurance_left(self.left(), latest) if self.certificates else self.mission
        return Left(left, self.seed, latest)

    def what_will_be_left(self, latest: Fraction) -> Left:
        """Return what will be left when everybody has come to rest, if until then is shown what nominal paths show.

        It may be asked while robots slow down. Whatever they show then, a piece that comes of it is judged with all that they may have shown.

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
                    {name: _point(track.evaluate(max(time - begin, 0.0))[:3]) for name, track in self._tracks.items()},
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
        """Return all that was flown with what was found behind it, to be judged.

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
        """Fly a piece from now on that was judged together with all that was flown before.

        Args:
            piece: It begins where everybody hovers.
            answer: What it was made of.
        """
        self.pieces, self.present = self.all_pieces, piece
        self._acted, self._braking = dict.fromkeys(self.pilots, 0), False
        self._ways = answer.ways
        self.certificates = (*self.certificates, answer.certified.certificate.digest())
        self.holding = None
        self.certified = answer.certified

    def refuse(self, error: LtlplanError) -> None:
        """Hold positions, as there is nothing certified to fly.

        Args:
            error: Why.
        """
        self.holding = f"No certified pieces for what is left, so the robots hold their positions: {error}"

    def step(self, now: float, positions: Mapping[str, Point]) -> Desired:
        """Go on along the certified trajectories, or hover at their ends."""
        self._now = _exact(now)
        self._keep_watch(positions)
        self.observe(now, positions)
        self.share_again(now)
        flat = np.zeros((ORDERS, 4, len(self.pilots)))
        for j, name in enumerate(self.pilots):
            track, time = self._tracks[name], self._time
            for order in range(ORDERS):
                flat[order, :, j] = track.evaluate(time, order)
        self.steps += 1
        satisfied = self.belief.accepts()
        return Desired(flat, satisfied, satisfied and self.holding is None and self.ended, self.holding)

    def observe(self, now: float, positions: Mapping[str, Point]) -> None:
        """Take note of what robots show and of actions that are due; nothing else happens.

        Args:
            now: Flight time, s.
            positions: Measured position of each robot in the air, m.
        """
        self._now = _exact(now)
        if self.present is not None and self.holding is None:
            self._act()
        self._show(now, positions)

    @property
    def ended(self) -> bool:
        """Whether everybody has come to the end of what is flown."""
        return all(self._time >= track.duration for track in self._tracks.values())

    def change(self, event: WorldEvent, now: float) -> None:
        """Take note of a change in the world: come to rest in a proved way, then share what is left again."""
        self._now = _exact(now)
        self.close_piece(event, self._now)
        if (stop := self.stop()) is not None:
            self.take_stop(come_to_rest(stop))

    def close_piece(self, event: WorldEvent, since: Fraction) -> None:
        """Take note of a change in the world; robots go on as before in a piece of its own, of which nothing is proved yet.

        Args:
            event: What changes.
            since: Flight time from which it counts, exact, in s.
        """
        super().change(event, float(since))
        start = self._now if self.present is None else self.present.start
        later: dict[str, tuple[InternalChange, ...]] = {}
        if self.present is not None:
            done = {name: actions[: self._acted.get(name, 0)] for name, actions in self.present.actions.items()}
            later = {name: tuple(a for a in actions if start + a.time > since) for name, actions in done.items()}
            self.pieces = (*self.pieces, replace(self.present, actions=done))
        tracks = {name: self._tracks.get(name) or _hovering(pilot.where.position, self.mission.agents[name])
                  for name, pilot in self.pilots.items()}  # fmt: skip
        actions = {name: later[name] for name in tracks if later.get(name)}
        self.present = Piece(start, since, self._world_of(tracks), tracks, actions) if self.pilots else None
        self._acted = {name: len(made) for name, made in actions.items()}
        self._braking = self._braking or not self.pilots

    def _world_of(self, tracks: Mapping[str, Trajectory]) -> Mission:
        """Return the world with where and how each one hovered when its trajectory began: that is where continuity is judged from."""
        agents = {
            name: self.mission.agents[name].model_copy(
                update={"start": _point(track.coefficients[0, :3, 0]), "yaw_deg": math.degrees(track.coefficients[0, 3, 0])}
            )
            for name, track in tracks.items()
        }
        return self.mission.model_copy(update={"agents": agents})

    def stop(self) -> Stop | None:
        """Return how everybody may come to rest, as a question that can be asked elsewhere; None where nobody is in the air."""
        if self.present is None:
            return None
        return Stop(self.present.mission, self.present.team, self.present.since - self.present.start, self._braking, self._ways)

    def take_stop(self, how: StoppingManoeuvre) -> None:
        """Come to rest as was found; remember where that could not be proved.

        Args:
            how: Trajectories that are the same as the present ones so far.
        """
        assert self.present is not None, "somebody is in the air"
        self._ways, self._braking = how.ways, True
        if how.refused:
            self.lose(f"the robots stopped in a way that is not certified (times from then): {how.refused[0].sentence}")
        self.present = replace(self.present, team=how.team)

    def lose(self, why: str) -> None:
        """Take note that nothing is proved of what is flown from the present piece on.

        Args:
            why: What happened then, as the rest of a sentence.
        """
        assert self.present is not None, "somebody is in the air"
        if self._proved_count is None:
            self._proved_count = len(self.pieces)
        if self.lost is None:
            self.lost = f"At {float(self.present.since):.2f} s {why}"

    @property
    def _time(self) -> float:
        """Time on the present piece's clock, s."""
        return 0.0 if self.present is None else float(self._now - self.present.start)

    def _keep_watch(self, positions: Mapping[str, Point]) -> None:
        """Remember it when a robot was seen outside its tube: then the proofs say nothing of what was flown."""
        for name, track in self._tracks.items():
            away = math.dist(positions[name], track.evaluate(self._time)[:3])
            if away > self.mission.margin and self.lost is None:
                self.lost = (
                    f"At {float(self._now):.2f} s {name} was {away:.3f} m from its certified path, more than the margin "
                    f"{self.mission.margin:g} m."
                )

    def _act(self) -> None:
        assert self.present is not None, "actions are of what is flown"
        for name, pilot in self.pilots.items():
            due, done = self.present.actions.get(name, ()), self._acted.get(name, 0)
            # the planned instant lies where the robot is in its region for sure, while it is inside its tube
            if done < len(due) and self._time >= due[done].time:
                pilot.where = replace(pilot.where, internal=due[done].target)
                self._acted[name] = done + 1

    def _show(self, now: float, positions: Mapping[str, Point]) -> None:
        events, inside = self.labelled(positions)
        for name in events:
            self.pilots[name].where = self.pilots[name].where.seen_in(inside[name])
        if events:
            self.note(now, events)

    def acts(self, pilot: LocatedRobot) -> Action | None:  # noqa: ARG002
        """Return None: actions are made at the instants that were certified, whatever is seen."""
        return None

    def rests(self, pilot: LocatedRobot, now: float) -> bool:  # noqa: ARG002  # certified courses do not glide
        """Tell whether a robot has come to the end of its certified piece."""
        track = self._tracks.get(pilot.name)
        return track is None or self._time >= track.duration

    def root(self, pilot: LocatedRobot, now: float) -> None:  # noqa: ARG002
        """Let a robot's state be where its certified piece ends."""
        track = self._tracks.get(pilot.name)
        if track is not None:
            pilot.where = replace(pilot.where, position=_point(track.evaluate(track.duration)[:3]))

    def agent(self, pilot: LocatedRobot) -> Agent:
        """Return a robot as it hovers now, with the heading that it has come to."""
        track = self._tracks[pilot.name]
        yaw = float(track.evaluate(track.duration)[3])
        return super().agent(pilot).model_copy(update={"yaw_deg": math.degrees(yaw)})


def _exact(now: float) -> Fraction:
    """Return the time of a step exactly."""
    return Fraction(round(now / PERIOD), round(1 / PERIOD))


def _hovering(position: Point, agent: Agent) -> Trajectory:
    still = np.zeros((1, 4, 8))
    still[0, :3, 0], still[0, 3, 0] = position, agent.yaw
    return Trajectory([1.0], still.astype(np.float32))


def _point(values: Floats) -> Point:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
