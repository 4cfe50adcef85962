"""Admission of requests: by name and page, by token or session, as often as is allowed."""

from __future__ import annotations

from dataclasses import dataclass, field

from ltlplan.service.problems import NotAuthenticated
from ltlplan.service.security.asker import ASSETS, LOGIN, Asker, is_open
from ltlplan.service.security.body_limits import Bodies, Body, Receive
from ltlplan.service.security.open_requests import OpenRequests
from ltlplan.service.security.origins import SAFE, require_own_host, require_own_page
from ltlplan.service.security.rates import Rates
from ltlplan.service.security.sessions import Sessions
from ltlplan.service.settings import Limits

UPLOADS = ("/api/flights/", "/_nicegui/")
"""Paths whose bodies may carry files."""


@dataclass(frozen=True)
class Rules:
    """Rules of admission.

    Attributes:
        sessions: Who may ask: by a token, or by a browser's session.
        names: Our names.
        everywhere: Whether the service listens to more than its own machine.
        closed: Whether it answers to tokens only, even when the last one was revoked.
        limits: How much and how often.
    """

    sessions: Sessions
    names: frozenset[str]
    everywhere: bool
    closed: bool
    limits: Limits


@dataclass
class Admission:
    """State of admission: tokens, sessions, how often and how much each client requests.

    Attributes:
        rules: What it goes by.
        open: Requests that are being answered.
    """

    rules: Rules
    open: OpenRequests = field(init=False, repr=False)
    _bodies: Bodies = field(init=False, repr=False)
    _closed: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        limits = self.rules.limits
        self.open = OpenRequests(limits.open_of_one)
        self._bodies = Bodies(limits.held_bytes, limits.body_seconds)
        self._reads, self._asked = Rates(limits.reads), Rates(limits.questions_asked)
        self._strangers = Rates(limits.strangers)

    @property
    def needs_tokens(self) -> bool:
        """True if only tokens are answered; a service that once answered to them does so until it ends, also when the last one is revoked."""
        self._closed = self._closed or self.rules.closed or self.rules.sessions.tokens.needed
        return self._closed

    def admit(self, method: str, asker: Asker, headers: dict[str, str]) -> str:
        """Return who asks: a token's name, or the address where none is needed.

        Args:
            method: The request's; "WEBSOCKET" for a websocket.
            asker: Who asks, as the request says it.
            headers: By lower-case name.

        Raises:
            LtlplanError: It may not pass; the class says why.
        """
        require_own_host(headers.get("host", ""), self.rules.names, everywhere=self.rules.everywhere)
        require_own_page(method, headers)
        by_token = self.needs_tokens and asker.bearer is not None
        who = self.owner_of(asker.bearer or "", asker.address) if by_token else self.who(asker)
        if who is None:
            raise NotAuthenticated(_HOW if self.rules.sessions.tokens.needed else _NONE_LEFT)
        if asker.path != LOGIN and not asker.path.startswith(
            ASSETS
        ):  # wrong tokens are counted, and nobody's others keep one out
            (self._reads if method in SAFE else self._asked).take(who)
        return who

    def who(self, asker: Asker) -> str | None:
        """Return who asks now, counting nothing; None where who asks may not."""
        if not self.needs_tokens:
            return asker.address
        owner = self.owner(asker)
        return asker.address if owner is None and is_open(asker.path) else owner

    def owner(self, asker: Asker) -> str | None:
        """Return the name of the token by which somebody asks, or None."""
        sessions = self.rules.sessions
        return sessions.owner(asker.session) if asker.bearer is None else sessions.tokens.owner(asker.bearer)

    def owner_of(self, token: str, address: str) -> str:
        """Return a token's name. A right one passes, however many wrong ones came from the same address.

        Args:
            token: As it was given.
            address: Where it comes from.

        Raises:
            NotAuthenticated: It is none of ours.
            TooManyRequests: It is none of ours, and not the first from this address.
        """
        owner = self.rules.sessions.tokens.owner(token)
        if owner is None:
            self._strangers.require_any(address)
            self._strangers.take(address)
            raise NotAuthenticated("This is no token of this service, or it was revoked.")
        return owner

    def guarded(self, receive: Receive, path: str, announced: str | None) -> Body:
        """Return a request's body, counted and with a clock.

        Args:
            receive: What it comes by.
            path: What is asked for.
            announced: The header `Content-Length`, if there is one.
        """
        limits = self.rules.limits
        most = limits.upload_bytes if path.startswith(UPLOADS) else limits.body_bytes
        return Body(receive, self._bodies, most, announced)


_HOW = (
    "This service answers to tokens only: send the header `Authorization: Bearer TOKEN` (in a browser, open /login). "
    "`ltlplan serve --new-token NAME` makes one."
)
_NONE_LEFT = "This service has no tokens left; `ltlplan serve --new-token NAME` makes one."
