"""Crazyswarm2: one CSV a robot, a crazyflies.yaml, and scripts that fly the mission by the numbers in flight.json.

The CSV is what uav_trajectories and crazyswarm2 read: a header and 33 columns, numbers as `%.9g` so that float32
survives. Crazyswarm2's loader fails on a file with one piece; `with_hovers` gives such flights a second one, which is then certified
with the first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from flight.control.profiles import controller_name
from flight.exports.braking import AtMost
from flight.exports.bundled_scripts import DATA, SWARM, about, batteries_said, climb_and_landing, scripts, written
from flight.exports.crazyflies.fits import crazyflies, require_crazyflie, require_float32, require_held
from flight.exports.crazyflies.inventory import Item, checked_weight, read_inventory, require_radios
from flight.exports.crazyflies.parameters import NUMBERS, cannot_fly, parameters_read, sentence
from flight.exports.crazyflies.radio_addresses import heard_by
from flight.exports.crazyflies.swarm_settings import configuration, weights_said
from flight.exports.parts import Part, notes_on, order_of, parts_of
from flight.exports.target import NOTE, ExportTarget, Product, Request
from flight.monitoring.thresholds import CRAZYFLIE_ACCURACY
from flight.storage.ownership import MANIFEST
from verify.data import BadInput, DoesNotFit, Mission, Trajectory
from verify.data.files.trajectory_csv import write_csv
from verify.data.trajectory import HOVER, PAUSE, PIECES

_CONFIGURATION = "crazyflies.yaml"


def file_names(robots: Iterable[str]) -> tuple[str, ...]:
    """Return the names of all files of a crazyswarm2 export, note and manifest included."""
    return (*(f"{name}.csv" for name in robots), _CONFIGURATION, DATA, *SWARM, NOTE, MANIFEST)


def _product(request: Request) -> Product:
    require_crazyflie(request)
    items = _items(request)
    files: dict[str, bytes] = {}
    parts = parts_of(request)
    for part in parts:
        for name, path in part.paths.items():
            require_float32(name, path)
            require_held(request.mission, name, path, part.ending)
            if len(path) == 1:
                raise DoesNotFit(
                    f"{name} has one piece, and crazyswarm2's loader fails on such files; certify `flight.with_hovers(team)` and "
                    "export that (a lap of one piece that moves needs a second one, or `repeat` 2)."
                )
            files[f"{name}{part.ending}.csv"] = write_csv(path).encode()
    files[_CONFIGURATION] = configuration(request, parts[0].starts, items).encode()
    climb, landing = climb_and_landing(request)
    files |= scripts(SWARM) | written(
        _described(request, parts, items) | {"climb": "; ".join(climb.faults), "landing": "; ".join(landing.faults)}
    )
    vehicles = dict.fromkeys(request.mission.vehicle_of(name) for name in request.team)
    notes = (
        "fly_mission.py flies it; its first lines say what it looks at before and in flight, and what it does where something is wrong. It climbs "
        "only if every robot stands below its own start, and begins only if each is within half a margin of it.",
        climb.sentence,
        *(
            ()
            if climb.certified
            else ("fly_mission.py does not climb: have robots hover at their starts, and add --hovering.",)
        ),
        landing.sentence,
        *(
            ()
            if landing.certified
            else ("fly_mission.py flies it only with --watch-landing; have the mission end where robots can land.",)
        ),
        *batteries_said(request, "fly_mission.py"),
        "Where something ends the flight, all brake to a hover and land straight down from there: that is not certified.",
        *(f"crazyflies.yaml sets what was simulated. {sentence(vehicle)}" for vehicle in vehicles),
        *weights_said(request, items),
        *notes_on(request, parts),
    )
    beyond = [f"the {which.name}, as said above" for which in (climb, landing) if not which.certified]
    return Product(
        files, notes, (*beyond, "the ways of vehicles that leave their margin, and of those that a fault has all land")
    )


def _described(request: Request, parts: tuple[Part, ...], items: Mapping[str, Item]) -> dict[str, object]:
    """Return what fly_mission.py has to know."""
    mission = request.mission
    robots = {
        name: {"parameters": parameters_read(vehicle, checked_weight(name, vehicle, items.get(name, Item()).mass))}
        for name in request.team
        for vehicle in (mission.vehicle_of(name),)
    }
    return {
        **about(request, CRAZYFLIE_ACCURACY, robots),
        "parts": [
            {
                "ending": part.ending,
                "duration": part.duration,
                "starts": {name: list(place) for name, place in part.starts.items()},
            }
            for part in parts
        ],
        "order": list(order_of(request)),
        "pause": PAUSE,
    }


def with_hovers(team: Mapping[str, Trajectory], laps: int = 1) -> dict[str, Trajectory]:
    """Return a team's flights with two pieces at least, so that crazyswarm2 can read them: the ones to certify and export.

    A hover of one piece is cut into halves, which are the same flight. Behind any other flight of one piece comes a hover
    of 1 s where it ends, to the nearest float32: a step that only a certificate of both pieces covers. A lap of one
    piece that moves is returned as it is, and so is a flight in parts.
    """
    return {name: _readable(path) if len(path.flattened(laps)) == 1 else path for name, path in team.items()}


def _readable(path: Trajectory) -> Trajectory:
    if not path.coefficients[:, :, 1:].any():
        return Trajectory(np.repeat(path.durations / 2, 2), np.repeat(path.coefficients, 2, axis=0), cycle=path.cycle)
    if path.cycle is not None:
        return path
    hover = np.zeros((1, 4, 8))
    hover[0, :, 0] = path.evaluate(path.duration).astype(np.float32)
    return Trajectory(np.append(path.durations, HOVER), np.concatenate([path.coefficients, hover]))


def _items(request: Request) -> dict[str, Item]:
    """Return what inventory and addresses say of robots; an address that is passed goes before the inventory's."""
    uris = request.options.get("uris", {})
    unknown = sorted(set(uris) - set(request.team))
    if unknown:
        raise BadInput(f"uris names '{unknown[0]}', which is not a robot of the mission: {', '.join(request.team)}.")
    inventory = request.options.get("inventory")
    items = {} if inventory is None else read_inventory(inventory, tuple(request.team))
    found = {**items, **{name: replace(items.get(name, Item()), uri=uri) for name, uri in uris.items()}}
    reached: dict[str, str] = {}
    for name, item in found.items():
        if item.uri is not None and (other := reached.setdefault(heard_by(item.uri), name)) != name:
            raise BadInput(f"{other} and {name} have one address, {item.uri}.")
    require_radios(request.mission, found)
    return found


CRAZYSWARM2 = ExportTarget(
    name="crazyswarm2",
    make=_product,
    options={"uris": "robot to radio address", "inventory": "file or table: robot to `uri` and `mass`"},
    voids=(
        "a `timescale` other than 1 (below 1 also breaks the vehicle's limits)",
        "`relative=True` in startTrajectory, which is crazyswarm2's default: the path is shifted to wherever the robot is",
        "`reverse=True`, or retiming single pieces",
    ),
    prepare=with_hovers,
    in_parts=True,
    join=AtMost(PIECES),
    controllers=tuple(NUMBERS),
    cannot_fly=cannot_fly,
)


def crazyswarm2_robots(mission: Mission) -> tuple[str, ...]:
    """Return the robots that crazyswarm2 flies by the controllers of their profiles: of a mixed team among the Crazyflies.

    Args:
        mission: Says what they fly.
    """
    robots = tuple(mission.agents) if mission.of_one_kind else crazyflies(mission, mission.agents)
    vehicles = {name: mission.vehicle_of(name) for name in robots}
    return tuple(name for name, own in vehicles.items() if CRAZYSWARM2.runs(controller_name(own)) and not cannot_fly(own))


def left_out(mission: Mission) -> str:
    """Return a sentence on Crazyflies that it does not fly, as they run other controllers than their profiles name; empty where there are none.

    Args:
        mission: Says what they fly.
    """
    flown = crazyswarm2_robots(mission)
    others = [name for name in crazyflies(mission, mission.agents) if name not in flown]
    if not others:
        return ""
    if CRAZYSWARM2.runs(controller_name(first := mission.vehicle_of(others[0]))):
        return f"crazyswarm2 leaves out {', '.join(others)}: of '{first.name}' {cannot_fly(first)}."
    by = ", ".join(dict.fromkeys(f"'{controller_name(mission.vehicle_of(name))}'" for name in others))
    return f"crazyswarm2 leaves out {', '.join(others)}: flown by {by}, which Crazyflies do not run. Name `controller: mellinger` in the vehicle's profile."
