"""`ltlplan plan`: words, robots, hoops and waypoints, without trajectories."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support import options


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write; without it nothing is written.")] = None,
    seed: options.SeedOption = None,
    pace: options.PaceOption = None,
    sequence: options.SequenceOption = None,
    formula: options.FormulaOption = None,
    cost: options.CostOption = None,
    json: options.JsonOption = False,
) -> None:
    """Plan a mission: each robot's word, visits and cost. The key Ctrl-Backslash takes the best plan that the search has so far."""
    import json as json_text

    from flight.storage.folders import check_folder, write_folder
    from ltlplan.allocation import Known
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.stopped_search import stoppable_search
    from ltlplan.commands.support.terminal import print_json
    from ltlplan.output import PLAN_FILES, write_plan_files
    from ltlplan.replanning.checked_plan import plan
    from ltlplan.report.summary import plan_lines

    asked = options.read_mission(mission, sequence=sequence, formula=formula, cost=cost, pace=pace)
    if out is not None:
        check_folder(out, PLAN_FILES)
    with progress_bar(quiet=json) as progress, stoppable_search() as budget:
        made = plan(asked, seed=seed, progress=progress, known=Known(budget=budget))
    files: tuple[Path, ...] = ()
    if out is not None:
        files = write_folder(out, lambda folder: write_plan_files(made, folder))
    if json:
        print_json({"plan": json_text.loads(made.to_json()), "files": [str(path) for path in files]})
        return
    for line in plan_lines(made):
        typer.echo(line)
    for path in files:
        typer.echo(f"wrote {path}")
