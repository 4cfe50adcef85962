"""Options that several commands share, and how they change a mission."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from verify.data import Mission


def missions_like(incomplete: str) -> list[str]:
    """Return what a shell may complete to: shipped missions, and mission files in the folder that is being typed."""
    from ltlplan.missions import shipped_missions

    folder = incomplete.rpartition("/")[0]
    files = sorted(str(path) for path in Path(folder or ".").glob("*.y*ml"))
    return [name for name in (*shipped_missions(), *files) if name.startswith(incomplete)]


MissionArgument = Annotated[
    str,
    typer.Argument(help="A mission file, or the name of a shipped mission.", show_default=False, autocompletion=missions_like),
]
FolderArgument = Annotated[Path, typer.Argument(help="A folder that `ltlplan run` wrote.", show_default=False)]
SeedOption = Annotated[int | None, typer.Option("--seed", min=0, help="Seed, instead of the mission's own.")]
PaceOption = Annotated[
    str | None,
    typer.Option(
        "--pace",
        help="Instead of the mission's: a share of the fastest flight, above 0 up to 1 (1 is as fast as limits allow), or 'nominal'.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON document instead of text.")]
DataOption = Annotated[Path | None, typer.Option("--data", help="Folder of the service's data (default: your data folder).")]
DatabaseOption = Annotated[
    str | None,
    typer.Option(
        "--db", help="PostgreSQL URL of the jobs, without its password (default: $LTLPLAN_DB, or SQLite in the data folder)."
    ),
]
DatabaseFileOption = Annotated[Path | None, typer.Option("--db-file", help="File that holds this URL, the password included.")]
SequenceOption = Annotated[
    str | None, typer.Option("--sequence", help="Hoops to fly, such as 'hoop0F hoop1R', instead of the mission's.")
]
FormulaOption = Annotated[str | None, typer.Option("--formula", help="Formula, instead of the mission's.")]
CostOption = Annotated[str | None, typer.Option("--cost", help="Cost weights, such as length=1,effort=0.5.")]
MarginOption = Annotated[float | None, typer.Option("--margin", min=0.0, help="Margin in m, instead of the mission's.")]


def read_mission(
    source: str,
    *,
    sequence: str | None = None,
    formula: str | None = None,
    cost: str | None = None,
    margin: float | None = None,
    pace: str | None = None,
) -> Mission:
    """Load a mission and replace what the command line says otherwise; the result is checked like a file.

    A `--formula` alone drops the mission's sequence, and a `--sequence` alone drops its formula: whoever types one
    of them wants that one flown. Give both to have the sequence checked against the formula.

    Args:
        source: A path, or the name of a shipped mission.
        sequence: Hoops with directions, in place of the mission's.
        formula: In place of the mission's.
        cost: Weights by term, as in `length=1,effort=0.5`.
        margin: m, in place of the mission's.
        pace: A share of the fastest flight, or "nominal", in place of `planner.pace`.

    Raises:
        BadInput: There is no such mission, its file is at fault, or a replacement does not fit it.
    """
    from ltlplan.missions import load_mission
    from ltlplan.missions.notes import notes_of
    from ltlplan.planner import pace_of, with_pace
    from verify.data.mission import check_mission

    mission = load_mission(source)
    for note in notes_of(mission):
        typer.echo(f"note: {note}", err=True)
    changes: dict[str, object] = {}
    if sequence is not None:
        changes["sequence"] = sequence
        cycle = sequence.rstrip().endswith(")*")
        changes["spec"] = mission.spec.model_copy(
            update={
                "formula": formula,
                "trace": "infinite" if cycle else "finite",
                "repeat": mission.spec.repeat if cycle else 1,
            }
        )
    elif formula is not None:
        changes["sequence"] = None
        changes["spec"] = mission.spec.model_copy(update={"formula": formula})
    if cost is not None:
        from ltlplan.paths.costs import parse_cost

        changes["planner"] = mission.planner.model_copy(update={"cost": parse_cost(cost)})
    if margin is not None:
        changes["margin"] = margin
        if mission.disturbance is not None:  # what is stated here is not fitted
            changes["disturbance"] = mission.disturbance.model_copy(update={"fitted": False})
    mission = check_mission(mission.model_copy(update=changes)) if changes else mission
    return with_pace(mission, pace_of(pace))
