"""`ltlplan submit`: hand a mission to a service, and wait for it where asked; exit codes are those of `run`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ltlplan.commands.support import options

if TYPE_CHECKING:
    from ltlplan.service.client_parts.job_handle import Submitted

ADDRESS = "LTLPLAN_SERVICE"
"""Environment variable that names the service."""


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    service: Annotated[
        str | None,
        typer.Option("--service", help="Address of the service (default: $LTLPLAN_SERVICE, or http://127.0.0.1:8000)."),
    ] = None,
    project: Annotated[str | None, typer.Option("--project", help="Project to put the job into.")] = None,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until it has ended, and end as `ltlplan run` would.")] = False,
    out: Annotated[Path | None, typer.Option("--out", help="With --wait: folder to write, proved again here.")] = None,
    seed: options.SeedOption = None,
    pace: options.PaceOption = None,
    json: options.JsonOption = False,
) -> None:
    """Submit a mission to a service; the token is in $LTLPLAN_TOKEN. What was accepted is finished, whether or not this waits."""
    from ltlplan import Client
    from ltlplan.commands.support.followed import TOKEN
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.planner import pace_of
    from verify.data.errors import BadInput

    if out is not None and not wait:
        raise BadInput("--out needs --wait: the folder is written when the job has ended.")
    asked = options.read_mission(mission)
    address = service or os.environ.get(ADDRESS) or "http://127.0.0.1:8000"
    with Client(address, token=os.environ.get(TOKEN)) as client:
        job = client.submit(asked, seed=seed, pace=pace_of(pace), project=project)
        told = {"job": job.id, "page": f"{client.url}/jobs/{job.id}", "found": job.job.found}
        if not wait:
            if json:
                print_json(told)
            else:
                typer.echo(f"{job.id} {'was planned before' if told['found'] else 'is accepted'}: {told['page']}")
            return
        _wait(job, told, out, as_json=json)


def _wait(job: Submitted, told: dict[str, Any], out: Path | None, *, as_json: bool) -> None:
    """Wait for a job, and say what it made."""
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.report.brief import brief_lines
    from verify.data import NotCertified

    lines: list[str] | None = None
    with progress_bar(quiet=as_json) as progress:
        if out is None:
            job.wait(progress=progress)
        else:
            lines = brief_lines(job.result(out, progress=progress))
    summary = job.refreshed().job.summary or {}
    if as_json:
        print_json({**told, **summary})
    else:
        for line in lines or _short(summary):
            typer.echo(line)
        typer.echo(f"page    {told['page']}")
    if not summary.get("holds"):
        if as_json:  # the document says so already
            raise typer.Exit(NotCertified.exit_code)
        raise NotCertified("The simulated flight is not the certified one; the page says where it strayed.")


def _short(summary: dict[str, Any]) -> list[str]:
    claims = summary.get("claims", [])
    checked = sum(claim.get("proof") == "checked" for claim in claims)
    proved = (
        f"proved  {len(claims)} claims at a margin of {1000 * summary['margin']:g} mm, {checked} checked by the kernel"
        if claims
        else ""
    )
    return [
        f"asked   {summary.get('mission')}",
        f"found   cost {summary.get('cost', 0.0):.3f}, {summary.get('duration', 0.0):.2f} s",
        proved,
    ]
