"""`ltlplan audit`: judge, for all times, flights that other programs planned."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from ltlplan.commands.support.options import FormulaOption, JsonOption, missions_like, read_mission

if TYPE_CHECKING:
    from verify import Audit

AUDIT_FILE = "audit.json"
"""The audit's name beside its proof."""

SHOWN = 10
"""Broken claims of each kind that are printed; a file or --json has all."""


# as many parameters as there are limits, each by its own option
def command(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="A Skybrush show (.skyc), or a folder of ROBOT.csv files as crazyswarm2 has them, or such files.",
            show_default=False,
        ),
    ],
    mission: Annotated[
        str | None,
        typer.Option(
            "--mission", help="A mission file or a shipped mission, whose agents the drones are.", autocompletion=missions_like
        ),
    ] = None,
    formula: FormulaOption = None,
    vehicle: Annotated[
        str | None, typer.Option("--vehicle", help="A shipped vehicle: its speed, acceleration and twice its radius.")
    ] = None,
    workspace: Annotated[
        str | None,
        typer.Option("--workspace", help="Box in which all stay: x,y,z of the lower corner, then of the upper one, in m."),
    ] = None,
    separation: Annotated[float | None, typer.Option("--separation", help="Least distance between centres, m.")] = None,
    separation_above: Annotated[
        float | None,
        typer.Option("--separation-above", help="Require it only while both drones are above this z, m (default: everywhere)."),
    ] = None,
    speed: Annotated[float | None, typer.Option("--speed", help="Greatest speed, m/s.")] = None,
    acceleration: Annotated[float | None, typer.Option("--acceleration", help="Greatest acceleration, m/s^2.")] = None,
    yaw_rate: Annotated[
        float | None,
        typer.Option("--yaw-rate", help="Greatest rate of turning, deg/s, of drones whose file says how they turn."),
    ] = None,
    min_height: Annotated[float | None, typer.Option("--min-height", help="Least z, m, take-off and landing included.")] = None,
    margin: Annotated[
        float | None, typer.Option("--margin", help="How far drones may be from their paths, m (default: the mission's, or 0).")
    ] = None,
    columns: Annotated[
        bool, typer.Option(help="Check take-off and landing that a show leaves to the autopilot; not of a show's excerpts.")
    ] = True,
    file_limits: Annotated[
        bool,
        typer.Option(
            help="Require the limits in a show's file (its validation settings, its geofence) where nothing else gives them."
        ),
    ] = True,
    out: Annotated[
        Path | None, typer.Option("--out", help="A file for the whole audit, as JSON; one that is there is kept.")
    ] = None,
    proof: Annotated[
        Path | None,
        typer.Option(
            "--proof",
            help="A folder for the audit with its proof, which the kernel checks: python check.pyz FOLDER.",
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", help="A page (.html) with the claims and pictures of the tightest instants.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Judge flights of other programs for all times, not for samples; exit code 5 where a claim is not proved."""
    from flight.storage.folders import check_folder, put_files, write_folder
    from flight.storage.single_files import check_page, replace_page, write_single
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from verify import AuditLimits, audit
    from verify.data import BadInput, NotCertified

    limits = AuditLimits(
        vehicle=vehicle, workspace=None if workspace is None else workspace.split(","), separation=separation,
        separation_above=separation_above, speed=speed, acceleration=acceleration, yaw_rate=yaw_rate, min_height=min_height, margin=margin,
        columns=columns, file_limits=file_limits,
    )  # fmt: skip
    if report is not None:
        check_page(report)
    if proof is not None:
        check_folder(proof)
    if formula is not None and mission is None:
        raise BadInput("--formula speaks of a mission's regions; give --mission as well.")
    asked = None if mission is None else read_mission(mission, formula=formula)
    with progress_bar(quiet=json) as progress:
        found = audit(files, asked, limits, proof=proof is not None, progress=progress)
    if out is not None:
        write_single(out, found.to_json().encode())
    if proof is not None and found.files:
        whole = {**found.files, AUDIT_FILE: found.to_json().encode()}
        write_folder(proof, lambda folder: put_files(whole, folder))
    if report is not None:
        from ltlplan.report.audit_report.audit_page import audit_html

        replace_page(report, audit_html(found))
    if json:
        print_json(found.to_dict())
    else:
        for line in audit_lines(found):
            typer.echo(line)
        for written in (out, proof if found.files else None, report):
            if written is not None:
                typer.echo(f"wrote {written}")
    if not found:
        raise typer.Exit(NotCertified.exit_code)


def audit_lines(found: Audit) -> list[str]:
    """Return what is said of an audit: each claim that holds, the worst of those that do not, and where limits are nearest."""
    from verify.checked_claims import proof_sentences

    lines = [f"{found.source}: {found.drones} drones, {found.pieces} pieces, {found.duration:.3f} s"]
    lines += _own_limits(found)
    shown: dict[str, int] = {}
    for claim in found.claims:
        shown[claim.name] = shown.get(claim.name, 0) + 1
        if shown[claim.name] <= SHOWN:
            word = f", {claim.proof}" if claim.outcome == "holds" else ""
            lines.append(f"{claim.name}: {claim.outcome}{word}. {claim.sentence}")
    lines += [
        f"{name}: {count - SHOWN} more like these; --out FILE or --json has all."
        for name, count in shown.items()
        if count > SHOWN
    ]
    lines += [f"note: {note}" for note in found.notes]
    for name, instants in found.tightest.items():
        rows = "; ".join(
            f"{i.robot}{'' if i.other is None else ' and ' + i.other} {_figure(i.value)} at {i.time:.3f} s" for i in instants
        )
        lines.append(f"nearest to the limit of {name}: {rows}")
    if found.holds:
        lines.append(f"every claim holds, for all times from 0 to {found.duration:.3f} s")
    else:
        lines.append(f"{len(found.broken)} of {len(found.claims)} claims are not proved")
    return [*lines, *proof_sentences(found.claims, found.kernel)]


def _own_limits(found: Audit) -> list[str]:
    """Return a line on what is asked because the files ask it themselves; none where nothing is."""
    sources: Mapping[str, str] = found.asked["from"]  # pyright: ignore[reportAssignmentType]  # plain data
    own = {name: source for name, source in sources.items() if source not in ("given", "mission", "vehicle")}
    asked = "; ".join(f"{name} {_said(found.asked[name])} ({source})" for name, source in own.items())
    return [f"asked by the file itself: {asked}"] if own else []


def _said(value: object) -> str:
    if isinstance(value, list):
        return f"of {len(cast('list[object]', value))} polygons"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _figure(value: float) -> str:
    """Return a bound for a person; what only keeps a bound above zero is none."""
    return f"{value:.5g}" if abs(value) > 1e-12 else "0"
