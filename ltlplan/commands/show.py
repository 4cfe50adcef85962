"""`ltlplan show`: pictures of a mission's planning as one page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support import options


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    out: Annotated[Path | None, typer.Option("--out", help="Page to write (default: MISSION.html).")] = None,
    seed: options.SeedOption = None,
    sequence: options.SequenceOption = None,
    formula: options.FormulaOption = None,
    cost: options.CostOption = None,
    shown_round: Annotated[
        int | None, typer.Option("--round", min=1, help="Iteration of cross-entropy to draw, counted from 1 (default: 1).")
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Draw the mission from above and from two sides, control points, primitives, the sampled paths of a round, the optimised path."""
    from flight.storage.single_files import check_page, replace_page
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.report.pictures import mission_html, pictures_html
    from verify.data import BadInput, Infeasible, Unsatisfiable

    asked = options.read_mission(mission, sequence=sequence, formula=formula, cost=cost)
    page = out or Path(f"{asked.name}.html")
    check_page(page)
    if not os.access(page.absolute().parent, os.W_OK):  # before minutes of work, not after
        raise BadInput(f"{page.absolute().parent} is no folder that can be written to; name a page elsewhere with --out.")
    try:
        with progress_bar(quiet=json) as progress:
            made = pictures_html(asked, seed=seed, shown_round=shown_round, progress=progress)
    except (Unsatisfiable, Infeasible) as error:  # now the picture is wanted most
        replace_page(page, mission_html(asked, str(error)))
        typer.echo(f"note: {page} shows the mission without a plan.", err=True)
        raise
    replace_page(page, made)
    if json:
        print_json({"files": [str(page)]})
    else:
        typer.echo(f"wrote {page}")
