"""The readable note beside every export: what is certified, what would void it, and what it does not cover."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flight.exports.files import Request

_VOIDS = {
    "all": (
        "changing any number of these files, or flying them on another airframe than the one named here",
        "starting further than the margin from the planned start, or any robot's clock running late or early",
        "a tracking error that reaches the margin at any time",
    ),
    "crazyswarm2": (
        "a `timescale` other than 1 (below 1 also breaks the vehicle's limits)",
        "`relative=True` in startTrajectory, which is crazyswarm2's default: the path is shifted to wherever the robot is",
        "`reverse=True`, or retiming single pieces",
    ),
    "crazyflie": (
        "a `time_scale` other than 1 (below 1 also breaks the vehicle's limits)",
        "`relative_position=True`, `relative_yaw=True` or `reversed=True` in start_trajectory",
        "writing another trajectory over the same part of the memory",
    ),
    "px4": (
        "sending the setpoints at another rate, or late",
        "an estimator whose local frame is not the mission's (see the origin above)",
    ),
    "ros2": ("replaying the bag at another rate, or following it with a controller that interpolates differently",),
}


def readme(request: Request, kind: str, notes: tuple[str, ...]) -> str:
    """Return the text of README.txt."""
    mission = request.mission
    voids = [*_VOIDS["all"], *_VOIDS["crazyflie" if kind.startswith("crazyflie") else kind]]
    starts = [
        f"  {name}: ({', '.join(f'{x:.4f}' for x in path.evaluate(0.0)[:3])}) m, heading {path.evaluate(0.0)[3]:.4f} rad, "
        f"{path.flattened(request.laps).duration:.4f} s"
        for name, path in request.team.items()
    ]
    lines = [
        f"Certified flight of the mission '{mission.name}', written for {kind}.",
        f"certificate: {request.digest}",
        f"airframe: {mission.vehicle.name}, {mission.vehicle.mass:g} kg",
        f"margin: {request.margin:g} m",
        *([f"laps of the cycle: {request.laps}"] if any(path.cycle is not None for path in request.team.values()) else []),
        "",
        "Every robot hovers at its start at time 0, and all start at the same instant:",
        *starts,
        "",
        *notes,
        *([""] if notes else []),
        "What voids the certificate:",
        *(f"  * {reason};" for reason in voids),
        "",
        "What it does not cover:",
        "  * the climb to the start before time 0, and the landing after the end;",
        "  * collisions with anything that the mission does not name, downwash, and faults of the vehicle.",
        "",
    ]
    return "\n".join(lines)
