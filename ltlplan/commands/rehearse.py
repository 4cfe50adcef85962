"""`ltlplan rehearse`: the same flight by several controllers, with masses, latencies and winds that may be."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from ltlplan.commands.support import flight_options, options
from ltlplan.commands.support.simulation import Outcome, certified, simulating, written
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight import Rehearsal
    from flight.model.airframe import Drag


# a parameter for each of the command's options
def command(
    source: flight_options.TeamArgument,
    runs: Annotated[int, typer.Option("--runs", min=1, help="Flights of each combination.")] = 20,
    controller: Annotated[
        list[str] | None, typer.Option("--controller", help="Controller; may be given several times.")
    ] = None,
    mass: Annotated[
        list[float] | None, typer.Option("--mass", help="Share of the profile's mass that is flown; several times.")
    ] = None,
    latency: Annotated[
        list[float] | None, typer.Option("--latency", help="s from a frame of motion capture to its use; several times.")
    ] = None,
    wind: Annotated[list[str] | None, typer.Option("--wind", help="m/s, as for `fly`; several times.")] = None,
    drag: Annotated[
        list[str] | None,
        typer.Option("--drag", help="Of vehicles whose drag is a guess: profile, least, most (default: all); several times."),
    ] = None,
    corners: Annotated[
        bool, typer.Option("--corners/--no-corners", help="Fly the corners of mass, thrust, drag, latency and noise as well.")
    ] = True,
    profile: Annotated[
        list[Path] | None,
        typer.Option("--profile", help="Profile that `identify` wrote, for its vehicle's corners; several times."),
    ] = None,
    hunt: Annotated[
        float | None, typer.Option("--hunt", help="m/s: fly also in winds of this speed that are aimed against the loop.")
    ] = None,
    noise: Annotated[str, typer.Option("--noise", help="Standard deviation of motion capture's positions, m.")] = "0.001",
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes; results do not depend on it.")] = 1,
    out: flight_options.OutOption = None,
    seed: options.SeedOption = None,
    json: options.JsonOption = False,
) -> None:
    """Rehearse a certified mission: which controllers stay in the tube, with what mass, latency and wind.

    Every controller that all vehicles run, three masses, three latencies and three winds unless options say otherwise; * marks flights that left the tube. Vehicles whose
    drag is a guess are flown with the ends of its range as well. Of a run's folder the report gets the table. The
    corners of what is not known are flown by the profiles' controllers in a laboratory's air.
    """
    from flight import MotionCapture, rehearse
    from flight.identification.profile import read_profile
    from flight.rehearsal.combinations import USUAL, Combinations
    from ltlplan.output import REHEARSAL_FILES, write_rehearsal

    combinations = Combinations(
        tuple(controller) if controller else None,
        tuple(mass or USUAL.masses),
        tuple(latency or USUAL.latencies),
        tuple(wind or USUAL.winds),
        cast("tuple[Drag, ...]", tuple(drag or USUAL.drags)),  # another word is rejected there
        corners,
        tuple(read_profile(file) for file in profile or ()),
        hunt,
    )
    cameras = MotionCapture.parse(noise)
    with simulating(out, REHEARSAL_FILES, quiet=json) as progress:
        plan, team, certificate = certified(source, part_of(progress, 0.0, 0.3))
        found = rehearse(
            plan, team, certificate, combinations=combinations, noise=cameras, runs=runs, seed=plan.seed if seed is None else seed,
            workers=workers, progress=part_of(progress, 0.3, 1.0),
        )  # fmt: skip
        files = written(out, lambda folder: write_rehearsal(plan, found, folder))
    page, note = _into_report(Path(source), found)
    Outcome([*_lines(found), *note], found.to_dict(), None).show((*files, *page), as_json=json)


def _into_report(run: Path, found: Rehearsal) -> tuple[tuple[Path, ...], tuple[str, ...]]:
    """Add what was found to the report of a run's folder, where there is one that is as we left it; return it, or why not."""
    from flight.storage.single_files import replace_listed
    from ltlplan.report.rehearsal import with_rehearsal
    from verify.data import BadInput

    report = run / "report.html"
    if not report.is_file():
        return (), ()
    try:
        return (replace_listed(run, report.name, with_rehearsal(report.read_text(encoding="utf-8"), found)),), ()
    except (BadInput, OSError, UnicodeError) as error:
        return (), (f"The report does not show it: {error}",)


def _lines(found: Rehearsal) -> list[str]:
    """Return the table, aligned, and the sentences."""
    rows = found.rows()
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.rjust(width) if i > 1 else cell.ljust(width) for i, (cell, width) in enumerate(zip(row, widths, strict=True)))
             for row in rows]  # fmt: skip
    return [*(line.rstrip() for line in lines), "", *found.sentences]
