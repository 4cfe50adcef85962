"""Sessions of browsers: kept by the service, so that each can be ended, and asked for again at every message.

A session is a name of 256 random bits in a cookie; kept is its digest, with whose it is, the digest of the token that it was begun with and its end. It
ends with its token, with a logout and after `SESSION_SECONDS`, and outlives a restart of the service.
"""

from __future__ import annotations

import hmac
import json
import logging
import secrets
import threading
import time
from dataclasses import asdict, dataclass, field
from typing import Any

from ltlplan.service.log import note
from ltlplan.service.security.tokens import Tokens, digest_of, write_private
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import parse_json, read_bytes

FILE = "sessions.json"
SESSION_SECONDS = 30 * 24 * 3600
MOST_OF_ONE = 50
"""Sessions that one owner may have; of more, those that were begun first end."""

_FORMAT = 1
_MOST_BYTES = 20_000_000


@dataclass(frozen=True, slots=True)
class _Session:
    """One browser's session.

    Attributes:
        owner: Name of the token that it was begun with.
        token: That token's digest.
        ends: s since 1970.
    """

    owner: str
    token: str
    ends: float


@dataclass
class Sessions:
    """The sessions of a data folder; the service that has the folder is the only one that changes them.

    Attributes:
        tokens: Who may begin one.
    """

    tokens: Tokens
    _known: dict[str, _Session] | None = field(default=None, init=False, repr=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False, repr=False)

    def begin(self, owner: str) -> str:
        """Return a new session of a token's owner, for a browser's cookie.

        Raises:
            BadInput: There is no such token, or the folder cannot be written.
        """
        token = self.tokens.digest(owner)
        if token is None:
            raise BadInput(f"There is no token '{owner[:60]}' any more; log in with another one.")
        session = secrets.token_urlsafe(32)
        with self._lock:
            known = {key: each for key, each in self._all().items() if self._holds(each)}
            own = [key for key, each in known.items() if each.owner == owner]
            for key in own[: max(0, len(own) + 1 - MOST_OF_ONE)]:
                del known[key]
            self._write({**known, digest_of(session): _Session(owner, token, time.time() + SESSION_SECONDS)})
        return session

    def owner(self, session: str) -> str | None:
        """Return whose session this is, or None where it has ended or is none of ours."""
        if not session:
            return None
        given, found = digest_of(session), None
        for key, each in self._all().items():
            if hmac.compare_digest(given, key):
                found = each
        return found.owner if found is not None and self._holds(found) else None

    def end(self, session: str) -> None:
        """End a session; one that is none of ours changes nothing.

        Raises:
            BadInput: The folder cannot be written.
        """
        with self._lock:
            known = dict(self._all())
            if known.pop(digest_of(session), None) is not None:
                self._write(known)

    def _holds(self, session: _Session) -> bool:
        return session.ends > time.time() and self.tokens.digest(session.owner) == session.token

    def _all(self) -> dict[str, _Session]:
        if self._known is None:
            self._known = self._read()
        return self._known

    def _read(self) -> dict[str, _Session]:
        """Return the sessions on the disk; of a damaged file none, so that browsers log in again."""
        path = self.tokens.folder / FILE
        if not path.exists():
            return {}
        try:
            data = parse_json(read_bytes(path, most=_MOST_BYTES, what="file of sessions"), str(path))
            if not isinstance(data, dict) or data.get("format") != _FORMAT:
                raise ValueError("another format")
            listed: dict[str, dict[str, Any]] = data["sessions"]
            return {key: _Session(str(e["owner"]), str(e["token"]), float(e["ends"])) for key, e in listed.items()}
        except (BadInput, AttributeError, KeyError, TypeError, ValueError) as error:
            note("sessions are lost", level=logging.WARNING, file=str(path), reason=str(error))
            return {}

    def _write(self, sessions: dict[str, _Session]) -> None:
        text = json.dumps({"format": _FORMAT, "sessions": {key: asdict(each) for key, each in sessions.items()}}, indent=1)
        write_private(self.tokens.folder / FILE, (text + "\n").encode())
        self._known = sessions
