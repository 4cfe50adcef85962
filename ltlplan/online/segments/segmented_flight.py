"""A team that flies pieces: what it flies now and flew before, how it comes to rest when the world changes, and what of it is proved.

A piece is a trajectory for each robot and a time from which it is flown; at a change of the world the present one is closed, and what robots go on
with is a piece of its own, in the world as it then is, of which nothing is proved until a way to come to rest is (`braking`). If they
cannot be brought to rest in a way that the checker accepts (a rim has moved into their way), they stop as soon as they can, which is
said, and hold for good. A robot that fails or leaves is outside every claim from then on, but for the letter that it held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ltlplan.online.segments.braking import Stop, StoppingManoeuvre, Ways, come_to_rest
from ltlplan.online.segments.deadlines import Deadlines
from ltlplan.online_mtac.team_in_flight import PERIOD, LocatedRobot, TeamInFlight
from verify.data import Mission, Trajectory
from verify.data.events import WorldEvent
from verify.data.sections import Action, Agent
from verify.data.shapes.inequalities import Point, point_of
from verify.flight_segments import Piece
from verify.model_checking.timeline import InternalChange

Floats = NDArray[np.float64]


class TeamInPieces(TeamInFlight[LocatedRobot]):
    """A team that flies trajectories piece by piece, and hovers at their ends.

    Attributes:
        pieces: What was flown before the present piece.
        present: What is flown now; None where nobody is in the air.
        lost: Why the flight is not certified in all its parts any more, or None.
        deadlines: What is bounded in seconds.
    """

    def __init__(self, mission: Mission) -> None:
        """Take in a team that hovers at its starts, and flies nothing yet.

        Args:
            mission: What is asked.

        Raises:
            BadInput: The trace is infinite, or the mission has a sequence.
        """
        super().__init__(mission, lambda _mission, _world, name, where: LocatedRobot(name, where))
        self.pieces: tuple[Piece, ...] = ()
        self.present: Piece | None = None
        self.lost: str | None = None
        self.deadlines = Deadlines.of(mission, self.first_letters, self.shown)
        self._now = Fraction(0)
        self._acted: dict[str, int] = {}
        self._braking = False
        self._ways: Ways = {}
        self._proved_count: int | None = None

    @property
    def all_pieces(self) -> tuple[Piece, ...]:
        """Proofs of the flight's segments, the present one last; a stop that was rejected ends it."""
        every = self.pieces if self.present is None else (*self.pieces, self.present)
        return every[: self._proved_count]

    @property
    def _tracks(self) -> Mapping[str, Trajectory]:
        return {} if self.present is None else self.present.team

    def observe(self, now: float, positions: Mapping[str, Point]) -> None:
        """Take note of what robots show and of actions that are due; nothing else happens.

        Args:
            now: Flight time, s.
            positions: Measured position of each robot in the air, m.
        """
        self._now = exact_step(now)
        if self.present is not None and self.holding is None:
            self._act()
        self._show(now, positions)
        self.deadlines.see(now, self.belief.held, hovers=self.holding is not None)

    @property
    def satisfied(self) -> bool:
        """True if what was shown so far satisfies the formula if nobody's letter changes any more."""
        return self.belief.accepts() and self.deadlines.satisfied(ended=self.ended)

    @property
    def ended(self) -> bool:
        """True if all robots have come to the end of their trajectories."""
        return all(self._time >= track.duration for track in self._tracks.values())

    def change(self, event: WorldEvent, now: float) -> None:
        """Take note of a change in the world: come to rest in a proved way, then share what is left again."""
        self._now = exact_step(now)
        self.close_piece(event, self._now)
        if (stop := self.stop()) is not None:
            self.take_stop(come_to_rest(stop))

    def close_piece(self, event: WorldEvent, since: Fraction) -> None:
        """Start a new, unproved flight segment at a world change. Robots keep following their current trajectories.

        Args:
            event: What changes.
            since: Flight time from which it counts, exact, in s.
        """
        super().change(event, float(since))
        self.deadlines = Deadlines.of(self.mission, self.first_letters, self.shown)
        self._close(since)

    def pause(self, why: str, since: Fraction) -> None:
        """Have all come to rest, though nothing changes in the world; they go on as before, as `close_piece` says.

        Args:
            why: What for, as the rest of a sentence.
            since: Flight time from which it counts, exact, in s.
        """
        self.hold(why)
        self._close(since)

    def _close(self, since: Fraction) -> None:
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
        """Return the world with where and how each one hovered when its trajectory began: that is where continuity is checked from."""
        agents = {
            name: self.mission.agents[name].model_copy(
                update={"start": point_of(track.coefficients[0, :3, 0]), "yaw_deg": math.degrees(track.coefficients[0, 3, 0])}
            )
            for name, track in tracks.items()
        }
        return self.mission.model_copy(update={"agents": agents})

    def stop(self) -> Stop | None:
        """Return how everybody may come to rest, as a question that can be asked elsewhere; None where nobody is in the air."""
        if self.present is None:
            return None
        return Stop(self.present.mission, self.present.team, self.present.since - self.present.start, self._braking, self._ways)

    def fly(self, piece: Piece, ways: Ways) -> None:
        """Fly a piece from now on.

        Args:
            piece: It begins where everybody hovers.
            ways: Ways to come to rest from it that were found already.
        """
        self.pieces, self.present = self.all_pieces, piece
        self._acted, self._braking = dict.fromkeys(self.pilots, 0), False
        self._ways = ways

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
        """Return whether a robot has come to the end of its certified piece."""
        track = self._tracks.get(pilot.name)
        return track is None or self._time >= track.duration

    def root(self, pilot: LocatedRobot, now: float) -> None:  # noqa: ARG002
        """Let a robot's state be where its certified piece ends."""
        track = self._tracks.get(pilot.name)
        if track is not None:
            pilot.where = replace(pilot.where, position=point_of(track.evaluate(track.duration)[:3]))

    def agent(self, pilot: LocatedRobot) -> Agent:
        """Return a robot as it hovers now, with the heading that it has come to."""
        track = self._tracks[pilot.name]
        yaw = float(track.evaluate(track.duration)[3])
        return super().agent(pilot).model_copy(update={"yaw_deg": math.degrees(yaw)})


def exact_step(now: float) -> Fraction:
    """Return the time of a step exactly."""
    return Fraction(round(now / PERIOD), round(1 / PERIOD))


def _hovering(position: Point, agent: Agent) -> Trajectory:
    still = np.zeros((1, 4, 8))
    still[0, :3, 0], still[0, 3, 0] = position, agent.yaw
    return Trajectory([1.0], still.astype(np.float32))
