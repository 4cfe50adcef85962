"""The readable note beside every export: what is certified, what would void it, and what it does not cover."""

from __future__ import annotations

from flight.control.profiles import controller_name
from flight.exports.target import ExportTarget, Request

_LAPS = "laps follow one another by each robot's own clock, which must keep to the others' as certified until the last one ends"
_VOIDS = (
    "changing any number of these files, or flying them on another airframe or by another controller than named here",
    "starting further than the margin from the planned start, or robots' clocks further apart than is said here",
    "a tracking error that reaches the margin at any time",
)
"""What voids a certificate in every target."""


def _clocks(error: float) -> str:
    """Say how far apart clocks may be."""
    return f"those of any two robots are at most {error:g} s apart at every moment" if error else "one for all robots"


def _aged(request: Request, target: ExportTarget) -> str:
    """Return of which age set-points may be where tracking is proved on those of a target, in words."""
    told = request.mission.disturbance and request.mission.disturbance.setpoints
    if target.rate is None or told is None or not target.proved(request):
        return ""
    return f"; tracking is proved where each command follows a set-point that is {told.age[0]:g} to {told.age[1]:g} s old"


def readme(request: Request, target: ExportTarget, notes: tuple[str, ...], beyond: tuple[str, ...]) -> str:
    """Return the text of README.txt.

    Args:
        request: What was exported.
        target: For what.
        notes: Sentences of this export.
        beyond: What comes before and after the flight and is not covered.
    """
    mission = request.mission
    flown: dict[str, list[str]] = {}
    for name in request.team:
        vehicle = mission.vehicle_of(name)
        meant = controller_name(vehicle)
        unproved = "" if mission.disturbance is None else "; tracking not proved for this target"
        streamed = (
            "" if target.proved(request) else f"{unproved}, as its set-points are streamed and rounded" if unproved else ""
        )
        lacks = target.cannot_fly(vehicle) if target.runs(meant) else ""
        other = f"margin meant for the controller {meant}, which it does not run{unproved}"
        if lacks:
            streamed = f", which flies otherwise: {lacks}{unproved}"
        who = f"controller {meant}{streamed}{_aged(request, target)}" if target.runs(meant) else other
        flown.setdefault(f"airframe: {vehicle.name}, {vehicle.mass:g} kg, {who}", []).append(name)
    airframes = list(flown) if len(flown) == 1 else [f"{airframe} ({', '.join(names)})" for airframe, names in flown.items()]
    others = [name for name in mission.agents if name not in request.team]
    if others:
        airframes.append(f"not in this export: {', '.join(others)}, of the same flight, to be started at the same instant")
    told = mission.disturbance
    proved = (
        ()
        if told is None
        else (
            f"starting further than {told.start:g} m from the planned start or not at rest, which the proof of tracking assumes",
        )
    )
    voids = (*_VOIDS, *proved, *target.voids)
    starts = [
        f"  {name}: ({', '.join(f'{x:.4f}' for x in path.evaluate(0.0)[:3])}) m, heading {path.evaluate(0.0)[3]:.4f} rad, "
        f"{path.flattened(request.laps).duration:.4f} s"
        for name, path in request.team.items()
    ]
    solid = ", ".join(mission.obstacles)
    lines = [
        f"Certified flight of the mission '{mission.name}', written for {target.name}.",
        f"certificate: {request.digest}",
        *airframes,
        f"margin: {request.margin:g} m",
        *([f"clocks: {_clocks(request.clock_error)}"] if len(mission.agents) > 1 else []),
        *([f"laps of the cycle: {request.laps}"] if any(path.cycle is not None for path in request.team.values()) else []),
        *([_LAPS] if len(mission.agents) > 1 and mission.spec.trace == "infinite" else []),
        "",
        "Every robot hovers at its start at time 0, and all start at the same instant:",
        *starts,
        "",
        *notes,
        *([""] if notes else []),
        *([f"Clear at all times of these solid bodies, where the mission says they stand: {solid}.", ""] if solid else []),
        "What voids the certificate:",
        *(f"  * {reason};" for reason in voids),
        "",
        "What it does not cover:",
        *(f"  * {phrase};" for phrase in beyond),
        "  * collisions with anything that the mission does not name, downwash, and faults of the vehicle.",
        "",
    ]
    return "\n".join(lines)
