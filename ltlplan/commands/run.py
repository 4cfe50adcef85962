"""`ltlplan run`: plan, refine, certify, fly in simulation, export; one summary at the end."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.support import options


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write (default: out/MISSION).")] = None,
    seed: options.SeedOption = None,
    pace: options.PaceOption = None,
    sequence: options.SequenceOption = None,
    formula: options.FormulaOption = None,
    cost: options.CostOption = None,
    margin: options.MarginOption = None,
    show: Annotated[bool, typer.Option("--open", help="Open the report when it is written.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Print every word, claim, note and file.")] = False,
    json: options.JsonOption = False,
) -> None:
    """Plan, refine, certify, fly in simulation and export a mission. The key Ctrl-Backslash takes the best plan that the search has so far."""
    from ltlplan.commands.support.processors import processes_for
    from ltlplan.commands.support.progress import progress_bar
    from ltlplan.commands.support.stopped_search import stoppable_search
    from ltlplan.commands.support.terminal import open_page, print_json
    from ltlplan.pipeline import run
    from ltlplan.report.brief import brief_lines
    from ltlplan.report.summary import holds, shortfall, summary_data, summary_lines

    asked = options.read_mission(mission, sequence=sequence, formula=formula, cost=cost, margin=margin, pace=pace)
    folder = out or Path("out") / asked.name
    with processes_for(asked) as workers, progress_bar(quiet=json) as progress, stoppable_search() as budget:
        result = run(asked, folder, seed=seed, progress=progress, workers=workers, budget=budget)
    if json:
        print_json(summary_data(result))
    else:
        for line in summary_lines(result) if verbose else brief_lines(result):
            typer.echo(line)
    if show:
        open_page(folder / "report.html")
    if not holds(result):
        from verify.data import NotCertified

        if json:  # the document says so already
            raise typer.Exit(NotCertified.exit_code)
        raise NotCertified(f"The simulated flight is not the certified one: {shortfall(result)}.")
