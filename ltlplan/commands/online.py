"""`ltlplan online`: tasks shared among the robots while they fly, in simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.shared import flight_options, options
from ltlplan.commands.shared.simulation import Outcome, simulating, written

if TYPE_CHECKING:
    from ltlplan.online.online_flight import OnlineFlight


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    certified: Annotated[bool, typer.Option("--certified", help="Fly only pieces that are certified.")] = False,
    event: Annotated[
        list[str] | None,
        typer.Option(
            "--event", help="Such as '12.5 quad1 fails', '8 water moves 0.3,-0.7,0.9' or '8 crate appears 0,0,1 0.4,0.4,2'."
        ),
    ] = None,
    out: flight_options.OutOption = None,
    seed: options.SeedOption = None,
    wind: flight_options.WindOption = None,
    noise: flight_options.NoiseOption = None,
    model: flight_options.ModelOption = flight_options.FULL,
    controller: flight_options.ControllerOption = flight_options.GEOMETRIC,
    json: options.JsonOption = False,
) -> None:
    """Share tasks while flying, in simulation only; exit code 5 where the flown words do not keep the formula.

    Nothing is certified in advance; with --certified each piece is, before it is flown. There is nothing to export.
    """
    from flight import Conditions
    from ltlplan.commands.shared.events import parse_events
    from ltlplan.online.files import ONLINE_FILES, write_online
    from ltlplan.online.flight import fly_online

    conditions = Conditions(wind, noise, model, controller)
    with simulating(out, ONLINE_FILES, quiet=json) as progress:
        asked = options.read_mission(mission)
        flown = fly_online(
            asked, seed=seed, certified=certified, events=parse_events(event or []), conditions=conditions, progress=progress
        )
        outcome = _outcome(flown)
        files = written(out, lambda folder: write_online(flown, outcome.lines, folder))
    outcome.show(files, as_json=json)


def _outcome(flown: OnlineFlight) -> Outcome:
    words = {name: " ".join("{" + ", ".join(sorted(letter)) + "}" for letter in word) for name, word in flown.words.items()}
    lines = [*(f"{name}: {word}" for name, word in words.items()), *flown.log.verdicts, flown.summary()]
    data = {
        "mission": flown.asked.name,
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
    return Outcome(lines, data, refusal)
