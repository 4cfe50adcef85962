"""`ltlplan certify`: prove the trajectories of a folder, or judge a recorded flight."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.options import FolderArgument, JsonOption, MarginOption


def command(
    folder: FolderArgument,
    margin: MarginOption = None,
    clock_error: Annotated[float, typer.Option("--clock-error", min=0.0, help="Between robots' clocks, in s.")] = 0.0,
    flight: Annotated[
        Path | None, typer.Option("--flight", help="A recorded flight (CSV) to judge instead of trajectories.")
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option("--max-speed", min=0.0, help="With --flight: bound on the speed, m/s.")
    ] = None,
    error: Annotated[float, typer.Option("--error", min=0.0, help="With --flight: bound on the position error, m.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Prove that the trajectories in a folder satisfy its mission and plan, and write certificate.json there."""
    import json as json_text

    from verify.recheck import read_folder

    from ltlplan.commands.summary import claim_lines
    from ltlplan.commands.terminal import print_json
    from ltlplan.output import replace_file
    from verify import certify

    if flight is not None:
        _judge_recording(folder, flight, max_speed, error, json)
        return
    plan, team = read_folder(folder)
    certificate = certify(plan, team, margin=margin, clock_error=clock_error)
    replace_file(folder / "certificate.json", certificate.to_json())
    if json:
        print_json(json_text.loads(certificate.to_json()))
        return
    for line in claim_lines(certificate):
        typer.echo(line)
    typer.echo(f"certified at margin {certificate.margin:g} m; wrote {folder / 'certificate.json'}")
