"""Links that the command line names: what is said of them, where robots stand, and the vehicles reached."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from verify.data import BadInput
from verify.data.events import unknown

if TYPE_CHECKING:
    from flight import Conditions
    from flight.condition_options import Said
    from flight.link.crazyflie.link import CrazyflieLink
    from flight.link.link import Link
    from ltlplan.transfers import Place
    from verify.data import Mission, Trajectory


Flown = Literal["on board", "from here"]
"""Whether vehicles that can do both fly what is stored on board, or set-points that are sent to them."""


@dataclass(frozen=True, slots=True)
class Asked:
    """Options of a link as the command line gives them.

    Attributes:
        kind: `simulated`, `crazyflie` or `mavlink`.
        places: `NAME=x,y,z`, where robots stand.
        addresses: `NAME=ADDRESS`.
        inventory: A file of addresses, weights and motion capture; None for none.
        real_time: Whether a simulated second takes a second.
        unchecked: Checks without which the operator flies where they cannot be made.
        followed: Services at which a stored flight is seen.
    """

    kind: str
    places: tuple[str, ...]
    addresses: tuple[str, ...]
    inventory: Path | None
    real_time: bool
    unchecked: tuple[str, ...] = ()
    followed: tuple[str, ...] = ()


def require_sense(asked: Asked, said: Said) -> None:
    """Reject options that do not go with a kind of link.

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


def require_batteries(asked: Asked, mission: Mission) -> str:
    """Reject vehicles whose battery cannot be compared with the flight's length, unless that is accepted; return a sentence on them, or nothing.

    Args:
        asked: Which link; simulated vehicles always have an endurance.
        mission: Names the vehicles.

    Raises:
        BadInput: There are such vehicles, and nothing was said of it.
    """
    unknown = [name for name in mission.agents if mission.vehicle_of(name).endurance is None]
    if not unknown or asked.kind == "simulated":
        return ""
    sentence = (
        f"Not checked: whether the battery of {', '.join(unknown)} lasts for the flight, as the vehicle's profile has no `endurance` (s, "
        "from take-off to touchdown)"
    )
    if "battery" in asked.unchecked:
        return f"{sentence}."
    raise BadInput(f"{sentence}: give it one in the mission, or add --unchecked battery to fly without that check.")


def flying_controllers(kind: str, mission: Mission, conditions: Conditions) -> dict[str, str]:
    """Return the name of the controller that flies each robot over a kind of link.

    Args:
        kind: `simulated`, `crazyflie` or `mavlink`.
        mission: Who flies.
        conditions: What simulated robots fly in and with.
    """
    from flight.control.profiles import controller_name
    from flight.exports.crazyflies.parameters import NUMBERS

    found: dict[str, str] = {}
    for name in mission.agents:
        own = controller_name(vehicle := mission.vehicle_of(name))
        on_board = {"simulated": conditions.follower(vehicle), "mavlink": "px4"}
        found[name] = on_board.get(kind, own if own in NUMBERS else "mellinger")
    return found


def controllers_said(flown: Mapping[str, str], mission: Mission, *, streamed: bool = False) -> str:
    """Return a sentence on who flies, and on robots whose margin is meant for another controller.

    Args:
        flown: Name of the controller of each robot.
        mission: Who flies.
        streamed: Whether set-points are sent from here to a controller on board.
    """
    from flight.conditions import conditions_of

    conditions = conditions_of(mission)
    said = "Controllers: " + ", ".join(f"{name} {controller}" for name, controller in flown.items()) + "."
    others = {name: own for name in flown if (own := conditions.follower(mission.vehicle_of(name))) != flown[name]}
    if streamed and mission.disturbance is not None and not others:
        said += " Tracking is not proved for them, as their set-points are streamed from here."
    if others:
        meant = ", ".join(f"{name} for '{own}'" for name, own in others.items())
        said += f" The margin is meant for another ({meant}), so that no simulated flight says that they keep to their paths."
        said += "" if mission.disturbance is None else " Tracking is not proved for them."
    return said


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


def vehicles(asked: Asked, mission: Mission, source: str | None = None, *, flown: Flown = "on board") -> Link:
    """Reach vehicles, and speak to them in the mission's frame.

    Args:
        asked: Which link, and their addresses.
        mission: Who flies.
        source: A run's folder, whose flight the memories of vehicles that store flights must hold; another source's is not known yet.
        flown: Where flights are that vehicles follow.

    Raises:
        BadInput: An address makes no sense.
        LinkLost: A robot cannot be reached.
        DoesNotFit: A memory does not hold it, or a set-point cannot say it.
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
        link = _crazyflies(asked.inventory, laboratory, addresses, flown)
        try:
            for stored in _stored(source, mission):
                link.require_room(stored)
        except BaseException:
            link.close()
            raise
        return _framed(link, mission)
    return _framed(_px4(asked.inventory, laboratory, addresses), mission)


def _stored(source: str | None, mission: Mission) -> list[dict[str, Trajectory]]:
    """Return what a run's folder has its robots hold at once, part by part, as the laboratory sees it; nothing of a mission that is still to be planned."""
    from flight.frames import team_in_laboratory
    from verify.run_folder import read_folder

    if source is None or not Path(source).is_dir():
        return []
    team = {name: path if path.cuts else path.flattened(mission.spec.repeat) for name, path in read_folder(source)[1].items()}
    found = [
        {name: path.part(*path.parts[number]) for name, path in team.items() if number < len(path.parts)}
        for number in range(max(len(path.parts) for path in team.values()))
    ]
    return [team_in_laboratory(mission, paths)[0] for paths in found]


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


def _crazyflies(inventory: Path | None, mission: Mission, addresses: dict[str, str], flown: Flown) -> CrazyflieLink:
    """Reach Crazyflies by an inventory and by addresses, which go before its own."""
    from flight.exports.crazyflies.inventory import read_capture, read_inventory
    from flight.link.crazyflie.capture import connected_to
    from flight.link.crazyflie.link import CrazyflieLink
    from flight.link.crazyflie.streamed import StreamedCrazyflies

    items = {} if inventory is None else read_inventory(inventory, tuple(mission.agents))
    system = None if inventory is None else read_capture(inventory)
    known = {name: item.uri for name, item in items.items() if item.uri is not None}
    masses = {name: item.mass for name, item in items.items() if item.mass is not None}
    capture = None if system is None else connected_to(system.kind, system.settings)
    kind = CrazyflieLink if flown == "on board" else StreamedCrazyflies
    return kind(mission, {**known, **addresses}, masses=masses, capture=capture)


def told_places(texts: tuple[str, ...], mission: Mission) -> dict[str, Place]:
    """Return where robots are said to stand, in the mission's frame.

    Args:
        texts: `NAME=x,y,z`, in the laboratory's frame.
        mission: Whose robots.

    Raises:
        BadInput: A text names no robot, one twice, or no place.
    """
    for text in texts:
        name = text.partition("=")[0]
        if name not in mission.agents:
            raise BadInput(f"--place {text}: {unknown(name, 'robot of the mission', mission.agents)}")
    return places_of("--place", texts, mission)


def places_of(option: str, texts: tuple[str, ...], mission: Mission) -> dict[str, Place]:
    """Return where robots, whoever they are, are said to stand, in the mission's frame.

    Args:
        option: How it is said.
        texts: `NAME=x,y,z`, in the laboratory's frame.
        mission: Says where that lies.

    Raises:
        BadInput: A text names a robot twice, or no place.
    """
    found: dict[str, Place] = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        if name in found:
            raise BadInput(f"{option} names {name} twice.")
        try:
            x, y, z = (float(part) for part in numbers.split(","))
        except ValueError:
            raise BadInput(f"{option} {text}: write NAME=x,y,z in m, such as {name or 'quad3'}=0.5,-1,0.") from None
        if not name or not all(map(math.isfinite, (x, y, z))):
            raise BadInput(f"{option} {text}: {'a place is finite' if name else 'it has no name before the place'}.")
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
