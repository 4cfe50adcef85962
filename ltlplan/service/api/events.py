"""A job's events as a stream that a browser reads by itself (server-sent events)."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Generator
from contextlib import contextmanager, suppress

from ltlplan.service.models import Event
from ltlplan.service.problems import Busy
from ltlplan.service.settings import Limits

MEDIA_TYPE = "text/event-stream"
SCHEMA = {
    "type": "object",
    "properties": {
        "id": {"type": "string"},
        "event": {"type": "string"},
        "data": {
            "type": "string",
            "contentMediaType": "application/json",
            "contentSchema": {"$ref": "#/components/schemas/Event"},
        },
    },
}
"""Of one event, as it is sent."""
HEARTBEAT = 15.0
"""s after which a line without meaning shows that somebody is still there."""
_RETRY = 2000
"""ms after which a browser asks again when the stream broke."""


def event_bytes(event: Event) -> bytes:
    """Return one event as it is sent."""
    return f"id: {event.id}\nevent: {event.kind}\ndata: {event.model_dump_json()}\n\n".encode("utf-8", "backslashreplace")


async def stream(first: Event, events: AsyncIterator[Event], stopping: asyncio.Event) -> AsyncIterator[bytes]:
    """Yield events as they come, and a heartbeat where none does, until the last event or the service's end.

    Args:
        first: The first event, which was waited for already.
        events: Those that follow.
        stopping: Set when the service is about to stop.
    """
    yield f"retry: {_RETRY}\n\n".encode() + event_bytes(first)
    end = asyncio.ensure_future(stopping.wait())
    following: asyncio.Future[Event] | None = None
    try:
        while True:
            following = following or asyncio.ensure_future(anext(events))
            await asyncio.wait({following, end}, timeout=HEARTBEAT, return_when=asyncio.FIRST_COMPLETED)
            if following.done():
                try:
                    yield event_bytes(following.result())
                except StopAsyncIteration:
                    return
                following = None
            elif end.done():
                return
            else:
                yield b": \n\n"
    finally:
        for task in (end, following):
            if task is not None:
                task.cancel()
                with suppress(asyncio.CancelledError, StopAsyncIteration):
                    await task


class Streams:
    """Streams that are open, and questions that wait: of all together not too many, and not all of one client.

    Args:
        limits: How many.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._of: Counter[str] = Counter()

    def require_room(self, client: str) -> None:
        """Reject a further stream where there is no room for it.

        Raises:
            Busy: Too many are open.
        """
        most, most_of_one = self._limits.streams, self._limits.streams_of_one
        if self._of.total() >= most:
            raise Busy(f"{most} streams are open, which is the most; close one, or ask without waiting.")
        if self._of[client] >= most_of_one:
            raise Busy(f"{most_of_one} streams of yours are open, which is the most; close one, or ask without waiting.")

    @contextmanager
    def counted(self, client: str) -> Generator[None]:
        """Count a stream while it is open; that there is room was asked before its answer began."""
        self._of[client] += 1
        try:
            yield
        finally:
            self._of[client] -= 1
            if not self._of[client]:
                del self._of[client]
