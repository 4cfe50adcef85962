"""A team in the air over a link: what it flies, who watches it, and what is being asked for it meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from flight.link.link import Link
from flight.link.live_executive import Alarm, Flying
from flight.link.record import Record
from flight.link.tracking_monitor import Watch
from ltlplan.online.live.executors import Answer, Computer, NoAnswer
from ltlplan.online.live.leaving import Leaving
from ltlplan.online.live.segment_monitor import watch_on
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online_mtac.team_in_flight import PERIOD
from verify.data.events import WorldEvent
from verify.data.shapes.inequalities import Point
from verify.flight_segments import Piece

PATIENCE = 30.0
"""s that planning and proving may take while the team hovers."""


@dataclass(frozen=True, slots=True)
class Answered:
    """Time from an event's arrival to its answer, s.

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
    """Pending answer, the receiver of its result, and the time of the question, s of the link's clock."""

    answer: Answer
    then: Callable[[Answer], None]
    asked: float


@dataclass
class InAir:
    """A team in the air.

    Attributes:
        team: What is proved and flown.
        computer: Who computes answers.
        flying: Shows it, and stores and begins what it flies.
        began: When the flight began, s of the link's clock.
        number: Of the flight that is stored in vehicles and flown.
        watch: Who watches it.
        shown: How much of what was said has been shown.
        answered: How long answers to events took, the last one's so far.
        known: When the last event was known, s of the link's clock.
        leaving: Robots that leave it.
        gone: When they were part of it last, s of the flight.
        question: What is being asked.
        climb: What all fly while a newcomer climbs and the others hover; None where nobody does.
    """

    team: CertifiedTeam
    computer: Computer
    flying: Flying
    began: float
    number: int
    watch: Watch
    shown: int
    answered: list[Answered]
    known: float = 0.0
    leaving: list[Leaving] = field(default_factory=list[Leaving])
    gone: dict[str, float] = field(default_factory=dict[str, float])
    question: _Question | None = None
    climb: Piece | None = None

    @property
    def link(self) -> Link:
        """To the robots."""
        return self.flying.link

    @property
    def record(self) -> Record:
        """Takes in what is seen and said."""
        return self.flying.record

    @property
    def now(self) -> float:
        """Flight time, s."""
        return self.link.now() - self.began

    @property
    def present(self) -> Piece:
        """Trajectories that are flown."""
        assert self.team.present is not None, "somebody is in the air"
        return self.team.present

    def note(self, sentence: str, robot: str | None = None, kind: str = "note") -> None:
        """Say something of now.

        Args:
            sentence: For a person.
            robot: Whom it concerns; None for the team.
            kind: As a record's events have it.
        """
        self.record.note(self.link.now(), sentence, robot, kind)

    def took(self, **seconds: float) -> None:
        """Note how long the answer to the last event took so far: `stop`, `proved` or `begun`, s."""
        self.answered[-1] = replace(self.answered[-1], **seconds)

    def show(self) -> None:
        """Look, and show all that was said since."""
        look, ends = self.watch.look(), float((self.climb or self.present).end)
        said = tuple(self.record.events[self.shown :])
        self.shown = len(self.record.events)
        self.flying.show(replace(look, time=self.now, duration=ends, events=said))

    def positions(self) -> dict[str, Point]:
        """Return where each robot was seen last, m."""
        return {name: pose.position for name in self.team.pilots if (pose := self.link.pose(name)) is not None}

    def watch_again(self) -> None:
        """Watch what is flown from now on."""
        self.watch = watch_on(self.link, self.record, self.climb or self.present, self.began, without=self.gone)

    def breathe(self) -> None:
        """Let set-points go out between two steps that take some milliseconds each."""
        self.link.sleep(0.0)

    # -- what is asked ---------------------------------------------------------------------------------------

    def ask(self, work: Callable[..., Any], about: object, then: Callable[[Answer], None]) -> None:
        """Have a question answered beside the flight.

        Args:
            work: What answers it.
            about: The question.
            then: What is done with the answer.
        """
        self.breathe()
        self.question = _Question(self.computer.ask(work, about), then, self.link.now())

    def go_on(self, patience: float) -> None:
        """Do what is to be done with the answer to what is asked, where it has come.

        Args:
            patience: s that it may take.

        Raises:
            Alarm: It takes longer.
        """
        assert self.question is not None, "something is asked"
        waited = self.link.now() - self.question.asked
        if self.question.answer.done():
            question, self.question = self.question, None
            try:
                question.then(question.answer)
                self.breathe()
            finally:
                question.answer.drop()
        elif waited > patience:
            raise Alarm(f"there was no answer in {waited:.1f} s: its computation hangs.")

    def drop(self) -> None:
        """Give up what is asked."""
        if self.question is not None:
            self.question.answer.drop()
        self.question = None


def result_of(answer: Answer) -> Any:  # of any type: what the question was of
    """Return an answer.

    Raises:
        Alarm: There will be none.
        LtlplanError: What was raised in its place.
    """
    try:
        return answer.result()
    except NoAnswer as error:
        raise Alarm(str(error)) from None


def exact_instant(time: float, rounded: Callable[[float], int]) -> Fraction:
    """Return the instant before or after a time on the grid of steps, exact.

    Args:
        time: s.
        rounded: `floor` or `ceil`.
    """
    return Fraction(rounded(time / PERIOD), round(1 / PERIOD))
