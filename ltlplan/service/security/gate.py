"""The gate: whatever comes over HTTP or a websocket passes here first, the page's own traffic too.

our name?  -  from our page?  -  who?  -  how often?  -  how much, how slowly?  -  (the request)  -  headers  -  note
"""

from __future__ import annotations

import asyncio
import http.cookies
import json
import math
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from ltlplan.service.log import note, note_bug
from ltlplan.service.problems import MEDIA_TYPE, NotAuthenticated, WrongHost, problem_of
from ltlplan.service.security.bodies import Bodies, Body, Message, Receive
from ltlplan.service.security.origins import SAFE, require_own_host, require_own_page
from ltlplan.service.security.rates import Rates
from ltlplan.service.security.tokens import Tokens
from ltlplan.service.settings import Limits
from verify.data.errors import LtlplanError

Scope = Message
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "ltlplan_session"
LOGIN = "/login"
OPEN = ("/health", LOGIN, "/logout", "/docs", "/openapi.json", "/problems", "/favicon.ico")
"""What is answered without a token: nothing in it is anybody's."""
ASSETS = ("/_nicegui/", "/docs/")
"""Files that a page fetches by the dozen, which no rate counts."""
UPLOADS = ("/api/flights/", "/_nicegui/")
"""Paths whose bodies may carry files."""

_EVERYWHERE = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
}
_PAGE_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'none'"
)
"""What a page may load: what comes from here. Its templates are compiled in the browser, which `eval` is needed for."""
_DATA_POLICY = "default-src 'none'; frame-ancestors 'none'; sandbox"
"""What everything else may load: nothing, as whom or what it is opened."""


@dataclass(frozen=True)
class Rules:
    """What the gate goes by.

    Attributes:
        tokens: Who may ask.
        names: Our names.
        everywhere: Whether the service listens to more than its own machine.
        closed: Whether it answers to tokens only, even when the last one was revoked.
        limits: How much and how often.
    """

    tokens: Tokens
    names: frozenset[str]
    everywhere: bool
    closed: bool
    limits: Limits


@dataclass
class Gate:
    """An ASGI application before another.

    Attributes:
        inner: What is asked, once a request is through.
        rules: What it goes by.
    """

    inner: Application
    rules: Rules
    _bodies: Bodies = field(init=False, repr=False)

    def __post_init__(self) -> None:
        limits = self.rules.limits
        self._bodies = Bodies(limits.held_bytes, limits.body_seconds)
        self._reads, self._asked = Rates(limits.reads), Rates(limits.questions_asked)
        self._strangers = Rates(limits.strangers)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer why not."""
        if scope["type"] not in ("http", "websocket"):
            await self.inner(scope, receive, send)
            return
        await _Passage(self, scope, receive, send).pass_through()

    def admit(self, method: str, path: str, address: str, headers: dict[str, str]) -> str:
        """Return who asks: a token's name, or the address where none is needed.

        Args:
            method: The request's; "WEBSOCKET" for a websocket.
            path: What is asked for.
            address: Where it comes from.
            headers: By lower-case name.

        Raises:
            LtlplanError: It may not pass; the class says why.
        """
        require_own_host(headers.get("host", ""), self.rules.names, everywhere=self.rules.everywhere)
        require_own_page(method, headers)
        who = self._who(path, address, headers)
        if not path.startswith(ASSETS):
            (self._reads if method in SAFE else self._asked).take(who)
        return who

    def _who(self, path: str, address: str, headers: dict[str, str]) -> str:
        tokens = self.rules.tokens
        if not tokens.needed:
            if self.rules.closed and not is_open(path):  # the last token was revoked meanwhile
                raise NotAuthenticated("This service has no tokens left; `ltlplan serve --new-token NAME` makes one.")
            return address
        scheme, _, given = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and given:
            self._strangers.require_any(address)
            if (owner := tokens.owner(given.strip())) is not None:
                return owner
            self._strangers.take(address)
            raise NotAuthenticated("This is no token of this service, or it was revoked.")
        if (owner := tokens.owner_of_session(cookie(headers))) is not None:
            return owner
        if is_open(path):
            return address
        raise NotAuthenticated(
            "This service answers to tokens only: send the header `Authorization: Bearer TOKEN` (in a browser, open /login). "
            "`ltlplan serve --new-token NAME` makes one."
        )

    def is_known(self, headers: dict[str, str]) -> bool:
        """Tell whether who asks has said who that is, where nobody needs to."""
        scheme, _, given = headers.get("authorization", "").partition(" ")
        tokens = self.rules.tokens
        bearer = scheme.lower() == "bearer" and tokens.owner(given.strip()) is not None
        return bearer or tokens.owner_of_session(cookie(headers)) is not None

    def require_patience(self, address: str) -> None:
        """Refuse an address that came with too many wrong tokens.

        Raises:
            TooManyRequests: It did.
        """
        self._strangers.require_any(address)

    def note_stranger(self, address: str) -> None:
        """Count a wrong token."""
        self._strangers.take(address)

    def most(self, path: str) -> int:
        """Return how many bytes a body may have."""
        limits = self.rules.limits
        return limits.upload_bytes if path.startswith(UPLOADS) else limits.body_bytes

    def guarded(self, receive: Receive, path: str, announced: str | None) -> Body:
        """Return a request's body, counted and with a clock.

        Args:
            receive: What it comes by.
            path: What is asked for.
            announced: The header `Content-Length`, if there is one.
        """
        return Body(receive, self._bodies, self.most(path), announced)


def is_open(path: str) -> bool:
    """Tell whether a path is answered without a token."""
    return any(path == each or path.startswith(f"{each}/") for each in OPEN)


def cookie(headers: dict[str, str]) -> str:
    """Return the session in a request's cookies, or an empty text."""
    try:
        found = http.cookies.SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except http.cookies.CookieError:
        return ""
    return "" if found is None else found.value


class _Passage:
    """One request on its way through the gate."""

    def __init__(self, gate: Gate, scope: Scope, receive: Receive, send: Send) -> None:
        self._gate, self._scope, self._receive, self._send = gate, scope, receive, send
        self._method = "WEBSOCKET" if scope["type"] == "websocket" else str(scope["method"])
        self._path = str(scope["path"])
        self._headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        self._began = time.perf_counter()
        self._status = 0
        self._client = ""
        self._body: Body | None = None

    async def pass_through(self) -> None:
        self._client = str((self._scope.get("client") or ("unknown",))[0])
        try:
            self._client = self._gate.admit(self._method, self._path, self._client, self._headers)
            if self._method == "WEBSOCKET":
                await self._gate.inner(self._scope, self._receive, self._send)
                return
            self._body = self._gate.guarded(self._receive, self._path, self._headers.get("content-length"))
            known = not self._gate.rules.tokens.needed or self._gate.is_known(self._headers)
            self._scope.setdefault("state", {}).update(client=self._client, known=known, gate=self._gate)
            await self._gate.inner(self._scope, self._body.receive, self._told)
        except LtlplanError as error:
            await self._refuse(error)
        except (TimeoutError, OSError):  # who asked reads no more
            self._status = self._status or 499
        except Exception as error:  # the outermost door: a bug ends its own request only
            note_bug(error, method=self._method, path=self._path)
            await self._refuse(error)
        finally:
            if self._body is not None:
                self._body.release()
            if self._method != "WEBSOCKET":
                self._note()

    async def _told(self, message: Message) -> None:
        """Send, with the headers that everything has."""
        if message["type"] == "http.response.start":
            self._status = message["status"]
            given = {name.lower() for name, _ in message["headers"]}
            kind = next((value for name, value in message["headers"] if name.lower() == b"content-type"), b"")
            page = kind.startswith(b"text/html") and not self._path.startswith("/api/")
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
            message = {**message, "headers": [*message["headers"], *own]}
        async with asyncio.timeout(self._gate.rules.limits.send_seconds):
            await self._send(message)

    async def _refuse(self, error: Exception) -> None:
        """Answer why a request is not let through, if nothing was answered yet."""
        if self._method == "WEBSOCKET":
            await self._send({"type": "websocket.close", "code": 1008, "reason": str(error)[:100]})
            return
        if self._status:
            return
        if isinstance(error, NotAuthenticated) and self._method == "GET" and "text/html" in self._headers.get("accept", ""):
            await self._answer(303, b"", {"location": LOGIN, "content-type": "text/html"})
            return
        status, headers, content = refusal(error)
        if not isinstance(error, NotAuthenticated | WrongHost):
            headers["connection"] = "close"  # what is left of the body is not read
        await self._answer(status, content, headers)

    async def _answer(self, status: int, content: bytes, headers: dict[str, str]) -> None:
        headers["content-length"] = str(len(content))
        listed = [(name.encode(), value.encode("latin-1", "replace")) for name, value in headers.items()]
        await self._told({"type": "http.response.start", "status": status, "headers": listed})
        await self._told({"type": "http.response.body", "body": content})

    def _note(self) -> None:
        took = round(1000 * (time.perf_counter() - self._began), 1)
        if not self._path.startswith(ASSETS):
            note(
                "request",
                method=self._method[:20],
                path=self._path[:200],
                status=self._status,
                milliseconds=took,
                client=self._client,
            )


def refusal(error: BaseException, status: int | None = None) -> tuple[int, dict[str, str], bytes]:
    """Return status, headers and body that tell an error.

    Args:
        error: What was raised.
        status: HTTP status, instead of the error's own.
    """
    problem = problem_of(error)
    if status is not None:
        problem = problem.model_copy(update={"status": status})
    headers: dict[str, Any] = {"content-type": MEDIA_TYPE}
    seconds = getattr(error, "seconds", None)
    if seconds is not None:
        headers["retry-after"] = str(max(1, math.ceil(seconds)))
    if problem.status == 401:
        headers["www-authenticate"] = "Bearer"
    content = json.dumps(problem.model_dump(mode="json"), allow_nan=False).encode("utf-8", "backslashreplace")
    return problem.status, headers, content
