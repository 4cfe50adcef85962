"""`ltlplan restore`: a service's data from a backup, into a new folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import DatabaseFileOption, DatabaseOption, JsonOption


def command(
    backup: Annotated[Path, typer.Argument(help="File that `ltlplan backup` wrote.", show_default=False)],
    data: Annotated[Path, typer.Option("--data", help="Folder to restore into: a new one, or an empty one.")],
    db: DatabaseOption = None,
    db_file: DatabaseFileOption = None,
    json: JsonOption = False,
) -> None:
    """Restore a service's data. All sessions have ended, and tokens are made anew; look whether accounts were disabled since."""
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.service.storage.backups import restore
    from ltlplan.service.storage.database_url import database_url

    database, notes = database_url(db, db_file, os.environ)
    for note in notes:
        typer.echo(f"note: {note}", err=True)
    made = restore(backup.absolute(), data.absolute(), database)
    if json:
        print_json({"jobs": made.jobs, "values": made.values, "recordings": made.recordings, "bytes": made.bytes})
        return
    typer.echo(f"{made.jobs} jobs and {made.values} values are in {data}; serve them: ltlplan serve --data {data}")
