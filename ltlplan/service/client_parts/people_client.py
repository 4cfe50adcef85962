"""A lab's half of the client: who asks, projects, and for admins accounts and the log of who did what."""

from __future__ import annotations

from ltlplan.service.client_parts.transport import Wire, checked, segment
from ltlplan.service.models import Job
from ltlplan.service.people_models import AccountTold, LogEntry, Project, Secret, Webhook, WhoAmI


class PeopleClient:
    """A service, as people of a lab ask it."""

    _wire: Wire

    def whoami(self) -> WhoAmI:
        """Return who asks, and the role; "local" on a service without accounts and tokens."""
        return checked(WhoAmI, self._wire.ask("GET", "/api/account").json())

    def projects(self) -> tuple[Project, ...]:
        """Return your projects, and those that are shared."""
        return tuple(checked(Project, each) for each in self._wire.ask("GET", "/api/projects").json())

    def share_project(self, name: str, shared: bool = True) -> Project:
        """Share a project with everybody who may log in, or make it private; one that there is not yet is made.

        Args:
            name: The project's.
            shared: Whether everybody sees its jobs.

        Raises:
            Forbidden: It is another's.
        """
        return checked(Project, self._wire.ask("PUT", f"/api/projects/{segment(name)}", json={"shared": shared}).json())

    def move_job(self, job: str, project: str) -> Job:
        """Put a job of yours into a project, or into none.

        Args:
            job: The job's id.
            project: The project's name; empty for none.

        Raises:
            Conflict: It is another's.
        """
        path = f"/api/jobs/{segment(job)}/project"
        return checked(Job, self._wire.ask("POST", path, params={"project": project}).json())

    def webhooks(self) -> tuple[Webhook, ...]:
        """Return your webhooks, each with what came of the last try."""
        return tuple(checked(Webhook, each) for each in self._wire.ask("GET", "/api/webhooks").json())

    def add_webhook(self, url: str) -> Secret:
        """Add an address that hears of the ends of jobs that you submit from now on; its id as `name`, and its secret.

        Args:
            url: https://HOST/PATH, of a host that an admin lists.

        Raises:
            Forbidden: No admin lists the host.
        """
        return checked(Secret, self._wire.ask("POST", "/api/webhooks", json={"url": url}).json())

    def delete_webhook(self, webhook: Webhook | int | str) -> None:
        """Delete a webhook, with what is still to be sent to it.

        Args:
            webhook: A webhook, or its id.
        """
        self._wire.ask("DELETE", f"/api/webhooks/{segment(str(webhook.id if isinstance(webhook, Webhook) else webhook))}")

    # For admins

    def accounts(self) -> tuple[AccountTold, ...]:
        """Return all accounts."""
        return tuple(checked(AccountTold, each) for each in self._wire.ask("GET", "/api/accounts").json())

    def add_account(self, name: str, role: str = "planner") -> Secret:
        """Make an account, and return its temporary password.

        Args:
            name: Names its user.
            role: "viewer", "planner", "pilot" or "admin".

        Raises:
            Conflict: The name is taken.
        """
        return checked(Secret, self._wire.ask("POST", "/api/accounts", json={"name": name, "role": role}).json())

    def change_account(self, name: str, *, role: str | None = None, disabled: bool | None = None) -> AccountTold:
        """Give an account another role, disable it, or enable it again; its sessions end at once.

        Args:
            name: The account's.
            role: Its new role.
            disabled: Whether it may log in no more.

        Raises:
            NotFound: There is none of that name.
            Conflict: It is the last admin.
        """
        given = {key: value for key, value in (("role", role), ("disabled", disabled)) if value is not None}
        return checked(AccountTold, self._wire.ask("PATCH", f"/api/accounts/{segment(name)}", json=given).json())

    def reset_password(self, name: str) -> Secret:
        """Give an account a temporary password, and return it; its sessions end at once.

        Raises:
            NotFound: There is none of that name.
        """
        return checked(Secret, self._wire.ask("POST", f"/api/accounts/{segment(name)}/password").json())

    def log(
        self, *, user: str | None = None, action: str | None = None, limit: int = 100, before: int | None = None
    ) -> tuple[LogEntry, ...]:
        """Return who did what, the newest first.

        Args:
            user: Only of this user.
            action: Only this, such as "tell".
            limit: At most so many.
            before: Only entries of smaller numbers.
        """
        asked = {"user": user, "action": action, "limit": limit, "before": before}
        given = {name: value for name, value in asked.items() if value is not None}
        return tuple(checked(LogEntry, each) for each in self._wire.ask("GET", "/api/log", params=given).json())
