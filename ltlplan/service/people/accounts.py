"""Accounts of people: made by an admin or at the first login by OpenID Connect; disabled, never deleted, because the log names them."""

from __future__ import annotations

from dataclasses import dataclass

from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.passwords import drawn, hashed, matches
from ltlplan.service.people.roles import Role, role_of
from ltlplan.service.problems import Conflict, NotAuthenticated, NotFound
from ltlplan.service.security.tokens import require_name
from ltlplan.service.times import utc_now
from verify.data.errors import BadInput, did_you_mean

_COLUMNS = "name, role, password IS NOT NULL, temporary, issuer, subject, made, disabled"


@dataclass(frozen=True, slots=True)
class Account:
    """An account.

    Attributes:
        name: Names the user.
        role: What it may do.
        has_password: Whether it logs in by a password.
        temporary: Whether that password was drawn by the service, to be changed before anything else.
        issuer: OpenID Connect provider that it logs in by.
        subject: The provider's own name for it.
        made: When it was made, UTC, ISO 8601.
        disabled: When it was disabled; None while it may log in.
    """

    name: str
    role: Role
    has_password: bool
    temporary: bool
    issuer: str | None
    subject: str | None
    made: str
    disabled: str | None


@dataclass(frozen=True, slots=True)
class Accounts:
    """The accounts of a data folder.

    Attributes:
        database: The file of people.
    """

    database: PeopleDatabase

    @property
    def needed(self) -> bool:
        """True if there are any: then every client logs in."""
        return bool(self.database.read("SELECT 1 FROM accounts LIMIT 1"))

    def all(self) -> list[Account]:
        """Return all accounts by their names."""
        return [_account(row) for row in self.database.read(f"SELECT {_COLUMNS} FROM accounts ORDER BY name")]

    def find(self, name: str) -> Account | None:
        """Return an account; None where there is none of that name, in letters of any case."""
        rows = self.database.read(f"SELECT {_COLUMNS} FROM accounts WHERE name = ?", (name,))
        return _account(rows[0]) if rows else None

    def get(self, name: str) -> Account:
        """Return an account.

        Raises:
            NotFound: There is none of that name.
        """
        found = self.find(name)
        if found is None:
            known = [each.name for each in self.all()]
            raise NotFound(f"There is no account '{name[:60]}'.{did_you_mean(name, known)}")
        return found

    def add(self, name: str, role: Role) -> str:
        """Make an account, and return its temporary password, which cannot be shown again.

        Raises:
            BadInput: The name is none.
            Conflict: It is taken.
        """
        require_name(name, "an account")
        password = drawn()
        self._insert(name, role, hashed(password), None, None)
        return password

    def add_by_openid(self, name: str, role: Role, issuer: str, subject: str) -> Account:
        """Make an account that logs in by OpenID Connect.

        Args:
            name: Names the user.
            role: What it may do.
            issuer: The provider.
            subject: The provider's own name for it.

        Raises:
            BadInput: The name is none.
            Conflict: It is taken.
        """
        require_name(name, "an account")
        self._insert(name, role, None, issuer, subject)
        return self.get(name)

    def _insert(self, name: str, role: Role, password: str | None, issuer: str | None, subject: str | None) -> None:
        with self.database.changing() as run:
            if run.execute("SELECT 1 FROM accounts WHERE name = ?", (name,)).fetchone():
                raise Conflict(f"There is an account '{name}' already; take another name.")
            run.execute(
                "INSERT INTO accounts (name, role, password, temporary, issuer, subject, made) VALUES (?, ?, ?, ?, ?, ?, ?)",
                (name, role.name, password, int(password is not None), issuer, subject, utc_now()),
            )

    def by_openid(self, issuer: str, subject: str) -> Account | None:
        """Return the account of an OpenID Connect provider's subject: nothing else identifies it, and no e-mail address."""
        rows = self.database.read(f"SELECT {_COLUMNS} FROM accounts WHERE issuer = ? AND subject = ?", (issuer, subject))
        return _account(rows[0]) if rows else None

    def reset(self, name: str) -> str:
        """Give an account a temporary password, end its sessions, and return the password.

        Raises:
            NotFound: There is no such account.
            Conflict: It logs in by OpenID Connect.
        """
        account = self.get(name)
        if account.issuer is not None:
            raise Conflict(f"'{account.name}' logs in by {account.issuer}, which knows its password.")
        password = drawn()
        self._set(account.name, "password = ?, temporary = 1", (hashed(password),))
        return password

    def set_role(self, name: str, role: Role) -> Account:
        """Give an account another role, and end its sessions.

        Raises:
            NotFound: There is no such account.
            Conflict: It is the last admin.
        """
        account = self.get(name)
        if account.role != role:
            self._require_other_admin(account, stays=role is Role.admin)
            self._set(account.name, "role = ?", (role.name,))
        return self.get(name)

    def set_disabled(self, name: str, disabled: bool) -> Account:
        """Let an account log in no more, and end its sessions; or let it again.

        Raises:
            NotFound: There is no such account.
            Conflict: It is the last admin.
        """
        account = self.get(name)
        if (account.disabled is not None) != disabled:
            self._require_other_admin(account, stays=not disabled)
            self._set(account.name, "disabled = ?", (utc_now() if disabled else None,))
        return self.get(name)

    def _require_other_admin(self, account: Account, *, stays: bool) -> None:
        if stays or account.role is not Role.admin or account.disabled is not None:
            return
        if not any(each.role is Role.admin and each.disabled is None and each.name != account.name for each in self.all()):
            raise Conflict(f"'{account.name}' is the last admin; make another one first.")

    def _set(self, name: str, what: str, values: tuple[object, ...]) -> None:
        """Change an account, and end its sessions, in one transaction."""
        with self.database.changing() as run:
            run.execute(f"UPDATE accounts SET {what} WHERE name = ?", (*values, name))
            run.execute("DELETE FROM sessions WHERE owner = ? AND token IS NULL", (name,))

    def check(self, name: str, password: str) -> Account:
        """Return the account of a name and its password; slow on purpose.

        Raises:
            NotAuthenticated: There is none, it is disabled, or the password is another.
        """
        account = self.find(name)
        rows = self.database.read("SELECT password FROM accounts WHERE name = ?", (name,))
        if not matches(rows[0][0] if rows else None, password) or account is None or account.disabled is not None:
            raise NotAuthenticated("No account has this name and password, or it is disabled. An admin can reset a password.")
        return account

    def change_password(self, name: str, password: str, new: str) -> Account:
        """Change a password by the one before, and end all sessions of the account.

        Args:
            name: Of the account.
            password: The one before.
            new: The new one.

        Raises:
            NotAuthenticated: The one before is another.
            BadInput: The new one is too short, too long, or the one before.
        """
        account = self.check(name, password)
        if new == password:
            raise BadInput("The new password is the present one; choose another.")
        self._set(account.name, "password = ?, temporary = 0", (hashed(new),))
        return self.get(name)


def _account(row: tuple[object, ...]) -> Account:
    name, role, has_password, temporary, issuer, subject, made, disabled = row
    text = [None if each is None else str(each) for each in (issuer, subject, disabled)]
    return Account(str(name), role_of(str(role)), bool(has_password), bool(temporary), text[0], text[1], str(made), text[2])
