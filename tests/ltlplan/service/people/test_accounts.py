"""Accounts, their passwords and tokens: who is who, and what ends whose sessions."""

from __future__ import annotations

from pathlib import Path

import pytest

from ltlplan.service.people.administration import Administration
from ltlplan.service.people.audit_log import LogQuery
from ltlplan.service.people.passwords import hashed, matches
from ltlplan.service.people.people import People
from ltlplan.service.people.roles import LEAST, Action, Principal, Role, allows, require, role_of
from ltlplan.service.problems import Conflict, Forbidden, NotAuthenticated, NotFound
from ltlplan.service.security.tokens import Tokens
from verify.data import BadInput

PASSWORD = "twelve letters"


def _user(principal: Principal | None) -> tuple[str, str] | None:
    return None if principal is None else (principal.user, principal.role.name)


def _account(people: People, name: str, role: Role = Role.planner) -> str:
    """Make an account with the password above, and return a session of it."""
    people.accounts.change_password(name, people.accounts.add(name, role), PASSWORD)
    return people.sessions.begin_of_account(name)


def test_a_role_has_all_that_those_before_it_have() -> None:
    assert list(LEAST) == list(Action)
    for role in Role:
        may = {action for action in Action if allows(role, action)}
        assert all(may >= {action for action in Action if allows(less, action)} for less in Role if less < role)
    assert [action for action in Action if allows(None, action)] == [Action.OPEN]
    assert allows(Role.pilot, Action.FLY)
    assert not allows(Role.planner, Action.FLY)
    with pytest.raises(
        Forbidden, match="Only the role 'planner' and those above it may submit, cancel or delete; yours is 'viewer'"
    ):
        require(Principal("eve", Role.viewer), Action.PLAN)
    with pytest.raises(BadInput, match="Did you mean 'pilot'"):
        role_of("pilott")


def test_a_password_is_kept_as_argon2id_and_matches_itself_alone(people: People) -> None:
    password = people.accounts.add("alice", Role.planner)
    assert people.accounts.check("alice", password).temporary
    people.accounts.change_password("alice", password, PASSWORD)
    assert not people.accounts.check("ALICE", PASSWORD).temporary
    for wrong in (password, PASSWORD + "x", PASSWORD[:-1], "", "\udcff", "x" * 100_000):
        with pytest.raises(NotAuthenticated, match="No account has this name and password"):
            people.accounts.check("alice", wrong)
    with pytest.raises(NotAuthenticated, match="No account has this name and password"):
        people.accounts.check("nobody", PASSWORD)
    ((kept,),) = people.database.read("SELECT password FROM accounts")
    assert kept.startswith("$argon2id$")
    assert PASSWORD not in kept
    assert not matches("nonsense", PASSWORD)


@pytest.mark.parametrize("password", ["", "eleven char", "x" * 201])
def test_short_and_long_passwords(password: str) -> None:
    with pytest.raises(BadInput, match="12 to 200 letters"):
        hashed(password)


@pytest.mark.parametrize("name", ["", "a b", "../x", "x" * 61, "é", "10.0.0.1", "local", "Local", "a\n", "<b>"])
def test_names_of_accounts(name: str, people: People) -> None:
    with pytest.raises(BadInput, match="cannot name an account"):
        people.accounts.add(name, Role.viewer)


def test_nobody_takes_another_s_name_in_other_letters(people: People) -> None:
    people.accounts.add("alice", Role.viewer)
    with pytest.raises(Conflict, match="already"):
        people.accounts.add("Alice", Role.admin)


@pytest.mark.parametrize("way", ["reset", "role", "disable", "password", "all", "one"])
def test_what_ends_an_account_s_sessions_ends_them_at_once_and_no_others(way: str, people: People, tmp_path: Path) -> None:
    session, others = _account(people, "alice"), _account(people, "bob")
    elsewhere = People(Tokens(tmp_path))  # such as the command line
    assert _user(people.of_session(session)) == ("alice", "planner")
    if way == "reset":
        password = elsewhere.accounts.reset("alice")
        assert elsewhere.accounts.check("alice", password).temporary
    elif way == "role":
        elsewhere.accounts.set_role("alice", Role.viewer)
    elif way == "disable":
        elsewhere.accounts.set_disabled("alice", True)
    elif way == "password":
        elsewhere.accounts.change_password("alice", PASSWORD, PASSWORD + "!")
    elif way == "all":
        elsewhere.sessions.end_all("alice")
    else:
        elsewhere.sessions.end(session)
    elsewhere.close()
    assert people.of_session(session) is None
    assert _user(people.of_session(others)) == ("bob", "planner")


def test_a_disabled_account_comes_in_by_nothing_and_back_with_what_it_had(people: People) -> None:
    session = _account(people, "alice")
    principal = people.of_session(session)
    assert principal is not None
    _, token = people.new_token(principal, "laptop")
    people.accounts.set_disabled("alice", True)
    assert people.of_session(session) is people.of_token(token) is None
    with pytest.raises(NotAuthenticated):
        people.accounts.check("alice", PASSWORD)
    people.accounts.set_disabled("alice", False)
    assert people.of_session(session) is None
    assert _user(people.of_token(token)) == ("alice", "planner")


def test_tokens_have_the_role_of_their_account_at_most(people: People) -> None:
    session = _account(people, "alice", Role.pilot)
    principal = people.of_session(session)
    assert principal is not None
    name, token = people.new_token(principal, "lab")
    assert name == "alice.lab"
    weak = people.tokens.new("alice.ci", role="viewer", account="alice")
    earlier = people.tokens.new("robot")
    admins = people.tokens.new("admins", role="admin")
    assert [_user(people.of_token(each)) for each in (token, weak, earlier, admins)] == [
        ("alice", "pilot"), ("alice", "viewer"), ("robot", "pilot"), ("admins", "admin"),
    ]  # fmt: skip
    people.accounts.set_role("alice", Role.viewer)
    assert _user(people.of_token(token)) == ("alice", "viewer")
    by_token = people.of_token(token)
    assert by_token is not None
    with pytest.raises(Forbidden, match="log in in a browser"):
        people.new_token(by_token, "more")
    assert people.tokens_of("alice") == ("alice.lab", "alice.ci")
    assert people.of_token(people.tokens.new("orphan", account="gone")) is None


def test_an_account_named_after_a_token_takes_over_who_had_it(people: People) -> None:
    token = people.tokens.new("carol")
    people.accounts.add("carol", Role.viewer)
    assert _user(people.of_token(token)) == ("carol", "viewer")


def test_there_is_always_an_admin(people: People) -> None:
    people.accounts.add("root", Role.admin)
    for change in (lambda: people.accounts.set_role("root", Role.viewer), lambda: people.accounts.set_disabled("root", True)):
        with pytest.raises(Conflict, match="the last admin"):
            change()
    people.accounts.add("other", Role.admin)
    people.accounts.set_disabled("root", True)
    with pytest.raises(Conflict, match="the last admin"):
        people.accounts.set_role("other", Role.pilot)


def test_by_openid_issuer_and_subject_identify_and_no_name_leads_to_another_s(people: People) -> None:
    people.tokens.new("alice")
    people.accounts.add("bob", Role.planner)
    people.references.add("job-1", "carol", "")
    for taken in ("alice", "Bob", "carol", "local", "10.0.0.1"):
        assert people.free_name(taken) == f"{taken}-2"
    assert people.free_name("<é>") == "person"
    account = people.accounts.add_by_openid("dora", Role.viewer, "https://id.lab", "17")
    assert people.accounts.by_openid("https://id.lab", "17") == account
    assert people.accounts.by_openid("https://id.lab", "18") is people.accounts.by_openid("https://other", "17") is None
    with pytest.raises(Conflict, match=r"https://id\.lab"):
        people.accounts.reset("dora")
    with pytest.raises(NotAuthenticated):
        people.accounts.check("dora", "")


def test_administration_is_for_admins_and_stands_in_the_log(people: People) -> None:
    _account(people, "root", Role.admin)
    root = Administration(people, Principal("root", Role.admin))
    made = root.add_account("eve", "viewer")
    eve = Administration(people, Principal("eve", Role.viewer))
    for forbidden in (eve.accounts, eve.log, lambda: eve.add_account("x", "admin"), lambda: eve.set_role("eve", "admin"),
                      lambda: eve.reset_password("root"), lambda: eve.end_sessions("root"), lambda: eve.set_disabled("root", True),
                      lambda: eve.account("root"), lambda: eve.share("mine", True)):  # fmt: skip
        with pytest.raises(Forbidden):
            forbidden()
    with pytest.raises(NotFound):
        eve.revoke_token("root.x")
    with pytest.raises(NotFound, match="Did you mean 'eve'"):
        root.set_role("evee", "pilot")
    root.set_role("eve", "pilot")
    assert root.set_disabled("eve", True).disabled is not None
    assert [each.name for each in root.accounts()] == ["eve", "root"]
    assert [(each.user, each.action, each.object, each.detail) for each in root.log()] == [
        ("root", "disable account", "eve", ""), ("root", "set role", "eve", "pilot"), ("root", "add account", "eve", "viewer"),
    ]  # fmt: skip
    assert made.secret not in str(root.log())
    assert len(root.log(LogQuery(action="set role"))) == len(root.log(LogQuery(limit=1))) == 1
    assert len(root.log(LogQuery(before=root.log()[0].number))) == 2
    with pytest.raises(Forbidden, match="ltlplan accounts add NAME --role admin"):
        Administration(people, people.local("127.0.0.1")).add_account("x", "admin")
