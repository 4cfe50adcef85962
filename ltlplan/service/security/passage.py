"""One request on its way through the gate: admitted, counted, asked again at each of its messages, ended in words, noted."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress

from ltlplan.service.log import note, note_bug
from ltlplan.service.people.roles import Principal
from ltlplan.service.problems import NotAuthenticated, WrongHost
from ltlplan.service.security.admission import Admission, client_of
from ltlplan.service.security.asker import ASSETS, LOGIN, Asker, is_open, is_urgent
from ltlplan.service.security.body_limits import Body, Message, Receive
from ltlplan.service.security.open_requests import gone
from ltlplan.service.security.origins import SAFE
from ltlplan.service.security.plain_pages import PLAIN_POLICY
from ltlplan.service.security.refusals import HTML, reads_pages, refusal
from verify.data.errors import LtlplanError

Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

_EVERYWHERE = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
"""Headers of every answer. With `no-referrer` a browser says `Origin: null` of our own forms, which nothing tells from another site's."""
_PAGE_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'none'"
)
"""What a page may load: what comes from here. Its templates are compiled in the browser, which `eval` is needed for."""
_DATA_POLICY = "default-src 'none'; frame-ancestors 'none'; sandbox"
"""What everything else may load: nothing, as whom or what it is opened."""
_CLOSED: Message = {"type": "websocket.disconnect", "code": 1008, "reason": ""}


class Passage:
    """One request on its way through the gate."""

    def __init__(self, admission: Admission, inner: Application, scope: Message, receive: Receive, send: Send) -> None:
        self._inner = inner
        self._admission, self._scope, self._receive, self._send = admission, scope, receive, send
        self._method = "WEBSOCKET" if scope["type"] == "websocket" else str(scope["method"])
        self._headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        self._path = str(scope["path"])
        self._asker = Asker.of(self._path, str((scope.get("client") or ("unknown",))[0]), self._headers)
        self.client = self._asker.address
        self._principal: Principal | None = None
        self._began = time.perf_counter()
        self._status = 0
        self._chunked = False
        self._over = False
        self._body: Body | None = None
        self._ended: LtlplanError | None = None
        self._end_of_socket = asyncio.Event()
        self._clock = asyncio.timeout(None)
        self._telling: asyncio.Task[None] | None = None

    @property
    def waits(self) -> bool:
        """True if it waits for more of what is being sent to it."""
        return self._body is not None and self._body.waits

    def may_go_on(self) -> bool:
        """Return whether who asks is still who asked, or it does not matter."""
        try:
            return is_open(self._path) or self._admission.who(self._asker) == self._principal
        except LtlplanError:  # the people cannot be read, so nobody is known
            return False

    def end(self, error: LtlplanError) -> None:
        """End it now. What is being done for it and changes something is finished; nobody is told of it.

        Args:
            error: Why.
        """
        if self._ended is not None:
            return
        if self._method == "WEBSOCKET":
            self._ended = error
            self._end_of_socket.set()
            self._telling = asyncio.ensure_future(self._refuse(error))
        elif self.waits or self._status or self._method in SAFE:
            self._ended = error
            with suppress(RuntimeError):  # it is over already
                self._clock.reschedule(0.0)

    async def pass_through(self) -> None:
        """Let the request through, or answer why not."""
        try:
            self._principal = self._admission.admit(self._method, self._asker, self._headers)
            self.client = client_of(self._principal, self._asker)
            self._admission.open.enter(self, urgent=is_urgent(self._path))
            async with self._clock:
                await self._answered()
        except LtlplanError as error:
            await self._refuse(error)
        except (TimeoutError, OSError):  # it was ended here, or who asked reads no more
            if self._ended is not None:
                await self._finish(self._ended)
            self._status = self._status or 499
        except Exception as error:  # the outermost door: a bug ends its own request only
            note_bug(error, method=self._method, path=self._path)
            await self._refuse(error)
        finally:
            self._admission.open.leave(self)
            if self._body is not None:
                self._body.release()
            if self._telling is not None:
                await self._telling
            if self._method != "WEBSOCKET":
                self._note()

    async def _answered(self) -> None:
        self._scope.setdefault("state", {}).update(
            client=self.client, principal=self._principal, admission=self._admission, asker=self._asker
        )
        if self._method == "WEBSOCKET":
            await self._inner(self._scope, self._heard, self._told)
            return
        self._body = self._admission.guarded(self._receive, self._path, self._headers.get("content-length"))
        await self._inner(self._scope, self._body.receive, self._told)

    async def _heard(self) -> Message:
        """Return the next message of a websocket; that it is closed, where who asks may not go on."""
        coming, end = asyncio.ensure_future(self._receive()), asyncio.ensure_future(self._end_of_socket.wait())
        try:
            await asyncio.wait({coming, end}, return_when=asyncio.FIRST_COMPLETED)
            if self._ended is None and not self.may_go_on():
                self.end(gone())
            return coming.result() if self._ended is None else _CLOSED
        finally:
            for task in (coming, end):
                task.cancel()
                with suppress(asyncio.CancelledError, Exception):
                    await task

    async def _told(self, message: Message) -> None:
        """Send, with the headers that everything has, to who still may ask."""
        if self._ended is None and not self.may_go_on():
            self._ended = gone()
            if self._method == "WEBSOCKET":
                self._end_of_socket.set()
                await self._refuse(self._ended)
        if self._ended is not None:
            raise OSError("the client may no longer send requests")
        await self._put(message)

    async def _put(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            message = self._with_headers(message)
        elif message["type"] == "http.response.body":
            self._over = not message.get("more_body", False)
        if self._method == "WEBSOCKET":
            await self._send(message)
            return
        async with asyncio.timeout(self._admission.rules.limits.send_seconds):
            await self._send(message)

    def _with_headers(self, message: Message) -> Message:
        self._status = message["status"]
        given = {name.lower(): value for name, value in message["headers"]}
        self._chunked = b"content-length" not in given
        page = given.get(b"content-type", b"").startswith(b"text/html") and not self._path.startswith("/api/")
        added = {
            **_EVERYWHERE,
            "content-security-policy": _PAGE_POLICY if page else _DATA_POLICY,
            "cache-control": "no-store" if page or self._path.startswith("/api/") else "no-cache",
        }
        if self._body is not None and self._body.refused:
            added["connection"] = "close"
        if self._scope.get("scheme") == "https":
            added["strict-transport-security"] = "max-age=31536000"
        own = [(name.encode(), value.encode()) for name, value in added.items() if name.encode() not in given]
        return {**message, "headers": [*message["headers"], *own]}

    async def _finish(self, error: LtlplanError) -> None:
        """End what was begun: say why where nothing was said yet, close a stream; of the rest the connection is closed."""
        with suppress(OSError, TimeoutError):
            if not self._status:
                await self._refuse(error)
            elif self._chunked and not self._over:
                await self._put({"type": "http.response.body", "body": b""})

    async def _refuse(self, error: Exception) -> None:
        """Answer why a request is not let through, if nothing was answered yet."""
        if self._method == "WEBSOCKET":
            with suppress(Exception):  # it may be closed already
                await self._send({"type": "websocket.close", "code": 1008, "reason": str(error)[:100]})
            return
        if self._status:
            return
        if isinstance(error, NotAuthenticated) and self._method == "GET" and reads_pages(self._headers):
            await self._answer(303, b"", {"location": LOGIN, "content-type": HTML})
            return
        told = refusal(error, self._headers)
        headers = (
            {**told.headers, "content-security-policy": PLAIN_POLICY} if told.headers["content-type"] == HTML else told.headers
        )
        if not isinstance(error, NotAuthenticated | WrongHost):
            headers = {**headers, "connection": "close"}  # what is left of the body is not read
        await self._answer(told.status, told.content, headers)

    async def _answer(self, status: int, content: bytes, headers: dict[str, str]) -> None:
        headers = {**headers, "content-length": str(len(content))}
        listed = [(name.encode(), value.encode("latin-1", "replace")) for name, value in headers.items()]
        await self._put({"type": "http.response.start", "status": status, "headers": listed})
        await self._put({"type": "http.response.body", "body": content})

    def _note(self) -> None:
        seconds = time.perf_counter() - self._began
        took = round(1000 * seconds, 1)
        if self._admission.rules.metrics is not None:
            route = self._scope.get("state", {}).get("route") or ("asset" if self._path.startswith(ASSETS) else "other")
            self._admission.rules.metrics.answered(self._method, route, self._status, seconds)
        if not self._path.startswith(ASSETS):
            note(
                "request",
                method=self._method[:20],
                path=self._path[:200],
                status=self._status,
                milliseconds=took,
                client=self.client,
            )
