"""`ltlplan online`: tasks shared among the robots while they fly, in simulation or over a link."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.support import flight_options, options
from ltlplan.commands.support.simulation import Outcome, simulating, written
from verify.data import BadInput

if TYPE_CHECKING:
    from ltlplan.online.online_flight import OnlineFlight


# a parameter for each of the command's options
def command(
    mission: options.MissionArgument,
    certified: Annotated[bool, typer.Option("--certified", help="Fly only certified segments.")] = False,
    event: Annotated[
        list[str] | None,
        typer.Option(
            "--event", help="Such as '12.5 quad1 fails', '8 water moves 0.3,-0.7,0.9' or '8 crate appears 0,0,1 0.4,0.4,2'."
        ),
    ] = None,
    out: flight_options.OutOption = None,
    seed: options.SeedOption = None,
    pace: options.PaceOption = None,
    wind: flight_options.WindOption = None,
    noise: flight_options.NoiseOption = None,
    model: flight_options.ModelOption = flight_options.FULL,
    controller: flight_options.ControllerOption = flight_options.GEOMETRIC,
    link: Annotated[
        flight_options.LinkName | None,
        typer.Option(
            "--link",
            help="Fly live over a link and in real time, with --certified: checks, certified climb and transit to the starts, segments as they are "
            "proved, and a certified landing. `simulated`: our simulation behind the same interface; `crazyflie`: by radio, --inventory or --address; `mavlink`: "
            "PX4, by --address.",
        ),
    ] = None,
    place: flight_options.PlaceOption = None,
    address: flight_options.AddressOption = None,
    inventory: flight_options.InventoryOption = None,
    unchecked: flight_options.UncheckedOption = None,
    follow: Annotated[
        list[str] | None,
        typer.Option(
            "--follow",
            help="With --link: events as they arrive, a line each as in --event, at once where no time is written: a file that grows, a "
            "named pipe, - for the keyboard, ros2:/TOPIC for messages of ROS 2, or http://HOST:PORT/live/NAME for what "
            "a planning service is told (again for more).",
        ),
    ] = None,
    standby: Annotated[
        list[str] | None,
        typer.Option(
            "--standby",
            help="With --link: NAME=x,y,z in m, where motion capture sees a robot that is none of the mission's, and waits on the ground until an "
            "event has it join: `quad3 joins 1,0.5,1`. One that --event has join stands below its start where nothing else is said.",
        ),
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Reassign tasks in flight; exit code 5 if the flown words violate the formula, or a live flight was ended.

    With --certified each segment is certified before it is flown, and with --link it is flown over a link: robots fly on or hover while the next
    one is computed. There is nothing to export.
    """
    from ltlplan.online.event_sources.lines import parse_events

    if link is not None:
        from ltlplan.commands.support.links import Asked
        from ltlplan.commands.support.live_online import Happening, online_over_link
        from ltlplan.planner import with_seed

        if not certified:
            raise BadInput("over a link only certified pieces are flown: add --certified.")
        follower = None if controller == flight_options.GEOMETRIC else controller
        from flight.condition_options import Said

        said = Said(wind, noise, model, follower, None, None, None)
        kind = Asked(str(link), tuple(place or ()), tuple(address or ()), inventory, False, tuple(map(str, unchecked or ())))
        asked = with_seed(options.read_mission(mission, pace=pace), seed)
        online_over_link(
            asked, out, kind, said, Happening(tuple(event or ()), tuple(follow or ()), tuple(standby or ())), json=json
        )
        return
    if place or address or inventory or follow or standby or unchecked:
        raise BadInput("--place, --address, --inventory, --unchecked, --follow and --standby go with --link.")
    from flight import Conditions
    from ltlplan.online.files import ONLINE_FILES, write_online
    from ltlplan.online.simulated_online_flight import fly_online

    conditions = Conditions(wind, noise, model, controller)
    with simulating(out, ONLINE_FILES, quiet=json) as progress:
        asked = options.read_mission(mission, pace=pace)
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
