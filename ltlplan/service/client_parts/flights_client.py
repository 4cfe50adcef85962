"""An operator's half of the client: the connection to a service, whether it works, and the flights that listen to it."""

from __future__ import annotations

from typing import Any, Self

from ltlplan.service.client_parts.transport import Wire, checked, segment
from ltlplan.service.event_inbox.control import Act
from ltlplan.service.models import EventsAccepted, Health, LiveEvent, LiveFlight, StopLevel, StopReceipt
from verify.data.names.former_names import warn_former

PATIENCE = 60.0
"""s that an answer is waited for."""


class FlightsClient:
    """A service, as an operator of teams in flight asks it."""

    def __init__(self, url: str, token: str | None = None, *, timeout: float = PATIENCE) -> None:
        """Prepare to ask a service; nothing is sent yet.

        Args:
            url: Where it is, such as "http://127.0.0.1:8000".
            token: A bearer token, where it needs one.
            timeout: s that an answer is waited for.

        Raises:
            BadInput: That is no address.
            MissingEngine: The extra `service` is not installed.
        """
        self._wire = Wire(url, token, timeout)

    @property
    def url(self) -> str:
        """Address of the service."""
        return self._wire.url

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the connection."""
        self._wire.close()

    def metrics(self) -> str:
        """Return what the service counts, in Prometheus' text format."""
        return self._wire.ask("GET", "/metrics").text

    def limits(self) -> dict[str, Any]:  # of any type: numbers, and rates as dictionaries
        """Return the limits on time, memory, sizes and rates that jobs and questions meet, by their names."""
        return self._wire.ask("GET", "/api/limits").json()

    def flights(self) -> tuple[LiveFlight, ...]:
        """Return the flights that listen, or did: the newest of each name."""
        return tuple(checked(LiveFlight, each) for each in self._wire.ask("GET", "/api/live").json())

    def send_events(self, flight: str, *events: str) -> EventsAccepted:
        """Send events to a flight, all or none. When this returns they are stored, and the flight receives them.

        A call that failed may have been received.

        Args:
            flight: What it listens as, by `ltlplan online --follow http://.../live/NAME`.
            events: Lines such as "quad1 fails".

        Raises:
            BadInput: No flight listens as that, one is no event, or the flight has been sent too many already.
        """
        text = "\n".join(events).encode()
        accepted = self._wire.ask(
            "POST", f"/api/live/{segment(flight)}/events", content=text, headers={"content-type": "text/plain"}
        )
        return checked(EventsAccepted, accepted.json())

    def events(self, flight: str, *, after: int = 0) -> tuple[LiveEvent, ...]:
        """Return the events that a flight was sent, with its answers: a hundred at most.

        Args:
            flight: What it listens as.
            after: Only events of greater numbers.

        Raises:
            BadInput: No flight listens as that.
        """
        sent = self._wire.ask("GET", f"/api/live/{segment(flight)}/events", params={"after": after}).json()
        return tuple(checked(LiveEvent, each) for each in sent)

    def control_flight(self, flight: str, act: Act, *, to: str = "") -> LiveFlight:
        """Change who is in control of a flight, and return it.

        Args:
            flight: What it listens as.
            act: "take" control that nobody has, "offer" it, "accept" or "decline" an offer, or "release" it.
            to: To whom it is offered.

        Raises:
            BadInput: No flight listens as that, or that cannot be done as it is.
        """
        answer = self._wire.ask("POST", f"/api/live/{segment(flight)}/control", params={"act": act, "to": to})
        return checked(LiveFlight, answer.json())

    def stop_flight(self, flight: LiveFlight, level: StopLevel = "hold") -> StopReceipt:
        """Order all robots of a flight to hold, to land, or to stop their motors; the receipt says that the order is on the line, no more.

        It is no safety function: the flight's terminal and the kill switch come first.

        Args:
            flight: The flight, of `flights()`; no other one of its name is meant.
            level: "hold" where they can stop, for as long as that can last; "land"; "motors" off, by who ordered a stop before.

        Raises:
            BadInput: It is not connected, so that nobody hears this.
        """
        asked = {"run": flight.run, "level": level}
        answer = self._wire.ask("POST", f"/api/live/{segment(flight.name)}/stop", params=asked)
        return checked(StopReceipt, answer.json())

    def tell(self, flight: str, *events: str) -> EventsAccepted:
        """Send events by this method's former name, with a `DeprecationWarning`; as `send_events`."""
        warn_former("`Client.tell`", "`Client.send_events`")
        return self.send_events(flight, *events)

    def told(self, flight: str, *, after: int = 0) -> tuple[LiveEvent, ...]:
        """Return events by this method's former name, with a `DeprecationWarning`; as `events`."""
        warn_former("`Client.told`", "`Client.events`")
        return self.events(flight, after=after)

    def health(self) -> Health:
        """Return whether the service works."""
        return checked(Health, self._wire.ask("GET", "/health", also=(503,)).json())
