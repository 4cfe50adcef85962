"""Airframes: lag, drag, battery and gains of vehicles, beyond their physical profiles.

The tables in `airframes/` carry the names of the vehicles in `vehicles/`; each number there stands next to its source. Simulation flies with them. The
checker reads them in one place: a mission's `disturbance` names one, whose numbers then stand in the resolved mission.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any

from pydantic import Field, model_validator

from verify.data.errors import BadInput
from verify.data.storage.shipped_tables import ShippedTables, or_by_name
from verify.data.value import Value
from verify.data.vehicle import NotNegative, Positive

GENERIC = "generic"
"""The table for vehicles that are not shipped: its drag and battery are by weight, so that it is no airframe by itself."""


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


class AirframeTable(Value):
    """Rotors, air, battery and gains of a vehicle."""

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
    def _inside(self) -> AirframeTable:
        for name in () if self.drag_range is None else ("rotor_drag", "inflow_drag"):
            least, most = getattr(self.drag_range, name)
            if not least <= getattr(self, name) <= most:
                raise ValueError(f"{name} {getattr(self, name):g} kg is not within its drag_range, {least:g} to {most:g} kg")
        return self


_TABLES = ShippedTables("verify.data", "airframe")


def shipped_airframe_names() -> tuple[str, ...]:
    """Return the names of the vehicles whose airframe is known, sorted."""
    return tuple(name for name in _TABLES.names() if name != GENERIC)


@cache
def read_airframe(name: str) -> dict[str, Any]:  # of any type: tables nest
    """Return what a shipped table says, `generic` too; it is shared, and not to be changed.

    Args:
        name: Of the vehicle.
    """
    return _TABLES.read(name)


@cache
def load_airframe(name: str) -> AirframeTable:
    """Return a shipped airframe by its vehicle's name.

    Raises:
        BadInput: There is no such airframe; the message lists those that there are.
    """
    if name == GENERIC:
        raise BadInput(f"'{GENERIC}' is an estimate by weight, no airframe. Shipped: {', '.join(shipped_airframe_names())}.")
    return AirframeTable(**read_airframe(name))


NamedAirframe = Annotated[AirframeTable, or_by_name(load_airframe)]
"""An airframe in a file: a shipped table's name, or a table."""
