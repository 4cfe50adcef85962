"""Roles of people, actions that the service knows, and the one function that decides who may do what."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum

from ltlplan.service.problems import Forbidden
from ltlplan.service.security.tokens import LOCAL
from verify.data.errors import BadInput, did_you_mean


class Role(IntEnum):
    """Roles, each with all that those before it may do."""

    viewer = 1
    planner = 2
    pilot = 3
    admin = 4


class Action(StrEnum):
    """Actions that a route or a page asks for."""

    OPEN = "open"
    READ = "read"
    ASK = "ask"
    PLAN = "plan"
    FLY = "fly"
    ADMINISTER = "administer"


LEAST: dict[Action, Role | None] = {
    Action.OPEN: None,
    Action.READ: Role.viewer,
    Action.ASK: Role.viewer,
    Action.PLAN: Role.planner,
    Action.FLY: Role.pilot,
    Action.ADMINISTER: Role.admin,
}
"""The least role for each action: reading, asking what is computed and not kept, submitting, telling flights, administering. Strangers have none."""

_WORDS = {
    Action.READ: "read this",
    Action.ASK: "ask this",
    Action.PLAN: "submit, cancel or delete",
    Action.FLY: "tell flights anything",
    Action.ADMINISTER: "administer this service",
}


@dataclass(frozen=True, slots=True)
class Principal:
    """User of a request.

    Attributes:
        user: Name of an account, or of a token that belongs to none; `LOCAL` where neither is needed.
        role: What it may do.
        address: Where the request comes from.
        token: Name of the token that came with it; empty with a session, and where none is needed.
    """

    user: str
    role: Role
    address: str = ""
    token: str = ""

    @property
    def client(self) -> str:
        """Name under which requests are counted and noted: the user, or the address where nobody logs in."""
        return self.address if self.user == LOCAL else self.user

    @property
    def sees_all(self) -> bool:
        """True if every job may be looked at."""
        return self.role >= Role.admin


def allows(role: Role | None, action: Action) -> bool:
    """Return whether a role may do something; strangers have the role None."""
    least = LEAST[action]
    return least is None or (role is not None and role >= least)


def require(principal: Principal | None, action: Action) -> None:
    """Reject who may not do something.

    Args:
        principal: Who asks; None for strangers.
        action: What is asked for.

    Raises:
        Forbidden: The role is not enough.
    """
    if allows(None if principal is None else principal.role, action):
        return
    least = LEAST[action]
    assert least is not None
    role = "a stranger" if principal is None else f"'{principal.role.name}'"
    raise Forbidden(
        f"Only the role '{least.name}' and those above it may {_WORDS[action]}; yours is {role}. An admin of this service can change it."
    )


def role_of(name: str) -> Role:
    """Return the role of a name.

    Raises:
        BadInput: There is none of that name.
    """
    if name not in Role.__members__:
        known = list(Role.__members__)
        raise BadInput(f"'{name[:40]}' is no role.{did_you_mean(name, known)} Roles: {', '.join(known)}.")
    return Role[name]
