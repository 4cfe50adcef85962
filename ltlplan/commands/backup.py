"""`ltlplan backup`: a service's data in one file, while it runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import DatabaseFileOption, DatabaseOption, DataOption, JsonOption


def command(
    out: Annotated[Path, typer.Argument(help="File to write, such as lab.tar.", show_default=False)],
    data: DataOption = None,
    db: DatabaseOption = None,
    db_file: DatabaseFileOption = None,
    json: JsonOption = False,
) -> None:
    """Back up a service's jobs, accounts, log, drafts and events, while it runs. Tokens and sessions are not in it."""
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.service.people.people import People
    from ltlplan.service.security.tokens import Tokens
    from ltlplan.service.storage.backups import back_up
    from ltlplan.service.storage.data_folder import default_data
    from ltlplan.service.storage.database_url import database_url

    folder = (data or default_data()).absolute()
    database, notes = database_url(db, db_file, os.environ)
    for note in notes:
        typer.echo(f"note: {note}", err=True)
    made = back_up(folder, out.absolute(), database)
    people = People(Tokens(folder))
    people.log.write(None, "back up", "", out.name)
    people.close()
    if json:
        counts = {"jobs": made.jobs, "values": made.values, "recordings": made.recordings, "bytes": made.bytes}
        print_json({**counts, "damaged": list(made.damaged)})
        return
    typer.echo(f"{made.jobs} jobs, {made.values} values, {made.bytes / 1e6:.1f} MB in {out}.")
    if made.damaged:
        typer.echo(f"note: {len(made.damaged)} values were damaged already and are not in it.", err=True)
