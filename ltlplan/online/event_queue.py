"""Queue of a live flight's events: scheduled events, operator events, and events raised when a robot is lost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from ltlplan.online.checked_events import in_order
from ltlplan.online.segments.certified_team import CertifiedTeam
from ltlplan.online.standby import Standby, shown_at
from verify.data import BadInput, Mission
from verify.data.events import RobotJoins, RobotLeaves, WorldEvent


@dataclass(frozen=True, slots=True)
class Told:
    """An event that was told by somebody who is to hear what became of it.

    Attributes:
        event: The event.
        answer: Told whether it was heard, and what was done or why it was not, as a sentence. It returns at once.
    """

    event: WorldEvent
    answer: Callable[[bool, str], None]


News = Callable[[], Sequence[WorldEvent | Told | str]]
"""Returns what was told since it was asked last, without waiting; a text says what was told and is no event."""

GIVE_UP = 3.0
"""s that a team hovers which cannot finish: until then another event may help it."""
TOO_LATE = "the flight ended before."
"""Why an event was not heard that nobody took in time."""

_NOBODY = Standby()


def checked_events(mission: Mission, events: Sequence[WorldEvent], standby: Standby = _NOBODY) -> tuple[WorldEvent, ...]:
    """Return events in the order of their times, if all of them can be in a flight over a link.

    Args:
        mission: As it is at take-off.
        events: What happens.
        standby: Who may join.

    Raises:
        BadInput: An event cannot be, or a robot is to join that does not wait on the ground.
    """
    for event in events:
        if isinstance(event, RobotJoins) and event.robot not in mission.agents and (fault := standby.fault(mission, event)):
            raise BadInput(fault)
    return in_order(mission, events)


def no_news() -> Sequence[WorldEvent | Told | str]:
    """Return nothing."""
    return ()


def fault_of(team: CertifiedTeam, event: WorldEvent, standby: Standby = _NOBODY, earlier: Sequence[Mission] = ()) -> str | None:
    """Say why an event cannot be, as the world is now; None where it can.

    Args:
        team: As it flies.
        event: What was told.
        standby: Who may join, or climbs already.
        earlier: The mission as it was before, at any time of the flight.
    """
    if isinstance(event, RobotJoins) and event.robot not in team.mission.agents:
        if fault := standby.fault(team.mission, event):
            return fault
        if team.lost is not None:
            return f"{event}: nothing more is certified of this flight. {team.lost}"
        if team.mission.written.counts:
            return f"{event}: the formula counts robots or names them, and what it asks of a team that somebody joins is not planned in flight."
        if region := next((name for world in (*earlier, team.mission) if (name := shown_at(event.agent.start, world))), None):
            return (
                f"{event}: where it is to hover it may show '{region}', where that is or was in this flight; let it begin outside of all "
                "regions."
            )
    if isinstance(event, RobotLeaves) and event.robot not in team.pilots:
        return f"{event}: it is not in the air."
    try:
        in_order(team.mission, (replace(event, time=0.0),))
    except BadInput as error:
        return str(error)
    return None


def _nobody(_heard: bool, _sentence: str) -> None:
    """Tell nobody."""


@dataclass(slots=True)
class Happenings:
    """Events that were not taken yet.

    Attributes:
        timed: Those of times to come, s of the flight, in order.
        news: What is told.
        queue: Those that are known, with when that came to be, s of the link's clock.
    """

    timed: tuple[WorldEvent | Told, ...]
    news: News
    queue: list[tuple[float, Told]] = field(default_factory=list[tuple[float, Told]])

    def __bool__(self) -> bool:
        """Return whether any event is pending."""
        return bool(self.timed or self.queue)

    def add(self, arrived: float, event: WorldEvent) -> None:
        """Take in what nobody told.

        Args:
            arrived: When it came to be known, s of the link's clock.
            event: What happened.
        """
        self.queue.append((arrived, Told(event, _nobody)))

    def first(self, *, joining: bool) -> tuple[float, Told] | None:
        """Take out the first event that can be taken now; None where there is none.

        Args:
            joining: Whether a robot can join now; where none can, those that are to wait, and others go before them.
        """
        for index, (_, told) in enumerate(self.queue):
            if joining or not isinstance(told.event, RobotJoins):
                return self.queue.pop(index)
        return None

    def hear(self, now: float, arrived: float) -> list[str]:
        """Take in what is due and what was told, and return what was told and is no event.

        Args:
            now: s of the flight.
            arrived: The same on the link's clock, s.
        """
        news = self.news()
        self.timed = tuple(sorted((*self.timed, *(each for each in news if not isinstance(each, str))), key=_time))
        while self.timed and _time(self.timed[0]) <= now:
            first, self.timed = self.timed[0], self.timed[1:]
            self.queue.append((arrived, first if isinstance(first, Told) else Told(first, _nobody)))
        return [each for each in news if isinstance(each, str)]

    def end(self) -> None:
        """Answer all who told what was not taken, and forget it."""
        for told in (*(told for _, told in self.queue), *self.timed):
            if isinstance(told, Told):
                told.answer(False, TOO_LATE)
        self.queue, self.timed = [], ()


def _time(each: WorldEvent | Told) -> float:
    return each.event.time if isinstance(each, Told) else each.time
