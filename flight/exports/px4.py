"""PX4 and ArduPilot: MAVLink setpoints for offboard (guided) flight, as a telemetry log a robot, and a script that sends them.

Each entry is a SET_POSITION_TARGET_LOCAL_NED with position, velocity, acceleration, heading and its rate. Our world is taken
as east, north, up (ROS's REP 103), theirs is north, east, down: north = y, east = x, down = -z, and heading is counted
from north clockwise. A `.tlog` is eight bytes of time (microseconds, big-endian) before each message.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np

from flight.control.profiles import autopilot_of_vehicle, controller_name
from flight.exports.bundled_scripts import STREAM, about, batteries_said, climb_and_landing, scripts, written
from flight.exports.crazyflies.inventory import read_inventory, system_ids
from flight.exports.px4_parameters import px4_parameters
from flight.exports.target import ExportTarget, Product, Request
from flight.model.attitude import Floats
from flight.monitoring.thresholds import PX4_ACCURACY
from verify.data import BadInput, MissingEngine, Trajectory

RATE = 50.0
"""Setpoints a second."""
FAILSAFE = {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 4}
"""What acts on board when set-points end: after so many seconds, land (4)."""

_SENDER = (255, 190)  # system and component of a ground station's planner
_AUTOPILOT = 1


def _product(request: Request) -> Product:
    """Return one `.tlog` a robot, `flight.json` with what belongs to all, and `stream_setpoints.py` that flies them with PX4."""
    rate, origin = float(request.options.get("rate", RATE)), request.options.get("origin", (0.0, 0.0, 0.0))
    if not 2.0 < rate <= 500.0:
        raise BadInput(f"rate must be above 2 (PX4 leaves offboard flight below that) and at most 500 a second, not {rate:g}.")
    try:
        centre = np.array([float(x) for x in origin])
    except (TypeError, ValueError):
        centre = np.zeros(0)
    if centre.shape != (3,) or not np.all(np.isfinite(centre)):
        raise BadInput(f"origin must be three finite numbers in m, not {origin}.")
    duration = max(path.duration for path in request.flown.values())
    inventory = request.options.get("inventory")
    items = {} if inventory is None else read_inventory(inventory, tuple(request.team))
    systems = system_ids(request.team, items)
    files = {
        f"{name}.tlog": _log(path, systems[name], rate, centre, duration, (f"certificate {request.digest}", request.warning))
        for name, path in request.flown.items()
    }
    robots = {
        name: {
            "system": systems[name],
            "file": f"{name}.tlog",
            "controller": controller_name(request.mission.vehicle_of(name)),
            "gains": px4_parameters(request.mission.vehicle_of(name)),
        }
        for name in request.team
    }
    data = about(request, PX4_ACCURACY, robots) | {
        "lasts": duration,
        "rate": rate,
        "origin": centre.tolist(),
        "failsafe": FAILSAFE,
    }
    files |= scripts(STREAM) | written(data)
    said = ", ".join(f"{name} is system {systems[name]}" for name in request.team)
    _, landing = climb_and_landing(request)
    return Product(
        files,
        (
            f"Setpoints at {rate:g} a second; {said}. stream_setpoints.py sends them to PX4 in real time; see its first lines.",
            *batteries_said(request, "stream_setpoints.py"),
            "Bring every robot to a hover at its start yourself, and land them yourself: at the end all hold where they are (PX4's hold). "
            f"{landing.sentence}",
            "North is the mission's y, east its x; the local frame's origin is "
            f"({', '.join(f'{x:g}' for x in centre)}) m in the mission's frame.",
            "The certificate is of the path that the setpoints are samples of; what an autopilot does between them is its own.",
            *_gains_said(request),
        ),
        (
            "the climb to the start before time 0, which is the pilot's",
            "the hold behind the last setpoint, and the landing, as said above",
        ),
    )


def _gains_said(request: Request) -> tuple[str, ...]:
    """Return a note on the parameters that were simulated, for each table of them."""
    tables: dict[str, list[str]] = {}
    for name in request.team:
        vehicle = request.mission.vehicle_of(name)
        if controller_name(vehicle) == "px4":
            tables.setdefault(autopilot_of_vehicle(vehicle).name, []).append(name)
    return tuple(
        f"{', '.join(names)} must fly with the parameters that were simulated, PX4's of the table '{table}' (docs/px4.md lists them). "
        "stream_setpoints.py reads the gains on board, and flies with no others; it sets none."
        for table, names in tables.items()
    )


def to_ned(flat: Floats, origin: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return position, velocity and acceleration in NED, heading and its rate.

    Args:
        flat: x, y, z, yaw and two derivatives. Shape (3, samples, 4).
        origin: m. Shape (3,).

    Returns:
        Shapes (samples, 3) three times, (samples,) twice.
    """
    position = flat[0, :, :3] - origin
    swapped = [np.stack([v[:, 1], v[:, 0], -v[:, 2]], axis=1) for v in (position, flat[1, :, :3], flat[2, :, :3])]
    heading = np.mod(math.pi / 2 - flat[0, :, 3] + math.pi, 2 * math.pi) - math.pi
    return swapped[0], swapped[1], swapped[2], heading, -flat[1, :, 3]


def _log(path: Trajectory, system: int, rate: float, origin: Floats, duration: float, said: tuple[str, ...]) -> bytes:
    mavlink = _pymavlink()
    packer = mavlink.MAVLink(None, srcSystem=_SENDER[0], srcComponent=_SENDER[1])
    content = bytearray()

    def add(message: Any, microseconds: int) -> None:
        content.extend(struct.pack(">Q", microseconds))
        content.extend(message.pack(packer))
        packer.seq = (packer.seq + 1) % 256

    for number, text in enumerate(said, start=1):
        words = text.encode()
        for chunk in range(-(-len(words) // 50)):
            part = words[50 * chunk : 50 * chunk + 50]
            add(mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_INFO, part, id=number, chunk_seq=chunk), 0)
    times = np.minimum(np.arange(math.ceil(round(duration * rate, 6)) + 1) / rate, duration)
    flat = np.stack([path.evaluate(times, order) for order in range(3)])
    rows = np.concatenate([part.reshape(len(times), -1) for part in to_ned(flat, origin)], axis=1)
    for time, row in zip(times.tolist(), rows.tolist(), strict=True):
        message = mavlink.MAVLink_set_position_target_local_ned_message(
            round(1000 * time), system, _AUTOPILOT, mavlink.MAV_FRAME_LOCAL_NED, 0, *row
        )
        add(message, round(1e6 * time))
    return bytes(content)


def _pymavlink() -> Any:
    """Return pymavlink's MAVLink 2 dialect."""
    try:
        from pymavlink.dialects.v20 import common
    except ImportError:
        raise MissingEngine("PX4 export needs pymavlink: pip install 'ltlplan[px4]'.") from None
    return common


PX4 = ExportTarget(
    name="px4",
    make=_product,
    options={
        "rate": "setpoints a second",
        "origin": "m, the local frame's origin in the mission's",
        "inventory": "file or table: robot to `id`, its MAVLink system",
    },
    voids=(
        "sending the setpoints at another rate, or late",
        "other gains on board than those of the vehicle's autopilot table",
        "an estimator whose local frame is not the mission's (see the origin above)",
    ),
    controllers=("px4",),
    rate=RATE,
    orders=2,
)
