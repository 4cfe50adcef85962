"""`ltlplan fly`: one flight in simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from flight.monitoring.reaction import Reaction
from ltlplan.commands.shared.choices import choices
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

if TYPE_CHECKING:
    ReactionName = Reaction
else:
    ReactionName = choices("ReactionName", get_args(Reaction))


def command(
    source: TeamArgument,
    out: OutOption = None,
    seed: SeedOption = None,
    wind: WindOption = None,
    noise: NoiseOption = None,
    model: ModelOption = FULL,
    controller: ControllerOption = GEOMETRIC,
    reaction: Annotated[
        ReactionName | None,
        typer.Option("--reaction", help="What the team does after an alarm, instead of the mission's choice."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Fly a certified mission once in simulation; exit code 5 where the flight left its tube or broke its formula."""
    from flight import Conditions, fly
    from ltlplan.commands.shared.progress import progress_bar
    from ltlplan.output import LOG_FILES, write_plan_files

    conditions = Conditions(wind, noise, model, controller)
    with progress_bar(quiet=json) as progress:
        check_out(out, LOG_FILES)
        plan, team, certificate = certified(source, progress)
        progress("flying in simulation", 0.5)
        log = fly(
            plan, team, certificate, seed=plan.seed if seed is None else seed, conditions=conditions, reaction=reaction,
            progress=lambda sentence, share: progress(sentence, 0.5 + 0.5 * share),
        )  # fmt: skip

        def write(folder: Path) -> None:
            write_plan_files(plan, folder)
            (folder / "flight.csv").write_text(log.to_csv(), encoding="utf-8")

        files = written(out, write)
    margin, worst = 1000 * certificate.margin, 1000 * log.worst_error()
    lines = [
        f"{name}: worst tracking error {1000 * log.worst_error(name):.1f} mm, RMS {1000 * log.rms_error(name):.1f} mm (margin {margin:.1f} mm)"
        for name in log.robots
    ]
    refusal = None
    if log.satisfied is False:
        refusal = "The flown path breaks the formula."
    elif log.worst_error() > certificate.margin:
        refusal = f"The flight left its tube: {worst:.1f} mm against a margin of {margin:.1f} mm."
    data = {
        "mission": plan.mission.name,
        "tracking": {name: {"worst": log.worst_error(name), "rms": log.rms_error(name)} for name in log.robots},
        "margin": certificate.margin,
        "satisfied": log.satisfied,
        "tube": log.tube,
        "sentences": [*log.verdicts, *log.notes],
    }
    Finish([*lines, *log.verdicts, *log.notes], data, refusal, files).show(json)
