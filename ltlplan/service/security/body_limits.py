"""Limits on the size and slowness of a request's body: counted as it comes, before anything is made of it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
from typing import Any

from ltlplan.service.problems import BodyTooLarge, BodyTooSlow, Busy
from verify.data.errors import LtlplanError

Message = MutableMapping[str, Any]  # of any type: ASGI's messages
Receive = Callable[[], Awaitable[Message]]


@dataclass
class Bodies:
    """Bytes that all requests together hold.

    Attributes:
        most_held: Bytes that may be held at the same time.
        seconds: s within which a whole body must have come.
        held: Bytes that are held now.
    """

    most_held: int
    seconds: float
    held: int = 0


class Body:
    """One request's body: a `receive` that counts and has a clock.

    Attributes:
        refused: Whether what is left of it is not read, so that its connection is of no more use.
        waits: Whether more of it is waited for.
    """

    def __init__(self, receive: Receive, bodies: Bodies, most: int, announced: str | None) -> None:
        self.refused = self.waits = False
        self._receive, self._bodies, self._most = receive, bodies, most
        self._taken, self._over = 0, False
        self._ends = asyncio.get_running_loop().time() + bodies.seconds
        if announced is not None and announced.isascii() and announced.isdigit() and int(announced[:20]) > most:
            raise self._too_large()

    async def receive(self) -> Message:
        """Return the next message.

        Raises:
            BodyTooLarge: More came than is read.
            BodyTooSlow: It did not come in time.
            Busy: All requests together hold too much.
        """
        try:
            return await self._next()
        except LtlplanError:
            self.refused = True
            raise

    async def _next(self) -> Message:
        if self._over:
            return await self._receive()
        self.waits = True
        try:
            async with asyncio.timeout_at(self._ends):
                message = await self._receive()
        except TimeoutError:
            raise BodyTooSlow(f"The body did not come within {self._bodies.seconds:g} s; nothing was done.") from None
        finally:
            self.waits = False
        if message["type"] == "http.request":
            size = len(message.get("body", b""))
            self._taken += size
            self._bodies.held += size
            self._over = not message.get("more_body", False)
            if self._taken > self._most:
                raise self._too_large()
            if self._bodies.held > self._bodies.most_held:
                raise Busy("Too much is being sent to this service at the same time; try again soon.")
        return message

    def release(self) -> None:
        """Let go of what is held."""
        self._bodies.held -= self._taken
        self._taken = 0

    def _too_large(self) -> BodyTooLarge:
        size = f"{self._most / 1e6:g} MB" if self._most >= 1_000_000 else f"{self._most / 1e3:g} kB"
        return BodyTooLarge(f"The body is larger than {size}, which is the most that is read here.")
