"""Autopilots: what the software on board of common vehicles is tuned to, controller by controller, and its estimator.

The shipped tables are YAML files in `autopilots/`; each number there stands next to the parameter or paper that it is from. Simulation
flies with them. They stand in a resolved mission and count in its digest. The checker reads there those of `mellinger` and its filter, for the claim `tracking`.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, TypeVar

from pydantic import Field, Strict

from verify.data.errors import BadInput
from verify.data.storage.shipped_tables import ShippedTables, or_by_name
from verify.data.value import Value

_Number = Annotated[float, Strict(), Field(gt=0, le=1e9, allow_inf_nan=False)]  # squares and products of which are numbers
_Gain = Annotated[float, Strict(), Field(ge=0, le=1e9, allow_inf_nan=False)]
Gains = tuple[_Gain, _Gain, _Gain]
"""About or along x, y and z."""


class MellingerGains(Value):
    """Gains of Mellinger and Kumar's controller as the Crazyflie has it; moments in counts of its motors' PWM."""

    mass: _Number = Field(description="kg, that the controller takes the vehicle for where nobody sets it")
    thrust_to_pwm: _Number = Field(description="counts of one motor per newton of all four")
    position: Gains = Field(description="N/m")
    velocity: Gains = Field(description="N s/m")
    integral: Gains = Field(description="N/(m s)")
    integral_limit: Gains = Field(description="m s")
    attitude: Gains = Field(description="counts per unit of the error Rd'R - R'Rd")
    rate: Gains = Field(description="counts s/rad")
    attitude_integral: Gains = Field(description="counts/s")
    attitude_integral_limit: Gains = Field(description="s")
    rate_change: Gains = Field(description="counts s^2/rad, on the derivative of the rates' error")
    moment_limit: _Number = Field(description="counts")


class LeeGains(Value):
    """Gains of Lee, Leok and McClamroch's controller as the Crazyflie has it."""

    mass: _Number = Field(description="kg, that the controller takes the vehicle for where nobody sets it")
    inertia: Gains = Field(description="kg m^2")
    position: Gains = Field(description="1/s^2")
    velocity: Gains = Field(description="1/s")
    integral: Gains = Field(description="1/s^3")
    attitude: Gains = Field(description="N m per unit of the error (Rd'R - R'Rd) / 2")
    rate: Gains = Field(description="N m s")
    attitude_integral: Gains = Field(description="N m/s")


class PidGains(Value):
    """Gains of the cascade of position, velocity, angle and rate, in degrees and counts of the motors' PWM."""

    position: Gains = Field(description="1/s")
    position_integral: Gains = Field(description="1/s^2")
    speed_limit: Gains = Field(description="m/s")
    velocity: Gains = Field(description="deg s/m; along z thrust_scale counts s/m")
    velocity_integral: Gains = Field(description="the same per s")
    tilt_limit: _Number = Field(description="deg")
    thrust_scale: _Number = Field(description="counts")
    thrust_base: _Number = Field(description="counts, to which the cascade adds")
    thrust_least: _Gain = Field(description="counts")
    angle: Gains = Field(description="1/s")
    angle_integral: Gains = Field(description="1/s^2")
    angle_integral_limit: Gains = Field(description="deg s")
    angle_change: Gains = Field(description="of the measured angle")
    rate: Gains = Field(description="counts s/deg")
    rate_integral: Gains = Field(description="counts/deg")
    rate_integral_limit: Gains = Field(description="deg")
    rate_change: Gains = Field(description="counts s^2/deg, of the measured rate")


class Px4Gains(Value):
    """Gains of PX4's cascade, thrust and moments as shares of what its allocation can give."""

    position: Gains = Field(description="1/s")
    velocity: Gains = Field(description="1/s")
    velocity_integral: Gains = Field(description="1/s^2")
    velocity_change: Gains = Field(description="of the measured velocity's derivative")
    velocity_change_cutoff: _Number = Field(description="Hz, of that derivative's filter")
    speed_limit: _Number = Field(description="m/s, along the ground")
    climb_limit: _Number = Field(description="m/s")
    descent_limit: _Number = Field(description="m/s")
    tilt_limit: _Number = Field(description="deg", lt=90)
    thrust_least: _Number = Field(description="share")
    thrust_most: _Number = Field(description="share", le=1)
    thrust_sideways: _Number = Field(description="share that is kept for the horizontal where thrust ends")
    angle: Gains = Field(description="1/s")
    yaw_weight: _Number = Field(description="share of the heading's error beside that of the tilt", le=1)
    rate_limit: Gains = Field(description="deg/s")
    rate: Gains = Field(description="s")
    rate_integral: Gains = Field(description="no unit")
    rate_integral_limit: Gains = Field(description="share")
    rate_change: Gains = Field(description="s^2, of the measured rate's derivative")
    gyro_cutoff: _Number = Field(description="Hz, of the rates' filter of order two", lt=250)
    gyro_change_cutoff: _Number = Field(description="Hz, of the filter of their derivative")
    yaw_cutoff: _Number = Field(description="Hz, of the filter of the moment about z")
    mix: Gains = Field(description="share of a moment that each rotor's signal gets")
    idle: _Gain = Field(description="share of the greatest rotor speed at no signal", lt=1)
    thrust_curve: _Gain = Field(description="share of the square in what the autopilot takes the thrust of a signal for", le=1)


class FilterNoise(Value):
    """Noise that the extended Kalman filter on board assumes."""

    position_noise: _Number = Field(description="m, standard deviation of motion capture's position")
    attitude_noise: _Number = Field(description="rad, standard deviation of motion capture's attitude")
    acceleration_noise: Gains = Field(description="m/s^2")
    gyro_noise: Gains = Field(description="rad/s")
    least_variance: _Gain = Field(description="no variance is taken for less")
    least_turn: _Gain = Field(description="rad, corrections of the attitude below are dropped")


class Autopilot(Value):
    """Software on board of a vehicle: gains of each controller that it has, and of the estimator."""

    name: str = Field(description="name of the table", min_length=1)
    mellinger: MellingerGains | None = None
    lee: LeeGains | None = None
    pid: PidGains | None = None
    px4: Px4Gains | None = None
    ekf: FilterNoise

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the controllers that it has gains for."""
        return tuple(name for name in _CONTROLLERS.values() if getattr(self, name) is not None)

    def gains(self, kind: type[_Kind]) -> _Kind:
        """Return the gains of one controller.

        Args:
            kind: Of which one.

        Raises:
            BadInput: It has none; the message lists those that it has.
        """
        name = _CONTROLLERS[kind]
        if not isinstance(found := getattr(self, name), kind):
            has = ", ".join(self.controllers) or "none"
            raise BadInput(f"the autopilot '{self.name}' does not run '{name}'. Controllers that it runs: {has}.")
        return found


_Kind = TypeVar("_Kind", MellingerGains, LeeGains, PidGains, Px4Gains)
_CONTROLLERS: dict[type[Value], str] = {MellingerGains: "mellinger", LeeGains: "lee", PidGains: "pid", Px4Gains: "px4"}


_TABLES = ShippedTables("verify.data", "autopilot")


def shipped_autopilots() -> tuple[str, ...]:
    """Return the names of the shipped tables, sorted."""
    return _TABLES.names()


@cache
def load_autopilot(name: str) -> Autopilot:
    """Return a shipped table by name.

    Args:
        name: As in `shipped_autopilots`.

    Raises:
        BadInput: There is no such table; the message lists those that there are.
    """
    return Autopilot.model_validate({"name": name, **_TABLES.read(name)})


NamedAutopilot = Annotated[Autopilot, or_by_name(load_autopilot)]
"""An autopilot of a vehicle: a shipped table's name, or a table."""
