"""Hub of live views: the newest frame and picture of each flight that is connected, those who look, and orders to stop on their way.

All of it is in memory, in the event loop's thread, and nothing here waits: a frame replaces the one before, and a viewer that is slow gets the newest
when it is ready. An order to stop needs no disk, no queue and no thread.
"""

from __future__ import annotations

import asyncio
import time
import uuid
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from ltlplan.service.live_view.messages import FRESH, Frame, StopOrder
from ltlplan.service.models import StopLevel, StopReceipt
from ltlplan.service.problems import Conflict, NotFound

LINE = 1.0
"""s without a frame after which a flight is not connected any more."""


@dataclass(frozen=True, slots=True)
class Listening:
    """A flight as the inbox of events knows it.

    Attributes:
        name: What it listens as.
        run: Its number among all flights.
        flight: Its own name for itself.
        mission: What it flies.
        opened: When it began to listen, UTC.
    """

    name: str
    run: int
    flight: str
    mission: str
    opened: str


@dataclass(eq=False)
class Viewer:
    """Viewer of a flight: what it was not sent yet.

    Attributes:
        name: The flight's.
        changed: Set when there is something new.
        frame: The newest frame that was not sent yet, as JSON.
        picture: The newest picture that was not sent yet, as JSON.
        state: Whether what is known of the connection is to be sent.
    """

    name: str
    changed: asyncio.Event = field(default_factory=asyncio.Event)
    frame: str | None = None
    picture: str | None = None
    state: bool = True

    def take(self) -> tuple[bool, str | None, str | None]:
        """Take out what is new: whether the connection's state is, the picture, and the frame."""
        found = self.state, self.picture, self.frame
        self.state, self.picture, self.frame = False, None, None
        self.changed.clear()
        return found


@dataclass(eq=False)
class Feed:
    """A flight that is connected.

    Attributes:
        flight: Which one.
        frame: Its last frame; None before any.
        seen: When that came, s of this process's clock.
        text: The same frame as it is sent to viewers.
        picture: Its last picture, as JSON; None before any.
        shown: What the last picture is made of, as JSON; None before any.
    """

    flight: Listening
    clock: Callable[[], float] = time.monotonic
    frame: Frame | None = None
    seen: float = 0.0
    text: str = ""
    picture: str | None = None
    shown: str | None = None
    _orders: deque[tuple[float, StopOrder]] = field(default_factory=deque, init=False)
    _ordered: asyncio.Event = field(default_factory=asyncio.Event, init=False)

    @property
    def connected(self) -> bool:
        """True if its frames come, and it is not over."""
        return self.frame is not None and not self.frame.over and self.clock() - self.seen < LINE

    def order(self, level: StopLevel, who: str) -> StopOrder:
        """Send an order to stop, and return it.

        Args:
            level: What is ordered.
            who: Who orders it.
        """
        assert self.frame is not None, "it is connected"
        now = self.clock()
        made = StopOrder(
            order=uuid.uuid4().hex[:12], flight=self.flight.flight, level=level, who=who, after=self.frame.sent, since=now - self.seen
        )  # fmt: skip
        self._orders.append((now, made))
        self._ordered.set()
        return made

    async def next_order(self) -> StopOrder:
        """Return the next order that is to go out, once there is one; those that have expired here are left out."""
        while True:
            while self._orders:
                issued, order = self._orders.popleft()
                if self.clock() - issued <= FRESH:
                    return order
            self._ordered.clear()
            await self._ordered.wait()


class Hub:
    """Live views of all flights."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with no flight.

        Args:
            clock: s, growing.
        """
        self._clock = clock
        self._feeds: dict[str, Feed] = {}
        self._viewers: dict[str, set[Viewer]] = {}

    def feed(self, name: str) -> Feed | None:
        """Return the flight that is, or was last, connected as a name."""
        return self._feeds.get(name)

    def connected(self, name: str, run: int) -> bool:
        """Return whether a flight's frames come."""
        feed = self._feeds.get(name)
        return feed is not None and feed.flight.run == run and feed.connected

    def join(self, flight: Listening) -> Feed:
        """Let a flight be seen; one that was connected before goes on with its picture.

        Args:
            flight: Which one.
        """
        before = self._feeds.get(flight.name)
        feed = Feed(flight, self._clock)
        if before is not None and before.flight.run == flight.run:
            feed.picture, feed.shown = before.picture, before.shown
        self._feeds[flight.name] = feed
        self.tell_state(flight.name)
        return feed

    def leave(self, feed: Feed) -> None:
        """Note that a flight's socket has closed.

        Args:
            feed: The connection.
        """
        feed.seen = -LINE
        self.tell_state(feed.flight.name)

    def show(self, feed: Feed, frame: Frame, text: str) -> None:
        """Hand a frame on.

        Args:
            feed: Whose it is.
            frame: The frame.
            text: The same as JSON, as viewers are sent it.
        """
        before = feed.connected
        feed.frame, feed.seen, feed.text = frame, self._clock(), text
        for viewer in self._viewers.get(feed.flight.name, ()):
            viewer.frame = text
            viewer.state |= before != feed.connected
            viewer.changed.set()

    def draw(self, feed: Feed, picture: str) -> None:
        """Hand a picture on.

        Args:
            feed: Whose it is.
            picture: As JSON.
        """
        feed.picture = picture
        for viewer in self._viewers.get(feed.flight.name, ()):
            viewer.picture = picture
            viewer.changed.set()

    def look(self, name: str) -> Viewer:
        """Begin to look at a flight, and return what there is to see so far.

        Args:
            name: The flight's.
        """
        viewer = Viewer(name)
        feed = self._feeds.get(name)
        if feed is not None:
            viewer.picture, viewer.frame = feed.picture, feed.text or None
        viewer.changed.set()
        self._viewers.setdefault(name, set()).add(viewer)
        return viewer

    def look_away(self, viewer: Viewer) -> None:
        """Stop looking."""
        looking = self._viewers.get(viewer.name, set())
        looking.discard(viewer)
        if not looking:
            self._viewers.pop(viewer.name, None)

    def stop(self, name: str, run: int, level: StopLevel, who: str) -> StopReceipt:
        """Order a flight to stop; nothing here can fail for want of room, and nothing waits.

        Args:
            name: What it listens as.
            run: Its number among all flights: another flight of the same name is not meant.
            level: What is ordered.
            who: Who orders it.

        Raises:
            NotFound: No flight was ever connected as that.
            Conflict: Another flight is, or this one is not any more.
        """
        feed = self._feeds.get(name)
        if feed is None:
            raise NotFound(
                f"No flight is connected as '{name[:60]}', so nobody hears this. Use its terminal, or the kill switch."
            )
        if feed.flight.run != run:
            raise Conflict(
                f"Flight {run} is not connected as '{name}'; flight {feed.flight.run} is. Look at the page again, or use the terminal."
            )
        if not feed.connected:
            raise Conflict(f"The connection to '{name}' is down, so nobody hears this. Use its terminal, or the kill switch.")
        order = feed.order(level, who)
        return StopReceipt(order=order.order, name=name, run=run, level=level, who=who, expires=FRESH)

    def tell_state(self, name: str) -> None:
        """Have viewers of a flight told of its state."""
        for viewer in self._viewers.get(name, ()):
            viewer.state = True
            viewer.changed.set()
