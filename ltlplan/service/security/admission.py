"""Admission of requests: by name and page, by token or session, as often as is allowed."""

from __future__ import annotations

from dataclasses import dataclass, field

from ltlplan.service.metrics import Metrics
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal
from ltlplan.service.problems import NotAuthenticated
from ltlplan.service.security.asker import ASSETS, LOGIN, Asker, is_open, is_urgent
from ltlplan.service.security.body_limits import Bodies, Body, Receive
from ltlplan.service.security.open_requests import OpenRequests
from ltlplan.service.security.origins import SAFE, require_own_host, require_own_page
from ltlplan.service.security.rates import Rates
from ltlplan.service.settings import Limits

UPLOADS = ("/api/flights/", "/_nicegui/")
"""Paths whose bodies may carry files."""


@dataclass(frozen=True)
class Rules:
    """Rules of admission.

    Attributes:
        people: Who may ask: by a token, or by a browser's session.
        names: Our names.
        everywhere: Whether the service listens to more than its own machine.
        closed: Whether it answers to tokens only, even when the last one was revoked.
        limits: How much and how often.
        metrics: What counts requests, if anything.
    """

    people: People
    names: frozenset[str]
    everywhere: bool
    closed: bool
    limits: Limits
    metrics: Metrics | None = None


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
        self._strangers, self._logins = Rates(limits.strangers), Rates(limits.strangers)
        self._guesses_of_address, self._guesses_of_account = Rates(limits.guesses), Rates(limits.guesses_of_account)

    @property
    def needs_tokens(self) -> bool:
        """True if everybody has to say who they are; a service that once asked for it does so until it ends, also when the last token is revoked."""
        self._closed = self._closed or self.rules.closed or self.rules.people.needed
        return self._closed

    def admit(self, method: str, asker: Asker, headers: dict[str, str]) -> Principal | None:
        """Return who asks: by a token or a session, or from this machine where none is needed; None for strangers, where they are answered.

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
        who = self.holder_of(asker.bearer or "", asker.address) if by_token else self.who(asker)
        if who is None and not is_open(asker.path):
            raise NotAuthenticated(_HOW if self.rules.people.needed else _NONE_LEFT)
        if not (asker.path == LOGIN or asker.path.startswith(ASSETS) or is_urgent(asker.path)):
            # wrong tokens are counted, and nobody's others keep one out
            (self._reads if method in SAFE else self._asked).take(client_of(who, asker))
        return who

    def who(self, asker: Asker) -> Principal | None:
        """Return who asks now, counting nothing; None for strangers."""
        people = self.rules.people
        if not self.needs_tokens:
            return people.local(asker.address)
        if asker.bearer is not None:
            return people.of_token(asker.bearer, asker.address)
        return people.of_session(asker.session, asker.address)

    def holder_of(self, token: str, address: str) -> Principal:
        """Return a token's holder. A right one passes, however many wrong ones came from the same address.

        Args:
            token: As it was given.
            address: Where it comes from.

        Raises:
            NotAuthenticated: It is none of ours.
            TooManyRequests: It is none of ours, and not the first from this address.
        """
        holder = self.rules.people.of_token(token, address)
        if holder is None:
            self._strangers.require_any(address)
            self._strangers.take(address)
            raise NotAuthenticated("This is no token of this service, or it was revoked.")
        return holder

    def require_guess(self, name: str, address: str) -> None:
        """Count a password that somebody is about to try, before it is looked at: passwords can be guessed, so a right one waits as well.

        Args:
            name: Of the account.
            address: Where it comes from.

        Raises:
            TooManyRequests: Too many came from this address, or for this account.
        """
        self._guesses_of_address.take(address)
        self._guesses_of_account.take(name.casefold()[:60])

    def require_login(self, address: str) -> None:
        """Count a login elsewhere that an address begins or comes back from.

        Raises:
            TooManyRequests: Too many came from it.
        """
        self._logins.take(address)

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


def client_of(principal: Principal | None, asker: Asker) -> str:
    """Return the name under which a request is counted and noted: the user's, or the address."""
    return asker.address if principal is None else principal.client


_HOW = (
    "This service asks who you are: send the header `Authorization: Bearer TOKEN`, or open /login in a browser. "
    "`ltlplan serve --new-token NAME` makes a token, `ltlplan accounts add NAME` an account."
)
_NONE_LEFT = "This service has no tokens left; `ltlplan serve --new-token NAME` makes one."
