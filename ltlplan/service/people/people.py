"""People of a service together: who sends a request, by which token or session, and what they may do."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ltlplan.service.people.accounts import Accounts
from ltlplan.service.people.audit_log import AuditLog
from ltlplan.service.people.database import PeopleDatabase
from ltlplan.service.people.job_references import References
from ltlplan.service.people.roles import LOCAL, Principal, Role, role_of
from ltlplan.service.people.sessions import Sessions
from ltlplan.service.people.stored_missions import StoredMissions
from ltlplan.service.people.studies import Studies
from ltlplan.service.people.webhooks import Webhooks
from ltlplan.service.problems import Conflict, Forbidden
from ltlplan.service.security.tokens import DEFAULT_ROLE, Tokens
from verify.data.errors import BadInput


@dataclass
class People:
    """People of a data folder.

    Attributes:
        tokens: Tokens of programs.
        openid: Whether people log in by OpenID Connect, so that everybody has to.
        database: The file of people.
        accounts: Their accounts.
        sessions: Browsers that are logged in.
        log: Log of who did what.
        references: Whose jobs are whose.
        missions: Stored missions.
        studies: Studies, and which jobs are in them.
        webhooks: Addresses that hear of the ends of jobs.
    """

    tokens: Tokens
    openid: bool = False
    database: PeopleDatabase = field(init=False)
    accounts: Accounts = field(init=False)
    sessions: Sessions = field(init=False)
    log: AuditLog = field(init=False)
    references: References = field(init=False)
    missions: StoredMissions = field(init=False)
    studies: Studies = field(init=False)
    webhooks: Webhooks = field(init=False)

    def __post_init__(self) -> None:
        self.database = PeopleDatabase(self.tokens.folder)
        self.accounts, self.log = Accounts(self.database), AuditLog(self.database)
        self.sessions, self.references = Sessions(self.database, self.tokens), References(self.database)
        self.missions = StoredMissions(self.database, self.references, self.log)
        self.studies = Studies(self.database, self.references)
        self.webhooks = Webhooks(self.database, self.log)

    @property
    def needed(self) -> bool:
        """True if every client has to say who it is."""
        return self.openid or self.tokens.needed or self.accounts.needed

    def local(self, address: str) -> Principal:
        """Return who asks from this machine, where nobody has to say who they are."""
        return Principal(LOCAL, Role.admin, address)

    def of_token(self, token: str, address: str = "") -> Principal | None:
        """Return the holder of a token, or None where it is none of ours or its account is disabled."""
        name = self.tokens.owner(token)
        return None if name is None else self._of_token_named(name, address)

    def of_session(self, session: str, address: str = "") -> Principal | None:
        """Return whose session this is, or None where it has ended or its account is disabled."""
        found = self.sessions.find(session)
        if found is None:
            return None
        if found.by_token:
            return self._of_token_named(found.owner, address)
        account = self.accounts.find(found.owner)
        return None if account is None or account.disabled is not None else Principal(account.name, account.role, address)

    def _of_token_named(self, name: str, address: str) -> Principal | None:
        """Return who holds a token: the account that it belongs to or is named after, with at most the token's role; else a user of its name."""
        entry = self.tokens.entry(name)
        if entry is None:
            return None
        account = self.accounts.find(entry.account or name)
        if account is None:
            return None if entry.account else Principal(name, role_of(entry.role or DEFAULT_ROLE), address, name)
        if account.disabled is not None:
            return None
        role = account.role if not entry.role else min(account.role, role_of(entry.role))
        return Principal(account.name, role, address, name)

    # Accounts and their tokens

    def tokens_of(self, user: str) -> tuple[str, ...]:
        """Return the names of a user's tokens."""
        return tuple(name for name, entry in self.tokens.entries().items() if (entry.account or name) == user)

    def new_token(self, principal: Principal, label: str) -> tuple[str, str]:
        """Make a token of somebody's own account, and return its name, `USER.LABEL`, and the token.

        Raises:
            Forbidden: A token asks, or nobody is logged in.
            BadInput: That cannot name one.
            Conflict: It is taken.
        """
        if principal.token or self.accounts.find(principal.user) is None:
            raise Forbidden("Only who logged in to an account makes tokens of it; log in in a browser.")
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,30}", label):
            raise BadInput("A token is called by at most 30 letters, digits, '-' and '_', such as laptop.")
        name = f"{principal.user}.{label}"
        if name in self.tokens.entries():
            raise Conflict(f"There is a token '{name}' already; revoke it first, or take another name.")
        return name, self.tokens.new(name, account=principal.user)

    def free_name(self, wanted: str) -> str:
        """Return a name for a new account that no account, token or owner of a job has: nobody becomes somebody else by a name.

        Args:
            wanted: What it may look like.
        """
        stem = re.sub(r"[^A-Za-z0-9_.-]", "", wanted).lstrip("_.-")[:50] or "person"
        asked = "SELECT user FROM job_references UNION SELECT owner FROM projects UNION SELECT name FROM accounts"
        taken = {str(name).lower() for (name,) in self.database.read(asked)}
        for name, entry in self.tokens.entries().items():
            taken |= {name.lower(), entry.account.lower()}
        taken.add(LOCAL)
        number, name = 1, stem
        while name.lower() in taken or re.fullmatch(r"[0-9.]+", name):
            number += 1
            name = f"{stem}-{number}"
        return name

    def close(self) -> None:
        """Let go of the file."""
        self.database.close()
