"""Client of a request, as the request names it, and the answers that any client gets."""

from __future__ import annotations

import http.cookies
import re
from dataclasses import dataclass

COOKIE = "ltlplan_session"
LOGIN = "/login"
PASSWORD = "/password"
OPENID = "/login/openid"
OPENID_BACK = "/login/openid/back"
OPEN = ("/health", LOGIN, PASSWORD, OPENID, OPENID_BACK, "/logout", "/docs", "/openapi.json", "/favicon.ico")
"""What is answered without a token: nothing in it is anybody's."""
OPEN_FOLDERS = ("/docs/", "/problems/")
"""Of what lies right in them, the same is so."""
ASSETS = ("/_nicegui/", "/docs/")
"""Files that a page fetches by the dozen, which no rate counts."""

_STOP = re.compile(r"/api/live/[^/]+/stop")


@dataclass(frozen=True, slots=True)
class Asker:
    """Client of a request, as the request names it.

    Attributes:
        path: What is asked for.
        address: Where it comes from.
        bearer: The token in the header `Authorization`; None where there is none.
        session: The session in the cookie, or an empty text.
    """

    path: str
    address: str
    bearer: str | None
    session: str

    @staticmethod
    def of(path: str, address: str, headers: dict[str, str]) -> Asker:
        """Return who asks.

        Args:
            path: What is asked for.
            address: Where it comes from.
            headers: By lower-case name.
        """
        scheme, _, given = headers.get("authorization", "").partition(" ")
        bearer = given.strip() if scheme.lower() == "bearer" and given.strip() else None
        return Asker(path, address, bearer, cookie(headers))


def is_open(path: str) -> bool:
    """Return whether a path is answered without a token."""
    folder, slash, name = path.rpartition("/")
    return path in OPEN or (bool(name) and folder + slash in OPEN_FOLDERS)


def is_urgent(path: str) -> bool:
    """Return whether a path is that of an order to stop a flight, which passes all limits on how much and how often."""
    return _STOP.fullmatch(path) is not None


def cookie(headers: dict[str, str]) -> str:
    """Return the session in a request's cookies, or an empty text."""
    try:
        found = http.cookies.SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except http.cookies.CookieError:
        return ""
    return "" if found is None else found.value
