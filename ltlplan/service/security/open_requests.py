"""All requests that are open: of one client not too many, and none for longer than it may ask.

Whether who asks still may is asked again at each message by the request itself (`passage`), and here for all, twice a second: a stream or a socket in which
nothing happens ends within a second too.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Protocol

from ltlplan.service.problems import BodyTooSlow, Busy, NotAuthenticated
from verify.data.errors import LtlplanError

LOOK = 0.5
"""s between looks at all open requests."""


class Open(Protocol):
    """A request that is open."""

    @property
    def client(self) -> str:
        """Its client."""
        ...

    @property
    def waits(self) -> bool:
        """True if it waits for more of what is being sent to it."""
        ...

    def may_go_on(self) -> bool:
        """Return whether who asks still may."""
        ...

    def end(self, error: LtlplanError) -> None:
        """End it, with a reason."""
        ...


class OpenRequests:
    """Requests that are open, in the order in which they came.

    Args:
        most_of_one: Requests that one client may have open.
    """

    def __init__(self, most_of_one: int) -> None:
        self._most = most_of_one
        self._open: dict[Open, None] = {}
        self._of: Counter[str] = Counter()
        self._watching: asyncio.Task[None] | None = None

    def enter(self, request: Open, *, urgent: bool = False) -> None:
        """Count a request in; of a client that has too many, the one goes that has waited longest for what is sent to it.

        Args:
            request: The request.
            urgent: Whether it is let in however many there are.

        Raises:
            Busy: The client has too many, and none of them waits.
        """
        if self._of[request.client] >= self._most and not urgent:
            waiting = next((each for each in self._open if each.client == request.client and each.waits), None)
            if waiting is None:
                raise Busy(f"{self._most} requests of yours are open, which is the most; end some of them.")
            self.leave(waiting)
            waiting.end(BodyTooSlow("The body did not come before others needed its place; nothing was done."))
        self._open[request] = None
        self._of[request.client] += 1
        if self._watching is None or self._watching.done():
            self._watching = asyncio.get_running_loop().create_task(self._watch())

    def leave(self, request: Open) -> None:
        """Count a request out; once is enough."""
        if request in self._open:
            del self._open[request]
            self._of[request.client] -= 1
            if not self._of[request.client]:
                del self._of[request.client]

    async def _watch(self) -> None:
        while self._open:
            await asyncio.sleep(LOOK)
            for request in list(self._open):
                if not request.may_go_on():
                    request.end(gone())


def gone() -> NotAuthenticated:
    """Return why a request ends whose session or token has ended."""
    return NotAuthenticated("Your session has ended, or your token was revoked; log in again.")
