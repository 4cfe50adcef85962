"""`ltlplan backup`: a service's data in one file, while it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import DataOption, JsonOption


def command(
    out: Annotated[Path, typer.Argument(help="File to write, such as lab.tar.", show_default=False)],
    data: DataOption = None,
    json: JsonOption = False,
) -> None:
    """Back up a service's jobs, accounts, log, drafts and events, while it runs. Tokens and sessions are not in it."""
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.service.people.people import People
    from ltlplan.service.security.tokens import Tokens
    from ltlplan.service.storage.backups import back_up
    from ltlplan.service.storage.data_folder import default_data

    folder = (data or default_data()).absolute()
    made = back_up(folder, out.absolute())
    people = People(Tokens(folder))
    people.log.write(None, "back up", "", out.name)
    people.close()
    if json:
        print_json({"jobs": made.jobs, "values": made.values, "bytes": made.bytes, "damaged": list(made.damaged)})
        return
    typer.echo(f"{made.jobs} jobs, {made.values} values, {made.bytes / 1e6:.1f} MB in {out}.")
    if made.damaged:
        typer.echo(f"note: {len(made.damaged)} values were damaged already and are not in it.", err=True)
