"""Airframes: what simulation and control need to know of a vehicle beyond its physical profile.

The files in `airframes/` carry the names of the vehicles in `verify/data/vehicles`; each number there stands next to its
source. The checker never reads them: a certificate rests on the vehicle's own limits alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, Literal, get_args

from pydantic import Field, model_validator

from verify.data import Mission, Vehicle
from verify.data.storage.shipped_tables import ShippedTables
from verify.data.value import Value
from verify.data.vehicle import NotNegative, Positive

_TABLES = ShippedTables("flight", "airframe")
_GENERIC = "generic"


class Gains(Value):
    """Gains of both controllers, per unit of mass and inertia, so that they carry over between airframes.

    The `position` gains serve both; the rest belongs to one controller, as said.
    """

    position: tuple[Positive, Positive] = Field(description="1/s^2, on the position error: horizontal, vertical")
    velocity: tuple[Positive, Positive] = Field(description="1/s, on the velocity error: horizontal, vertical")
    integral: tuple[NotNegative, NotNegative] = Field(description="1/s^3, on the summed position error")
    integral_limit: Positive = Field(description="m/s^2, most that the summed error may ask for, an axis")
    attitude: tuple[Positive, Positive] = Field(description="1/s^2, geometric controller: tilt, heading")
    rate: tuple[Positive, Positive] = Field(description="1/s, on the body rates: roll and pitch, yaw")
    angle: Positive = Field(description="1/s, papers' controller: body rate per rad of angle error")
    chain: Positive = Field(description="1/s, papers' controller: the chain of integrators (4), (5) has its four poles here")
    quickened_lag: Positive = Field(description="s, rotor lag that the autopilot's lead leaves of the rotors' own")


class Battery(Value):
    """A lithium cell as voltage behind a resistance; thrust at a given command falls with the voltage."""

    full: Positive = Field(description="V, open circuit, charged")
    empty: Positive = Field(description="V, open circuit, discharged")
    charge: Positive = Field(description="C, what the cell holds")
    resistance: NotNegative = Field(description="ohm")
    hover_current: Positive = Field(description="A, drawn in hover; grows with thrust^1.5")
    compensation: NotNegative = Field(description="share of the sag that the firmware takes out of a command, 0 to 1", le=1)

    @model_validator(mode="after")
    def _ordered(self) -> Battery:
        if self.empty >= self.full:
            raise ValueError(f"empty {self.empty} V is not below full {self.full} V")
        sag = self.resistance * self.hover_current
        if sag >= self.full:
            raise ValueError(
                f"in hover {sag:g} V of its {self.full:g} V are lost to its resistance; nothing is left to fly with"
            )
        return self


Drag = Literal["profile", "least", "most"]
"""Drag of a vehicle whose drag was not measured: the one that is simulated, and the ends of where it may be."""
DRAGS: tuple[Drag, ...] = get_args(Drag)


class DragRange(Value):
    """Range of a rotor's drag, of a vehicle on which it was not measured. kg, force per rad/s and m/s: least and most."""

    rotor_drag: tuple[NotNegative, NotNegative] = Field(description="across a rotor's axis")
    inflow_drag: tuple[NotNegative, NotNegative] = Field(description="along it")

    @model_validator(mode="after")
    def _ordered(self) -> DragRange:
        for name in ("rotor_drag", "inflow_drag"):
            least, most = getattr(self, name)
            if least > most:
                raise ValueError(f"{name} {least:g} to {most:g} kg is no range: the least comes first")
        return self


class Airframe(Value):
    """A vehicle with what moves it: rotors, air, battery and gains."""

    name: str = Field(description="which file of airframes/ it was read from")
    vehicle: Vehicle = Field(description="the physical profile")
    thrust_coefficient: Positive = Field(description="N s^2, thrust of a rotor per (rad/s)^2")
    rotor_lag: Positive = Field(description="s, first-order lag of a rotor's speed")
    rotor_inertia: NotNegative = Field(description="kg m^2, of one rotor about its axis")
    rotor_drag: NotNegative = Field(description="kg, force across a rotor's axis per rad/s and m/s")
    inflow_drag: NotNegative = Field(description="kg, force along a rotor's axis per rad/s and m/s")
    body_drag: tuple[NotNegative, NotNegative] = Field(description="kg/m, quadratic: across the body's z axis, along it")
    drag_range: DragRange | None = Field(default=None, description="where the rotors' drag may be; None where it was measured")
    battery: Battery
    gains: Gains

    @model_validator(mode="after")
    def _inside(self) -> Airframe:
        for name in () if self.drag_range is None else ("rotor_drag", "inflow_drag"):
            least, most = getattr(self.drag_range, name)
            if not least <= getattr(self, name) <= most:
                raise ValueError(f"{name} {getattr(self, name):g} kg is not within its drag_range, {least:g} to {most:g} kg")
        return self

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
        return self.name != _GENERIC

    @property
    def hover_speed(self) -> float:
        """Rotor speed in hover, rad/s."""
        return float((self.vehicle.weight / 4.0 / self.thrust_coefficient) ** 0.5)


def shipped_airframes() -> tuple[str, ...]:
    """Return the names of the vehicles whose airframe is known, sorted."""
    return tuple(name for name in _TABLES.names() if name != _GENERIC)


def airframe_of(vehicle: Vehicle) -> Airframe:
    """Return the airframe of a vehicle: by its name, or for a name that is not shipped an estimate from its size.

    The estimate takes lag, gains and battery of the generic file and scales rotor drag with the weight; `known`
    is False for it, and every flight log says so.
    """
    values = _read(vehicle.name if vehicle.name in shipped_airframes() else _GENERIC)
    name = values.pop("name")
    if name == _GENERIC:
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


def airframes_of(mission: Mission, robots: Iterable[str]) -> tuple[Airframe, ...]:
    """Return the airframe of each of some robots of a mission.

    Args:
        mission: Says what they fly.
        robots: Their names.
    """
    return tuple(airframe_of(mission.vehicle_of(robot)) for robot in robots)


def _read(name: str) -> dict[str, Any]:
    values = _load(name)
    return {"name": name, **{key: dict(part) if isinstance(part, dict) else part for key, part in values.items()}}


@cache
def _load(name: str) -> dict[str, Any]:
    return _TABLES.read(name)
