"""Online flight over a link, in real time: computing takes the time that it takes, and nobody flies what is not proved.

While robots fly, what is asked is answered elsewhere (`in_air`, `asking`), one question after the other:

1. An event comes. Robots go on as before until a way to come to rest is found that is proved in the world as it is now, from the instant of the
   event on; it begins a little ahead, and is asked for anew, to begin later, where its answer came too late. Then what is flown is
   replaced by it: the same up to where it slows down. Another event waits for that, some tenths of a second.
2. While robots slow down and hover, what will be left is planned, refined and certified (`what_follows`). Another event makes that void: back to 1.
3. The piece is checked with all that was flown, to begin at an instant a little ahead, and begins at that very instant; where the judgement came
   too late it is asked for anew, for a later one.

A robot that is to join (`joining`) makes all others come to rest as any event does, and climbs before step 2.

Who does not answer in time, or was ended, ends the flight: the team holds and lands. Where nothing is proved of what is left, it hovers for a while,
as another event may help, and lands where it can.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import floor

from flight.link.live_executive import STEP, Alarm, Flying
from flight.link.phases import FLIGHT, Part, Stage
from ltlplan.online.checked_events import falls_on
from ltlplan.online.event_queue import GIVE_UP, Happenings, Told, fault_of, no_news
from ltlplan.online.live.executors import Computer, way_down
from ltlplan.online.live.flight_session import PATIENCE, Answered, InAir, exact_instant, result_of
from ltlplan.online.live.joining import Joining
from ltlplan.online.live.leaving import Leaving
from ltlplan.online.live.segment_handover import WhatFollows, stage_of
from ltlplan.online.live.stopping import LONGEST_REACTION, ComingToRest
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.standby import Standby
from ltlplan.transfers import Place
from verify.data import LtlplanError, Mission
from verify.data.events import RobotJoins, RobotLeaves, WorldEvent

ENDS = 0.5
"""s that a team hovers at its end before it lands."""
LANDING_TAKES = 10.0
"""s of battery for what comes after the flight."""


@dataclass
class OnlineCourse:
    """One online flight over a link while it happens: `fly_live` flies it after climb and way.

    Attributes:
        team: What is proved and flown; it hovers at its starts.
        computer: Who computes answers.
        places: Where each robot stood, m, those that wait included.
        happenings: What happens.
        standby: Who waits on the ground and may join.
        began: When the flight began, s of the link's clock.
        ended: When it ended, s of the link's clock.
        happened: What has happened, each with the flight time from which it counts.
        earlier: The mission as it was before each event, with that time, s.
        answered: How long answers took.
        satisfied_at: When what was shown came to satisfy what was asked then, s of the flight; None where it does not.
    """

    team: CertifiedTeam
    computer: Computer
    places: Mapping[str, Place]
    happenings: Happenings = field(default_factory=lambda: Happenings((), no_news))
    standby: Standby = field(default_factory=Standby)
    began: float = 0.0
    ended: float = 0.0
    happened: list[WorldEvent] = field(default_factory=list[WorldEvent])
    earlier: list[tuple[float, Mission]] = field(default_factory=list[tuple[float, Mission]])
    answered: list[Answered] = field(default_factory=list[Answered])
    satisfied_at: float | None = None

    @property
    def duration(self) -> float:
        """S that a battery must last for it, if nothing happens."""
        assert self.team.present is not None, "it is at its starts"
        return float(self.team.present.end) + LANDING_TAKES

    @property
    def first(self) -> Stage:
        """Flight of the first piece."""
        assert self.team.certified is not None, "it was certified before anything spun"
        return stage_of(self.team.certified)

    @property
    def standing(self) -> Part | None:
        """Climbs of the robots that wait on the ground; None where nobody waits."""
        return self.standby.standing(self.team.mission)

    # -- the flight ----------------------------------------------------------------------------------------

    def fly(self, flying: Flying) -> None:
        """Fly until the formula is satisfied, or nothing more can be proved, and land.

        Args:
            flying: The team, hovering at its starts.

        Raises:
            Alarm: It cannot go on in a proved way; whoever called holds and lands.
        """
        stage = self.first
        first = stage.watched(flying.link.accuracy)
        number, shown = flying.store(first.paths), len(flying.record.events)
        flying.come_to_rest(stage.parts[0], flying.link.sleep)
        watch = flying.begin(first, number)
        self.began = flying.record.starts[FLIGHT]
        self._air = InAir(self.team, self.computer, flying, self.began, number, watch, shown, self.answered)
        self._next = WhatFollows(self._air)
        everybody = {**self.team.mission.agents, **self.standby.agents}
        self._joining = Joining(self._air, self.standby, everybody, self.duration)
        self._stopping = ComingToRest(self._air, self._at_rest)
        self._joining.lookout.look(self._air.link, self._air.record, self._joining.standby.agents)
        try:
            while not self._over():
                self._look()
                self._hear()
                self._go_on()
            self._end()
            self._land()
        finally:
            self._drop()
            self._joining.end()
            self.happenings.end()
            self.ended = self.ended or flying.link.now()
            if self._stopping.looks:
                self.team.lose("the world changed, and the robots did not come to rest in a certified way.")

    def _look(self) -> None:
        """Let a moment pass, and look at all robots."""
        air = self._air
        air.link.sleep(STEP)
        air.show()
        self._joining.lookout.look(air.link, air.record, self._joining.standby.agents)
        if astray := self._joining.astray:
            self._joining.give_up(astray)
        elif (lost := air.watch.lost()) is not None:
            self._lose(*lost)
        elif reason := air.watch.alarm():
            raise Alarm(reason)
        self.team.observe(air.now, air.positions())
        for sentence in self.team.deadlines.news():
            air.note(sentence, None, "reaction")
        satisfied = self.team.satisfied
        self.satisfied_at = None if not satisfied else air.now if self.satisfied_at is None else self.satisfied_at
        for leaving in air.leaving:
            leaving.go_on(air.link, air.record)
            if leaving.off:
                air.flying.leave_out(leaving.robot)

    def _hear(self) -> None:
        """Take in what happens: one event at a time, and none while a way to come to rest is looked for."""
        arrived = self._air.link.now()
        for sentence in self.happenings.hear(self._air.now, arrived):
            self._air.record.note(arrived, sentence)
        while (
            not self._stopping.looks
            and (following := self.happenings.first(joining=self._joining.newcomer is None)) is not None
        ):
            self._take(*following)

    def _go_on(self) -> None:
        """Do what is next where an answer has come, or it is time for the next piece."""
        air = self._air
        if air.question is not None:
            air.go_on(LONGEST_REACTION if self._stopping.looks else PATIENCE)
        elif self._joining.newcomer is None:
            self._next.go_on()
        elif (event := self._joining.go_on()) is not None:
            self._join(event)
        if self._joining.gave_up and air.question is None:
            self._resume()

    def _drop(self) -> None:
        """Give up what is asked, and what was found for a world that is no more."""
        self._air.drop()
        self._next.forget()

    def _over(self) -> bool:
        """Return whether nothing is left to be flown, or nothing can be proved of what is left."""
        air = self._air
        if (
            air.question
            or self._next.due
            or self.happenings
            or self._joining.newcomer
            or not all(leaving.stopped for leaving in air.leaving)
        ):
            return False
        refused = self._next.refused_at
        given_up = refused is None or air.link.now() - refused > GIVE_UP
        return given_up and air.now > float(air.present.end) + ENDS

    # -- what happens --------------------------------------------------------------------------------------

    def _lose(self, robot: str, sentence: str) -> None:
        """Leave a robot out that cannot go on; the flight is over where it was the last one."""
        air = self._air
        pose = air.link.pose(robot)
        if pose is None or len(self.team.pilots.keys() - air.gone.keys()) < 2:
            raise Alarm(sentence)
        air.note(sentence, robot, "alarm")
        self._leave(robot, max(pose.time - self.began, 0.0))
        air.watch_again()
        self.happenings.add(air.link.now(), RobotLeaves(time=0.0, robot=robot))

    def _leave(self, robot: str, seen: float) -> None:
        """Let a robot land where it is, whatever the others do; it was part of the team for so many s of the flight."""
        self._air.gone[robot] = seen
        self._air.leaving.append(Leaving(robot, self.places[robot][2]))

    def _take(self, arrived: float, told: Told) -> None:
        """Let the world change, and look for a way to come to rest in it."""
        air, team, now, event = self._air, self.team, self._air.now, told.event
        joins = self._joining
        if joins.newcomer is not None and isinstance(event, RobotLeaves) and event.robot == joins.newcomer.robot:
            joins.give_up(f"{event}.")
            told.answer(True, f"{event}: it did not join.")
            return
        unseen = air.gone.get(event.robot) if isinstance(event, RobotLeaves) else None
        since = exact_instant(now if unseen is None else min(unseen, now), floor)
        if (fault := self._fault_of(event, joins.standby)) is not None:
            air.note(f"Not done: {fault}")
            told.answer(False, fault)
            return
        if isinstance(event, RobotLeaves) and len(team.pilots) == 1:
            told.answer(True, f"{event}, and no robot is left in the air.")
            raise Alarm(f"{event}: no robot is left in the air.")
        if since < air.present.since:
            if unseen is not None and team.lost is None:
                team.lost = f"when the world changed at {float(air.present.since):.2f} s, {event} had begun, and was not known."
            since = air.present.since
        air.breathe()
        if isinstance(event, RobotJoins):
            self._drop()
            joins.begin(event, told)
            air.note(f"{event.robot} is to join, and the others come to rest for it.", event.robot)
            team.pause(f"at {now:.2f} s {event.robot} is to join", since)
            self._come_to_rest(replace(event, time=float(since)), arrived)
            return
        trouble = falls_on(team.mission, event, air.positions())
        joins.world_changes(event)
        event = self._change(event, since)
        told.answer(True, f"{event}, from {float(since):.2f} s of the flight on.")
        if isinstance(event, RobotLeaves) and unseen is None:
            self._leave(event.robot, now)
        if trouble is not None:
            raise Alarm(trouble)
        self._come_to_rest(event, arrived)

    def _join(self, event: RobotJoins) -> None:
        """Let a robot that hovers at its start be one of the team."""
        joins, since = self._joining, exact_instant(self._air.now, floor)
        if (fault := self._fault_of(event, self.standby)) is not None:
            joins.give_up(fault)
            return
        joins.joined(f"{event}, from {float(since):.2f} s of the flight on.")
        self._come_to_rest(self._change(event, since), self._air.link.now())

    def _fault_of(self, event: WorldEvent, standby: Standby) -> str | None:
        """Say why an event cannot be now; None where it can."""
        return fault_of(self.team, event, standby, [mission for _, mission in self.earlier])

    def _change(self, event: WorldEvent, since: Fraction) -> WorldEvent:
        """Let the world change from an instant on, and return the event with it; robots go on as before."""
        air, team = self._air, self.team
        self._drop()
        self.earlier.append((float(since), team.mission))
        event = replace(event, time=float(since))
        self.happened.append(event)
        air.note(f"{event}.", getattr(event, "robot", None))
        team.close_piece(event, since)
        return event

    def _come_to_rest(self, event: WorldEvent, arrived: float) -> None:
        """Look for a way to come to rest, as something happens that came to be known at a time of the link's clock, s."""
        self._air.breathe()
        self._next.refused_at = None
        self.answered.append(Answered(event))
        self._air.known = arrived
        self._air.watch_again()
        self._stopping.ask()

    def _at_rest(self) -> None:
        """Ask for what comes next, now that it is proved where all come to rest."""
        if self._joining.newcomer is None:
            self._resume()
        else:
            self._joining.at_rest()

    def _resume(self) -> None:
        """Ask for what is flown next, as nobody joins."""
        self._joining.gave_up = False
        if self.team.waits_to_share:
            self._next.ask()
        else:
            self._next.refuse(None)

    # -- the end -------------------------------------------------------------------------------------------

    def _end(self) -> None:
        self.ended = self._air.record.ends[FLIGHT] = self._air.link.now()
        self._air.watch.finish()

    def _land(self) -> None:
        """Land in a certified way, from where all hover."""
        air = self._air
        mission, team = air.present.mission, air.present.team
        places = {name: self.places[name] for name in mission.agents}
        answer = self.computer.ask(way_down, (self._joining.solid(mission), team, places))
        try:
            since = air.link.now()
            while not answer.done():
                air.link.sleep(STEP)
                air.show()
                if reason := (air.watch.lost() or ("", ""))[1] or air.watch.alarm():
                    raise Alarm(reason)
                if air.link.now() - since > PATIENCE:
                    raise Alarm(f"there was no way to land in {PATIENCE:g} s: its computation hangs.")
            try:
                ways = result_of(answer)
            except LtlplanError as error:
                raise Alarm(f"no certified way to land: {error}") from None
        finally:
            answer.drop()
        for transfer in ways:
            air.flying.fly(transfer.stage)
