"""`ltlplan export`: write a certified folder's flight for a vehicle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flight.exports.target import EXPORT_TARGETS
from ltlplan.commands.support.choices import choices
from ltlplan.commands.support.options import FolderArgument, JsonOption

if TYPE_CHECKING:
    TargetName = str
else:
    TargetName = choices("TargetName", EXPORT_TARGETS.names())

CRAZYSWARM2 = TargetName("crazyswarm2")


# a parameter for each of the command's options
def command(
    folder: FolderArgument,
    format: Annotated[  # noqa: A002  # the name that users type
        TargetName, typer.Option("--format", help="Target that the flight is written for.")
    ] = CRAZYSWARM2,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder to write (default: a folder of the format's name inside).")
    ] = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", help="Airframe that will fly, to be compared with the certificate's.")
    ] = None,
    robots: Annotated[
        str | None, typer.Option("--robots", help="Robots to write, such as quad0,quad1, where others fly from another export.")
    ] = None,
    rate: Annotated[float | None, typer.Option("--rate", min=1.0, help="px4, ros2: setpoints a second.")] = None,
    inventory: Annotated[
        Path | None,
        typer.Option(
            "--inventory",
            help="crazyswarm2, px4: YAML of your robots' addresses, weights and MAVLink systems (robots: NAME: uri, mass, id); only read.",
        ),
    ] = None,
    upload: Annotated[
        list[str] | None, typer.Option("--upload", help="crazyflie formats: ROBOT=URI, once a robot; send after writing.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="With --upload: write the exact bytes, send nothing.")] = False,
    force: Annotated[
        bool,
        typer.Option("--force", help="Write without a simulated flight that stayed in its tube, with a warning in the files."),
    ] = False,
    part: Annotated[int, typer.Option("--part", min=1, help="With --upload: which part of a flight in parts.")] = 1,
    json: JsonOption = False,
) -> None:
    """Write the certified flight in a folder for a real vehicle, after proving its certificate again and flying it in simulation.

    The controllers of the vehicles' profiles fly it, in wind and noise; it must stay in its tube (exit code 5). Vehicles of the format must run
    these controllers, on as many set-points a second as were simulated.

    The compressed format rounds to whole millimetres: its path is fitted to that grid, certified as it is then, and
    written with a certificate of its own. So are flights of one piece for crazyswarm2, whose loader needs a second.
    """
    from flight.storage.folders import check_folder, put_files, write_folder
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.output import make_export
    from verify.data import BadInput

    if dry_run and not upload:
        raise BadInput("--dry-run goes with --upload ROBOT=URI.")
    addresses = _addresses(upload or [])
    target = EXPORT_TARGETS.find(format)
    if addresses and target.send is None:
        able = ", ".join(name for name in EXPORT_TARGETS.built_in if EXPORT_TARGETS.find(name).send is not None)
        raise BadInput(f"--upload sends to Crazyflies; take --format {able}, not {format}.")
    place = check_folder(out or folder / target.name)
    with progress_bar(quiet=json) as progress:
        given = {"rate": rate, "inventory": inventory}
        options = {name: value for name, value in given.items() if value is not None}
        names = None if robots is None else [name.strip() for name in robots.split(",")]
        made = make_export(
            folder, target, vehicle=vehicle, robots=names, options=options, force=force, progress=progress,
            named=lambda files: check_folder(place, files),
        )  # fmt: skip
        written = write_folder(place, lambda fresh: put_files(made.files, fresh))
    sent = (
        target.send(place, addresses, dry_run=dry_run, **({} if part == 1 else {"part": part}))
        if addresses and target.send is not None
        else ()
    )
    words = [f"{'would send' if dry_run else 'sent'} {len(item.data)} bytes to {item.robot} at {item.uri}" for item in sent]
    if json:
        files = [str(path) for path in written]
        print_json(
            {
                "format": target.name,
                "certificate": made.digest,
                "files": files,
                "notes": list(made.notes),
                "sent": words,
            }
        )
        return
    for path in written:
        typer.echo(f"wrote {path}")
    for line in (*(f"note: {note}" for note in made.notes), *words):
        typer.echo(line)


def _addresses(texts: list[str]) -> dict[str, str]:
    from verify.data import BadInput

    addresses: dict[str, str] = {}
    for text in texts:
        robot, separator, uri = text.partition("=")
        if not separator or not robot or not uri:
            raise BadInput(f"'{text}' is no address: write ROBOT=URI, such as quad0=radio://0/80/2M/E7E7E7E701.")
        addresses[robot] = uri
    return addresses
