"""`ltlplan serve`: the planning service, on this machine or a lab's network."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import DatabaseFileOption, DatabaseOption, JsonOption
from ltlplan.service.settings import LOOPBACK, PORT


# a parameter for each of the command's options
def command(
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; others than this machine's own need tokens.")
    ] = LOOPBACK,
    port: Annotated[int, typer.Option("--port", min=0, max=65535, help="Port to listen on; 0 takes a free one.")] = PORT,
    name: Annotated[
        list[str] | None, typer.Option("--name", help="Name of a proxy in front of it; may be given several times.")
    ] = None,
    data: Annotated[Path | None, typer.Option("--data", help="Folder of all data (default: your data folder).")] = None,
    db: DatabaseOption = None,
    db_file: DatabaseFileOption = None,
    dask: Annotated[str | None, typer.Option("--dask", help="Dask scheduler that computes, such as tcp://head:8786.")] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Stages computed at the same time (default: one a processor).")
    ] = None,
    webhook_host: Annotated[
        list[str] | None,
        typer.Option(
            "--webhook-host",
            help="Host (or HOST:PORT) that webhooks may go to, or a network such as 10.1.0.0/16; several times.",
        ),
    ] = None,
    limits: Annotated[
        Path | None,
        typer.Option("--limits", help="YAML file of limits that are other than usual (docs/service.md lists them)."),
    ] = None,
    page: Annotated[bool, typer.Option("--page/--no-page", help="Whether the page is served besides the API.")] = True,
    openid: Annotated[
        str | None, typer.Option("--openid", help="Address of an OpenID Connect provider by which people log in (its issuer).")
    ] = None,
    openid_client: Annotated[str, typer.Option("--openid-client", help="What it calls this service (client id).")] = "ltlplan",
    openid_secret_file: Annotated[
        Path | None, typer.Option("--openid-secret-file", help="File of the client's secret (default: $LTLPLAN_OPENID_SECRET).")
    ] = None,
    openid_role: Annotated[str, typer.Option("--openid-role", help="Role of those who come for the first time.")] = "viewer",
    new_token: Annotated[
        str | None, typer.Option("--new-token", help="Make a token of this name, print it once, and end.")
    ] = None,
    role: Annotated[str | None, typer.Option("--role", help="Role of the new token (default: pilot).")] = None,
    revoke_token: Annotated[
        str | None, typer.Option("--revoke-token", help="Take the token of this name away, and end.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Serve the HTTP API and the page. Jobs that were accepted go on after a restart."""
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.service.limits_file import read_limits
    from ltlplan.service.people.roles import role_of
    from ltlplan.service.security.tokens import Tokens
    from ltlplan.service.server import serve
    from ltlplan.service.settings import Limits, OpenIdSettings, Settings
    from ltlplan.service.storage.data_folder import default_data, make_private
    from ltlplan.service.storage.database_url import database_url, secret_of

    folder = (data or default_data()).absolute()
    if new_token is not None or revoke_token is not None:
        make_private(folder)
        tokens = Tokens(folder)
        if revoke_token is not None:
            tokens.revoke(revoke_token)
        made = None if new_token is None else tokens.new(new_token, role="" if role is None else role_of(role).name)
        if json:
            print_json({"token": made, "names": list(tokens.names())})
        elif made is not None:
            typer.echo(made)
            typer.echo(
                "note: this is shown once. Who asks sends it as `Authorization: Bearer TOKEN`, or logs in with it.", err=True
            )
        return
    database, notes = database_url(db, db_file, os.environ)
    for note in notes:
        typer.echo(f"note: {note}", err=True)
    provider = None
    if openid is not None:
        secret = secret_of("LTLPLAN_OPENID_SECRET", openid_secret_file, os.environ)
        provider = OpenIdSettings(openid, openid_client, secret, role_of(openid_role))
    settings = Settings(
        data=folder, host=host, port=port, names=tuple(name or ()), database=database, dask=dask, workers=workers, openid=provider,
        webhook_hosts=tuple(webhook_host or ()), limits=Limits() if limits is None else read_limits(limits),
    )  # fmt: skip
    serve(settings, page=page, announce=(lambda said: print_json({"said": said})) if json else _say)


def _say(sentence: str) -> None:
    typer.echo(sentence)
    import sys

    sys.stdout.flush()
