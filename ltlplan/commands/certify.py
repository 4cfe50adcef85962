"""`ltlplan certify`: prove the trajectories of a folder, or judge a recorded flight."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ltlplan.commands.options import FolderArgument, JsonOption, MarginOption

if TYPE_CHECKING:
    from verify import Certificate
    from verify.data import Mission


def command(
    folder: FolderArgument,
    margin: MarginOption = None,
    clock_error: Annotated[
        float | None,
        typer.Option("--clock-error", min=0.0, help="Between robots' clocks, in s (default: as in certificate.json, or 0)."),
    ] = None,
    flight: Annotated[
        Path | None, typer.Option("--flight", help="A recorded flight (CSV) to judge instead of trajectories.")
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option("--max-speed", help="With --flight: bound on every robot's speed, m/s.")
    ] = None,
    error: Annotated[float, typer.Option("--error", min=0.0, help="With --flight: bound on a position's error, m.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Prove that the trajectories in a folder satisfy its mission and plan, and write certificate.json there."""
    if flight is not None:
        _judge_recording(folder, flight, max_speed, error, as_json=json)
        return
    import json as json_text

    from ltlplan.commands.summary import claim_lines
    from ltlplan.commands.terminal import print_json
    from verify import certify
    from verify.data.folders import PROOF
    from verify.data.single_files import replace_listed
    from verify.recheck import read_folder

    plan, team = read_folder(folder)
    error_of_clocks = _clock_error_before(folder) if clock_error is None else clock_error
    certificate = certify(plan, team, margin=margin, clock_error=error_of_clocks)
    written = replace_listed(folder, PROOF, certificate.to_json())
    if json:
        print_json(json_text.loads(certificate.to_json()))
        return
    for line in claim_lines(certificate):
        typer.echo(line)
    clocks = f", clocks up to {certificate.clock_error:g} s apart" if certificate.clock_error else ""
    typer.echo(f"certified at margin {certificate.margin:g} m{below_asked(certificate)}{clocks}; wrote {written}")


def _clock_error_before(folder: Path) -> float:
    """Return the clock error of the folder's certificate, so that proving again does not drop it; 0 without one."""
    from verify.data.folders import PROOF
    from verify.recheck import read_certificate

    path = folder / PROOF
    return float(read_certificate(path)["clock_error"]) if path.exists() else 0.0


def below_asked(certificate: Certificate) -> str:
    """Say that a certificate has a smaller margin than its mission asks for; nothing where it has not."""
    asked = certificate.mission.margin
    return f" (the mission asks for {asked:g} m)" if certificate.margin < asked else ""


def _judge_recording(folder: Path, recording: Path, max_speed: float | None, error: float, *, as_json: bool) -> None:
    """Judge a recorded flight of the folder's mission, for all times between its samples too."""
    from flight import read_recording
    from ltlplan.commands.terminal import print_json
    from verify import check_recording, check_samples
    from verify.data import NotCertified, load_mission_file

    mission = load_mission_file(folder / "mission.yaml" if folder.is_dir() else folder)
    from_plan = False
    if _is_our_log(recording):
        verdict = check_recording(recording, mission, max_speed=max_speed, error=error)
    else:
        table = read_recording(recording, tuple(mission.agents))
        internal = _planned_states(folder, mission, table.times.tolist())
        from_plan = internal is not None and bool(mission.internal_propositions & mission.formula.names())
        verdict = check_samples(
            table.times, table.position, mission, max_speed=max_speed, error=error, rounding=table.rounding, internal=internal
        )
    if as_json:
        print_json({"mission": mission.name, "flight": str(recording), **verdict.to_dict()})
    else:
        words = {"holds": "satisfied", "fails": "violated", "undecided": "samples too sparse to tell"}
        typer.echo(f"{words[verdict.outcome]}. {verdict.sentence}")
        if from_plan:
            typer.echo("Internal states are those of the certificate's planned actions, from the table's first row on.")
    if not verdict:
        raise typer.Exit(NotCertified.exit_code)


def _is_our_log(path: Path) -> bool:
    """Tell a log of ours, which holds internal propositions, from a table of motion capture."""
    from flight.log import COLUMNS
    from verify.data.files import begins_with

    return begins_with(path, ",".join(COLUMNS).encode(), "recording")


def _planned_states(folder: Path, mission: Mission, times: list[float]) -> dict[str, list[frozenset[str]]] | None:
    """Return each robot's internal propositions at each time, by the certificate's instants of its actions.

    A table of positions does not show internal states; the folder's certificate says when they were to change.
    """
    from verify.data import BadInput
    from verify.recheck import read_certificate

    path = folder / "certificate.json"
    if not folder.is_dir() or not path.exists():
        return None
    actions = read_certificate(path)["actions"]
    for index, action in enumerate(actions):
        if action["robot"] not in mission.agents or action["target"] not in mission.robot.states:
            raise BadInput(f"{path}: action {index} is not of this mission; certify the folder again.")
    states: dict[str, list[frozenset[str]]] = {}
    for name in mission.agents:
        mine = sorted((action["time"], action["target"]) for action in actions if action["robot"] == name)
        reached = [
            [mission.initial_internal(name), *(state for instant, state in mine if instant <= time)][-1] for time in times
        ]
        states[name] = [frozenset(mission.robot.states[state]) for state in reached]
    return states
