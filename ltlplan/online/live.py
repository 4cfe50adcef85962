"""Online flight over a link, in real time: computing takes the time that it takes, and nobody flies what is not proved.

While robots fly, what is asked is answered elsewhere (`asking`), one question after the other:

1. An event comes. Robots go on as before until a way to come to rest is found that is proved in the world as it is now, from the instant of the
   event on; it begins a little ahead, and is asked for anew, to begin later, where its answer came too late. Then what is flown is
   replaced by it: the same up to where it slows down. Another event waits for that, some tenths of a second.
2. While robots slow down and hover, what will be left is planned, refined and certified. Another event makes that void: back to 1.
3. The piece is judged with all that was flown, to begin at an instant a little ahead, and begins at that very instant; where the judgement came
   too late it is asked for anew, for a later one.

Who does not answer in time, or was ended, ends the flight: the team holds and lands. Where nothing is proved of what is left, it hovers for a while,
as another event may help, and lands where it can.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import ceil, floor, inf
from typing import Any

from flight.link.live import STEP, Alarm, Flying
from flight.link.stages import FLIGHT, Stage, Watched
from flight.link.watch import Watch
from ltlplan.online.asking import Answer, Computer, NoAnswer, judgement, next_piece, way_down, way_to_stop
from ltlplan.online.braking import StoppingManoeuvre
from ltlplan.online.certified import CertifiedTeam
from ltlplan.online.happenings import Happenings, Told, fault_of, no_news
from ltlplan.online.leaving import Leaving
from ltlplan.online.next_piece import Found, Left, WholeFlight
from ltlplan.online.watching import watch_on
from ltlplan.sharing.events import falls_on
from ltlplan.sharing.team_in_flight import PERIOD
from ltlplan.transfers import Place
from verify.data import LtlplanError, Mission, Trajectory
from verify.data.events import RobotLeaves, WorldEvent
from verify.data.shapes.inequalities import Point

REACTION = 0.3
"""s from an event to where robots begin to slow down, at first: finding a way for three robots takes 0.15 s."""
LONGEST_REACTION = 2.0
"""s from an event, after which a team that has no proved way to come to rest holds as its vehicles do, and lands."""
LEAD = 0.15
"""s from asking for a judgement to where the piece begins, at first."""
AHEAD = 0.06
"""s before its beginning at which a piece is started: three looks."""
PATIENCE = 30.0
"""s that planning and proving may take while the team hovers."""
LATEST = 10.0
"""s after an answer is asked for at which its piece begins at the latest, as far as endurances are counted."""
GIVE_UP = 3.0
"""s that a team hovers for which nothing is proved."""
ENDS = 0.5
"""s that a team hovers at its end before it lands."""
LANDING_TAKES = 10.0
"""s of battery for what comes after the flight."""


@dataclass(frozen=True, slots=True)
class Answered:
    """How long it took to answer an event, s since it was known.

    Attributes:
        event: The event.
        stop: Until a way to come to rest was proved.
        proved: Until the next piece was certified and proved with all that was flown before; None where none was.
        begun: Until it began; None where it did not.
    """

    event: WorldEvent
    stop: float | None = None
    proved: float | None = None
    begun: float | None = None


@dataclass(frozen=True, slots=True)
class _Question:
    """What is being answered, what is done with the answer, and when it was asked, s of the link's clock."""

    answer: Answer
    then: Callable[[Answer], None]
    asked: float


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
    _leaving: list[Leaving] = field(default_factory=list[Leaving])
    _gone: dict[str, float] = field(default_factory=dict[str, float])
    _question: _Question | None = None
    _stopping: bool = False
    _lead: float = LEAD
    _known: float = 0.0
    _left: Left | None = None
    _found: Found | None = None
    _whole: WholeFlight | None = None
    _due: Watched | None = None
    _refused_at: float | None = None
    _number: int = 0
    _shown: int = 0

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
        self._flying, self._link, self._record = flying, flying.link, flying.record
        first = self._stage().watched(self._link.accuracy)
        self._number, self._shown = flying.store(first.paths), len(self._record.events)
        self._watch = flying.begin(first, self._number)
        self.began = self._record.starts[FLIGHT]
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
            self.ended = self.ended or self._link.now()
            if self._stopping:
                self.team.lose("the world changed, and the robots did not come to rest in a certified way.")

    @property
    def _now(self) -> float:
        """Flight time, s."""
        return self._link.now() - self.began

    def _look(self) -> None:
        """Let a moment pass, and look at all robots."""
        self._link.sleep(STEP)
        self._show()
        if (lost := self._watch.lost()) is not None:
            self._lose(*lost)
        elif reason := self._watch.alarm():
            raise Alarm(reason)
        self.team.observe(self._now, self._positions())
        satisfied = self.team.belief.accepts()
        self.satisfied_at = None if not satisfied else self._now if self.satisfied_at is None else self.satisfied_at
        for leaving in self._leaving:
            leaving.go_on(self._link, self._record)

    def _show(self) -> None:
        """Look, and show all that was said since."""
        assert self.team.present is not None, "somebody is in the air"
        look, ends = self._watch.look(), float(self.team.present.end)
        said = tuple(self._record.events[self._shown :])
        self._shown = len(self._record.events)
        self._flying.show(replace(look, time=self._now, duration=ends, events=said))

    def _positions(self) -> dict[str, Point]:
        return {name: pose.position for name in self.team.pilots if (pose := self._link.pose(name)) is not None}

    def _hear(self) -> None:
        """Take in what happens: one event at a time, and none while a way to come to rest is looked for."""
        arrived = self._link.now()
        for sentence in self.happenings.hear(self._now, arrived):
            self._record.note(arrived, sentence)
        while self.happenings.queue and not self._stopping:
            self._take(*self.happenings.queue.pop(0))

    def _go_on(self) -> None:
        """Do what is next where an answer has come, or it is time for the next piece."""
        if self._question is not None:
            waited = self._link.now() - self._question.asked
            if self._question.answer.done():
                question, self._question = self._question, None
                try:
                    question.then(question.answer)
                    self._breathe()
                finally:
                    question.answer.drop()
            elif waited > (LONGEST_REACTION if self._stopping else PATIENCE):
                raise Alarm(f"there was no answer in {waited:.1f} s: whoever computes it hangs.")
        elif self._due is not None and self._whole is not None and self._now >= float(self._whole.last.start) - AHEAD:
            self._begin_piece(self._due, self._whole)

    def _breathe(self) -> None:
        """Let set-points go out between two steps that take some milliseconds each."""
        self._link.sleep(0.0)

    def _ask(self, work: Callable[..., Any], about: object, then: Callable[[Answer], None]) -> None:
        self._breathe()
        self._question = _Question(self.computer.ask(work, about), then, self._link.now())

    def _drop(self) -> None:
        """Give up what is asked, and what was found for a world that is no more."""
        if self._question is not None:
            self._question.answer.drop()
        self._question = self._due = self._whole = self._found = self._left = None

    def _over(self) -> bool:
        """Whether nothing is left to be flown, or nothing can be proved of what is."""
        if self._question or self._due or self.happenings or not all(leaving.stopped for leaving in self._leaving):
            return False
        assert self.team.present is not None, "somebody is in the air"
        given_up = self._refused_at is None or self._link.now() - self._refused_at > GIVE_UP
        return given_up and self._now > float(self.team.present.end) + ENDS

    # -- what happens --------------------------------------------------------------------------------------

    def _lose(self, robot: str, sentence: str) -> None:
        """Leave a robot out that cannot go on; the flight is over where it was the last one."""
        pose = self._link.pose(robot)
        if pose is None or len(self.team.pilots.keys() - self._gone.keys()) < 2:
            raise Alarm(sentence)
        self._record.note(self._link.now(), sentence, robot, "alarm")
        self._leave(robot, max(pose.time - self.began, 0.0))
        self._watch = self._watch_now()
        self.happenings.add(self._link.now(), RobotLeaves(time=0.0, robot=robot))

    def _leave(self, robot: str, seen: float) -> None:
        """Let a robot land where it is, whatever the others do; it was part of the team for so many s of the flight."""
        self._gone[robot] = seen
        self._leaving.append(Leaving(robot, self.places[robot][2]))

    def _take(self, arrived: float, told: Told) -> None:
        """Let the world change, and look for a way to come to rest in it."""
        team, now, event = self.team, self._now, told.event
        unseen = self._gone.get(event.robot) if isinstance(event, RobotLeaves) else None
        since = _exact(now if unseen is None else min(unseen, now), floor)
        if (fault := fault_of(team, event)) is not None:
            self._record.note(self._link.now(), f"Not done: {fault}")
            told.answer(False, fault)
            return
        if isinstance(event, RobotLeaves) and len(team.pilots) == 1:
            told.answer(True, f"{event}, and no robot is left in the air.")
            raise Alarm(f"{event}: no robot is left in the air.")
        assert team.present is not None, "somebody is in the air"
        if since < team.present.since:
            if unseen is not None and team.lost is None:
                team.lost = (
                    f"when the world changed at {float(team.present.since):.2f} s, {event} had begun, and was not known."
                )
            since = team.present.since
        self._breathe()
        trouble = falls_on(team.mission, event, self._positions())
        self._drop()
        self.earlier.append((float(since), team.mission))
        event = replace(event, time=float(since))
        self.happened.append(event)
        self._record.note(self._link.now(), f"{event}.", getattr(event, "robot", None))
        told.answer(True, f"{event}, from {float(since):.2f} s of the flight on.")
        team.close_piece(event, since)
        self._breathe()
        self._refused_at = None
        if isinstance(event, RobotLeaves) and unseen is None:
            self._leave(event.robot, now)
        if trouble is not None:
            raise Alarm(trouble)
        self.answered.append(Answered(event))
        self._known = arrived
        self._watch = self._watch_now()
        self._ask_stop(REACTION)

    # -- coming to rest ------------------------------------------------------------------------------------

    def _ask_stop(self, reaction: float) -> None:
        """Ask for a way to come to rest that begins some seconds from now."""
        stop, self._stopping = self.team.stop(), True
        assert stop is not None and self.team.present is not None, "somebody is in the air"  # noqa: PT018
        late = self._now - float(self.team.present.since)
        if late + reaction > LONGEST_REACTION:
            raise Alarm(f"no proved way to come to rest was found within {LONGEST_REACTION:g} s.")
        self._ask(way_to_stop, replace(stop, reaction=late + reaction), lambda answer: self._stop_found(answer, reaction))

    def _stop_found(self, answer: Answer, reaction: float) -> None:
        """Come to rest as was found, unless it begins in the past: then ask for a later one."""
        how: StoppingManoeuvre = self._from(answer)
        team = self.team
        if how.refused:
            raise Alarm(f"no way to come to rest is proved: {how.refused[0].sentence}")
        assert team.present is not None, "somebody is in the air"
        if self._now - float(team.present.start) >= _first_change(team.present.team, how.team) - STEP:
            self._ask_stop(2 * reaction)
            return
        team.take_stop(how)
        for robot in team.present.team.keys() - self._gone.keys():
            self._link.upload(robot, self._number, team.present.team[robot])
        self._watch, self._stopping = self._watch_now(), False
        self.answered[-1] = replace(self.answered[-1], stop=self._link.now() - self._known)
        self._breathe()
        if team.waits_to_share:
            self._ask_piece()
        else:
            self._refuse(None)

    # -- the next piece ------------------------------------------------------------------------------------

    def _ask_piece(self) -> None:
        """Ask for a certified flight of what will be left when all have come to rest."""
        try:
            self._left = self.team.what_will_be_left(_exact(self._now + LATEST, ceil))
        except LtlplanError as error:
            self._refuse(error)
            return
        self._ask(next_piece, self._left, self._piece_found)

    def _piece_found(self, answer: Answer) -> None:
        try:
            self._found = self._from(answer)
        except LtlplanError as error:
            self._refuse(error)
            return
        self._ask_judgement()

    def _ask_judgement(self) -> None:
        """Ask whether all is proved if the piece begins in a moment, when all hover and nobody is on the way down."""
        assert self._left is not None and self._found is not None and self.team.present is not None, "it was found"  # noqa: PT018
        down = max((leaving.down or 0.0 for leaving in self._leaving), default=0.0) - self.began
        start = _exact(max(self._now + self._lead + AHEAD, float(self.team.present.end), down), ceil)
        if start > self._left.latest:
            self._ask_piece()
            return
        self._whole = self.team.with_next(self._left, self._found, start)
        self._ask(judgement, self._whole, self._judged)

    def _judged(self, answer: Answer) -> None:
        """Take the piece, or refuse it; where it should have begun by now, ask for a later beginning."""
        try:
            self._from(answer)
        except LtlplanError as error:
            self._refuse(error)
            return
        if self.answered[-1].proved is None:
            self.answered[-1] = replace(self.answered[-1], proved=self._link.now() - self._known)
        assert self._whole is not None and self._found is not None, "it was judged"  # noqa: PT018
        if self._now > float(self._whole.last.start) - STEP / 2 or any(leaving.down is None for leaving in self._leaving):
            self._lead *= 2
            self._ask_judgement()
            return
        self._due = self._stage().watched(self._link.accuracy)

    def _begin_piece(self, watched: Watched, whole: WholeFlight) -> None:
        """Begin a proved piece at the very instant with which it was judged."""
        if self._now > float(whole.last.start):
            self._due = None
            self._ask_judgement()
            return
        assert self._found is not None, "it was judged"
        self._number = self._flying.store(watched.paths)
        self._watch = self._flying.begin(watched, self._number, self.began + float(whole.last.start))
        self.team.take_over(whole.last, self._found)
        self.answered[-1] = replace(self.answered[-1], begun=self.began + float(whole.last.start) - self._known)
        self._record.note(
            self._link.now(), f"A certified piece for what is left begins at {float(whole.last.start):.2f} s.", None, "reaction"
        )
        self._due = self._whole = self._found = self._left = None

    def _refuse(self, error: LtlplanError | None) -> None:
        """Hover, as nothing is proved of what is left."""
        if error is not None:
            self.team.refuse(error)
        self._refused_at = self._link.now()
        self._record.note(self._link.now(), self.team.holding or "", None, "reaction")

    def _from(self, answer: Answer) -> Any:  # of any type: what the question was of
        """Return an answer.

        Raises:
            Alarm: There will be none.
        """
        try:
            return answer.result()
        except NoAnswer as error:
            raise Alarm(str(error)) from None

    def _watch_now(self) -> Watch:
        assert self.team.present is not None, "somebody is in the air"
        return watch_on(self._link, self._record, self.team.present, self.began, without=self._gone)

    # -- the end -------------------------------------------------------------------------------------------

    def _end(self) -> None:
        self.ended = self._record.ends[FLIGHT] = self._link.now()
        self._watch.finish()

    def _land(self) -> None:
        """Land in a certified way, from where all hover."""
        present = self.team.present
        assert present is not None, "somebody is in the air"
        places = {name: self.places[name] for name in present.mission.agents}
        answer = self.computer.ask(way_down, (present.mission, present.team, places))
        try:
            since = self._link.now()
            while not answer.done():
                self._link.sleep(STEP)
                self._show()
                if reason := (self._watch.lost() or ("", ""))[1] or self._watch.alarm():
                    raise Alarm(reason)
                if self._link.now() - since > PATIENCE:
                    raise Alarm(f"there was no way to land in {PATIENCE:g} s: whoever computes it hangs.")
            try:
                ways = self._from(answer)
            except LtlplanError as error:
                raise Alarm(f"no certified way to land: {error}") from None
        finally:
            answer.drop()
        for transfer in ways:
            self._flying.fly(transfer.stage)

    def _stage(self) -> Stage:
        """Return what was found last, or else what the team began with, as a link flies it."""
        certified = self.team.certified if self._found is None else self._found.certified
        assert certified is not None, "it was certified before anything spun"
        return Stage(FLIGHT, certified.plan, certified.team, certified.certificate)


def _exact(time: float, rounded: Callable[[float], int]) -> Fraction:
    """Return the instant before or after a time on the grid of steps, exact, as `floor` or `ceil` says."""
    return Fraction(rounded(time / PERIOD), round(1 / PERIOD))


def _first_change(before: Mapping[str, Trajectory], after: Mapping[str, Trajectory]) -> float:
    """Return when the first robot begins to fly otherwise, s on the trajectories' clocks."""
    begins = [float(path.knots[-2]) for name, path in after.items() if path.digest() != before[name].digest()]
    return min(begins, default=inf)
