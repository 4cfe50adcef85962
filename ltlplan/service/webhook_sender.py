"""Sender of webhooks: the id and state of a job that has ended, signed, to an address that was looked at before.

A host's name is resolved once for each try, and the connection goes to that very address. Redirects are not followed, proxies not asked, and nothing of
the answer is read but its status. Signatures are those of https://www.standardwebhooks.com.
"""

from __future__ import annotations

import asyncio
import base64
import hmac
import ipaddress
import json
import logging
import socket
import ssl
import time
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from urllib.parse import urlsplit, urlunsplit

from ltlplan.service.job_queue.job_index import Register
from ltlplan.service.models import ENDED
from ltlplan.service.people.webhooks import Call, Webhooks, require_listed
from verify.data.errors import BadInput, LtlplanError

LOOK = 1.0
"""s between looks for what is to be sent."""
PATIENCE = 10.0
"""s that an answer is waited for."""
_TOGETHER = 8

Address = ipaddress.IPv4Address | ipaddress.IPv6Address
Resolve = Callable[[str, int], Awaitable[list[str]]]

_log = logging.getLogger("ltlplan.service")


@dataclass(frozen=True, slots=True)
class Allowed:
    """Destinations that webhooks may have.

    Attributes:
        hosts: Names, each with its port where that is not 443.
        networks: Addresses beside the public ones, such as 10.1.0.0/16.
    """

    hosts: tuple[str, ...] = ()
    networks: tuple[ipaddress.IPv4Network | ipaddress.IPv6Network, ...] = ()

    @classmethod
    def read(cls, listed: Sequence[str]) -> Allowed:
        """Return what an admin lists: names of hosts, and networks.

        Raises:
            BadInput: One is neither.
        """
        hosts, networks = list[str](), list[ipaddress.IPv4Network | ipaddress.IPv6Network]()
        for each in listed:
            if "/" in each:
                try:
                    networks.append(ipaddress.ip_network(each))
                except ValueError as error:
                    raise BadInput(f"--webhook-host {each[:80]}: {error}; a network is written 10.1.0.0/16.") from None
            else:
                require_listed(f"https://{each}/", [each])
                hosts.append(each)
        return cls(tuple(hosts), tuple(networks))

    def allows(self, address: Address) -> bool:
        """Return whether something may be sent to an address."""
        plain = getattr(address, "ipv4_mapped", None) or address
        if any(plain.version == network.version and plain in network for network in self.networks):
            return True
        return plain.is_global and not plain.is_multicast


async def resolved(host: str, port: int) -> list[str]:
    """Return the addresses of a host."""
    found = await asyncio.get_running_loop().getaddrinfo(host, port, type=socket.SOCK_STREAM)
    return list(dict.fromkeys(str(each[4][0]) for each in found))


@dataclass
class Sender:
    """Sender of what is due.

    Attributes:
        webhooks: What is to be sent.
        register: All jobs.
        allowed: Where it may go.
        resolve: Finds the addresses of a host.
        context: Certificates that are trusted; None for the system's.
    """

    webhooks: Webhooks
    register: Register
    allowed: Allowed
    resolve: Resolve = resolved
    context: ssl.SSLContext | None = None

    async def run(self) -> None:
        """Send what is due until this is cancelled."""
        while True:
            try:
                await self.send_due()
            except LtlplanError as error:
                _log.warning("webhooks wait: %s", error)
            except Exception:  # the next look tries again
                _log.exception("webhooks cannot be sent yet")
            await asyncio.sleep(LOOK)

    async def send_due(self) -> int:
        """Send what is due now, and return how much that was."""
        ready: list[tuple[Call, str]] = []
        for call in await asyncio.to_thread(self.webhooks.due):
            entry = self.register.find(call.job)
            if entry is None:
                await asyncio.to_thread(self.webhooks.dropped, call)
            elif entry.job.state in ENDED:
                ready.append((call, entry.job.state))
        together = asyncio.Semaphore(_TOGETHER)

        async def one(call: Call, state: str) -> None:
            async with together:
                why = await self._sent(call, state)
            if why is None:
                await asyncio.to_thread(self.webhooks.sent, call)
            else:
                _log.info("webhook %d of job %s: %s", call.webhook, call.job, why)
                await asyncio.to_thread(self.webhooks.failed, call, why)

        await asyncio.gather(*(one(*each) for each in ready))
        return len(ready)

    async def _sent(self, call: Call, state: str) -> str | None:
        """Send something; return why it was not received, or None where it was."""
        import httpx

        try:
            host, port = require_listed(call.url, self.allowed.hosts)
            address = await self._address(host, port)
        except LtlplanError as error:
            return str(error)
        body = json.dumps({"id": call.job, "state": state}, separators=(",", ":")).encode()
        parts = urlsplit(call.url)
        literal = f"[{address}]" if address.version == 6 else str(address)
        url = urlunsplit(("https", f"{literal}:{port}", parts.path or "/", parts.query, ""))
        headers = {
            "host": host if port == 443 else f"{host}:{port}",
            "content-type": "application/json",
            "user-agent": "ltlplan",
            **signed(self.webhooks.secret(call.webhook), f"job_{call.webhook}_{call.job}", int(time.time()), body),
        }
        trusted = self.context or ssl.create_default_context()
        try:
            async with (
                asyncio.timeout(PATIENCE),
                httpx.AsyncClient(verify=trusted, trust_env=False, follow_redirects=False) as http,
            ):
                asked = http.build_request("POST", url, content=body, headers=headers, extensions={"sni_hostname": host})
                answer = await http.send(asked, stream=True)
                with suppress(httpx.HTTPError):
                    await answer.aclose()
        except TimeoutError:
            return f"no answer within {PATIENCE:g} s"
        except (httpx.HTTPError, OSError) as error:
            return f"it cannot be reached: {str(error)[:200] or type(error).__name__}"
        return None if answer.is_success else f"it answered with status {answer.status_code}"

    async def _address(self, host: str, port: int) -> Address:
        """Return the address to connect to.

        Raises:
            BadInput: The host is not found, or has an address that nothing may be sent to.
        """
        try:
            found = [ipaddress.ip_address(each.partition("%")[0]) for each in await self.resolve(host, port)]
        except (OSError, ValueError):
            found = []
        if not found:
            raise BadInput(f"The host {host} is not found.")
        for address in found:
            if not self.allowed.allows(address):
                raise BadInput(
                    f"{host} is at {address}, to which nothing is sent: an admin can list its network (--webhook-host 10.1.0.0/16)."
                )
        return found[0]


def signed(secret: str, identity: str, now: int, body: bytes) -> dict[str, str]:
    """Return the headers that say who sent something, and when.

    Args:
        secret: The webhook's, as `whsec_...`.
        identity: Names what is sent; the same for each try.
        now: s since 1970.
        body: What is sent.
    """
    key = base64.b64decode(secret.removeprefix("whsec_"))
    digest = hmac.digest(key, f"{identity}.{now}.".encode() + body, "sha256")
    return {
        "webhook-id": identity,
        "webhook-timestamp": str(now),
        "webhook-signature": "v1," + base64.b64encode(digest).decode(),
    }
