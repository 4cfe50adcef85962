"""A user's inventory: each robot's address, what it weighs, and its MAVLink system. It is read, and never written.

A YAML file with a table `robots`: `quad0: {uri: radio://0/80/2M/E7E7E7E701, mass: 0.0331}`, of a PX4 vehicle `{uri: udpin:0.0.0.0:14540, id: 3}`. A `crazyflies.yaml` of crazyswarm2 will do: what
it says beyond that of its robots belongs to crazyswarm2, and is left there. Live flights read a table `motion_capture` beside it, as
crazyswarm2's `motion_capture.yaml` has it: `{type: optitrack, hostname: 192.168.1.2}`.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML, YAMLError

from flight.exports.crazyflies.radio_addresses import heard_by
from verify.data import BadInput, DoesNotFit, Mission, Vehicle
from verify.data.errors import did_you_mean
from verify.data.events import unknown
from verify.data.storage.safe_reading import read_text

_OFF = 0.1
"""Share by which a robot's weight may differ from the certificate's before it is another airframe."""
KEYS = ("uri", "mass", "id")
"""What is read of a robot."""
_CRAZYSWARM2 = ("enabled", "initial_position", "type", "firmware_params", "firmware_logging", "reference_frame")
"""What crazyswarm2 reads of a robot, and we do not."""
_RADIO = re.compile(r"radio://([^/]+)")
"""Of an address, which radio on this machine."""
_ADDRESS = re.compile(r"\w+://.+|(udp|tcp|mcast)\w*:.+|/dev/.+|COM\d+")
"""By radio, or as pymavlink takes them: network or serial port."""
_SYSTEMS = 255
"""Of MAVLink."""
_MOST = 1_000_000
"""Bytes of an inventory."""


@dataclass(frozen=True, slots=True)
class Item:
    """Entry of one robot.

    Attributes:
        uri: Its address, by radio or for MAVLink; None where it is not said.
        mass: kg as it flies; None where it was not weighed.
        id: Its MAVLink system; None where it is not said.
    """

    uri: str | None = None
    mass: float | None = None
    id: int | None = None


@dataclass(frozen=True, slots=True)
class CaptureSystem:
    """Motion capture that sees the robots; its bodies have their names.

    Attributes:
        kind: Such as `optitrack` or `vicon`.
        settings: What it is reached by, such as `hostname`.
    """

    kind: str
    settings: Mapping[str, str]


def read_capture(path: Path) -> CaptureSystem | None:
    """Return the motion capture of an inventory; None where it has none.

    Args:
        path: The file.

    Raises:
        BadInput: It is no inventory, or what it says of motion capture is no table with a `type`.
    """
    table = _content(path).get("motion_capture")
    if table is None:
        return None
    if not isinstance(table, dict) or not isinstance(kind := table.get("type"), str):
        raise BadInput(
            f"{path}: motion_capture must be a table such as {{type: optitrack, hostname: 192.168.1.2}}, not {table!r:.60}."
        )
    return CaptureSystem(kind, {str(key): str(value) for key, value in table.items() if key != "type"})


def require_radios(mission: Mission, items: Mapping[str, Item]) -> None:
    """Reject addresses of more radios than a certificate's skew of the start was reckoned for: they start robots one after the other.

    Args:
        mission: Which says what clocks may be apart, or by how many radios robots are started.
        items: What is known of the robots.

    Raises:
        BadInput: As said.
    """
    radios = {match[1] for item in items.values() if item.uri is not None and (match := _RADIO.match(item.uri))}
    if mission.clock_error is None and len(radios) > (mission.radios or 1):
        raise BadInput(
            f"the addresses are those of {len(radios)} radios, which start their robots one after the other; the certificate counts on "
            f"{mission.radios or 1}. Write `radios: {len(radios)}` in the mission, or the `clock_error` that you know of, and run it again."
        )


def read_inventory(
    source: str | os.PathLike[str] | Mapping[str, Any], robots: Collection[str]
) -> dict[str, Item]:  # plain data
    """Return what an inventory says of a team's robots; robots of other teams are nobody's business here.

    Args:
        source: A file, or the same as plain data: robot to `uri` and `mass`.
        robots: Names of the team.

    Raises:
        BadInput: It is no inventory, a robot of the team has a key that none has, or two of them have one address.
    """
    table, where = (source, "inventory") if isinstance(source, Mapping) else (_table(Path(source)), str(source))
    if not any(name in table for name in robots):
        raise BadInput(f"{where} has no robot of the mission; {unknown(next(iter(robots)), 'robot of the inventory', table)}")
    found = {name: _item(f"{where}: robots.{name}", table[name]) for name in robots if name in table}
    addresses: dict[str, str] = {}
    for name, item in found.items():
        if (
            item.uri is not None
            and (other := addresses.setdefault(_reached(f"{where}: robots.{name}", item.uri), name)) != name
        ):
            raise BadInput(f"{where}: {other} and {name} have one address, {item.uri}.")
    return found


def _reached(where: str, uri: str) -> str:
    """Return what is reached by an address, so that two ways to write it are one; refuse a radio's that cannot be."""
    try:
        return heard_by(uri)
    except BadInput as error:
        raise BadInput(f"{where}.uri: {error}") from None


def _content(path: Path) -> Mapping[str, Any]:
    text = read_text(path, most=_MOST, what="inventory")
    try:
        data = YAML(typ="safe", pure=True).load(text)
    except YAMLError as error:
        raise BadInput(f"{path} is no YAML: {' '.join(str(error).split())[:200]}") from None
    return data if isinstance(data, dict) else {}


def _table(path: Path) -> Mapping[str, Any]:
    robots = _content(path).get("robots")
    if not isinstance(robots, dict) or not robots:
        raise BadInput(
            f"{path} is no inventory: it needs a table `robots`, such as `robots: {{quad0: {{uri: radio://0/80/2M/E7E7E7E701}}}}`."
        )
    return {str(name): row for name, row in robots.items()}


def _item(where: str, row: object) -> Item:
    if not isinstance(row, Mapping):
        raise BadInput(f"{where} must be a table of {' and '.join(KEYS)}, not {row!r:.60}.")
    for key in row:
        if key not in KEYS and key not in _CRAZYSWARM2:
            raise BadInput(f"{where}.{key}: unknown key.{did_you_mean(str(key), KEYS)} Known here: {', '.join(KEYS)}.")
    uri, mass, system = row.get("uri"), row.get("mass"), row.get("id")
    if uri is not None and (not isinstance(uri, str) or not _ADDRESS.fullmatch(uri)):
        raise BadInput(
            f"{where}.uri must be an address such as radio://0/80/2M/E7E7E7E701 or udpin:0.0.0.0:14540, not {uri!r:.60}."
        )
    if mass is not None and (isinstance(mass, bool) or not isinstance(mass, int | float) or not 0 < mass < math.inf):
        raise BadInput(f"{where}.mass must be a number of kg above 0, not {mass!r:.60}.")
    if system is not None and (type(system) is not int or not 1 <= system <= _SYSTEMS):
        raise BadInput(f"{where}.id must be a MAVLink system of 1 to {_SYSTEMS}, not {system!r:.60}.")
    return Item(uri, None if mass is None else float(mass), system)


def system_ids(robots: Iterable[str], items: Mapping[str, Item]) -> dict[str, int]:
    """Return each robot's MAVLink system: as the inventory says, else its place among the robots, from 1.

    Args:
        robots: Who flies.
        items: What is known of the robots.

    Raises:
        BadInput: Two robots would be one system.
    """
    found = {name: items.get(name, Item()).id or index + 1 for index, name in enumerate(robots)}
    of: dict[int, str] = {}
    for name, system in found.items():
        if (other := of.setdefault(system, name)) != name:
            raise BadInput(f"{other} and {name} are both MAVLink system {system}; write `id` of each in the inventory.")
    return found


def checked_weight(name: str, vehicle: Vehicle, mass: float | None) -> float | None:
    """Return a robot's weight as it was given.

    Args:
        name: The robot's.
        vehicle: Its profile.
        mass: kg as it was weighed; None where it was not.

    Raises:
        DoesNotFit: It is another airframe's.
    """
    if mass is not None and abs(mass - vehicle.mass) > _OFF * vehicle.mass:
        raise DoesNotFit(
            f"{name} weighs {1000 * mass:.1f} g, and was certified as {1000 * vehicle.mass:.1f} g: put its mass into its `vehicle`, and certify that."
        )
    return mass
