"""`ltlplan fly RUN --link`: a certified mission flown live."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ltlplan.commands.shared.live_view import View, interrupts_land
from ltlplan.commands.shared.simulation import Outcome, certified, simulating, written
from verify.data import BadInput
from verify.data.events import unknown
from verify.data.progress import part_of

if TYPE_CHECKING:
    from flight import Conditions
    from flight.link.crazyflie.link import CrazyflieLink
    from flight.link.link import Link
    from flight.link.live import LiveFlight
    from flight.link.stages import Stage
    from ltlplan.commands.shared.flight_options import Said
    from ltlplan.transfers import Place
    from verify.data import Mission, Trajectory

FILES = ("poses.csv", "setpoints.csv", "live.csv", "live.json")
"""What a live flight writes."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line says of a link.

    Attributes:
        kind: `simulated`, `crazyflie` or `mavlink`.
        places: `NAME=x,y,z`, where robots stand.
        addresses: `NAME=ADDRESS`.
        inventory: A file of addresses, weights and motion capture; None for none.
        real_time: Whether a simulated second takes a second.
    """

    kind: str
    places: tuple[str, ...]
    addresses: tuple[str, ...]
    inventory: Path | None
    real_time: bool


def fly_over_link(source: str, out: Path | None, asked: Asked, said: Said, seed: int | None, *, json: bool) -> None:
    """Fly a certified mission over a link, and show how it ended.

    Args:
        source: A run's folder, a mission's file, or the name of a shipped mission.
        out: Folder for what was measured and asked; None writes nothing.
        asked: Which link, and where robots are.
        said: What simulated robots fly in and with.
        seed: Of every random number of theirs; None takes the plan's.
        json: One JSON document instead of text.

    Raises:
        NotCertified: The flight was not flown to its end inside the margin.
        BadInput: A place or an address makes no sense.
        LinkLost: A robot cannot be reached.
    """
    from flight.link.live import fly_live
    from ltlplan.live import stages

    require_sense(asked, said)
    mission = _mission(source)
    told, conditions = told_places(asked.places, mission), said.conditions(mission)
    with ExitStack() as opened:
        with simulating(out, FILES, quiet=json) as progress:
            progress("reaching the robots", 0.0)  # before what takes its time: who is not there is said at once
            link = None if asked.kind == "simulated" else opened.enter_context(closing(vehicles(asked, mission, source)))
            plan, team, certificate = certified(source, part_of(progress, 0.1, 0.5))
            stand = {**below_starts(team), **told}
            flown = stages(plan, team, certificate, stand, progress=part_of(progress, 0.5, 0.9))
            progress("judging whether it can be broken off", 0.9)
            abort = _abort(asked.kind, flown)
        if not json:
            typer.echo(abort)
        if link is None:
            seed = plan.seed if seed is None else seed
            link = opened.enter_context(closing(simulated_robots(mission, stand, conditions, seed, real_time=asked.real_time)))
        view = View(quiet=json)
        with interrupts_land():
            done = fly_live(link, flown, grounds={name: place[2] for name, place in stand.items()}, show=view.show)
    view.end()
    texts = done.record.files(mission.frame)

    files = written(out, lambda folder: write_texts(texts, folder))
    _outcome(done, mission.name, link.failsafe, abort).show(files, as_json=json)


def write_texts(texts: Mapping[str, str], folder: Path) -> None:
    """Write files of a live flight.

    Args:
        texts: By name.
        folder: Where; it exists.
    """
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")


def _abort(kind: str, flown: tuple[Stage, ...]) -> str:
    """Return what is proved of breaking the flight off, all stages judged."""
    from ltlplan.result import aborts_of

    if kind != "simulated":
        return "Abort not certified: what vehicles have on board brakes in a way of its own."
    verdicts = {stage.name: aborts_of(stage.plan.mission, stage.team, stage.certificate) for stage in flown}
    refused = [f"{name}: {verdict.sentence}" for name, verdict in verdicts.items() if not verdict]
    return " ".join(refused) or next(iter(verdicts.values())).sentence


def require_sense(asked: Asked, said: Said) -> None:
    """Refuse options that do not go with a kind of link.

    Args:
        asked: Which link, and where robots are.
        said: What simulated robots are to fly in and with.

    Raises:
        BadInput: One does not.
    """
    if asked.kind != "simulated" and said.anything:
        raise BadInput(
            f"--wind, --noise, --model, --controller, --estimator, --latency and --mass go with simulated robots; {asked.kind} is real."
        )
    if asked.kind == "simulated" and asked.addresses:
        raise BadInput("--address goes with --link crazyflie and mavlink, not simulated.")
    if asked.kind == "simulated" and asked.inventory:
        raise BadInput("--inventory goes with --link crazyflie and mavlink, not simulated.")
    if asked.kind != "simulated" and asked.real_time:
        raise BadInput(f"--real-time goes with --link simulated; {asked.kind} is real.")


def _mission(source: str) -> Mission:
    """Read the mission that is to be flown, without proving anything."""
    from ltlplan.missions import load_mission
    from verify.data.files.mission_file import load_mission_file
    from verify.run_folder import MISSION_FILE

    folder = Path(source)
    return load_mission_file(folder / MISSION_FILE, installed=False, alone=True) if folder.is_dir() else load_mission(source)


def simulated_robots(mission: Mission, stand: dict[str, Place], conditions: Conditions, seed: int, *, real_time: bool) -> Link:
    """Put simulated robots into the laboratory, and speak to them in the mission's frame.

    Args:
        mission: Who flies.
        stand: Where they stand, in the mission's frame, m.
        conditions: What they fly in and with.
        seed: Of every random number.
        real_time: Whether a second takes a second.
    """
    from flight.frames import mission_in_laboratory
    from flight.link.simulated import SimulatedLink

    there = stand
    if mission.frame is not None:
        seen = mission.frame.to_laboratory(list(stand.values())).tolist()
        there = {name: (x, y, z) for name, (x, y, z) in zip(stand, seen, strict=True)}
    link = SimulatedLink(mission_in_laboratory(mission), there, conditions=conditions, seed=seed, real_time=real_time)
    return _framed(link, mission)


def vehicles(asked: Asked, mission: Mission, source: str | None = None) -> Link:
    """Reach vehicles, and speak to them in the mission's frame.

    Args:
        asked: Which link, and their addresses.
        mission: Who flies.
        source: A run's folder, whose flight the memories of vehicles that store flights must hold; another source's is not known yet.

    Raises:
        BadInput: An address makes no sense.
        LinkLost: A robot cannot be reached.
        DoesNotFit: A memory does not hold it.
    """
    from flight.frames import mission_in_laboratory

    addresses: dict[str, str] = {}
    for text in asked.addresses:
        name, _, address = text.partition("=")
        if name in addresses:
            raise BadInput(f"--address names {name} twice.")
        addresses[name] = address
    laboratory = mission_in_laboratory(mission)
    if asked.kind == "crazyflie":
        link = _crazyflies(asked.inventory, laboratory, addresses)
        try:
            link.require_room(_flown(source, mission))
        except BaseException:
            link.close()
            raise
        return _framed(link, mission)
    return _framed(_px4(asked.inventory, laboratory, addresses), mission)


def _flown(source: str | None, mission: Mission) -> dict[str, Trajectory]:
    """Return what a run's folder has its robots fly, as the laboratory sees it; nobody's of a mission that is still to be planned."""
    from flight.frames import team_in_laboratory
    from verify.run_folder import read_folder

    if source is None or not Path(source).is_dir():
        return {}
    team = {name: path.flattened(mission.spec.repeat) for name, path in read_folder(source)[1].items()}
    return team_in_laboratory(mission, team)[0]


def _framed(link: Link, mission: Mission) -> Link:
    """Return a link to the laboratory that is spoken to in the mission's frame."""
    from flight.link.framed import FramedLink

    return link if mission.frame is None else FramedLink(link, mission.frame)


def _px4(inventory: Path | None, mission: Mission, addresses: dict[str, str]) -> Link:
    """Reach PX4 vehicles by an inventory and by addresses, which go before its own."""
    from flight.exports.crazyflies.inventory import read_capture, read_inventory, system_ids
    from flight.link.mavlink import MavlinkLink

    items = {} if inventory is None else read_inventory(inventory, tuple(mission.agents))
    if inventory is not None and read_capture(inventory) is not None:
        raise BadInput(f"{inventory}: motion_capture goes with --link crazyflie; PX4 is given poses by its own companion.")
    known = {name: item.uri for name, item in items.items() if item.uri is not None}
    return MavlinkLink(mission, {**known, **addresses}, systems=system_ids(mission.agents, items))


def _crazyflies(inventory: Path | None, mission: Mission, addresses: dict[str, str]) -> CrazyflieLink:
    """Reach Crazyflies by an inventory and by addresses, which go before its own."""
    from flight.exports.crazyflies.inventory import read_capture, read_inventory
    from flight.link.crazyflie.capture import connected_to
    from flight.link.crazyflie.link import CrazyflieLink

    items = {} if inventory is None else read_inventory(inventory, tuple(mission.agents))
    system = None if inventory is None else read_capture(inventory)
    known = {name: item.uri for name, item in items.items() if item.uri is not None}
    masses = {name: item.mass for name, item in items.items() if item.mass is not None}
    capture = None if system is None else connected_to(system.kind, system.settings)
    return CrazyflieLink(mission, {**known, **addresses}, masses=masses, capture=capture)


def told_places(texts: tuple[str, ...], mission: Mission) -> dict[str, Place]:
    """Return where robots are said to stand, in the mission's frame.

    Args:
        texts: `NAME=x,y,z`, in the laboratory's frame.
        mission: Whose robots.

    Raises:
        BadInput: A text names no robot, one twice, or no place.
    """
    found: dict[str, Place] = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        if name not in mission.agents:
            raise BadInput(f"--place {text}: {unknown(name, 'robot of the mission', mission.agents)}")
        if name in found:
            raise BadInput(f"--place names {name} twice.")
        try:
            x, y, z = (float(part) for part in numbers.split(","))
        except ValueError:
            raise BadInput(f"--place {text}: write NAME=x,y,z in m, such as {name}=0.5,-1,0.") from None
        if not all(map(math.isfinite, (x, y, z))):
            raise BadInput(f"--place {text}: a place is finite.")
        if mission.frame is not None:
            x, y, z = mission.frame.to_mission((x, y, z)).tolist()
        found[name] = (x, y, z)
    return found


def below_starts(team: Mapping[str, Trajectory]) -> dict[str, Place]:
    """Return the places at z = 0 below a team's starts.

    Args:
        team: Its trajectories.
    """
    starts = {name: path.evaluate(0.0).tolist() for name, path in team.items()}
    return {name: (start[0], start[1], 0.0) for name, start in starts.items()}


def _outcome(done: LiveFlight, mission: str, failsafe: str, abort: str) -> Outcome:
    lines = [
        *worst_lines(done),
        *(event.sentence for event in done.record.events if event.kind in ("alarm", "reaction")),
        f"On board when the link is gone: {failsafe}.",
    ]
    return Outcome(lines, {"mission": mission, "abort": abort, **data_of(done)}, refusal_of(done))


def worst_lines(done: LiveFlight) -> list[str]:
    """Return how far robots were from their plans at most, a line a stage.

    Args:
        done: The flight.
    """
    return [
        f"{stage}: " + ", ".join(f"{robot} at most {1000 * off:.1f} mm from its plan" for robot, off in worst.items())
        for stage, worst in done.record.worst.items()
    ]


def refusal_of(done: LiveFlight) -> str | None:
    """Return why a flight was ended; None where it was flown to its end.

    Args:
        done: The flight.
    """
    return None if done.flown else f"The flight was ended: {done.reason or 'not every robot is known to stand still'}"


def data_of(done: LiveFlight) -> dict[str, Any]:
    """Return how a live flight ended as plain data.

    Args:
        done: The flight.
    """
    return {
        "flown": done.flown,
        "reason": done.reason,
        "unsafe": list(done.unsafe),
        "worst": done.record.worst,
        "checks": [{"name": c.name, "robot": c.robot, "passed": c.passed, "sentence": c.sentence} for c in done.checks],
    }
