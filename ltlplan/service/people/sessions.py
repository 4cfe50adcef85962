"""Sessions of browsers: kept by the service, so that each can be ended, and asked for again at every message.

A session is a name of 256 random bits in a cookie; kept is its digest, with whose it is and its end. It ends with a logout, with its token or its account's
password, role or admission, and after some time, and outlives a restart of the service.
"""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass

from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.security.tokens import Tokens, digest_of
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput

SESSION_SECONDS = 30 * 24 * 3600
"""s that a session lasts that was begun with a token or a password."""
OPENID_SECONDS = 12 * 3600
"""s that a session lasts that was begun by OpenID Connect: the provider is asked again then."""
MOST_OF_ONE = 50
"""Sessions that one owner may have; of more, those that were begun first end."""


@dataclass(frozen=True, slots=True)
class Session:
    """A browser's session.

    Attributes:
        owner: Name of the account, or of the token that it was begun with.
        by_token: Whether it is a token's.
    """

    owner: str
    by_token: bool


@dataclass(frozen=True, slots=True)
class Sessions:
    """The sessions of a data folder.

    Attributes:
        database: The file of people.
        tokens: The tokens that sessions were begun with.
    """

    database: PeopleDatabase
    tokens: Tokens

    def begin(self, token: str) -> str:
        """Return a new session of a token's holder, for a browser's cookie.

        Args:
            token: The token's name.

        Raises:
            BadInput: There is no such token, or the folder cannot be written.
        """
        digest = self.tokens.digest(token)
        if digest is None:
            raise BadInput(f"There is no token '{token[:60]}' any more; log in with another one.")
        return self._begin(token, digest, SESSION_SECONDS)

    def begin_of_account(self, account: str, seconds: float = SESSION_SECONDS) -> str:
        """Return a new session of an account, for a browser's cookie."""
        return self._begin(account, None, seconds)

    def _begin(self, owner: str, token: str | None, seconds: float) -> str:
        session, now = secrets.token_urlsafe(32), time.time()
        with self.database.changing() as run:
            run.execute("DELETE FROM sessions WHERE ends <= ?", (now,))
            run.execute(
                "INSERT INTO sessions (digest, owner, token, began, ends) VALUES (?, ?, ?, ?, ?)",
                (digest_of(session), owner, token, utc_now(), now + seconds),
            )
            run.execute(
                "DELETE FROM sessions WHERE owner = ?1 AND token IS ?2 AND rowid NOT IN "
                "(SELECT rowid FROM sessions WHERE owner = ?1 AND token IS ?2 ORDER BY rowid DESC LIMIT ?3)",
                (owner, token, MOST_OF_ONE),
            )
        return session

    def find(self, session: str) -> Session | None:
        """Return what a session is, or None where it has ended or is none of ours; whether its account may still log in is for the account to say."""
        if not session:
            return None
        rows = self.database.read("SELECT owner, token, ends FROM sessions WHERE digest = ?", (digest_of(session),))
        if not rows:
            return None
        owner, token, ends = rows[0]
        if ends <= time.time() or (token is not None and self.tokens.digest(owner) != token):
            return None
        return Session(str(owner), token is not None)

    def end(self, session: str) -> None:
        """End a session; one that is none of ours changes nothing.

        Raises:
            BadInput: The folder cannot be written.
        """
        with self.database.changing() as run:
            run.execute("DELETE FROM sessions WHERE digest = ?", (digest_of(session),))

    def end_all(self, account: str, *, but: str = "") -> None:
        """End all sessions of an account.

        Args:
            account: The account's name.
            but: A session that stays.

        Raises:
            BadInput: The folder cannot be written.
        """
        with self.database.changing() as run:
            run.execute("DELETE FROM sessions WHERE owner = ? AND token IS NULL AND digest <> ?", (account, digest_of(but)))

    def counts(self) -> dict[str, int]:
        """Return how many browsers are logged in, by account."""
        asked = "SELECT owner, count(*) FROM sessions WHERE token IS NULL AND ends > ? GROUP BY owner"
        return {str(owner): int(count) for owner, count in self.database.read(asked, (time.time(),))}
