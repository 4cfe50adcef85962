"""Scripts and numbers bundled with exports for live flights: scripts from `scripts`, and `flight.json` with all numbers that they fly by."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np

from flight.exports.target import Request
from flight.exports.vertical_corridors import Columns, columns
from flight.monitoring import thresholds
from flight.monitoring.alarm_response import LANDING_SPEED, braking, braking_length

DATA = "flight.json"
_SWARM = (
    "__init__",
    "before",
    "checks",
    "crazyswarm",
    "ending",
    "paths",
    "record",
    "simulator",
    "stages",
    "standing",
    "starts",
    "supervisor",
    "watch",
)
_STREAM = ("__init__", "checks", "px4", "record", "reports", "starts", "streaming", "watch")
SWARM = ("fly_mission.py", *(f"flying/{name}.py" for name in _SWARM))
"""With crazyswarm2."""
STREAM = ("stream_setpoints.py", *(f"flying/{name}.py" for name in _STREAM))
"""With PX4."""

_PEAK = 35.0 / 16.0
"""Greatest speed of a climb against its mean: of a step of degree 7 from rest to rest."""
_BESIDE = 8.0
"""s that robots hover before, between and after what is flown: on the way to the start, and before they land."""


def scripts(names: tuple[str, ...]) -> dict[str, bytes]:
    """Return scripts by name.

    Args:
        names: As `SWARM` and `STREAM` have them.
    """
    folder = resources.files("flight.exports") / "scripts"
    return {name: folder.joinpath(*name.split("/")).read_bytes() for name in names}


def climb_and_landing(request: Request) -> tuple[Columns, Columns]:
    """Return what is proved of straight ways up to the starts, and down from the ends.

    Args:
        request: The export.
    """
    return (
        columns(request.mission, request.whole, "climb", request.margin),
        columns(request.mission, request.whole, "landing", request.margin),
    )


def batteries_said(request: Request, script: str) -> tuple[str, ...]:
    """Return a note on robots whose battery a script cannot hold against the flight; nothing where there are none.

    Args:
        request: The export.
        script: What flies it.
    """
    unknown = [name for name in request.team if request.mission.vehicle_of(name).endurance is None]
    if not unknown:
        return ()
    return (f"The vehicle of {', '.join(unknown)} has no `endurance`: {script} flies only with --unchecked battery.",)


def seconds_to_climb(request: Request) -> float:
    """Return s that climbing a metre takes.

    Args:
        request: The export.
    """
    speeds = [request.mission.limits_of(name).speed for name in request.team]
    return _PEAK / min(thresholds.CLIMB_SPEED, *speeds)


def about(request: Request, accuracy: float, robots: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return what scripts have to know of a flight.

    Args:
        request: The export.
        accuracy: m that a measured position may be off.
        robots: What else is to be known of each robot.
    """
    mission, flown = request.mission, request.flown
    rows: dict[str, dict[str, Any]] = {}
    for name, path in flown.items():
        start, end = path.evaluate(0.0).tolist(), path.evaluate(path.duration).tolist()
        rows[name] = {"start": start, "end": end, "endurance": mission.vehicle_of(name).endurance, **robots[name]}
    height = max(max(path.evaluate(0.0)[2], path.evaluate(path.duration)[2]) for path in flown.values())
    duration = max(path.duration for path in flown.values())
    climb = seconds_to_climb(request)
    watched = thresholds.bounds(mission, rows, request.margin, accuracy, mission.frame)
    return {
        "mission": mission.name,
        "certificate": request.digest,
        "duration": duration,
        "lasts": duration + max(0.0, float(height)) * (climb + 1.0 / LANDING_SPEED) + _BESIDE,
        "robots": rows,
        "start": None if mission.disturbance is None else mission.disturbance.start,
        "rest": {} if mission.disturbance is None else mission.disturbance.measured_rest,
        **watched,
        "braking": _shares(),
        "limits": {
            **watched["limits"],
            "climb": climb,
            "braking": braking_length(mission),
        },
    }


def written(data: Mapping[str, Any]) -> dict[str, bytes]:
    """Return `flight.json`.

    Args:
        data: What it says.
    """
    return {DATA: (json.dumps(data, indent=1, allow_nan=False) + "\n").encode()}


def _shares() -> list[float]:
    """Return what a velocity, an acceleration and a jerk of one add to the place of a robot that brakes for one second."""
    flat = np.zeros((5, 4, 3))
    for order in range(3):
        flat[order + 1, 0, order] = 1.0
    velocity = braking(flat, 1.0)
    return [float(sum(velocity[k, 0, order] / (k + 1) for k in range(6))) for order in range(3)]
