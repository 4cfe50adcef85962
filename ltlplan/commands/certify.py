"""`ltlplan certify`: prove the trajectories of a folder, or judge a recorded flight."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ltlplan.commands.options import FolderArgument, JsonOption, MarginOption

if TYPE_CHECKING:
    from verify.data import Mission


def command(
    folder: FolderArgument,
    margin: MarginOption = None,
    clock_error: Annotated[float, typer.Option("--clock-error", min=0.0, help="Between robots' clocks, in s.")] = 0.0,
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
    from ltlplan.output import replace_file
    from verify import certify
    from verify.recheck import read_folder

    plan, team = read_folder(folder)
    certificate = certify(plan, team, margin=margin, clock_error=clock_error)
    replace_file(folder / "certificate.json", certificate.to_json())
    if json:
        print_json(json_text.loads(certificate.to_json()))
        return
    for line in claim_lines(certificate):
        typer.echo(line)
    typer.echo(f"certified at margin {certificate.margin:g} m; wrote {folder / 'certificate.json'}")


def _judge_recording(folder: Path, recording: Path, max_speed: float | None, error: float, *, as_json: bool) -> None:
    """Judge a recorded flight of the folder's mission, for all times between its samples too."""
    from ltlplan.commands.terminal import print_json
    from verify.data import NotCertified, load_mission_file
    from verify.samples import check_samples

    mission = load_mission_file(folder / "mission.yaml" if folder.is_dir() else folder)
    times, positions, internal = _read(recording, mission)
    verdict = check_samples(times, positions, mission, max_speed=max_speed, error=error, internal=internal)
    if as_json:
        print_json({"mission": mission.name, "flight": str(recording), **verdict.to_dict()})
    else:
        words = {"holds": "satisfied", "fails": "violated", "undecided": "samples too sparse to tell"}
        typer.echo(f"{words[verdict.outcome]}. {verdict.sentence}")
    if not verdict:
        raise typer.Exit(NotCertified.exit_code)


def _read(path: Path, mission: Mission) -> tuple[Any, dict[str, Any], dict[str, list[frozenset[str]]] | None]:
    """Return times in s, positions in m by robot, and internal propositions where the file is a log of ours."""
    from flight.log import COLUMNS
    from flight.recording import read_recording
    from flight.tables import read_log

    names = tuple(mission.agents)
    try:
        with path.open(encoding="utf-8") as file:
            header = file.readline()
    except (OSError, UnicodeDecodeError):
        header = ""  # read_recording says what is wrong
    if header.startswith(",".join(COLUMNS)):
        log = read_log(path)
        regions = frozenset(mission.all_regions)
        order = {name: log.robots.index(name) for name in names if name in log.robots}
        internal = {name: [row[i] - regions for row in log.letters] for name, i in order.items()}
        return log.times, {name: log.position[:, i] for name, i in order.items()}, internal
    recording = read_recording(path, names)
    return recording.times, {name: recording.position[:, i] for i, name in enumerate(names)}, None
