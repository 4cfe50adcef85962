"""Administration of people as one user may do it: the own tokens, sessions and projects, and for admins every account and the log. Each change is logged."""

from __future__ import annotations

from ltlplan.service.people.accounts import Account
from ltlplan.service.people.audit_log import NEWEST, LogQuery
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Action, Principal, require, role_of
from ltlplan.service.people_models import AccountTold, LogEntry, Project, Secret, WhoAmI
from ltlplan.service.problems import Forbidden, NotFound
from ltlplan.service.security.tokens import LOCAL


class Administration:
    """Administration as one user may do it; each method waits for the disk.

    Args:
        people: The people.
        principal: Who asks.
        session: The session by which they do, if any.
    """

    def __init__(self, people: People, principal: Principal, session: str = "") -> None:
        self._people, self._principal, self._session = people, principal, session

    def who(self) -> WhoAmI:
        """Return who asks, and what they may do."""
        who = self._principal
        return WhoAmI(user=who.user, role=who.role.name, token=who.token, tokens=self._people.tokens_of(who.user))

    def new_token(self, label: str) -> Secret:
        """Make a token of one's own account, `USER.LABEL`.

        Raises:
            Forbidden: A token asks, or nobody is logged in.
            BadInput: That cannot name one.
            Conflict: It is taken.
        """
        name, token = self._people.new_token(self._principal, label)
        self._log("make token", name)
        return Secret(name=name, secret=token)

    def revoke_token(self, name: str) -> None:
        """Revoke one of one's own tokens.

        Raises:
            NotFound: There is none of that name.
        """
        if name not in self._people.tokens_of(self._principal.user):
            raise NotFound(f"You have no token '{name[:60]}'.")
        self._log("revoke token", name)
        self._people.tokens.revoke(name)

    def end_own_sessions(self) -> None:
        """Log out everywhere else."""
        self._log("end sessions", self._principal.user)
        self._people.sessions.end_all(self._principal.user, but=self._session)

    def projects(self) -> tuple[Project, ...]:
        """Return one's own projects and those that are shared; for an admin all."""
        return self._people.references.projects(self._principal)

    def share(self, project: str, shared: bool) -> Project:
        """Share a project with everybody, or make it private; one that there is not yet is made.

        Raises:
            LtlplanError: As `References.share`.
        """
        require(self._principal, Action.PLAN)
        made = self._people.references.share(project, shared, self._principal)
        self._log("share" if shared else "unshare", project)
        return made

    # Of admins

    def accounts(self) -> tuple[AccountTold, ...]:
        """Return all accounts by their names."""
        self._require_admin()
        counts = self._people.sessions.counts()
        return tuple(_told(each, counts.get(each.name, 0)) for each in self._people.accounts.all())

    def add_account(self, name: str, role: str) -> Secret:
        """Make an account, with a temporary password.

        Raises:
            Forbidden: There is no admin yet: the first account is made on the command line, so that nobody locks themselves out.
            BadInput: The name or role is none.
            Conflict: The name is taken.
        """
        self._require_admin()
        if self._principal.user == LOCAL:
            raise Forbidden("The first account is made on the command line: ltlplan accounts add NAME --role admin")
        made = Secret(name=name, secret=self._people.accounts.add(name, role_of(role)))
        self._log("add account", name, role)
        return made

    def set_role(self, name: str, role: str) -> AccountTold:
        """Give an account another role, and end its sessions.

        Raises:
            NotFound: There is no such account.
            Conflict: It is the last admin.
        """
        self._require_admin()
        account = self._people.accounts.set_role(name, role_of(role))
        self._log("set role", account.name, role)
        return _told(account, 0)

    def set_disabled(self, name: str, disabled: bool) -> AccountTold:
        """Let an account log in no more, and end its sessions; or let it again.

        Raises:
            NotFound: There is no such account.
            Conflict: It is the last admin.
        """
        self._require_admin()
        account = self._people.accounts.set_disabled(name, disabled)
        self._log("disable account" if disabled else "enable account", account.name)
        return _told(account, 0)

    def account(self, name: str) -> AccountTold:
        """Return an account.

        Raises:
            NotFound: There is none of that name.
        """
        self._require_admin()
        account = self._people.accounts.get(name)
        return _told(account, self._people.sessions.counts().get(account.name, 0))

    def reset_password(self, name: str) -> Secret:
        """Give an account a temporary password, and end its sessions.

        Raises:
            NotFound: There is no such account.
            Conflict: It logs in by OpenID Connect.
        """
        self._require_admin()
        account = self._people.accounts.get(name)
        self._log("reset password", account.name)
        return Secret(name=account.name, secret=self._people.accounts.reset(account.name))

    def end_sessions(self, name: str) -> None:
        """Log an account out everywhere.

        Raises:
            NotFound: There is no such account.
        """
        self._require_admin()
        account = self._people.accounts.get(name)
        self._log("end sessions", account.name)
        self._people.sessions.end_all(account.name)

    def log(self, asked: LogQuery = NEWEST) -> tuple[LogEntry, ...]:
        """Return who did what, the newest first.

        Args:
            asked: Which entries.
        """
        self._require_admin()
        return self._people.log.entries(asked)

    def _require_admin(self) -> None:
        require(self._principal, Action.ADMINISTER)

    def _log(self, action: str, of: str, detail: str = "") -> None:
        self._people.log.write(self._principal, action, of, detail)


def _told(account: Account, sessions: int) -> AccountTold:
    return AccountTold(
        name=account.name, role=account.role.name, made=account.made, disabled=account.disabled, temporary=account.temporary,
        issuer=account.issuer, sessions=sessions,
    )  # fmt: skip
