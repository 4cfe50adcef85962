"""The last tab: flights in the air that listen to this service; tell one an event, and see what it did."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.service.page.elements import Part, Words, box, button, table
from ltlplan.service.people.roles import Action
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.models import LiveEvent, LiveFlight
    from ltlplan.service.page.session_state import Desk

_REFRESH = 1.0
"""s between looks while the tab is seen."""
_LATE = 20.0
"""s without a question of a flight's, after which that is said."""
_HINT = "quad1 fails; water moves 0.3,-0.7,0.9; crate appears 0,0,1 0.4,0.4,2; formula F loc1"
_NOBODY = (
    "No flight listens. One begins to by `ltlplan online MISSION --certified --link KIND --follow ADDRESS/live/NAME`, ADDRESS being this "
    "service's and NAME what you choose."
)


class _Telling:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk, self.line = desk, ""
        with box("telling"):
            Words("h2", "Flights in the air")
            self.flights = Part(box("flights"))
            self.state = Part(box().props("role=status"))
            with box("tell", tag="form").props('aria-label="Tell the flight"') as self.form:
                with box(tag="label"):
                    Words("span", "An event, such as: " + _HINT)
                    self.field = ui.element("input").props("name=event autocomplete=off maxlength=10000")
                    self.field.on("input", self._typed, js_handler="(event) => emit(event.target.value)")
                button("Tell", self._send, "primary")
            self.form.on("submit", self._send, js_handler="(event) => { event.preventDefault(); emit(); }")
            self.events = Part(box("events").props("aria-live=polite"))
        desk.on_tab.append(lambda tab: self.timer.activate() if tab == "live" else self.timer.deactivate())
        self.timer = ui.timer(_REFRESH, self.refresh, active=False)

    def _typed(self, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self.line = str(event.args)

    async def refresh(self) -> None:
        """Look again at who listens, and at what was told."""
        try:
            await self._look()
        except LtlplanError as error:
            text = str(error)
            self.state.show(text, lambda: Words("p", text, "soft"))

    async def _look(self) -> None:
        live = self.desk.service.live
        flights = await live.flights()
        if self.desk.flight is None and flights:
            self.desk.flight = flights[0].name
        names = [(flight.name, flight.mission, flight.ended is None) for flight in flights]
        self.flights.show(
            (names, self.desk.flight), lambda: [self._flight(flight) for flight in flights] or Words("p", _NOBODY, "soft")
        )
        flight = next((flight for flight in flights if flight.name == self.desk.flight), None)
        said = _state(flight, self.desk.flight)
        self.state.show(said, lambda: Words("p", said, "soft"))
        self.form.set_visibility(flight is not None and flight.ended is None and self.desk.may(Action.FLY))
        last = 0 if flight is None else max(0, flight.events - 100)
        events = () if flight is None else await live.events(
            flight.name, flight=None, after=last, wait=0.0, stopping=self.desk.service.stopping
        )  # fmt: skip
        self.events.show(events, lambda: _listed(events))

    def _flight(self, flight: LiveFlight) -> None:
        mark = "" if flight.ended is None else " (ended)"
        entry = button(f"{flight.name}: {flight.mission}{mark}", lambda: self._choose(flight.name), "quiet")
        entry.props(f"aria-pressed={'true' if flight.name == self.desk.flight else 'false'}")

    async def _choose(self, name: str) -> None:
        self.desk.flight = name
        self.desk.show("live")
        await self.refresh()

    async def _send(self, _event: object = None) -> None:
        await self.desk.guarded(self._tell(), self.form)

    async def _tell(self) -> None:
        if self.desk.flight is None or not self.line.strip():
            return
        await self.desk.service.tell(self.desk.principal, self.desk.flight, self.line)
        self.line = ""
        self.desk.client.run_javascript(f"getHtmlElement({self.field.id}).value = ''")
        await self.refresh()


def _state(flight: LiveFlight | None, chosen: str | None) -> str:
    if flight is None:
        return "" if chosen is None else f"No flight listens as {chosen}."
    if flight.ended is not None:
        return f"{flight.name} has ended."
    silent = flight.silent or 0.0
    return f"{flight.name} listens." if silent < _LATE else f"{flight.name} has not asked for {silent // 10 * 10:.0f} s."


def _listed(events: tuple[LiveEvent, ...]) -> None:
    if events:
        told = {None: "not answered yet", True: "done", False: "not done"}
        rows = [
            [str(e.number), e.told[11:19], e.who, e.line, f"{told[e.heard]}{': ' if e.answer else ''}{e.answer}"]
            for e in events
        ]
        table(["", "UTC", "told by", "event", "what the flight did"], list(reversed(rows)))


def live_tab(desk: Desk) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
    """
    _Telling(desk)
