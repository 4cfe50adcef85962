"""Services at which a live flight is seen, and from which it may be stopped."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ltlplan.commands.support.followed import Source, followed
from verify.data import BadInput

if TYPE_CHECKING:
    from flight.link.link import Link
    from flight.link.live_executive import Operator
    from flight.link.tracking_monitor import Look
    from ltlplan.service.client_parts.long_polling import FollowedService
    from verify.data import Mission

STORED = "this flight follows its plan, and takes no events; it can be stopped."
"""Why a flight that is not replanned does nothing of what it is told."""


def services(sources: Sequence[Source]) -> list[FollowedService]:
    """Return those of the sources of events that are services."""
    from ltlplan.service.client_parts.long_polling import FollowedService

    return [source for source in sources if isinstance(source, FollowedService)]


def followed_services(names: Sequence[str], mission: str) -> list[Source]:
    """Begin to listen at services, for a flight that takes no events.

    Args:
        names: As `--follow` has them.
        mission: Name of the mission that is flown.

    Raises:
        BadInput: One is no service, or cannot be listened at.
    """
    if others := [name for name in names if not name.startswith(("http://", "https://"))]:
        raise BadInput(
            f"--follow {others[0][:100]}: a stored flight takes no events; name a service, http://HOST:PORT/live/NAME, to be seen at and stopped from."
        )
    return [followed(name, mission) for name in names]


@contextmanager
def seen_at(
    listeners: Sequence[FollowedService],
    link: Link,
    show: Callable[[Look], None],
    mission: Callable[[], Mission],
    *,
    hears: bool,
) -> Generator[tuple[Link, Operator]]:
    """Have a flight seen at services while it flies; yield the link and the operator by which it is flown.

    Args:
        listeners: Where; with none, nothing is changed.
        link: To the vehicles.
        show: Told what a person is shown here.
        mission: Returns the mission as it is now.
        hears: Whether the flight takes events; else each is answered so.
    """
    from flight.link.live_executive import Operator

    if not listeners:
        yield link, Operator(show)
        return
    from flight.link.observed_link import Observation, ObservedLink
    from flight.link.record import Record
    from flight.link.stop_orders import StopOrders
    from ltlplan.service.client_parts.flight_feed import FlightFeed

    orders, record = StopOrders(), Record()
    feeds = [FlightFeed(listener, mission, orders, hears=hears) for listener in listeners]

    def show_all(seen: Observation) -> None:
        for feed in feeds:
            feed.show(seen)

    observed = ObservedLink(link, orders, record, show_all)

    def look(seen: Look) -> None:
        observed.see(seen)
        if not hears:
            _answer_all(listeners)
        show(seen)

    try:
        yield observed, Operator(look, orders, record)
    finally:
        observed.observe()
        for feed in feeds:
            feed.end()


def _answer_all(listeners: Sequence[FollowedService]) -> None:
    for listener in listeners:
        for told in listener():
            if not isinstance(told, str):
                told.answer(False, STORED)
