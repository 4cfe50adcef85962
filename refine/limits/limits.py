"""Limits of flight as one value, in SI units with the mass divided out where that is possible."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from verify.data import GRAVITY, BadInput, Mission, Vehicle


@dataclass(frozen=True, kw_only=True)
class Rotors:
    """Parameters of rotor thrusts: four motors in an X, arms at 45 degrees.

    Attributes:
        mass: kg.
        inertia: kg m^2 about the body's x, y, z.
        arm: m, centre to motor axis.
        torque_to_thrust: m, yaw torque per newton of thrust.
        least: N, thrust of one rotor.
        most: N, thrust of one rotor.
    """

    mass: float
    inertia: tuple[float, float, float]
    arm: float
    torque_to_thrust: float
    least: float
    most: float


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of a flight at all times. Infinity (or zero, for the least thrust) means no limit.

    Attributes:
        speed: m/s.
        acceleration: m/s^2, gravity not included.
        thrust_min: m/s^2, collective thrust over mass.
        thrust_max: m/s^2, likewise.
        tilt: rad, between the body's z and the world's.
        body_rate: rad/s, norm of roll and pitch rate.
        yaw_rate: rad/s, about the body's z.
        rotors: Thrust of each rotor; None for no limit.
    """

    speed: float = math.inf
    acceleration: float = math.inf
    thrust_min: float = 0.0
    thrust_max: float = math.inf
    tilt: float = math.inf
    body_rate: float = math.inf
    yaw_rate: float = math.inf
    rotors: Rotors | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "thrust_max", "tilt", "body_rate", "yaw_rate"):
            value = getattr(self, name)
            if not value > 0:  # NaN too
                raise BadInput(f"the limit on {name} is {value}; it must be above 0 (leave it out for no limit).")
        if not 0 <= self.thrust_min < GRAVITY:
            raise BadInput(
                f"thrust_min {self.thrust_min:g} m/s^2 must be at least 0 and below g = {GRAVITY} m/s^2, or no hover is allowed."
            )
        if self.thrust_max <= GRAVITY:
            raise BadInput(f"thrust_max {self.thrust_max:g} m/s^2 does not lift the vehicle: gravity is {GRAVITY} m/s^2.")
        if self.rotors is not None:
            hover = self.rotors.mass * GRAVITY / 4
            if not self.rotors.least <= hover < self.rotors.most:
                raise BadInput(
                    f"hovering asks {hover:.4g} N of each rotor, outside its {self.rotors.least:g} to {self.rotors.most:g} N."
                )

    @classmethod
    def of_mission(cls, mission: Mission, name: str) -> Limits:
        """Return the limits of one robot's vehicle, tightened by the mission's."""
        own, vehicle = mission.limits_of(name), mission.vehicle_of(name)
        return cls(
            speed=own.speed,
            acceleration=own.acceleration,
            thrust_min=own.thrust_min / vehicle.mass,
            thrust_max=own.thrust_max / vehicle.mass,
            tilt=own.tilt,
            body_rate=own.body_rate,
            yaw_rate=own.yaw_rate,
            rotors=rotors_of(vehicle),
        )

    def tightened(self, name: str, factor: float) -> Limits:
        """Return these limits with one of them taken `factor` (0 to 1) of its way from hovering to the limit.

        Raises:
            BadInput: `factor` is not in (0, 1].
        """
        if not 0 < factor <= 1:
            raise BadInput(f"a limit is tightened by a factor in (0, 1], not {factor}.")
        if name in ("thrust_min", "thrust_max"):
            return replace(self, **{name: GRAVITY + factor * (getattr(self, name) - GRAVITY)})
        if name in ("rotor_thrust_min", "rotor_thrust_max"):
            if self.rotors is None:
                return self
            hover = self.rotors.mass * GRAVITY / 4
            end = "least" if name.endswith("min") else "most"
            value = hover + factor * (getattr(self.rotors, end) - hover)
            return replace(self, rotors=replace(self.rotors, **{end: value}))
        return replace(self, **{name: factor * getattr(self, name)})

    def shrunk(self, share: float) -> Limits:
        """Return all limits tightened by a small share, for what is only sampled.

        Raises:
            BadInput: `share` is not in [0, 1).
        """
        result = self
        for name in LIMIT_NAMES:
            result = result.tightened(name, 1.0 - share)
        return result


LIMIT_NAMES = (
    "speed",
    "acceleration",
    "thrust_max",
    "thrust_min",
    "rotor_thrust_max",
    "rotor_thrust_min",
    "tilt",
    "body_rate",
    "yaw_rate",
)
"""As in the certificate's claims `limits.<name>`."""


def rotors_of(vehicle: Vehicle) -> Rotors:
    """Return a vehicle's rotors."""
    return Rotors(
        mass=vehicle.mass,
        inertia=vehicle.inertia,
        arm=vehicle.arm,
        torque_to_thrust=vehicle.torque_to_thrust,
        least=vehicle.rotor_thrust_min,
        most=vehicle.rotor_thrust_max,
    )
