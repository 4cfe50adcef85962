"""Physical vehicles: what the flatness limits and the certificate need to know about an airframe.

The shipped profiles are YAML files beside this module; each number there stands next to its source.
Lag, drag and controller gains belong to `airframe.py`.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated

from pydantic import Field, Strict, model_validator

from verify.data.autopilot import NamedAutopilot
from verify.data.storage.shipped_tables import ShippedTables, or_by_name
from verify.data.trajectory import MAX_PIECES, PIECES
from verify.data.uncertain import Uncertain
from verify.data.value import Value

GRAVITY = 9.80665
"""Standard gravity in m/s^2, along -z."""

Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Positive = Annotated[float, Strict(), Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Strict(), Field(ge=0, allow_inf_nan=False)]

Held = Annotated[int, Strict(), Field(ge=2, le=MAX_PIECES)]

LIGHT = 0.1
"""kg; more than any Crazyflie can lift. What is lighter has a Crazyflie's memory where its profile says nothing, what is heavier is streamed to."""
CLIMB_AND_LANDING = 11.0
"""s that a vehicle's endurance counts beside the flight: 7.5 to climb and to fly to the start, 3.5 to land."""


class Vehicle(Value):
    """An airframe with its own limits. The vehicle is a sphere of `radius` around its centre."""

    name: str = Field(description="name of the profile", min_length=1)
    mass: Positive = Field(description="kg, as flown")
    radius: Positive = Field(description="m, sphere around the centre that holds the airframe and its propellers")
    arm: Positive = Field(description="m, centre to motor axis; four motors in an X")
    inertia: tuple[Positive, Positive, Positive] = Field(description="kg m^2, about the body's x, y, z")
    torque_to_thrust: Positive = Field(description="m, yaw torque of a rotor per newton of its thrust")
    rotor_thrust_min: NotNegative = Field(description="N, least thrust of one rotor")
    rotor_thrust_max: Positive = Field(description="N, greatest thrust of one rotor")
    thrust_min: Positive = Field(description="N, least collective thrust; above zero keeps the attitude defined")
    thrust_max: Positive = Field(description="N, greatest collective thrust")
    speed: Positive = Field(description="m/s")
    acceleration: Positive = Field(description="m/s^2, of the centre, gravity not included")
    tilt_deg: Annotated[Positive, Field(lt=90)] = Field(description="deg, between the body's z and the world's z")
    body_rate_deg: Positive = Field(description="deg/s, norm of the roll and pitch rates together")
    yaw_rate_deg: Positive = Field(description="deg/s, rate about the body's z axis")
    endurance: Positive | None = Field(default=None, description="s that it can fly, from take-off to touchdown")
    pieces: Held | None = Field(
        default=None, description="pieces of a flight that its memory holds at once; by its mass where left out"
    )
    controller: str | None = Field(default=None, description="who follows, on board: the controller that margins are meant for")
    autopilot: NamedAutopilot | None = Field(default=None, description="gains of the controllers and the estimator on board")
    uncertain: Uncertain | None = Field(
        default=None, description="intervals of what is not known of the airframe, as `ltlplan identify` writes them"
    )
    start_skew: NotNegative | None = Field(
        default=None, description="s within which one radio's broadcast starts all of its vehicles"
    )
    clock_drift: NotNegative | None = Field(
        default=None, description="share of the time since the last common start by which two clocks drift apart"
    )

    @property
    def tilt(self) -> float:
        """Greatest tilt in rad."""
        return math.radians(self.tilt_deg)

    @property
    def body_rate(self) -> float:
        """Greatest norm of roll and pitch rate in rad/s."""
        return math.radians(self.body_rate_deg)

    @property
    def yaw_rate(self) -> float:
        """Greatest rate about the body's z axis in rad/s."""
        return math.radians(self.yaw_rate_deg)

    @property
    def held(self) -> int | None:
        """Pieces of a flight that it holds at once; None for any number."""
        return self.pieces or (PIECES if self.mass <= LIGHT else None)

    @property
    def weight(self) -> float:
        """Thrust needed to hover, in N."""
        return self.mass * GRAVITY

    @model_validator(mode="after")
    def _can_hover(self) -> Vehicle:
        if self.rotor_thrust_min >= self.rotor_thrust_max:
            raise ValueError(
                f"rotor_thrust_min {self.rotor_thrust_min} N is not below rotor_thrust_max {self.rotor_thrust_max} N"
            )
        if self.thrust_min >= self.thrust_max:
            raise ValueError(f"thrust_min {self.thrust_min} N is not below thrust_max {self.thrust_max} N")
        most = min(self.thrust_max, 4 * self.rotor_thrust_max)
        if self.weight >= most:
            raise ValueError(f"it cannot hover: {self.mass} kg weigh {self.weight:.4f} N, its rotors lift at most {most:.4f} N")
        if self.uncertain is not None and self.uncertain.mass is not None:
            lightest, heaviest = self.uncertain.mass
            if not lightest <= self.mass <= heaviest:
                raise ValueError(f"its mass, {self.mass:g} kg, is not within uncertain.mass, {lightest:g} to {heaviest:g} kg")
        least = max(self.thrust_min, 4 * self.rotor_thrust_min)
        if self.weight <= least:
            raise ValueError(f"it cannot hover: {self.mass} kg weigh {self.weight:.4f} N, its least thrust is {least:.4f} N")
        return self


_TABLES = ShippedTables("verify.data", "vehicle")


def shipped_vehicles() -> tuple[str, ...]:
    """Return the names of the shipped profiles, sorted."""
    return _TABLES.names()


@cache
def load_vehicle(name: str) -> Vehicle:
    """Return a shipped profile by name.

    Raises:
        BadInput: There is no such profile; the message lists those that there are.
    """
    return Vehicle(name=name, **_TABLES.read(name))


NamedVehicle = Annotated[Vehicle, or_by_name(load_vehicle)]
"""A vehicle of a mission file: a shipped profile's name, or a table."""
