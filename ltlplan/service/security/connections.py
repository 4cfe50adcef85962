"""Connections that never say what they want are closed: a request's head must come within some seconds."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol


def with_head_clock(seconds: float) -> type[H11Protocol]:
    """Return uvicorn's HTTP protocol with a clock on each request's head. h11 bounds a head's size; the faster parser does not.

    Args:
        seconds: s within which a head must have come, from the connection's beginning or the head's first byte.
    """

    class Protocol(H11Protocol):
        _clock: asyncio.TimerHandle | None = None

        @property
        def _idle(self) -> bool:
            """Whether no request is being answered, so that a head is waited for."""
            cycle: Any = self.cycle  # None before the first request, whatever uvicorn declares
            return cycle is None or bool(cycle.response_complete)

        def connection_made(self, transport: Any) -> None:  # as asyncio declares it
            super().connection_made(transport)
            self._start()

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if not self._idle:
                self._stop()
            elif self._clock is None:
                self._start()

        def on_response_complete(self) -> None:
            self._stop()
            super().on_response_complete()

        def handle_websocket_upgrade(self, event: Any) -> None:  # as uvicorn declares it
            self._stop()
            super().handle_websocket_upgrade(event)

        def connection_lost(self, exc: Exception | None) -> None:
            self._stop()
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
