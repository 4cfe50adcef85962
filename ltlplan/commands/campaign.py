"""`ltlplan campaign`: the same flight many times in simulation."""

from __future__ import annotations

import json as json_format
from pathlib import Path
from typing import Annotated

import typer

from ltlplan.commands.shared.flight_options import (
    FULL,
    GEOMETRIC,
    ControllerOption,
    Finish,
    ModelOption,
    NoiseOption,
    OutOption,
    TeamArgument,
    WindOption,
    certified,
    check_out,
    written,
)
from ltlplan.commands.shared.options import JsonOption, SeedOption


def command(
    source: TeamArgument,
    runs: Annotated[int, typer.Option("--runs", min=1, help="How many flights.")] = 100,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes; findings do not depend on it.")] = 1,
    out: OutOption = None,
    seed: SeedOption = None,
    wind: WindOption = None,
    noise: NoiseOption = None,
    model: ModelOption = FULL,
    controller: ControllerOption = GEOMETRIC,
    json: JsonOption = False,
) -> None:
    """Fly a certified mission many times in simulation: which share of the flights kept tube and formula."""
    from flight import Conditions, campaign
    from ltlplan.commands.shared.progress import progress_bar
    from ltlplan.output import CAMPAIGN_FILES, write_plan_files
    from ltlplan.report.campaign import campaign_html

    conditions = Conditions(wind, noise, model, controller)
    with progress_bar(quiet=json) as progress:
        check_out(out, CAMPAIGN_FILES)
        plan, team, certificate = certified(source, progress)
        found = campaign(
            plan, team, certificate, runs=runs, seed=plan.seed if seed is None else seed, conditions=conditions, workers=workers,
            progress=lambda sentence, share: progress(sentence, 0.5 + 0.5 * share),
        )  # fmt: skip

        def write(folder: Path) -> None:
            write_plan_files(plan, folder)
            (folder / "campaign.json").write_text(json_format.dumps(found.to_dict(), indent=1) + "\n", encoding="utf-8")
            (folder / "campaign.html").write_text(campaign_html(found), encoding="utf-8")

        files = written(out, write)
    refusal = None
    if found.contradictions:
        refusal = f"Seeds {found.contradictions[:5]} flew inside the tube and broke the formula: a bug of the certificate."
    Finish(list(found.sentences), {"mission": plan.mission.name, **found.to_dict()}, refusal, files).show(json)
