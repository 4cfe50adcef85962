"""Flights that listen to the service, and what operators tell them.

A flight that begins to listen takes a name and says once more who it is whenever it asks. What is told to a name goes to the flight that
listens as it, numbered; the flight asks for what has a greater number than the last that it has, so that nothing comes twice, and nothing is
lost while the line or the service is down. Each answer is kept beside its event. A flight that has not asked for `LOST` seconds is told nothing
more, because nobody knows whether it still flies; what it was told before waits for it.

Who listens is looked up in the book each time; in memory is only when each flight asked last.
"""

from __future__ import annotations

import asyncio
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ltlplan.online.event_sources.lines import event_told, meant
from ltlplan.service.event_inbox.control import Act, changed, require_control
from ltlplan.service.event_inbox.event_store import Book, Entry
from ltlplan.service.job_queue.results import RESERVE
from ltlplan.service.job_queue.store import NoRoom
from ltlplan.service.live_view.flight_recorder import FlightRecorder
from ltlplan.service.live_view.hub import Hub, Listening
from ltlplan.service.models import EventsAccepted, FlightAnswered, LiveEvent, LiveFlight
from ltlplan.service.problems import Busy, Conflict, NotFound, TooManyRequests
from verify.data import BadInput
from verify.data.errors import did_you_mean

if TYPE_CHECKING:
    from ltlplan.service.settings import Limits

LOST = 60.0
"""s without a question of a flight's, after which it is told nothing more."""
TAKEN = 30.0
"""s without a question of a flight's, after which another may take its name."""
AT_ONCE = 100
"""Events that are told, or asked for, at once."""

_GONE = "the flight ended without hearing it."


class LiveFlights:
    """Flights that listen, and what they are told.

    Attributes:
        hub: What is seen of them, and orders to stop.
        recorder: Keeps what is seen.
    """

    def __init__(self, folder: Path, limits: Limits) -> None:
        """Open nothing yet.

        Args:
            folder: The service's data folder.
            limits: How many flights, and how much each may be told.
        """
        self._folder, self._limits = folder, limits
        self._opened: Book | None = None
        self._asked: dict[str, float] = {}
        self._started = 0.0
        self._changed, self._one = asyncio.Event(), asyncio.Lock()
        self.hub, self.recorder = Hub(), FlightRecorder(folder)

    def open(self) -> None:
        """Open the book.

        Raises:
            BadInput: It cannot be used.
        """
        self._opened, self._started = Book(self._folder), time.monotonic()

    def close(self) -> None:
        """Close the book; nobody is told anything more."""
        if self._opened is not None:
            self._opened.close()
        self._opened = None

    @property
    def _book(self) -> Book:
        if self._opened is None:
            raise Busy("The service is not running.")
        return self._opened

    async def flights(self) -> tuple[LiveFlight, ...]:
        """Return the newest flight of each name, those that listen before others, then the newest first."""
        newest: dict[str, Entry] = {}
        for entry in await asyncio.to_thread(self._book.flights):
            newest.setdefault(entry.name, entry)
        return tuple(self._told(entry) for entry in sorted(newest.values(), key=lambda entry: entry.ended is not None))

    async def flight(self, name: str) -> LiveFlight:
        """Return the newest flight of a name.

        Raises:
            NotFound: There is none.
        """
        return self._told(await self._entry(name))

    async def begin(self, name: str, flight: str, mission: str) -> tuple[LiveFlight, bool]:
        """Let a flight listen, and return it, and whether it did not yet; the same flight may ask again.

        Args:
            name: What it is to listen as.
            flight: Its own name for itself.
            mission: What it flies.

        Raises:
            Conflict: Another one listens as that, or this one has ended.
            TooManyRequests: Too many flights listen.
            NoRoom: The disk is full.
        """
        async with self._one:
            return await self._begin(name, flight, mission)

    async def _begin(self, name: str, flight: str, mission: str) -> tuple[LiveFlight, bool]:
        every = await asyncio.to_thread(self._book.flights)
        if (same := next((entry for entry in every if entry.flight == flight), None)) is not None:
            if same.name != name or same.ended is not None:
                raise Conflict(f"This flight listened as '{same.name}'{' and has ended' if same.ended else ''}.")
            return self._sign_of_life(same), False
        before = next((entry for entry in every if entry.name == name and entry.ended is None), None)
        if before is not None:
            if (silent := self._silent(before)) < TAKEN:
                raise Conflict(
                    f"Another flight listens as '{name}' and asked {silent:.0f} s ago; take another name, or wait {TAKEN:.0f} s after it was ended."
                )
            await asyncio.to_thread(self._book.end, before, _GONE)
        listening = sum(entry.ended is None for entry in every) - (before is not None)
        if listening >= self._limits.live_flights:
            for lost in (entry for entry in every if entry.ended is None and entry != before and self._silent(entry) > LOST):
                await asyncio.to_thread(self._book.end, lost, _GONE)
                listening -= 1
        if listening >= self._limits.live_flights:
            raise TooManyRequests(f"{listening} flights listen already, the most there may be.", 30.0)
        self._require_room()
        await asyncio.to_thread(self._enter, name, flight, mission)
        return self._sign_of_life(await self._entry(name)), True

    def _enter(self, name: str, flight: str, mission: str) -> None:
        self._book.begin(name, flight, mission, keep=2 * self._limits.live_flights)
        self.recorder.forget({entry.id for entry in self._book.flights()})

    async def forget_recordings(self, before: float) -> int:
        """Delete recordings of flights that ended before an instant, s since 1970, and return how many they were."""
        flying = {entry.id for entry in await asyncio.to_thread(self._book.flights) if entry.ended is None}
        return await asyncio.to_thread(self.recorder.forget_old, before, flying)

    async def listening(self, name: str, flight: str) -> Listening:
        """Return a flight that listens.

        Args:
            name: What it listens as.
            flight: Its own name for itself.

        Raises:
            NotFound: No flight ever listened as that.
            Conflict: This one does not.
        """
        entry = await self._entry(name)
        self._require_listening(entry, flight)
        self._sign_of_life(entry)
        return Listening(entry.name, entry.id, entry.flight, entry.mission, entry.opened)

    async def runs(self, name: str) -> tuple[LiveFlight, ...]:
        """Return all flights that are known of a name, the newest first."""
        return tuple(self._told(entry) for entry in await asyncio.to_thread(self._book.flights, name))

    async def require_run(self, name: str, run: int) -> None:
        """Reject a flight that never listened as a name.

        Raises:
            NotFound: It did not.
        """
        if not any(entry.id == run for entry in await asyncio.to_thread(self._book.flights, name)):
            raise NotFound(f"There is no flight {run} of '{name[:60]}'.")

    async def tell(self, name: str, text: str, who: str) -> EventsAccepted:
        """Tell a flight events, all or none: when this returns, they are on the disk.

        Args:
            name: What it listens as.
            text: An event a line, as `--follow FILE` has them.
            who: Who tells it.

        Raises:
            NotFound: No flight ever listened as that.
            BadInput: A line is no event; all faults are listed.
            Conflict: The flight has ended, or has not asked for long.
            TooManyRequests: It was told too much already.
            NoRoom: The disk is full.
        """
        lines = await asyncio.to_thread(checked, text)
        async with self._one:
            made = await self._tell(name, lines, who)
        self._wake()
        return EventsAccepted(flight=await self.flight(name), events=tuple(made))

    async def _tell(self, name: str, lines: list[str], who: str) -> list[LiveEvent]:
        entry = await self._entry(name)
        if entry.ended is not None:
            raise Conflict(f"The flight that listened as '{name}' has ended.")
        if (silent := self._silent(entry)) > LOST:
            raise Conflict(
                f"The flight that listens as '{name}' has not asked for {silent:.0f} s: its connection is down, or it was ended. "
                "Events that it was sent before wait for it."
            )
        require_control(name, entry.pilot, who)
        most, letters = self._limits.live_events, self._limits.live_letters
        if entry.events + len(lines) > most:
            raise TooManyRequests(f"A flight receives {most} events at most; '{name}' was told {entry.events}.", 60.0)
        if await asyncio.to_thread(self._book.letters, entry) + sum(map(len, lines)) > letters:
            raise TooManyRequests(f"A flight receives {letters} letters at most.", 60.0)
        self._require_room()
        if entry.pilot is None:
            await asyncio.to_thread(self._book.control, entry, who, entry.offered)
        return await asyncio.to_thread(self._book.tell, entry, lines, who)

    async def control(self, name: str, act: Act, who: str, *, to: str = "", admin: bool = False) -> LiveFlight:
        """Change who is in control of a flight; as `control.changed`.

        Args:
            name: What it listens as.
            act: What is done.
            who: Who does it.
            to: To whom control is offered.
            admin: Whether who does it is an admin.

        Raises:
            NotFound: No flight ever listened as that.
            Conflict: It has ended, or that cannot be done.
        """
        async with self._one:
            entry = await self._entry(name)
            if entry.ended is not None:
                raise Conflict(f"'{name}' has ended.")
            pilot, offered = changed(name, (entry.pilot, entry.offered), act, who, to=to, admin=admin)
            await asyncio.to_thread(self._book.control, entry, pilot, offered)
        self.hub.tell_state(name)
        return await self.flight(name)

    async def events(
        self, name: str, *, flight: str | None, after: int, wait: float, stopping: asyncio.Event
    ) -> tuple[LiveEvent, ...]:
        """Return what a flight was told, `AT_ONCE` events at most.

        Args:
            name: What it listens as.
            flight: Its own name for itself, where it is the flight that asks.
            after: Only events of greater numbers.
            wait: s to wait for one.
            stopping: Set when the service is about to stop; then nobody waits.

        Raises:
            NotFound: No flight ever listened as that.
            Conflict: The flight that asks does not listen as that any more.
        """
        end = time.monotonic() + wait
        while True:
            changed = self._changed
            entry = await self._entry(name)
            if flight is not None:
                self._require_listening(entry, flight)
                self._sign_of_life(entry)
            found = await asyncio.to_thread(self._book.events, entry, after, AT_ONCE)
            left = end - time.monotonic()
            if found or left <= 0 or stopping.is_set() or entry.ended is not None:
                return found
            await _first_of(changed, stopping, seconds=left)

    async def answer(self, name: str, flight: str, answers: Sequence[FlightAnswered]) -> None:
        """Keep what a flight did with what it was told.

        Args:
            name: What it listens as.
            flight: Its own name for itself.
            answers: What it did.

        Raises:
            NotFound: No flight ever listened as that.
            Conflict: This flight does not listen as that any more.
        """
        entry = await self._entry(name)
        self._require_listening(entry, flight)
        await asyncio.to_thread(self._book.answer, entry, answers)
        self._sign_of_life(entry)

    async def end(self, name: str, flight: str) -> None:
        """Note that a flight has ended.

        Args:
            name: What it listened as.
            flight: Its own name for itself.

        Raises:
            NotFound: No flight ever listened as that.
            Conflict: Another one listens as that now.
        """
        entry = await self._entry(name)
        if entry.flight != flight:
            raise Conflict(f"Another flight listens as '{name}' now.")
        await asyncio.to_thread(self._book.end, entry, _GONE)
        self._asked.pop(flight, None)
        self._wake()
        self.hub.tell_state(name)

    async def _entry(self, name: str) -> Entry:
        found = await asyncio.to_thread(self._book.flights, name)
        if not found:
            known = {entry.name for entry in await asyncio.to_thread(self._book.flights) if entry.ended is None}
            listen = f"These do: {', '.join(sorted(known))}." if known else "None does."
            raise NotFound(f"No flight listens as '{name[:60]}'.{did_you_mean(name, known)} {listen}")
        return found[0]

    def _require_listening(self, entry: Entry, flight: str) -> None:
        if entry.flight != flight or entry.ended is not None:
            raise Conflict(f"This flight does not listen as '{entry.name}' any more.")

    def _require_room(self) -> None:
        if shutil.disk_usage(self._folder).free < RESERVE:
            raise NoRoom(f"There is less than {RESERVE / 1e6:.0f} MB of room in {self._folder}; make room there.")

    def _silent(self, entry: Entry) -> float:
        """Return for how many s a flight has not asked, or since the service was started."""
        return time.monotonic() - self._asked.get(entry.flight, self._started)

    def _sign_of_life(self, entry: Entry) -> LiveFlight:
        self._asked[entry.flight] = time.monotonic()
        return self._told(entry)

    def _told(self, entry: Entry) -> LiveFlight:
        return LiveFlight(
            name=entry.name, mission=entry.mission, opened=entry.opened, ended=entry.ended,
            silent=None if entry.ended is not None else round(self._silent(entry), 1), events=entry.events, open=entry.open,
            pilot=entry.pilot, offered=entry.offered, run=entry.id, connected=self.hub.connected(entry.name, entry.id), recorded=self.recorder.recorded(entry.id),
        )  # fmt: skip

    def _wake(self) -> None:
        """Let all who wait look again."""
        self._changed.set()
        self._changed = asyncio.Event()


def checked(text: str) -> list[str]:
    """Return the lines of a text that are events.

    Raises:
        BadInput: One is none, or there are none, or too many; all faults are listed.
    """
    lines = meant(text.split("\n"))
    if not lines:
        raise BadInput("There is no event in this; write one a line, such as 'quad1 fails'.")
    if len(lines) > AT_ONCE:
        raise BadInput(f"{len(lines)} events are sent at once; {AT_ONCE} are the most.")
    faults: list[str] = []
    for number, line in enumerate(lines, 1):
        try:
            event_told(line)
        except BadInput as error:
            faults.append(f"event {number}: {error}")
    if faults:
        raise BadInput("\n".join(faults))
    return lines


async def _first_of(*events: asyncio.Event, seconds: float) -> None:
    """Wait until one is set, or for so long."""
    waiting = [asyncio.ensure_future(event.wait()) for event in events]
    try:
        await asyncio.wait(waiting, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for each in waiting:
            each.cancel()
