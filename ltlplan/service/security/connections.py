"""Connections that never say what they want are closed: a request's head must come within some seconds, and one address cannot hold them all.

A connection waits from its beginning, or the end of an answer, to the end of a request's head. One that waits costs its owner nothing, so of an address, and of
all, only some may: a further one takes the place of the one that has waited longest. Whoever says what it wants at once is never in the way.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import Any

from uvicorn.protocols.http.flow_control import service_unavailable
from uvicorn.protocols.http.h11_impl import H11Protocol

from ltlplan.service.security.asker import is_urgent


@dataclass
class Waiting:
    """Connections that wait for a request's head, by address, in the order in which they began to.

    Attributes:
        most: How many may wait.
        most_of_one: How many of one address may.
    """

    most: int
    most_of_one: int
    _of: dict[str, dict[H11Protocol, None]] = field(default_factory=dict[str, dict[H11Protocol, None]], init=False, repr=False)
    _count: int = field(default=0, init=False, repr=False)

    def add(self, address: str, connection: H11Protocol) -> None:
        """Have a connection wait; where too many do, the one is closed that has waited longest, of the address that has most."""
        waiting = self._of.setdefault(address, {})
        if connection not in waiting:
            waiting[connection] = None
            self._count += 1
        if len(waiting) > self.most_of_one:
            self._close_first(address)
        elif self._count > self.most:
            self._close_first(max(self._of, key=lambda each: len(self._of[each])))

    def drop(self, address: str, connection: H11Protocol) -> None:
        """Have a connection wait no more; once is enough."""
        waiting = self._of.get(address)
        if waiting is not None and connection in waiting:
            del waiting[connection]
            self._count -= 1
            if not waiting:
                del self._of[address]

    def _close_first(self, address: str) -> None:
        first = next(iter(self._of[address]))
        self.drop(address, first)
        first.transport.abort()


def _urgent_only(app: Any) -> Any:  # as uvicorn declares applications
    """Return an application that answers orders to stop, and nothing else."""

    async def answer(scope: Any, receive: Any, send: Any) -> None:
        await (app if is_urgent(scope["path"]) else service_unavailable)(scope, receive, send)

    return answer


def with_head_clock(seconds: float, waiting: Waiting, most: int) -> type[H11Protocol]:
    """Return uvicorn's HTTP protocol with a clock on each request's head. h11 bounds a head's size; the faster parser does not.

    Args:
        seconds: s within which a head must have come, from the connection's beginning or the head's first byte.
        waiting: Where connections are counted while they wait for one.
        most: Connections at the same time; a further one is answered orders to stop, and nothing else.
    """

    class Protocol(H11Protocol):
        _clock: asyncio.TimerHandle | None = None

        @property
        def _address(self) -> str:
            return self.client[0] if self.client else ""

        @property
        def _idle(self) -> bool:
            """Return whether no request is being answered, so that a head is waited for."""
            cycle: Any = self.cycle  # None before the first request, whatever uvicorn declares
            return cycle is None or bool(cycle.response_complete)

        def connection_made(self, transport: Any) -> None:  # as asyncio declares it
            super().connection_made(transport)
            if len(self.connections) > most:
                self.app = _urgent_only(self.app)
            waiting.add(self._address, self)
            self._start()

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.transport.get_protocol() is not self:  # a websocket's from now on, which has clocks of its own
                return
            if not self._idle:
                self._stop()
                waiting.drop(self._address, self)
            elif self._clock is None:
                self._start()

        def on_response_complete(self) -> None:
            self._stop()
            super().on_response_complete()
            if not self.transport.is_closing() and self._idle:
                waiting.add(self._address, self)

        def handle_websocket_upgrade(self, event: Any) -> None:  # as uvicorn declares it
            self._stop()
            waiting.drop(self._address, self)
            super().handle_websocket_upgrade(event)

        def connection_lost(self, exc: Exception | None) -> None:
            self._stop()
            waiting.drop(self._address, self)
            super().connection_lost(exc)

        def _start(self) -> None:
            self._clock = self.loop.call_later(seconds, self._end)

        def _stop(self) -> None:
            if self._clock is not None:
                self._clock.cancel()
                self._clock = None

        def _end(self) -> None:
            self._clock = None
            if not self.transport.is_closing() and self._idle:
                self.transport.close()

    return Protocol
