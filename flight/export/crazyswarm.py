"""Crazyswarm2: one CSV a robot, a crazyflies.yaml and a script that flies the mission.

The CSV is what uav_trajectories and crazyswarm2 read: a header and 33 columns, numbers as `%.9g` so that float32
survives. Crazyswarm2's loader fails on a file with one piece, so such a flight gets a second one: a hover where it ends.
"""

from __future__ import annotations

import io
from collections.abc import Iterable

import numpy as np
from ruamel.yaml import YAML

from flight.export.crazyswarm_script import script
from flight.export.files import NOTE, Product, Request
from verify.data import BadInput, DoesNotFit, Trajectory
from verify.data.ownership import MANIFEST
from verify.data.trajectory_csv import write_csv

PIECES = 31
"""Pieces that the vehicle's memory of 4096 bytes holds."""

HOVER = 1.0
"""s of hover behind a flight of one piece."""

_CONFIGURATION = "crazyflies.yaml"
_SCRIPT = "fly_mission.py"


def file_names(robots: Iterable[str]) -> tuple[str, ...]:
    """Return the names of all files of a crazyswarm2 export, note and manifest included."""
    return (*(f"{name}.csv" for name in robots), _CONFIGURATION, _SCRIPT, NOTE, MANIFEST)


def product(request: Request) -> Product:
    """Return the files of a crazyswarm2 export."""
    require_crazyflie(request)
    uris = request.options.get("uris", {})
    unknown = sorted(set(uris) - set(request.team))
    if unknown:
        raise BadInput(f"uris names '{unknown[0]}', which is not a robot of the mission: {', '.join(request.team)}.")
    files: dict[str, bytes] = {}
    notes: list[str] = []
    for name, path in request.flown.items():
        require_float32(name, path)
        if len(path) > PIECES:
            raise DoesNotFit(
                f"{name} has {len(path)} pieces; the vehicle's memory holds {PIECES}. Fly fewer laps or stream it."
            )
        readable = path
        if len(path) == 1:
            readable, off = with_hover(path)
            notes.append(
                f"{name}.csv has a second piece, a hover of {HOVER:g} s, because crazyswarm2's loader fails on one-piece "
                f"files; in float32 it lies {1e6 * off:.3f} um from where the flight ends."
            )
        files[f"{name}.csv"] = write_csv(readable).encode()
    starts = {name: tuple(map(float, path.evaluate(0.0))) for name, path in request.team.items()}
    duration = max(path.duration for path in request.flown.values())
    files[_CONFIGURATION] = _configuration(request, starts, uris).encode()
    files[_SCRIPT] = script(request, starts, duration).encode()
    notes.append("fly_mission.py climbs, goes to the starts, and begins only if every robot is within the margin of its own.")
    return Product(files, tuple(notes))


def require_crazyflie(request: Request) -> None:
    """Refuse a vehicle that is no Crazyflie by the size of its numbers.

    Raises:
        DoesNotFit: It weighs more than any Crazyflie can lift.
    """
    vehicle = request.mission.vehicle
    if vehicle.mass > 0.1:
        raise DoesNotFit(f"the certificate is for '{vehicle.name}' of {vehicle.mass:g} kg, which is no Crazyflie.")


def require_float32(name: str, path: Trajectory) -> None:
    """Refuse numbers that the vehicle's float32 would change after they were certified.

    Raises:
        DoesNotFit: As said.
    """
    if not path.is_float32:
        raise DoesNotFit(f"{name}'s trajectory does not survive the vehicle's float32; round it before it is certified.")


def with_hover(path: Trajectory) -> tuple[Trajectory, float]:
    """Return a flight followed by a hover at its end in float32, and how far in m that lies from the exact end."""
    end = path.evaluate(path.duration)
    rounded = end.astype(np.float32).astype(np.float64)
    hover = np.zeros((1, 4, 8))
    hover[0, :, 0] = rounded
    longer = Trajectory(np.append(path.durations, HOVER), np.concatenate([path.coefficients, hover]))
    return longer, float(np.linalg.norm((rounded - end)[:3]))


def _configuration(request: Request, starts: dict[str, tuple[float, ...]], uris: dict[str, str]) -> str:
    """Return crazyflies.yaml: who flies, where each stands before the climb, and how positions are known."""
    robots = {
        name: {
            "enabled": True,
            "uri": uris.get(name, f"radio://0/80/2M/E7E7E7E7{index + 1:02X}"),
            "initial_position": [round(start[0], 6), round(start[1], 6), 0.0],
            "type": "ltlplan",
        }
        for index, (name, start) in enumerate(starts.items())
    }
    content = {
        "fileversion": 3,
        "robots": robots,
        "robot_types": {
            "ltlplan": {
                "motion_capture": {"tracking": "librigidbodytracker", "marker": "default", "dynamics": "default"},
                "big_quad": False,
                "battery": {"voltage_warning": 3.8, "voltage_critical": 3.7},
            }
        },
        "all": {
            "firmware_logging": {"enabled": True, "default_topics": {"pose": {"frequency": 10}, "status": {"frequency": 1}}},
            "firmware_params": {"commander": {"enHighLevel": 1}, "stabilizer": {"estimator": 2, "controller": 2}},
            "broadcasts": {"num_repeats": 15, "delay_between_repeats_ms": 1},
        },
    }
    buffer = io.StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]  # ruamel declares it as None
    yaml.dump(content, buffer)
    given = "The radio addresses are the ones that were passed." if uris else "Put your own radio addresses in."
    return f"# Mission '{request.mission.name}', certificate {request.digest}. {given}\n{buffer.getvalue()}"
