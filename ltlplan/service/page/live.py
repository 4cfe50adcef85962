"""The live tab: flights in the air as they are seen, events that they are told, and replays of earlier ones."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.service.page.components import LiveView
from ltlplan.service.page.elements import Part, Words, box, button, submitted, table
from ltlplan.service.people.roles import Action
from verify.data import LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.event_inbox.control import Act
    from ltlplan.service.models import LiveEvent, LiveFlight
    from ltlplan.service.page.session_state import Desk

_REFRESH = 1.0
"""s between looks while the tab is seen."""
_LATE = 20.0
"""s without a question of a flight's, after which that is said."""
_HINT = "quad1 fails; water moves 0.3,-0.7,0.9; crate appears 0,0,1 0.4,0.4,2; formula F loc1"
_ARRIVES = "(event) => emit(event.target.value)"


class _Telling:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk, self.line, self.replay = desk, "", ""
        with box("telling"):
            Words("h2", "Flights in the air")
            self.flights = Part(box("flights"))
            with box("row"):
                self.state = Part(box().props("role=status"))
                self.control = Part(box("row control").props("aria-live=polite"))
            self.view = LiveView()
            self.view.on("moved", self._moved)
            with box("tell", tag="form").props('aria-label="Tell the flight"') as self.form:
                with box(tag="label"):
                    Words("span", "An event, such as: " + _HINT)
                    self.field = ui.element("input").props("name=event autocomplete=off maxlength=10000")
                    self.field.on("input", self._typed, js_handler=_ARRIVES, throttle=0.3, leading_events=False)
                Words("button", "Tell", "primary").props("type=submit")
                self.failing = Part(box("row failing"))
            submitted(self.form, self._send, "event.currentTarget.elements.event.value")
            self.foretold = Part(box("foretold").props("aria-live=polite"))
            self.events = Part(box("events").props("aria-live=polite"))
            self.runs = Part(box("runs"))
        desk.on_tab.append(lambda tab: self.timer.activate() if tab == "live" else self.timer.deactivate())
        self.timer = ui.timer(_REFRESH, self.refresh, active=False)

    async def _typed(self, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self.line = str(event.args)
        await self._foretell()

    async def _moved(self, event: Any) -> None:  # as above
        x, y, z = (float(part) for part in event.args["place"])
        await self._write(f"{event.args['name']} moves {x:g},{y:g},{z:g}")

    async def _write(self, line: str) -> None:
        """Write an event where events are written, and say what it will do; nothing is sent."""
        self.line = line
        self.desk.client.run_javascript(f"getHtmlElement({self.field.id}).value = {json.dumps(line)}")
        await self._foretell()

    async def _foretell(self) -> None:
        line = self.line.strip()
        said: list[str] = []
        if line and self.desk.flight is not None:
            try:
                said = await self.desk.service.foretell(self.desk.flight, line, who=self.desk.who)
            except LtlplanError as error:
                said = [str(error)]
        if line == self.line.strip():
            self.foretold.show(
                said, lambda: [Words("p", sentence) for sentence in ("If you tell it:", *said)] if said else None
            )

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
        self.flights.show((names, self.desk.flight), lambda: [self._flight(flight) for flight in flights] or self._nobody())
        flight = next((flight for flight in flights if flight.name == self.desk.flight), None)
        said = _state(flight, self.desk.flight)
        self.state.show(said, lambda: Words("p", said, "soft"))
        feed = None if flight is None else live.hub.feed(flight.name)
        seen = None if feed is None or not feed.connected else feed.frame
        hears = flight is not None and flight.ended is None and (seen is None or seen.hears)
        flies = hears and self.desk.may(Action.FLY)
        tells = flies and flight is not None and flight.pilot in (None, self.desk.who)
        who = (flight.pilot, flight.offered) if flight is not None and hears else None
        self.control.show((self.desk.flight, who, flies), lambda: self._control(*who, flies=flies) if who is not None else None)
        self.form.set_visibility(tells)
        self.view.look(None if flight is None else flight.name, self.replay or None, drags=tells)
        self.view.set_visibility(flight is not None)
        robots = () if seen is None or not tells else tuple(seen.robots)
        self.failing.show(robots, lambda: [self._fails(robot) for robot in robots])
        last = 0 if flight is None else max(0, flight.events - 100)
        events = () if flight is None else await live.events(
            flight.name, flight=None, after=last, wait=0.0, stopping=self.desk.service.stopping
        )  # fmt: skip
        self.events.show(events, lambda: _listed(events))
        await self._look_at_runs(flight)

    def _control(self, pilot: str | None, offered: str | None, *, flies: bool) -> None:
        """Show who is in control, and what this person can do about it."""
        me = self.desk.who
        said = "Nobody is in control." if pilot is None else f"{'You are' if pilot == me else f'{pilot} is'} in control."
        Words("span", said if offered is None else f"{said} Offered to {'you' if offered == me else offered}.", "soft")
        if not flies:
            return
        if pilot is None:
            button("Take control", lambda: self._do("take"), "quiet")
        if offered == me:
            button("Accept control", lambda: self._do("accept"), "primary")
        if offered is not None and me in (pilot, offered):
            button("Take the offer back" if pilot == me else "Decline", lambda: self._do("decline"), "quiet")
        if pilot == me and offered is None:
            other = ui.element("input").props('placeholder="another pilot" aria-label="Pilot to hand control to" maxlength=60')
            named = [""]
            other.on("input", lambda event: named.__setitem__(0, str(event.args)), js_handler=_ARRIVES)
            button("Hand over", lambda: self._do("offer", named[0].strip()), "quiet")
        if pilot is not None and (pilot == me or self.desk.may(Action.ADMINISTER)):
            button("Release", lambda: self._do("release"), "quiet")

    async def _do(self, act: Act, to: str = "") -> None:
        if self.desk.flight is not None:
            await self.desk.guarded(self._done(self.desk.flight, act, to), self.control.place)

    async def _done(self, flight: str, act: Act, to: str) -> None:
        await self.desk.service.control(self.desk.principal, flight, act, to)
        await self.refresh()

    async def _look_at_runs(self, flight: LiveFlight | None) -> None:
        runs = () if flight is None else await self.desk.service.live.runs(flight.name)
        recorded = tuple(run for run in runs if run.recorded)
        told = [(run.run, run.ended is None) for run in recorded]
        self.runs.show((told, self.replay), lambda: self._replays(recorded) if recorded else None)

    def _replays(self, runs: tuple[LiveFlight, ...]) -> None:
        Words("h2", "Replays")
        with box("row"):
            if self.replay:
                button("Back to live", lambda: self._play(""), "quiet")
            for run in runs:
                address = f"/api/live/{run.name}/replays/{run.run}"
                entry = button(
                    f"{run.opened[:10]} {run.opened[11:19]} UTC, {run.mission}", lambda at=address: self._play(at), "quiet"
                )
                entry.props(f"aria-pressed={'true' if address == self.replay else 'false'}")

    async def _play(self, address: str) -> None:
        self.replay = address
        await self.refresh()

    def _nobody(self) -> None:
        """Say how a flight comes to be seen here."""
        address = f"{str(self.desk.client.request.base_url).rstrip('/')}/live/lab"
        with box("empty"):
            Words(
                "p",
                "No flight is in the air. One is seen here, can be told events and stopped, when it is flown like this (lab is a name that you choose):",
            )
            for command in (
                f"ltlplan online firefighting --certified --link simulated --noise 0.001 --follow {address}",
                f"ltlplan fly RUN --link simulated --real-time --noise 0.001 --follow {address}",
            ):
                with Words("pre", ""):
                    Words("code", command)
            if self.desk.user is not None:
                Words(
                    "p",
                    "Its program needs a token of a pilot, made under People, in the environment variable LTLPLAN_TOKEN.",
                    "soft",
                )

    def _flight(self, flight: LiveFlight) -> None:
        mark = "" if flight.ended is None else " (ended)"
        entry = button(f"{flight.name}: {flight.mission}{mark}", lambda: self._choose(flight.name), "quiet")
        entry.props(f"aria-pressed={'true' if flight.name == self.desk.flight else 'false'}")

    def _fails(self, robot: str) -> None:
        button(f"{robot} failed", lambda: self._write(f"{robot} fails"), "quiet")

    async def _choose(self, name: str) -> None:
        self.desk.flight, self.replay = name, ""
        self.desk.show("live")
        await self.refresh()

    async def _send(self, event: Any) -> None:  # as above
        self.line = str(event.args)
        await self.desk.guarded(self._tell(), self.form)

    async def _tell(self) -> None:
        if self.desk.flight is None or not self.line.strip():
            return
        await self.desk.service.tell(self.desk.principal, self.desk.flight, self.line)
        await self._write("")
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


async def live_tab(desk: Desk) -> None:
    """Make the tab, with what there is to see if it is the one that is opened.

    Args:
        desk: What the person has open.
    """
    telling = _Telling(desk)
    if desk.tab == "live":
        await telling.refresh()
