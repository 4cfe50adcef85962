"""Online flight over a link, in real time: computing takes the time that it takes, and nobody flies what is not proved.

While robots fly, what is asked is answered elsewhere (`in_air`, `asking`), one question after the other:

1. An event comes. Robots go on as before until a way to come to rest is found that is proved in the world as it is now, from the instant of the
   event on; it begins a little ahead, and is asked for anew, to begin later, where its answer came too late. Then what is flown is
   replaced by it: the same up to where it slows down. Another event waits for that, some tenths of a second.
2. While robots slow down and hover, what will be left is planned, refined and certified (`what_follows`). Another event makes that void: back to 1.
3. The piece is judged with all that was flown, to begin at an instant a little ahead, and begins at that very instant; where the judgement came
   too late it is asked for anew, for a later one.

Who does not answer in time, or was ended, ends the flight: the team holds and lands. Where nothing is proved of what is left, it hovers for a while,
as another event may help, and lands where it can.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import floor, inf

from flight.link.live import STEP, Alarm, Flying
from flight.link.stages import FLIGHT
from ltlplan.online.asking import Answer, Computer, way_down, way_to_stop
from ltlplan.online.braking import StoppingManoeuvre
from ltlplan.online.certified import CertifiedTeam
from ltlplan.online.happenings import GIVE_UP, Happenings, Told, fault_of, no_news
from ltlplan.online.in_air import PATIENCE, Answered, InAir, exact_instant, result_of
from ltlplan.online.leaving import Leaving
from ltlplan.online.what_follows import WhatFollows, stage_of
from ltlplan.sharing.events import falls_on
from ltlplan.transfers import Place
from verify.data import LtlplanError, Mission, Trajectory
from verify.data.events import RobotLeaves, WorldEvent

REACTION = 0.3
"""s from an event to where robots begin to slow down, at first: finding a way for three robots takes 0.15 s."""
LONGEST_REACTION = 2.0
"""s from an event, after which a team that has no proved way to come to rest holds as its vehicles do, and lands."""
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
        places: Where each robot stood, m.
        happenings: What happens.
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
    began: float = 0.0
    ended: float = 0.0
    happened: list[WorldEvent] = field(default_factory=list[WorldEvent])
    earlier: list[tuple[float, Mission]] = field(default_factory=list[tuple[float, Mission]])
    answered: list[Answered] = field(default_factory=list[Answered])
    satisfied_at: float | None = None
    _stopping: bool = False

    @property
    def duration(self) -> float:
        """S that a battery must last for it, if nothing happens."""
        assert self.team.present is not None, "it is at its starts"
        return float(self.team.present.end) + LANDING_TAKES

    # -- the flight ----------------------------------------------------------------------------------------

    def fly(self, flying: Flying) -> None:
        """Fly until the formula is satisfied, or nothing more can be proved, and land.

        Args:
            flying: The team, hovering at its starts.

        Raises:
            Alarm: It cannot go on in a proved way; whoever called holds and lands.
        """
        assert self.team.certified is not None, "it was certified before anything spun"
        first = stage_of(self.team.certified).watched(flying.link.accuracy)
        number, shown = flying.store(first.paths), len(flying.record.events)
        watch = flying.begin(first, number)
        self.began = flying.record.starts[FLIGHT]
        self._air = InAir(self.team, self.computer, flying, self.began, number, watch, shown, self.answered)
        self._next = WhatFollows(self._air)
        try:
            while not self._over():
                self._look()
                self._hear()
                self._go_on()
            self._end()
            self._land()
        finally:
            self._drop()
            self.happenings.end()
            self.ended = self.ended or flying.link.now()
            if self._stopping:
                self.team.lose("the world changed, and the robots did not come to rest in a certified way.")

    def _look(self) -> None:
        """Let a moment pass, and look at all robots."""
        air = self._air
        air.link.sleep(STEP)
        air.show()
        if (lost := air.watch.lost()) is not None:
            self._lose(*lost)
        elif reason := air.watch.alarm():
            raise Alarm(reason)
        self.team.observe(air.now, air.positions())
        satisfied = self.team.belief.accepts()
        self.satisfied_at = None if not satisfied else air.now if self.satisfied_at is None else self.satisfied_at
        for leaving in air.leaving:
            leaving.go_on(air.link, air.record)

    def _hear(self) -> None:
        """Take in what happens: one event at a time, and none while a way to come to rest is looked for."""
        arrived = self._air.link.now()
        for sentence in self.happenings.hear(self._air.now, arrived):
            self._air.record.note(arrived, sentence)
        while self.happenings.queue and not self._stopping:
            self._take(*self.happenings.queue.pop(0))

    def _go_on(self) -> None:
        """Do what is next where an answer has come, or it is time for the next piece."""
        if self._air.question is None:
            self._next.go_on()
        else:
            self._air.go_on(LONGEST_REACTION if self._stopping else PATIENCE)

    def _drop(self) -> None:
        """Give up what is asked, and what was found for a world that is no more."""
        self._air.drop()
        self._next.forget()

    def _over(self) -> bool:
        """Whether nothing is left to be flown, or nothing can be proved of what is."""
        air = self._air
        if air.question or self._next.due or self.happenings or not all(leaving.stopped for leaving in air.leaving):
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
        unseen = air.gone.get(event.robot) if isinstance(event, RobotLeaves) else None
        since = exact_instant(now if unseen is None else min(unseen, now), floor)
        if (fault := fault_of(team, event)) is not None:
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
        trouble = falls_on(team.mission, event, air.positions())
        self._drop()
        self.earlier.append((float(since), team.mission))
        event = replace(event, time=float(since))
        self.happened.append(event)
        air.note(f"{event}.", getattr(event, "robot", None))
        told.answer(True, f"{event}, from {float(since):.2f} s of the flight on.")
        team.close_piece(event, since)
        air.breathe()
        self._next.refused_at = None
        if isinstance(event, RobotLeaves) and unseen is None:
            self._leave(event.robot, now)
        if trouble is not None:
            raise Alarm(trouble)
        self.answered.append(Answered(event))
        air.known = arrived
        air.watch_again()
        self._ask_stop(REACTION)

    # -- coming to rest ------------------------------------------------------------------------------------

    def _ask_stop(self, reaction: float) -> None:
        """Ask for a way to come to rest that begins some seconds from now."""
        stop, self._stopping = self.team.stop(), True
        assert stop is not None, "somebody is in the air"
        late = self._air.now - float(self._air.present.since)
        if late + reaction > LONGEST_REACTION:
            raise Alarm(f"no proved way to come to rest was found within {LONGEST_REACTION:g} s.")
        about = replace(stop, reaction=late + reaction)
        self._air.ask(way_to_stop, about, lambda answer: self._stop_found(answer, reaction))

    def _stop_found(self, answer: Answer, reaction: float) -> None:
        """Come to rest as was found, unless it begins in the past: then ask for a later one."""
        how: StoppingManoeuvre = result_of(answer)
        air, team = self._air, self.team
        if how.refused:
            raise Alarm(f"no way to come to rest is proved: {how.refused[0].sentence}")
        if air.now - float(air.present.start) >= _first_change(air.present.team, how.team) - STEP:
            self._ask_stop(2 * reaction)
            return
        team.take_stop(how)
        for robot in air.present.team.keys() - air.gone.keys():
            air.link.upload(robot, air.number, air.present.team[robot])
        air.watch_again()
        self._stopping = False
        air.took(stop=air.link.now() - air.known)
        air.breathe()
        if team.waits_to_share:
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
        answer = self.computer.ask(way_down, (mission, team, places))
        try:
            since = air.link.now()
            while not answer.done():
                air.link.sleep(STEP)
                air.show()
                if reason := (air.watch.lost() or ("", ""))[1] or air.watch.alarm():
                    raise Alarm(reason)
                if air.link.now() - since > PATIENCE:
                    raise Alarm(f"there was no way to land in {PATIENCE:g} s: whoever computes it hangs.")
            try:
                ways = result_of(answer)
            except LtlplanError as error:
                raise Alarm(f"no certified way to land: {error}") from None
        finally:
            answer.drop()
        for transfer in ways:
            air.flying.fly(transfer.stage)


def _first_change(before: Mapping[str, Trajectory], after: Mapping[str, Trajectory]) -> float:
    """Return when the first robot begins to fly otherwise, s on the trajectories' clocks."""
    begins = [float(path.knots[-2]) for name, path in after.items() if path.digest() != before[name].digest()]
    return min(begins, default=inf)
