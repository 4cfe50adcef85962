"""`ltlplan online`: tasks shared among the robots while they fly, in simulation."""

from __future__ import annotations

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
    WindOption,
    check_out,
    written,
)
from ltlplan.commands.shared.options import JsonOption, MissionArgument, SeedOption, read_mission


def command(
    mission: MissionArgument,
    certified: Annotated[bool, typer.Option("--certified", help="Fly only pieces that are certified.")] = False,
    event: Annotated[
        list[str] | None, typer.Option("--event", help="Such as '12.5 quad1 fails' or '8 water moves 0.3,-0.7,0.9'.")
    ] = None,
    out: OutOption = None,
    seed: SeedOption = None,
    wind: WindOption = None,
    noise: NoiseOption = None,
    model: ModelOption = FULL,
    controller: ControllerOption = GEOMETRIC,
    json: JsonOption = False,
) -> None:
    """Share tasks while flying, in simulation only; exit code 5 where the flown words do not keep the formula.

    Nothing is certified in advance; with --certified each piece is, before it is flown. There is nothing to export.
    """
    from flight import Conditions
    from ltlplan.commands.shared.events import parse_events
    from ltlplan.commands.shared.progress import progress_bar
    from ltlplan.online.flight import fly_online
    from ltlplan.output import ONLINE_FILES

    conditions = Conditions(wind, noise, model, controller)
    with progress_bar(quiet=json) as progress:
        check_out(out, ONLINE_FILES)
        asked = read_mission(mission)
        flown = fly_online(
            asked, seed=seed, certified=certified, events=parse_events(event or []), conditions=conditions, progress=progress
        )
        words = {name: " ".join("{" + ", ".join(sorted(letter)) + "}" for letter in word) for name, word in flown.words.items()}
        lines = [*(f"{name}: {word}" for name, word in words.items()), *flown.log.verdicts, flown.summary()]

        def write(folder: Path) -> None:
            from ltlplan.report.online import online_html
            from verify.data import mission_to_yaml
            from verify.data.events import EVENTS_FILE, events_to_json

            (folder / "mission.yaml").write_text(mission_to_yaml(flown.asked), encoding="utf-8")
            (folder / EVENTS_FILE).write_text(events_to_json(flown.events), encoding="utf-8")
            (folder / "flight.csv").write_text(flown.log.to_csv(), encoding="utf-8")
            (folder / "report.html").write_text(online_html(flown), encoding="utf-8")
            (folder / "summary.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")

        files = written(out, write)
    data = {
        "mission": asked.name,
        "duration": flown.duration,
        "satisfied_at": flown.satisfied_at,
        "verdict": flown.verdict.outcome,
        "sentence": flown.verdict.sentence,
        "note": flown.log.notes[0],
        "certified": flown.certified,
        "certificates": list(flown.certificates),
        "planned_cost": flown.planned_cost,
        "final_cost": flown.final_cost,
        "words": {name: [sorted(letter) for letter in word] for name, word in flown.words.items()},
    }
    refusal = None if flown.verdict else f"The flown words do not keep the formula: {flown.verdict.sentence}"
    Finish(lines, data, refusal, files).show(json)
