"""Conditions of a flight as options say them, of commands and of the service: words and numbers, None where nothing is said."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

from flight.conditions import Conditions, Estimator, conditions_of
from flight.control.controller import CONTROLLERS
from flight.control.profiles import controller_name
from verify.data import BadInput

if TYPE_CHECKING:
    from verify.data import Mission

FULL_MODEL = "full"
GEOMETRIC = "geometric"


@dataclass(frozen=True, slots=True)
class Said:
    """Options of a flight as they were given; None where they were not.

    Attributes:
        wind: As `--wind`.
        noise: As `--noise`.
        model: As `--model`.
        controller: As `--controller`.
        estimator: As `--estimator`.
        latency: As `--latency`.
        mass: As `--mass`.
    """

    wind: str | None = None
    noise: str | None = None
    model: str = FULL_MODEL
    controller: str | None = None
    estimator: str | None = None
    latency: float | None = None
    mass: float | None = None

    @property
    def anything(self) -> bool:
        """True if any of them was given."""
        said = (self.wind, self.noise, self.controller, self.estimator, self.latency, self.mass)
        return self.model != FULL_MODEL or any(option is not None for option in said)

    def require_sense(self) -> None:
        """Reject what makes no sense for any mission, before one is planned.

        Raises:
            BadInput: There are no such conditions.
        """
        told = GEOMETRIC if self.mass is None else "mellinger"  # somebody who is told what is said
        self.by(self.controller or told)

    def conditions(self, mission: Mission) -> Conditions:
        """Return what a mission is flown in: where nothing is said, as `run` flies it; else as said, by whom the profiles name if nobody is.

        Args:
            mission: Says what flies.

        Raises:
            BadInput: There are no such conditions, or a profile names a controller that there is not.
        """
        if not self.anything:
            return conditions_of(mission)
        names = {controller_name(mission.vehicle_of(robot)) for robot in mission.agents}
        usual = names.pop() if len(names) == 1 else "profile"
        return self.by(self.controller or (usual if self.model == FULL_MODEL else GEOMETRIC))

    def by(self, controller: str) -> Conditions:
        """Return what is said, flown by a controller.

        Args:
            controller: Who follows the plan, whatever `--controller` says.

        Raises:
            BadInput: There are no such conditions.
        """
        from flight.control.lee import Lee
        from flight.control.mellinger import Mellinger
        from flight.model.sensing import MotionCapture

        follower = CONTROLLERS.find(controller)
        if self.mass is not None:
            if not isinstance(follower, Mellinger | Lee):
                raise BadInput(f"--mass is the mass that `mellinger` or `lee` assumes; '{controller}' assumes none.")
            follower = replace(follower, mass=self.mass)
        sensor = None if self.noise is None else MotionCapture.parse(self.noise)
        if self.latency is not None:
            if sensor is None:
                raise BadInput("--latency is motion capture's: give --noise as well, 0 for cameras without error.")
            sensor = replace(sensor, delay=self.latency)
        return Conditions(self.wind, sensor, self.model, follower, estimator=cast("Estimator | None", self.estimator))
