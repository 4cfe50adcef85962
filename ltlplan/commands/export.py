"""`ltlplan export`: write a certified folder's flight for a vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.options import FolderArgument, JsonOption


def command(
    folder: FolderArgument,
    format: Annotated[  # noqa: A002  # the name that users type
        str, typer.Option("--format", help="crazyswarm2, crazyflie, crazyflie-compressed, px4 or ros2.")
    ] = "crazyswarm2",
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write (default: a folder of the format's name inside).")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", help="Airframe that will fly, to be held against the certificate's.")
    ] = None,
    rate: Annotated[float | None, typer.Option("--rate", min=1.0, help="px4, ros2: setpoints a second.")] = None,
    json: JsonOption = False,
) -> None:
    """Write the certified flight in a folder for a real vehicle, after proving its certificate again."""
    import flight
    from ltlplan.commands.terminal import print_json
    from verify import recheck
    from verify.recheck import read_folder

    certificate = recheck(folder)
    _plan, team = read_folder(folder)
    options = {} if rate is None else {"rate": rate}
    done = flight.export(team, certificate, out or folder / format, format=format, vehicle=vehicle, **options)
    if json:
        print_json(
            {
                "format": done.format,
                "certificate": done.digest,
                "files": [str(p) for p in done.files],
                "notes": list(done.notes),
            }
        )
        return
    for path in done.files:
        typer.echo(f"wrote {path}")
    for note in done.notes:
        typer.echo(f"note: {note}")
