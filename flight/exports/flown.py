"""The simulated flight that an export needs, and the warning in files that are written without one.

A certificate says that every flight inside the tube keeps its claims. That a vehicle's controller keeps it inside is not proved; that a
simulation of it did is the least to ask before anything is written for a real one. A flight by a controller that the vehicle does not run
says nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from flight.conditions import conditions_of
from flight.control.profiles import controller_name, controller_of
from flight.control.streamed import StreamedController
from flight.exports.target import ExportTarget
from flight.logs.log import FlightLog
from verify.certificate import Certificate
from verify.data import Mission, NotCertified

WARNING = (
    "WARNING: not rehearsed with this vehicle's controller: written without a simulated flight by it that stayed in its tube. "
    "Nothing says that the vehicles keep to this path."
)


def require_controllers(
    target: ExportTarget,
    mission: Mission,
    robots: Iterable[str],
    options: Mapping[str, Any],  # of any type that the target reads
) -> None:
    """Reject a target whose vehicles do not fly what simulation flies: the controllers that the margins are meant for, on the same set-points.

    Args:
        target: The export target.
        mission: What the certificate is of.
        robots: Those that are written.
        options: What the caller passed for the target.

    Raises:
        NotCertified: As said.
    """
    if not target.controllers:
        raise NotCertified(
            f"{target.name}: the controller of its vehicles is not modelled, and a simulated flight by another says nothing of them. Write it with "
            "`--force` (`force=True`) and a warning, or fly vehicles whose controller is modelled."
        )
    for name in (name for name in mission.agents if name in set(robots)):
        if not target.runs(own := controller_name(mission.vehicle_of(name))):
            runs = ", ".join(f"'{controller}'" for controller in target.controllers)
            unproved = "" if mission.disturbance is None else " Tracking is not proved for this target."
            raise NotCertified(
                f"the margin of {name} is meant for the controller '{own}', and vehicles of {target.name} run {runs}. Name one of these as "
                f"`controller` in the vehicle's profile, or write it with `--force` (`force=True`) and a warning.{unproved}"
            )
        if why := target.cannot_fly(mission.vehicle_of(name)):
            raise NotCertified(
                f"{target.name}: no vehicle flies as {name} was simulated: {why}. Take the firmware's for them, or write it with `--force` (`force=True`) and "
                "a warning."
            )
        _require_setpoints(target, name, mission, options)


def _require_setpoints(target: ExportTarget, robot: str, mission: Mission, options: Mapping[str, Any]) -> None:
    """Reject set-points that are not those of the simulated flight."""
    name, controller = controller_name(mission.vehicle_of(robot)), conditions_of(mission).controller
    controller = controller if isinstance(controller, StreamedController) else controller_of(mission.vehicle_of(robot))
    if target.orders is not None and controller.orders > target.orders:
        raise NotCertified(
            f"{target.name}: the controller '{name}' of {robot} is flown in simulation with the path's derivatives up to order {controller.orders}, and "
            f"set-points of {target.name} hold {target.orders}: no flight stands for theirs. Write it with `--force` (`force=True`) and a warning, or fly "
            "vehicles with `controller: px4`."
        )
    if target.rate is not None and (rate := float(options.get("rate", target.rate))) != controller.setpoints:
        raise NotCertified(
            f"{target.name}: the controller '{name}' of {robot} is flown in simulation on {controller.setpoints:g} set-points a second, and the export has "
            f"{rate:g}. Write it with `--rate {controller.setpoints:g}` (`rate={controller.setpoints:g}`), or with `--force` (`force=True`) and a warning."
        )


def require_flight(
    log: FlightLog | None,
    cert: Certificate,
    mission: Mission,
    robots: Iterable[str],
    target: ExportTarget,
    options: Mapping[str, Any],  # of any type that the target reads
) -> None:
    """Reject a flight that is not of this certificate, by controllers that the target's vehicles run, inside its tube.

    Args:
        log: A simulated flight; None where there is none.
        cert: What is to be written.
        mission: What the certificate is of.
        robots: Those that are written.
        target: What it is written for.
        options: What the caller passed for the target.

    Raises:
        NotCertified: As said, with who strayed, by how much, and what would be right.
    """
    robots = tuple(robots)
    require_controllers(target, mission, robots, options)
    if log is None:
        raise NotCertified(
            "there is no simulated flight that stayed in its tube: fly it (`flight.fly` with conditions=flight.conditions_of(mission)) and "
            "pass `flight=`, or write it with `force=True` and a warning."
        )
    if log.certificate != cert.digest():
        raise NotCertified("the flight is of another certificate; fly this one (`flight.fly` with it, `ltlplan run`).")
    for name in robots:
        wanted = conditions_of(mission).follower(mission.vehicle_of(name))
        who = None if log.controllers is None else log.controllers[log.robots.index(name)]
        if who != wanted:
            flown = "nobody knows whom" if who is None else f"'{who}'"
            raise NotCertified(
                f"the margin of {name} is meant for the controller '{wanted}', and the flight was flown by {flown}; fly it with "
                'conditions=flight.conditions_of(mission), or controller="profile".'
            )
        if not (worst := log.worst_error(name)) < cert.margin:
            raise NotCertified(
                f"in simulation {name}, flown by '{wanted}', strayed {1000 * worst:.1f} mm from its certified path, and the margin is "
                f"{1000 * cert.margin:g} mm: ask for a greater margin or a slower flight (`ltlplan rehearse` says what it takes), or "
                "write it with `--force` (`force=True`)."
            )
    if log.satisfied is False:
        raise NotCertified("the flown path breaks the formula in simulation.")


def warned(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return files with a warning in each that has room for words: scripts, YAML and JSON; the note has one. Tables and bytes have none.

    Args:
        files: Contents by file name.
    """
    return {name: _warned(name, content) for name, content in files.items()}


def _warned(name: str, content: bytes) -> bytes:
    ending = name.rsplit(".", 1)[-1]
    if ending in ("yaml", "yml"):
        return f"# {WARNING}\n".encode() + content
    if ending == "py":
        first, separator, rest = content.partition(b"\n")
        said = f"# {WARNING}\n".encode()
        return first + separator + said + rest if first.startswith(b"#!") else said + content
    if ending == "json":
        data = json.loads(content)
        if isinstance(data, dict):
            return (json.dumps({"warning": WARNING, **data}, indent=1) + "\n").encode()
    return content
