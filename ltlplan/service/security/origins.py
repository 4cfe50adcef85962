"""From where a request may come: by names that are ours, and from no other site's page.

A page of another site can make a browser ask a service on its own machine. It cannot choose the header `Host` but by naming a host of
its own that leads here (DNS rebinding), so only our names are answered; and it cannot hide that it is another site's (`Origin`,
`Sec-Fetch-Site`), so what would change something is rejected to it.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Mapping
from urllib.parse import urlsplit

from ltlplan.service.problems import Forbidden, WrongHost

SAFE = frozenset({"GET", "HEAD", "OPTIONS"})


def is_loopback(host: str) -> bool:
    """Return whether an address or name can be reached from this machine only."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower().rstrip(".") == "localhost"


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def own_names(host: str, extra: tuple[str, ...] = ()) -> frozenset[str]:
    """Return the names by which a service that listens on an address may be asked, besides addresses.

    Args:
        host: What it listens on.
        extra: More names, such as a proxy's.
    """
    names = {"localhost", *(name.lower().rstrip(".") for name in extra)}
    if not is_loopback(host):
        names |= {host.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}
    return frozenset(names)


def require_own_host(given: str, names: frozenset[str], *, everywhere: bool) -> None:
    """Reject a name that is not ours.

    Args:
        given: The header `Host`.
        names: Ours.
        everywhere: Whether any address may stand there, not only this machine's own: no page can lie about an address.

    Raises:
        WrongHost: It is none.
    """
    host = hostname(given)
    if host in names or (_is_address(host) and (everywhere or is_loopback(host))):
        return
    raise WrongHost(
        f"'{given[:100]}' is not a name of this service; `ltlplan serve --name {host[:60] or 'NAME'}` would make it one."
    )


def hostname(given: str) -> str:
    """Return the name or address in a header `Host`, without port and brackets."""
    try:
        return (urlsplit(f"//{given}").hostname or "").rstrip(".")
    except ValueError:
        return ""


def require_own_page(method: str, headers: Mapping[str, str]) -> None:
    """Reject what a page of another site asks, if it would change something.

    Args:
        method: The request's; "WEBSOCKET" for a websocket.
        headers: Its headers, by lower-case name.

    Raises:
        Forbidden: It comes from elsewhere.
    """
    if method in SAFE:
        return
    origin, site = headers.get("origin"), headers.get("sec-fetch-site")
    foreign = site in ("cross-site", "same-site")
    if origin is not None:
        try:
            foreign |= urlsplit(origin).netloc.lower() != headers.get("host", "").lower()
        except ValueError:
            foreign = True
    if foreign:
        raise Forbidden("This came from a page of another site; only this service's own pages, and programs, may ask for that.")
