"""`ltlplan fly`: one flight in simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, get_args

import typer

from flight.monitoring.alarm_response import Reaction
from ltlplan.commands.support import flight_options, options
from ltlplan.commands.support.choices import choices
from ltlplan.commands.support.simulation import Outcome, certified, simulating, written
from verify.data import BadInput
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight import FlightLog

    ReactionName = Reaction
else:
    ReactionName = choices("ReactionName", get_args(Reaction))


# a parameter for each of the command's options
def command(
    source: flight_options.TeamArgument,
    out: flight_options.OutOption = None,
    seed: options.SeedOption = None,
    wind: flight_options.WindOption = None,
    noise: flight_options.NoiseOption = None,
    model: flight_options.ModelOption = flight_options.FULL,
    controller: flight_options.FollowerOption = None,
    estimator: flight_options.EstimatorOption = None,
    latency: flight_options.LatencyOption = None,
    mass: flight_options.MassOption = None,
    reaction: Annotated[
        ReactionName | None,
        typer.Option("--reaction", help="Response of the team to an alarm, instead of the mission's `reaction`."),
    ] = None,
    link: Annotated[
        flight_options.LinkName | None,
        typer.Option(
            "--link",
            help="Fly live over a link: checks, certified climb, transit to the starts, flight and landing, watched, with a way out "
            "at every moment. `simulated`: our simulation behind the same interface; `crazyflie`: by radio, --inventory or --address; "
            "`mavlink`: PX4, by --address.",
        ),
    ] = None,
    place: flight_options.PlaceOption = None,
    address: flight_options.AddressOption = None,
    inventory: flight_options.InventoryOption = None,
    unchecked: flight_options.UncheckedOption = None,
    real_time: Annotated[bool, typer.Option("--real-time", help="With --link simulated: a second takes a second.")] = False,
    follow: Annotated[
        list[str] | None,
        typer.Option(
            "--follow",
            help="With --link: http://HOST:PORT/live/NAME, a service at which the flight is seen, and from which it may be stopped.",
        ),
    ] = None,
    json: options.JsonOption = False,
) -> None:
    """Fly a certified mission once in simulation, or live over a link; exit code 5 if it left its tube, violated its formula or was ended."""
    from flight import fly
    from flight.condition_options import Said
    from ltlplan.output import LOG_FILES, write_flight

    said = Said(wind, noise, model, controller, estimator, latency, mass)
    said.require_sense()
    if link is not None:
        from ltlplan.commands.support.links import Asked
        from ltlplan.commands.support.live_flight import fly_over_link

        kind = Asked(
            str(link),
            tuple(place or ()),
            tuple(address or ()),
            inventory,
            real_time,
            tuple(map(str, unchecked or ())),
            tuple(follow or ()),
        )
        fly_over_link(source, out, kind, said, seed, json=json)
        return
    if place or real_time or address or inventory or unchecked or follow:
        raise BadInput("--place, --address, --inventory, --unchecked, --follow and --real-time go with --link.")
    with simulating(out, LOG_FILES, quiet=json) as progress:
        plan, team, certificate = certified(source, part_of(progress, 0.0, 0.5))
        progress("flying in simulation", 0.5)
        log = fly(
            plan, team, certificate, seed=plan.seed if seed is None else seed, conditions=said.conditions(plan.mission),
            reaction=reaction, progress=part_of(progress, 0.5, 1.0),
        )  # fmt: skip
        files = written(out, lambda folder: write_flight(plan, log, folder))
    _outcome(log, certificate.margin).show(files, as_json=json)


def _outcome(log: FlightLog, margin: float) -> Outcome:
    """Say how near to the plan was flown, with what margin in m, and whether the promises were kept."""
    lines = [
        f"{name}: worst tracking error {1000 * log.worst_error(name):.1f} mm, RMS {1000 * log.rms_error(name):.1f} mm "
        f"(margin {1000 * margin:.1f} mm)"
        for name in log.robots
    ]
    refusal = None
    if log.satisfied is False:
        refusal = "The flown path breaks the formula."
    elif log.worst_error() > margin:
        refusal = f"The flight left its tube: {1000 * log.worst_error():.1f} mm against a margin of {1000 * margin:.1f} mm."
    data = {
        "mission": log.mission,
        "tracking": {name: {"worst": log.worst_error(name), "rms": log.rms_error(name)} for name in log.robots},
        "margin": margin,
        "satisfied": log.satisfied,
        "tube": log.tube,
        "sentences": [*log.verdicts, *log.notes],
    }
    return Outcome([*lines, *log.verdicts, *log.notes], data, refusal)
