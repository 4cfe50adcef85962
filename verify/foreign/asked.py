"""What an audit asks of each drone and each pair, put together from a mission, a vehicle and single limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.errors import BadInput, did_you_mean
from verify.data.mission import Mission
from verify.data.sections import Box
from verify.data.vehicle import Vehicle, load_vehicle
from verify.foreign.fleet import Fleet, Indices


@dataclass(frozen=True, kw_only=True)
class AuditLimits:
    """What is asked of others' flights; None asks for nothing, and a mission or vehicle says the rest.

    Attributes:
        vehicle: A shipped profile's name or a vehicle: its speed and acceleration, and twice its radius between centres.
        workspace: Where all drones stay; a box, or its lower and upper corner in m.
        separation: Least distance between centres, in m.
        speed: m/s.
        acceleration: m/s^2.
        min_height: Least z, in m, take-off and landing included.
        margin: How far the drones may be from their paths, in m; None for the mission's, or 0.
        velocity_jump: How far velocities may jump between pieces where acceleration is asked, in m/s.
    """

    vehicle: str | Vehicle | None = None
    workspace: Box | Sequence[float] | Sequence[str] | None = None
    separation: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    min_height: float | None = None
    margin: float | None = None
    velocity_jump: float = 0.1


@dataclass(frozen=True, eq=False)
class Asked:
    """What is asked of a fleet, drone by drone.

    Attributes:
        workspace: Where all drones stay, or None.
        least: For pairs given by two arrays of drones, how far apart their paths must stay, in m; None where nothing is asked.
        most: The greatest of these, in m.
        weight: By which distances in z are multiplied.
        speeds: Of each drone, in m/s, or None.
        accelerations: Of each drone, in m/s^2, or None.
        min_height: In m, or None.
        margin: In m, exact.
        velocity_jump: In m/s.
        said: The limits as they are told, for the result.
    """

    workspace: Box | None
    least: Callable[[Indices, Indices], Floats] | None
    most: float
    weight: Fraction
    speeds: Floats | None
    accelerations: Floats | None
    min_height: float | None
    margin: Fraction
    velocity_jump: float
    said: dict[str, object]


def resolve(fleet: Fleet, mission: Mission | None, limits: AuditLimits) -> Asked:
    """Put together what is asked; a single limit takes the place of the mission's or the vehicle's.

    Args:
        fleet: The drones.
        mission: Whose agents they all are, or None.
        limits: Single limits.

    Raises:
        BadInput: Nothing is asked, or a limit is no number that can be kept.
    """
    _require_numbers(limits)
    vehicle = load_vehicle(limits.vehicle) if isinstance(limits.vehicle, str) else limits.vehicle
    if not isinstance(vehicle, Vehicle | None):  # pyright: ignore[reportUnnecessaryIsInstance]  # callers without types
        raise BadInput(f"vehicle must be a shipped profile's name or a Vehicle, not {type(vehicle).__name__}.")
    workspace = _box(limits.workspace) if limits.workspace is not None else mission.workspace if mission else None
    margin = Fraction(limits.margin if limits.margin is not None else mission.margin if mission else 0.0)
    radii, weight, separation = np.zeros(len(fleet)), Fraction(1), limits.separation
    speeds = accelerations = None
    if mission is not None:
        radii = np.array([mission.vehicle_of(name).radius for name in fleet.names])
        separation = mission.separation if separation is None else separation
        weight = Fraction(mission.separation) / Fraction(mission.separation_z) if mission.separation_z else weight
        speeds = np.array([mission.limits_of(name).speed for name in fleet.names])
        accelerations = np.array([mission.limits_of(name).acceleration for name in fleet.names])
    if vehicle is not None:
        radii = np.full(len(fleet), vehicle.radius)
        separation = 0.0 if separation is None else separation
        speeds, accelerations = (np.full(len(fleet), value) for value in (vehicle.speed, vehicle.acceleration))
    speeds = speeds if limits.speed is None else np.full(len(fleet), limits.speed)
    accelerations = accelerations if limits.acceleration is None else np.full(len(fleet), limits.acceleration)
    if workspace is None and separation is None and speeds is None and accelerations is None and limits.min_height is None:
        raise BadInput(
            "Nothing is asked of these flights; give a mission or a vehicle, or a separation, a workspace, a speed, an acceleration or a "
            "least height."
        )
    stretch = max(1.0, float(weight))
    room = float(np.nextafter(2.0 * float(margin) * stretch * (1 + 2.0**-50), np.inf)) if margin else 0.0

    def least(one: Indices, other: Indices) -> Floats:
        asked = np.maximum(separation or 0.0, (radii[one] + radii[other]) * stretch)
        return np.nextafter(asked + room, np.inf) if room else asked

    two = np.argsort(radii)[-2:]
    most = float(least(two[-1:], two[:1])[0])
    said: dict[str, object] = {
        "mission": mission.digest() if mission else None,
        "vehicle": vehicle.name if vehicle else None,
        "workspace": [list(workspace.min), list(workspace.max)] if workspace else None,
        "separation": None if separation is None else most,
        "separation_z": mission.separation_z if mission else None,
        "speed": None if speeds is None else float(speeds.max()),
        "acceleration": None if accelerations is None else float(accelerations.max()),
        "min_height": limits.min_height,
        "margin": float(margin),
    }
    return Asked(
        workspace=workspace, least=None if separation is None else least, most=most, weight=weight, speeds=speeds,
        accelerations=accelerations, min_height=limits.min_height, margin=margin, velocity_jump=limits.velocity_jump, said=said,
    )  # fmt: skip


def _require_numbers(limits: AuditLimits) -> None:
    for name in ("separation", "speed", "acceleration", "min_height", "margin", "velocity_jump"):
        value = getattr(limits, name)
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise BadInput(f"{name} must be a finite number, not {value!r:.40}.")
        if name != "min_height" and (value < 0 or (value == 0 and name in ("speed", "acceleration"))):
            raise BadInput(f"{name} must be {'above 0' if name in ('speed', 'acceleration') else 'at least 0'}, not {value:g}.")


def require_agents(fleet: Fleet, mission: Mission) -> None:
    """Refuse drones that are not a mission's agents, one and all.

    Args:
        fleet: The drones.
        mission: The mission.

    Raises:
        BadInput: An agent has no flight, or a flight no agent.
    """
    agents = set(mission.agents)
    if missing := sorted(agents - set(fleet.names)):
        raise BadInput(
            f"{fleet.source} has no flight of '{missing[0]}', an agent of mission '{mission.name}'."
            f"{did_you_mean(missing[0], set(fleet.names) - agents)} Its flights: {_few(fleet.names)}."
        )
    if extra := sorted(set(fleet.names) - agents):
        raise BadInput(
            f"{fleet.source} has a flight of '{extra[0]}', which is no agent of mission '{mission.name}'."
            f"{did_you_mean(extra[0], agents)} Agents: {_few(sorted(agents))}."
        )


def _few(names: Sequence[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")


def _box(given: Box | Sequence[float] | Sequence[str]) -> Box:
    """Return a box, from its corners where numbers are given."""
    if isinstance(given, Box):
        return given
    try:
        numbers = [float(value) for value in given]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        raise BadInput(
            f"A workspace is six numbers in m: x, y, z of its lower corner, then of its upper one; not {given!r:.60}."
        )
    if any(low >= high for low, high in zip(numbers[:3], numbers[3:], strict=True)):
        raise BadInput(
            f"The workspace's lower corner {numbers[:3]} must be below its upper corner {numbers[3:]} on every axis."
        )
    return Box(min=(numbers[0], numbers[1], numbers[2]), max=(numbers[3], numbers[4], numbers[5]))
