"""Values of people, projects and stored missions: HTTP answers them and the client returns them."""

from __future__ import annotations

from ltlplan.service.models import Told


class Project(Told):
    """A project: jobs that are shared with everybody, or with nobody.

    Attributes:
        name: Names it.
        owner: User who made it, and may share it.
        shared: Whether everybody sees its jobs.
        made: When it was made, UTC, ISO 8601.
        jobs: How many jobs are in it.
    """

    name: str
    owner: str
    shared: bool
    made: str
    jobs: int = 0


class StoredMission(Told):
    """A mission that is stored with all its versions.

    Attributes:
        id: Names it.
        name: What its owner calls it.
        owner: User who stored it first.
        project: Its project; empty for none. In a shared one everybody sees it, and planners add versions.
        tags: Words to find it by.
        version: Number of its newest version, from 1.
        changed: When that was stored, UTC, ISO 8601.
        by: Who stored that.
    """

    id: int
    name: str
    owner: str
    project: str = ""
    tags: tuple[str, ...] = ()
    version: int
    changed: str
    by: str


class DraftTold(Told):
    """A mission as it is being written.

    Attributes:
        id: Names it among its user's.
        text: YAML, with its faults.
        changed: When it was changed last, ms since 1970.
    """

    id: str
    text: str
    changed: float


class MissionVersion(Told):
    """A version of a stored mission.

    Attributes:
        number: From 1 on.
        user: Who stored it.
        made: When, UTC, ISO 8601.
        text: YAML as it was written; empty in lists.
    """

    number: int
    user: str
    made: str
    text: str = ""


class LogEntry(Told):
    """An entry of the log of who did what.

    Attributes:
        number: Grows.
        time: UTC, ISO 8601.
        user: Who.
        role: The user's role then.
        action: What: "submit", "cancel", "delete", "export", "tell", "log in" and so on.
        object: What it was done to: a job, a flight, an account.
        detail: More: what a flight was told, a role.
    """

    number: int
    time: str
    user: str
    role: str
    action: str
    object: str
    detail: str


class AccountTold(Told):
    """An account.

    Attributes:
        name: Names the user.
        role: "viewer", "planner", "pilot" or "admin".
        made: When it was made, UTC, ISO 8601.
        disabled: When it was disabled; None while it may log in.
        temporary: Whether its password was drawn by the service and is to be changed.
        issuer: OpenID Connect provider that it logs in by; None for a password.
        sessions: How many browsers are logged in.
    """

    name: str
    role: str
    made: str
    disabled: str | None = None
    temporary: bool = False
    issuer: str | None = None
    sessions: int = 0


class WhoAmI(Told):
    """User of a request.

    Attributes:
        user: The user's name; "local" on a service without accounts and tokens.
        role: "viewer", "planner", "pilot" or "admin".
        token: Name of the token that came with the request; empty for a session.
        tokens: Names of the account's tokens.
    """

    user: str
    role: str
    token: str = ""
    tokens: tuple[str, ...] = ()


class Webhook(Told):
    """An address that hears of the ends of a user's jobs.

    Attributes:
        id: Names it.
        url: Where they are sent to.
        owner: Whose jobs.
        made: When it was added, UTC, ISO 8601.
        said: What came of the last try: "received", or why not; empty before.
        said_at: When that was.
    """

    id: int
    url: str
    owner: str
    made: str
    said: str = ""
    said_at: str | None = None


class Secret(Told):
    """A secret that is shown once: a token, or a temporary password.

    Attributes:
        name: Of the token or account.
        secret: The secret.
    """

    name: str
    secret: str
