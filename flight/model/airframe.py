"""Airframes: what simulation and control need to know of a vehicle beyond its physical profile.

Lag, drag, battery and gains are tables of `verify/data/airframes`, which carry the names of the vehicles in `verify/data/vehicles`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, get_args

from pydantic import Field

from verify.data import Mission, Vehicle
from verify.data.airframe import GENERIC, AirframeTable, read_airframe, shipped_airframe_names

Drag = Literal["profile", "least", "most"]
"""Drag of a vehicle whose drag was not measured: the one that is simulated, and the ends of where it may be."""
DRAGS: tuple[Drag, ...] = get_args(Drag)


class Airframe(AirframeTable):
    """A vehicle with what moves it: rotors, air, battery and gains."""

    name: str = Field(description="which file of airframes/ it was read from")
    vehicle: Vehicle = Field(description="the physical profile")

    def with_drag(self, drag: Drag) -> Airframe:
        """Return the airframe with the drag that is meant; itself where its drag was measured.

        Args:
            drag: The one of its file (`profile`), or an end of its range.
        """
        if self.drag_range is None or drag == "profile":
            return self
        end = DRAGS.index(drag) - 1
        across, along = self.drag_range.rotor_drag[end], self.drag_range.inflow_drag[end]
        return self.changed(rotor_drag=across, inflow_drag=along)

    @property
    def doubt(self) -> str:
        """A sentence on what of it is a guess, for a person; empty where nothing is."""
        if not self.known:
            return f"no airframe is known for '{self.vehicle.name}'; lag, drag and gains are estimates."
        if self.drag_range is None:
            return ""
        least, most = self.drag_range.rotor_drag
        if self.vehicle.uncertain is not None and self.vehicle.uncertain.drag is not None:
            return ""  # identified: the corners are flown
        return (
            f"the rotors' drag of '{self.vehicle.name}' is a guess ({self.rotor_drag:g} kg; {least:g} to {most:g} may be), and it decides whether "
            "flights stay in their tube: `ltlplan rehearse` flies both ends."
        )

    @property
    def known(self) -> bool:
        """True if the airframe was measured or published, rather than estimated from the vehicle's size."""
        return self.name != GENERIC

    @property
    def hover_speed(self) -> float:
        """Rotor speed in hover, rad/s."""
        return float((self.vehicle.weight / 4.0 / self.thrust_coefficient) ** 0.5)


def shipped_airframes() -> tuple[str, ...]:
    """Return the names of the vehicles whose airframe is known, sorted."""
    return shipped_airframe_names()


def airframe_of(vehicle: Vehicle) -> Airframe:
    """Return the airframe of a vehicle: by its name, or for a name that is not shipped an estimate from its size.

    The estimate takes lag, gains and battery of the generic file and scales rotor drag with the weight; `known`
    is False for it, and every flight log says so.
    """
    values = _read(vehicle.name if vehicle.name in shipped_airframes() else GENERIC)
    name = values.pop("name")
    if name == GENERIC:
        hover = (vehicle.weight / 4.0 / values["thrust_coefficient"]) ** 0.5
        damping = values.pop("damping")
        values["rotor_drag"] = values["inflow_drag"] = damping * vehicle.mass / (4.0 * hover)
        amperes = values["battery"].pop("hover_current_per_newton")
        values["battery"] = {**values["battery"], "hover_current": amperes * vehicle.weight}
        values["battery"]["charge"] *= vehicle.weight
        values["battery"]["resistance"] /= vehicle.weight
    drag = None if vehicle.uncertain is None else vehicle.uncertain.drag
    if drag is not None:
        values |= _dragged(values["rotor_drag"], values["inflow_drag"], drag)
    return Airframe(name=name, vehicle=vehicle, **values)


def _dragged(across: float, along: float, ends: tuple[float, float]) -> dict[str, Any]:
    """Return the drag of a vehicle on which it was identified: the middle of its range, along the axis in the file's proportion."""
    share = along / across if across > 0.0 else 1.0
    middle = 0.5 * (ends[0] + ends[1])
    reach = {"rotor_drag": ends, "inflow_drag": (share * ends[0], share * ends[1])}
    return {"rotor_drag": middle, "inflow_drag": share * middle, "drag_range": reach}


def airframe_in(mission: Mission, vehicle: Vehicle) -> Airframe:
    """Return the airframe of a vehicle of a mission: of one of your own what `disturbance` states, as it is proved with that.

    Args:
        mission: Says what is stated.
        vehicle: One of its.
    """
    if mission.disturbance is None or vehicle != mission.vehicle or vehicle.name in shipped_airframes():
        return airframe_of(vehicle)
    stated = mission.disturbance.airframe
    return Airframe(name=vehicle.name, vehicle=vehicle, **{name: getattr(stated, name) for name in AirframeTable.model_fields})


def airframes_of(mission: Mission, robots: Iterable[str]) -> tuple[Airframe, ...]:
    """Return the airframe of each of some robots of a mission.

    Args:
        mission: Says what they fly.
        robots: Their names.
    """
    return tuple(airframe_in(mission, mission.vehicle_of(robot)) for robot in robots)


def _read(name: str) -> dict[str, Any]:
    values = read_airframe(name)
    return {"name": name, **{key: dict(part) if isinstance(part, dict) else part for key, part in values.items()}}
