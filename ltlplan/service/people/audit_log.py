"""Log of who did what: submitted, cancelled, deleted, told a flight, logged in, changed an account. Kept before it is answered."""

from __future__ import annotations

from dataclasses import dataclass

from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.roles import Principal
from ltlplan.service.people_models import LogEntry
from ltlplan.service.times import utc_now

MOST = 500_000
"""Entries that are kept; of more the oldest go."""
_LONGEST = 2000


@dataclass(frozen=True, slots=True)
class LogQuery:
    """Entries of the log that somebody asks for.

    Attributes:
        user: Only of this user.
        action: Only of this action.
        limit: At most so many.
        before: Only those of smaller numbers.
    """

    user: str | None = None
    action: str | None = None
    limit: int = 100
    before: int | None = None


NEWEST = LogQuery()


@dataclass(frozen=True, slots=True)
class AuditLog:
    """The log of a data folder.

    Attributes:
        database: The file of people.
    """

    database: PeopleDatabase

    def write(self, principal: Principal | None, action: str, of: str = "", detail: str = "") -> None:
        """Keep that something is done.

        Args:
            principal: Who does it; None for the command line.
            action: What, such as "submit".
            of: What it is done to: a job, a flight, an account.
            detail: More, never a secret.

        Raises:
            BadInput: It cannot be kept; then it is not to be done.
        """
        user, role = ("command line", "") if principal is None else (principal.user, principal.role.name)
        with self.database.changing() as run:
            run.execute(
                "INSERT INTO log (time, user, role, action, object, detail) VALUES (?, ?, ?, ?, ?, ?)",
                (utc_now(), user, role, action, of[:300], detail[:_LONGEST]),
            )
            run.execute("DELETE FROM log WHERE number <= (SELECT max(number) FROM log) - ?", (MOST,))

    def forget(self, before: str) -> int:
        """Delete entries of before an instant, and return how many they were."""
        with self.database.changing() as run:
            return run.execute("DELETE FROM log WHERE time < ?", (before,)).rowcount

    def entries(self, asked: LogQuery = NEWEST) -> tuple[LogEntry, ...]:
        """Return entries, the newest first.

        Args:
            asked: Which ones.
        """
        statement = (
            "SELECT number, time, user, role, action, object, detail FROM log WHERE (?1 IS NULL OR user = ?1) AND (?2 IS NULL OR action = ?2)"
            " AND (?3 IS NULL OR number < ?3) ORDER BY number DESC LIMIT ?4"
        )
        rows = self.database.read(statement, (asked.user, asked.action, asked.before, asked.limit))
        names = ("number", "time", "user", "role", "action", "object", "detail")
        return tuple(LogEntry.model_validate(dict(zip(names, row, strict=True))) for row in rows)
