"""What happens while a team flies over a link: at times that are known, as it is told, and what a robot that is lost makes happen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from ltlplan.online.certified import CertifiedTeam
from ltlplan.sharing.events import in_order
from verify.data import BadInput, Mission
from verify.data.events import RobotJoins, RobotLeaves, WorldEvent

News = Callable[[], Sequence[WorldEvent | str]]
"""Returns what was told since it was asked last, without waiting; a text says what was told and is no event."""

_NO_JOINING = "{}: robots join a team in simulation without a link; over one, land and begin anew with all of them."


def checked_events(mission: Mission, events: Sequence[WorldEvent]) -> tuple[WorldEvent, ...]:
    """Return events in the order of their times, if all of them can be in a flight over a link.

    Args:
        mission: As it is at take-off.
        events: What happens.

    Raises:
        BadInput: An event cannot be, or a robot is to join.
    """
    for event in events:
        if isinstance(event, RobotJoins):
            raise BadInput(_NO_JOINING.format(event))
    return in_order(mission, events)


def no_news() -> Sequence[WorldEvent | str]:
    """Return nothing."""
    return ()


def fault_of(team: CertifiedTeam, event: WorldEvent) -> str | None:
    """Say why an event cannot be, as the world is now; None where it can.

    Args:
        team: As it flies.
        event: What was told.
    """
    if isinstance(event, RobotJoins):
        return _NO_JOINING.format(event)
    if isinstance(event, RobotLeaves) and event.robot not in team.pilots:
        return f"{event}: it is not in the air."
    try:
        in_order(team.mission, (replace(event, time=0.0),))
    except BadInput as error:
        return str(error)
    return None


@dataclass(slots=True)
class Happenings:
    """Events that were not taken yet.

    Attributes:
        timed: Those of times to come, s of the flight, in order.
        news: What is told.
        queue: Those that are known, with when that came to be, s of the link's clock.
    """

    timed: tuple[WorldEvent, ...]
    news: News
    queue: list[tuple[float, WorldEvent]] = field(default_factory=list[tuple[float, WorldEvent]])

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self.timed or self.queue)

    def hear(self, now: float, arrived: float) -> list[str]:
        """Take in what is due and what was told, and return what was told and is no event.

        Args:
            now: s of the flight.
            arrived: The same on the link's clock, s.
        """
        said: list[str] = []
        told = list[WorldEvent]()
        for event in self.news():
            if isinstance(event, str):
                said.append(event)
            else:
                told.append(event)
        self.timed = tuple(sorted((*self.timed, *told), key=lambda event: event.time))
        while self.timed and self.timed[0].time <= now:
            self.queue.append((arrived, self.timed[0]))
            self.timed = self.timed[1:]
        return said
