"""Webhooks of users: addresses that hear of the ends of their jobs, and what is still to be sent to them.

What is to be sent is noted when a job is submitted, so that a kill at any instant loses nothing. Secrets are not kept: each is derived from the service's own
key, a file that no backup has.
"""

from __future__ import annotations

import base64
import hmac
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from ltlplan.service.people.audit_log import AuditLog
from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.roles import Action, Principal, require
from ltlplan.service.people_models import Webhook
from ltlplan.service.problems import Forbidden, NotFound, TooManyRequests
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput

KEY = "webhooks.key"
MOST = 10
"""Webhooks of one user."""
TRIES = 6
"""How often something is sent before it is given up."""
_LONGEST = 500
_SELECT = "SELECT id, url, owner, made, said, said_at FROM webhooks"


@dataclass(frozen=True, slots=True)
class Call:
    """Something that is to be sent.

    Attributes:
        webhook: The webhook's id.
        url: Where to.
        job: The job's id.
        tries: How often it was tried.
    """

    webhook: int
    url: str
    job: str
    tries: int


@dataclass(frozen=True, slots=True)
class Webhooks:
    """The webhooks of a data folder. Each method waits for the disk.

    Attributes:
        database: The file of people.
        log: Where changes are noted.
    """

    database: PeopleDatabase
    log: AuditLog

    def add(self, principal: Principal, url: str, hosts: Sequence[str]) -> tuple[Webhook, str]:
        """Add a webhook, and return it with its secret.

        Args:
            principal: Whose it is.
            url: Where the ends of the user's jobs are sent to.
            hosts: Hosts that the admin lists, each with its port where that is not 443.

        Raises:
            Forbidden: The admin does not list the host.
            BadInput: It is no address of HTTPS.
            TooManyRequests: The user has too many.
        """
        require(principal, Action.PLAN)
        require_listed(url, hosts)
        if len(self.listed(principal)) >= MOST:
            raise TooManyRequests(f"You have {MOST} webhooks, the most of one user; delete one first.", 60.0)
        self.log.write(principal, "add webhook", url)
        with self.database.changing() as run:
            run.execute("INSERT INTO webhooks (owner, url, made) VALUES (?, ?, ?)", (principal.user, url, utc_now()))
            webhook = run.lastrowid
            assert webhook is not None
        return self._get(webhook), self.secret(webhook)

    def listed(self, principal: Principal) -> tuple[Webhook, ...]:
        """Return a user's webhooks."""
        require(principal, Action.READ)
        return tuple(_webhook(row) for row in self.database.read(f"{_SELECT} WHERE owner = ? ORDER BY id", (principal.user,)))

    def delete(self, principal: Principal, webhook: int) -> None:
        """Delete a webhook, with what is still to be sent to it.

        Raises:
            NotFound: The user has no such webhook.
        """
        require(principal, Action.PLAN)
        if webhook not in {each.id for each in self.listed(principal)}:
            raise NotFound(f"There is no webhook {webhook}.")
        self.log.write(principal, "delete webhook", self._get(webhook).url)
        with self.database.changing() as run:
            run.execute("DELETE FROM webhook_calls WHERE webhook = ?", (webhook,))
            run.execute("DELETE FROM webhooks WHERE id = ?", (webhook,))

    def _get(self, webhook: int) -> Webhook:
        return _webhook(self.database.read(f"{_SELECT} WHERE id = ?", (webhook,))[0])

    def secret(self, webhook: int) -> str:
        """Return a webhook's secret: what it is signed with, as https://www.standardwebhooks.com writes it."""
        digest = hmac.digest(_key(self.database.folder / KEY), f"webhook {webhook}".encode(), "sha256")
        return "whsec_" + base64.b64encode(digest).decode()

    # What is to be sent

    def expect(self, user: str, job: str) -> None:
        """Note that the end of a job is to be sent to a user's webhooks."""
        rows = self.database.read("SELECT id FROM webhooks WHERE owner = ?", (user,))
        if rows:
            with self.database.changing() as run:
                run.executemany(
                    "INSERT OR IGNORE INTO webhook_calls VALUES (?, ?, 0, 0)", [(webhook, job) for (webhook,) in rows]
                )

    def due(self) -> tuple[Call, ...]:
        """Return what may be sent by now, should the job have ended."""
        asked = (
            "SELECT w.id, w.url, c.job, c.tries FROM webhook_calls c JOIN webhooks w ON w.id = c.webhook "
            "LEFT JOIN accounts a ON a.name = w.owner WHERE a.disabled IS NULL AND c.due <= ? ORDER BY c.due"
        )
        return tuple(Call(*row) for row in self.database.read(asked, (time.time(),)))

    def sent(self, call: Call) -> None:
        """Note that something was received."""
        self._done(call, "received")

    def dropped(self, call: Call) -> None:
        """Note that something will not be sent, as its job is not there any more."""
        with self.database.changing() as run:
            run.execute("DELETE FROM webhook_calls WHERE webhook = ? AND job = ?", (call.webhook, call.job))

    def failed(self, call: Call, why: str) -> None:
        """Note that something was not received: it is tried again after 5 s, 25 s and so on, or given up."""
        if call.tries + 1 >= TRIES:
            self._done(call, f"given up: {why}")
            return
        with self.database.changing() as run:
            run.execute(
                "UPDATE webhook_calls SET tries = ?, due = ? WHERE webhook = ? AND job = ?",
                (call.tries + 1, time.time() + 5.0 ** (call.tries + 1), call.webhook, call.job),
            )
            run.execute("UPDATE webhooks SET said = ?, said_at = ? WHERE id = ?", (why[:300], utc_now(), call.webhook))

    def _done(self, call: Call, said: str) -> None:
        with self.database.changing() as run:
            run.execute("DELETE FROM webhook_calls WHERE webhook = ? AND job = ?", (call.webhook, call.job))
            run.execute("UPDATE webhooks SET said = ?, said_at = ? WHERE id = ?", (said[:300], utc_now(), call.webhook))


def require_listed(url: str, hosts: Sequence[str]) -> tuple[str, int]:
    """Return host and port of an address that the admin lists.

    Args:
        url: The address.
        hosts: Hosts, each with its port where that is not 443.

    Raises:
        Forbidden: The admin does not list the host.
        BadInput: It is no address of HTTPS.
    """
    try:
        parts = urlsplit(url)
        host, port = (parts.hostname or "").rstrip("."), parts.port or 443
    except ValueError:
        raise BadInput(f"{url[:100]!r} is no address.") from None
    plain = url.isascii() and url.isprintable() and " " not in url and len(url) <= _LONGEST and "\\" not in url
    if not plain or parts.scheme != "https" or not host or parts.username or parts.password or parts.fragment:
        raise BadInput(
            f"A webhook's address is https://HOST/PATH of at most {_LONGEST} plain letters, without a password, not {url[:100]!r}."
        )
    listed = {_host(each) for each in hosts}
    if (host, port) not in listed:
        known = ", ".join(sorted(hosts)) or "none"
        raise Forbidden(
            f"Webhooks go to hosts that an admin lists (`ltlplan serve --webhook-host`), not to {host}:{port}. Listed: {known}."
        )
    return host, port


def _host(listed: str) -> tuple[str, int]:
    parts = urlsplit(f"//{listed.lower()}")
    return (parts.hostname or "").rstrip("."), parts.port or 443


def _key(path: Path) -> bytes:
    """Return the service's own key, drawn at its first use."""
    if not path.exists():
        beside = path.with_suffix(f".{os.getpid()}")
        with os.fdopen(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
            file.write(os.urandom(32))
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    return path.read_bytes()


def _webhook(row: tuple[object, ...]) -> Webhook:
    names = ("id", "url", "owner", "made", "said", "said_at")
    return Webhook.model_validate(dict(zip(names, row, strict=True)))
