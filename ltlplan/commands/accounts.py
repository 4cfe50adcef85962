"""`ltlplan accounts`: accounts of people on a service's data folder, and its log of who did what."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ltlplan.commands.support.options import DataOption, JsonOption

if TYPE_CHECKING:
    from ltlplan.service.people.people import People


class What(StrEnum):
    """Things that the command does."""

    list = "list"
    add = "add"
    reset = "reset"
    role = "role"
    disable = "disable"
    enable = "enable"
    log = "log"


_ONCE = "note: this password is temporary and shown once; at the first login its owner chooses another."


def command(
    what: Annotated[What, typer.Argument(help="What to do.", show_default=False)] = What.list,
    name: Annotated[str | None, typer.Argument(help="The account's name.", show_default=False)] = None,
    role: Annotated[
        str | None,
        typer.Option("--role", help="viewer, planner, pilot (may tell live flights) or admin; of a new account, planner."),
    ] = None,
    limit: Annotated[int, typer.Option("--limit", min=1, help="Entries of the log.")] = 50,
    data: DataOption = None,
    json: JsonOption = False,
) -> None:
    """List accounts of the service, make one, reset its password, give it a role, disable it; or print who did what. It counts at once."""
    from ltlplan.service.people.people import People
    from ltlplan.service.security.tokens import Tokens
    from ltlplan.service.storage.data_folder import default_data, make_private

    folder = (data or default_data()).absolute()
    make_private(folder)
    people = People(Tokens(folder))
    try:
        done = (
            _log(people, limit)
            if what is What.log
            else _list(people)
            if what is What.list
            else _change(people, what, name, role)
        )
    finally:
        people.close()
    _show(done, as_json=json)


def _change(people: People, what: What, name: str | None, role: str | None) -> dict[str, Any]:  # as JSON
    from ltlplan.service.people.roles import Role, role_of
    from verify.data.errors import BadInput

    if name is None:
        raise BadInput(f"`ltlplan accounts {what}` needs the account's name.")
    if what is What.role and role is None:
        raise BadInput("Which role? --role viewer, planner, pilot or admin.")
    accounts, made = people.accounts, Role.planner if role is None else role_of(role)
    password: str | None = None
    if what is What.add:
        password = accounts.add(name, made)
    elif what is What.reset:
        password = accounts.reset(name)
    elif what is What.role:
        accounts.set_role(name, made)
    else:
        accounts.set_disabled(name, what is What.disable)
    account = accounts.get(name)
    words = {What.add: "add account", What.reset: "reset password", What.role: "set role", What.disable: "disable account"}
    people.log.write(
        None, words.get(what, "enable account"), account.name, account.role.name if what in (What.add, What.role) else ""
    )
    told = {"name": account.name, "role": account.role.name, "disabled": account.disabled is not None}
    return told if password is None else {**told, "password": password}


def _list(people: People) -> list[dict[str, Any]]:  # as JSON
    counts = people.sessions.counts()
    return [
        {
            "name": each.name, "role": each.role.name, "disabled": each.disabled is not None, "logged_in": counts.get(each.name, 0),
            "by": each.issuer or "password",
        }
        for each in people.accounts.all()
    ]  # fmt: skip


def _log(people: People, limit: int) -> list[dict[str, Any]]:  # as JSON
    from ltlplan.service.people.audit_log import LogQuery

    return [entry.model_dump() for entry in people.log.entries(LogQuery(limit=limit))]


def _show(done: dict[str, Any] | list[dict[str, Any]], *, as_json: bool) -> None:
    from ltlplan.commands.support.terminal import print_json

    if as_json:
        print_json(done)
        return
    if isinstance(done, dict):
        if "password" in done:
            typer.echo(done["password"])
            typer.echo(_ONCE, err=True)
        else:
            typer.echo(_line(done))
        return
    for each in done:
        typer.echo(_line(each))
    if not done:
        typer.echo("None. `ltlplan accounts add NAME --role admin` makes the first account; then everybody logs in.")


def _line(told: dict[str, Any]) -> str:
    if "action" in told:
        who = f"{told['user']} ({told['role']})" if told["role"] else told["user"]
        return " ".join(filter(None, (told["time"][:19], who, told["action"], told["object"], told["detail"])))
    by = "" if told.get("by", "password") == "password" else f", by {told['by']}"
    logged_in = f", {told['logged_in']} logged in" if told.get("logged_in") else ""
    return f"{told['name']}: {told['role']}{', disabled' if told['disabled'] else ''}{by}{logged_in}"
