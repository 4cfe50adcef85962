"""`ltlplan batch`: every mission of a folder, each into a folder of its own, and a table of what became of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.support import machines, options
from ltlplan.commands.support.processors import processors

if TYPE_CHECKING:
    from ltlplan.service.execution.batches import Entry

_HEADER = ("mission", "outcome", "checked", "cost", "seconds", "exit code")


def command(
    folder: Annotated[Path, typer.Argument(help="A folder with mission files (*.yaml, *.yml).", show_default=False)],
    out: Annotated[Path | None, typer.Option("--out", help="Where each mission gets its folder (default: out/FOLDER).")] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes (default: one for each processor).")
    ] = None,
    dask: machines.DaskOption = None,
    seed: options.SeedOption = None,
    pace: options.PaceOption = None,
    json: options.JsonOption = False,
) -> None:
    """Run every mission of a folder, each into a folder of its own; unchanged missions that are done already are skipped."""
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.planner import pace_of
    from ltlplan.service.execution.batches import exit_code, run_batch
    from ltlplan.service.execution.workers import LocalWorkers

    target = out or Path("out") / folder.resolve().name
    with progress_bar(quiet=json) as progress:
        pool = LocalWorkers(workers or processors()) if dask is None else machines.cluster_at(dask, workers)
        with closing(pool):
            entries = run_batch(folder, target, workers=pool, seed=seed, pace=pace_of(pace), progress=progress)
    code = exit_code(entries)
    if json:
        print_json({"missions": [_data(entry) for entry in entries], "exit_code": code})
    else:
        for line in _lines(entries):
            typer.echo(line)
    if code:
        raise typer.Exit(code)


def _lines(entries: Sequence[Entry]) -> list[str]:
    """Return a table of what became of the missions, and below it why some failed."""
    rows = [_HEADER, *map(_row, entries)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADER))]
    lines = [
        "  ".join(
            cell.rjust(width) if column > 1 else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    return [*lines, *(f"{entry.name}: {entry.sentence}" for entry in entries if entry.sentence)]


def _row(entry: Entry) -> tuple[str, ...]:
    cost = "" if entry.cost is None else f"{entry.cost:.3f}"
    seconds = "" if entry.found else f"{entry.seconds:.1f}"
    return (entry.name, _outcome(entry), entry.checked, cost, seconds, str(entry.exit_code))


def _outcome(entry: Entry) -> str:
    from ltlplan.commands.support.terminal import kind

    outcome = kind(entry.exit_code) if entry.exit_code else "certified"
    return f"{outcome} before" if entry.found else outcome


def _data(entry: Entry) -> dict[str, object]:
    return {
        "mission": entry.name,
        "outcome": _outcome(entry),
        "checked": entry.checked,
        "cost": entry.cost,
        "seconds": entry.seconds,
        "exit_code": entry.exit_code,
        "message": entry.sentence,
        "found": entry.found,
        "folder": None if entry.folder is None else str(entry.folder),
    }
