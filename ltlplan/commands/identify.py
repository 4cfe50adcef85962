"""`ltlplan identify`: mass, thrust, drag and latency of a vehicle from a recorded hover and a line."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support.options import JsonOption


# a parameter for each of the command's options
def command(
    log: Annotated[
        Path,
        typer.Argument(
            help="CSV with t, x, y, z, roll, pitch, yaw, thrust (s, m, rad, commanded N), and ex, ey, ez for the latency.",
            show_default=False,
        ),
    ],
    vehicle: Annotated[str, typer.Option("--vehicle", help="Shipped vehicle that flew, or a profile's file (.yaml).")],
    mass: Annotated[
        float | None, typer.Option("--mass", help="kg from scales, within 0.5 % (default: the profile's, within 2 %).")
    ] = None,
    robot: Annotated[str | None, typer.Option("--robot", help="Whose rows, where the log has several robots'.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="File to write the profile to, such as mine.yaml.")] = None,
    json: JsonOption = False,
) -> None:
    """Identify a vehicle from a recorded hover and a line, there and back: thrust, drag and latency with intervals at 95 %.

    A log that cannot tell is rejected, with what to fly instead. The profile goes into a mission as its `vehicle`; `ltlplan rehearse --profile`
    flies the corners of its intervals.
    """
    from flight.identification.identify import identify
    from flight.identification.profile import profile_text, read_profile
    from flight.identification.recorded import read_recorded
    from ltlplan.commands.support.terminal import print_json
    from verify.data import load_vehicle

    flown = read_profile(vehicle) if vehicle.endswith((".yaml", ".yml")) else load_vehicle(vehicle)
    found = identify(read_recorded(log, robot), flown, mass=mass)
    if out is not None:
        _write(out, profile_text(found.profile, (f"Identified from {log.name}.", *found.sentences)))
    if json:
        numbers = {name: asdict(each) for name in ("mass", "thrust", "drag") for each in (getattr(found, name),)}
        late = None if found.latency is None else asdict(found.latency)
        about = {"vehicle": flown.name, **numbers, "latency": late, "residual": list(found.residual), "lasts": found.lasts}
        print_json({**about, "files": [] if out is None else [str(out)]})
        return
    for sentence in found.sentences:
        typer.echo(sentence)
    if out is not None:
        typer.echo(f"wrote {out}")


def _write(path: Path, text: str) -> None:
    """Write a new file."""
    from verify.data import BadInput

    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise BadInput(f"{path} is there already; name another file with --out.") from None
    except OSError as error:
        raise BadInput(f"{path} cannot be written: {error.strerror or error}.") from None
