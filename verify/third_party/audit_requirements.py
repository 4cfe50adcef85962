"""Requirements of an audit on each drone and each pair, put together from a mission, a vehicle and single limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeVar

import numpy as np

from verify.arithmetic.balls import Floats
from verify.data.errors import BadInput, did_you_mean
from verify.data.mission import Mission
from verify.data.names.former_names import former_arguments, warn_former
from verify.data.sections import Box
from verify.data.vehicle import Vehicle, load_vehicle
from verify.third_party.extremes import Direction, Rate
from verify.third_party.fleet import Fleet, Indices
from verify.third_party.shows.own_limits import NO_LIMITS, Fence, OwnLimits

_OWN_RATES: dict[int, tuple[tuple[str, str, Direction], ...]] = {
    1: (("speed_xy", "horizontal speed", "level"), ("climb", "climb", "up"), ("descent", "descent", "down")),
    2: (
        ("acceleration_xy", "horizontal acceleration", "level"),
        ("acceleration_up", "upward acceleration", "up"),
        ("acceleration_down", "downward acceleration", "down"),
    ),
}
"""Limits of files by their order: name, what the quantity is called, direction."""


@dataclass(frozen=True, kw_only=True)
class AuditLimits:
    """Required limits of others' flights; None requires nothing, and a mission or vehicle gives the rest.

    Attributes:
        vehicle: A shipped profile's name or a vehicle: its speed and acceleration, and twice its radius between centres.
        workspace: Where all drones stay; a box, or its lower and upper corner in m.
        separation: Least distance between centres, in m.
        separation_above: The separation is asked only while both drones are above this height, in m; None for everywhere.
        speed: m/s.
        acceleration: m/s^2.
        yaw_rate: deg/s, of drones whose file says how they turn.
        min_height: Least z, in m, take-off and landing included.
        margin: How far the drones may be from their paths, in m; None for the mission's, or 0.
        velocity_jump: How far velocities may jump between pieces where acceleration is asked, in m/s.
        columns: Whether take-off and landing are checked that a show leaves to the autopilot; not of a show's excerpts.
        file_limits: Whether limits and fences that the files themselves hold are asked, where neither these nor a mission or vehicle say them.
    """

    vehicle: str | Vehicle | None = None
    workspace: Box | Sequence[float] | Sequence[str] | None = None
    separation: float | None = None
    separation_above: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    yaw_rate: float | None = None
    min_height: float | None = None
    margin: float | None = None
    velocity_jump: float = 0.1
    columns: bool = True
    file_limits: bool = True

    @property
    def own_limits(self) -> bool:
        """Former name of `file_limits`."""
        warn_former("`own_limits`", "`file_limits`")
        return self.file_limits


AuditLimits.__init__ = former_arguments(own_limits="file_limits")(AuditLimits.__init__)


@dataclass(frozen=True, eq=False)
class Asked:
    """Requirements on a fleet, drone by drone.

    Attributes:
        workspace: Where all drones stay, or None.
        least: For pairs given by two arrays of drones, how far apart their paths must stay, in m; None where nothing is asked.
        most: The greatest of these, in m.
        fewest: The least of these, in m.
        separation: Least distance between centres, in m, without radii and margin; None where nothing is asked.
        radii: Of the drones, in m. Shape (drones,).
        weight: By which distances in z are multiplied.
        above: Height above which it is asked, in m; None for everywhere.
        rates: Limits of speeds and accelerations.
        yaw_rates: deg/s of each drone, or None. Shape (drones,).
        min_height: In m, or None.
        altitude: Greatest z, in m, or None.
        fences: Polygons to stay inside or outside of.
        margin: In m, exact.
        velocity_jump: In m/s.
        said: The limits as they are told, for the result, and under "from" where each is from.
        notes: Limits that the files hold and that are not asked, in sentences.
    """

    workspace: Box | None
    least: Callable[[Indices, Indices], Floats] | None
    most: float
    fewest: float
    separation: float | None
    radii: Floats
    weight: Fraction
    above: float | None
    rates: tuple[Rate, ...]
    yaw_rates: Floats | None
    min_height: float | None
    altitude: float | None
    fences: tuple[Fence, ...]
    margin: Fraction
    velocity_jump: float
    said: dict[str, object]
    notes: tuple[str, ...]


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
    own = fleet.own if limits.file_limits else NO_LIMITS
    chosen = _Chosen(own)
    margin = Fraction(limits.margin if limits.margin is not None else mission.margin if mission else 0.0)
    given_box = _box(limits.workspace) if limits.workspace is not None else None
    workspace = chosen.of("workspace", given_box, ("mission", mission.workspace if mission else None))
    separation = chosen.of("separation", limits.separation, ("mission", mission.separation if mission else None), "separation")
    if separation is None and vehicle is not None:
        separation = chosen.of("separation", None, ("vehicle", 0.0))
    chosen.of("min_height", limits.min_height)
    altitude = chosen.of("altitude", None, None, "altitude") if workspace is None else None
    fences = own.fences if workspace is None else ()
    if fences:
        chosen.sources["geofence"] = own.source("fences")
    rates = tuple(rate for order in (1, 2) for rate in _rates(fleet, mission, vehicle, limits, chosen, order))
    yaw_rates = _yaw_rates(fleet, mission, vehicle, limits, chosen)
    if not chosen.sources:
        raise BadInput(
            "Nothing is required of these flights; give a mission or a vehicle, or a separation, a workspace, a speed, an acceleration or a "
            "least height."
        )
    if limits.separation_above is not None and separation is None:
        raise BadInput(f"separation_above is {limits.separation_above:g} m, and no separation is required; give one as well.")
    radii = np.zeros(len(fleet))
    if vehicle is not None:
        radii = np.full(len(fleet), vehicle.radius)
    elif mission is not None:
        radii = np.array([mission.vehicle_of(name).radius for name in fleet.names])
    weight = Fraction(mission.separation) / Fraction(mission.separation_z) if mission and mission.separation_z else Fraction(1)
    stretch = max(1.0, float(weight))
    room = float(np.nextafter(2.0 * float(margin) * stretch * (1 + 2.0**-50), np.inf)) if margin else 0.0

    def least(one: Indices, other: Indices) -> Floats:
        asked = np.maximum(separation or 0.0, (radii[one] + radii[other]) * stretch)
        return np.nextafter(asked + room, np.inf) if room else asked

    order = np.argsort(radii)
    most, fewest = (float(least(two[:1], two[-1:])[0]) for two in (order[-2:], order[:2]))
    said: dict[str, object] = {
        "mission": mission.digest() if mission else None,
        "vehicle": vehicle.name if vehicle else None,
        "workspace": [list(workspace.min), list(workspace.max)] if workspace else None,
        "separation": None if separation is None else most,
        "separation_above": limits.separation_above,
        "separation_z": mission.separation_z if mission else None,
        **{rate.name.removeprefix("limits."): float(rate.limits.max()) for rate in rates},
        "yaw_rate": None if yaw_rates is None else float(yaw_rates.max()),
        "min_height": limits.min_height,
        "altitude": altitude,
        "geofence": [{"name": f.name, "inside": f.inside, "corners": f.corners.tolist()} for f in fences],
        "margin": float(margin),
        "from": chosen.sources,
    }
    return Asked(
        workspace=workspace, least=None if separation is None else least, most=most, fewest=fewest, separation=separation, radii=radii,
        weight=weight,
        above=limits.separation_above, rates=rates, yaw_rates=yaw_rates,
        min_height=limits.min_height, altitude=altitude, fences=fences, margin=margin, velocity_jump=limits.velocity_jump,
        said=said, notes=_not_asked(fleet.own, chosen, wanted=limits.file_limits),
    )  # fmt: skip


T = TypeVar("T")


class _Chosen:
    """Picks each limit from the first who says it, and keeps who that was.

    Args:
        own: What the files ask themselves, who say it last.
    """

    def __init__(self, own: OwnLimits) -> None:
        self._own = own
        self.sources: dict[str, str] = {}

    def of(self, name: str, given: T | None, other: tuple[str, T | None] | None = None, own: str | None = None) -> T | None:
        """Return a limit: given by itself, by a mission or vehicle, or by the files under the name `own`."""
        if given is not None:
            self.sources[name] = "given"
            return given
        if other is not None and other[1] is not None:
            self.sources[name] = other[0]
            return other[1]
        value = getattr(self._own, own) if own else None
        if own and value is not None:
            self.sources[name] = self._own.source(own)
        return value


# six parameters: the first four say what is asked
def _rates(
    fleet: Fleet, mission: Mission | None, vehicle: Vehicle | None, limits: AuditLimits, chosen: _Chosen, order: Literal[1, 2]
) -> Iterator[Rate]:
    """Yield limits of speed (order 1) or acceleration (order 2): one of its size, or the files' own by direction."""
    what: Literal["speed", "acceleration"] = "speed" if order == 1 else "acceleration"
    kinds = None if mission is None else np.array([getattr(mission.limits_of(name), what) for name in fleet.names])
    single = np.full(len(fleet), getattr(vehicle, what)) if vehicle is not None else None
    given = getattr(limits, what)
    found = chosen.of(
        what,
        None if given is None else np.full(len(fleet), given),
        ("vehicle", single) if single is not None else ("mission", kinds),
    )
    if found is not None:
        yield Rate(f"limits.{what}", what, order, "all", found)
        return
    for name, called, direction in _OWN_RATES[order]:
        if (value := chosen.of(name, None, None, name)) is not None:
            yield Rate(f"limits.{name}", called, order, direction, np.full(len(fleet), value))


# five parameters: the first four say what is asked
def _yaw_rates(
    fleet: Fleet, mission: Mission | None, vehicle: Vehicle | None, limits: AuditLimits, chosen: _Chosen
) -> Floats | None:
    """Return limits of turning in deg/s, where a file says how drones turn or one is given. Shape (drones,)."""
    if not fleet.yaws:
        if limits.yaw_rate is not None:
            raise BadInput(
                f"yaw_rate is {limits.yaw_rate:g} deg/s, and {fleet.source} does not say how any drone turns; leave it out."
            )
        return None
    other = None
    if vehicle is not None:
        other = "vehicle", np.full(len(fleet), vehicle.yaw_rate_deg)
    elif mission is not None:
        other = "mission", np.degrees([mission.limits_of(name).yaw_rate for name in fleet.names])
    given = None if limits.yaw_rate is None else np.full(len(fleet), limits.yaw_rate)
    if (found := chosen.of("yaw_rate", given, other)) is not None:
        return found
    own = chosen.of("yaw_rate", None, None, "yaw_rate")
    return None if own is None else np.full(len(fleet), own)


def _not_asked(own: OwnLimits, chosen: _Chosen, *, wanted: bool) -> tuple[str, ...]:
    """Return, in sentences, which of the files' own limits are not asked."""
    asked = set(chosen.sources.values())
    rest = dict.fromkeys(name for _, name in own.where if name not in asked)
    why = "something else takes its place" if wanted else "nothing of the file's own is"
    unknown = dict(own.where).get("yaw_rate") if wanted and "yaw_rate" not in chosen.sources else None
    return tuple(
        f"The file's own {name} is not asked: {'it does not say how any drone turns' if name == unknown else why}."
        for name in rest
    )


def _require_numbers(limits: AuditLimits) -> None:
    for name in (
        "separation",
        "separation_above",
        "speed",
        "acceleration",
        "yaw_rate",
        "min_height",
        "margin",
        "velocity_jump",
    ):
        value = getattr(limits, name)
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise BadInput(f"{name} must be a finite number, not {value!r:.40}.")
        rate = name in ("speed", "acceleration", "yaw_rate")
        if name not in ("min_height", "separation_above") and (value < 0 or (value == 0 and rate)):
            raise BadInput(f"{name} must be {'above 0' if rate else 'at least 0'}, not {value:g}.")


def require_agents(fleet: Fleet, mission: Mission) -> None:
    """Reject drones that are not a mission's agents, one and all.

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
