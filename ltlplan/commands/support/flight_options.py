"""Options that the commands which simulate flights share.

Models and controllers are those of the registries; reading them loads `flight`, which these commands need anyway.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from flight.conditions import ESTIMATORS, Conditions, Estimator, conditions_of
from flight.control.controller import CONTROLLERS
from flight.control.profiles import controller_name
from flight.exports.scripts.flying.checks import NAMES as UNCHECKED
from flight.model.plant import AIRFRAME_MODELS
from ltlplan.commands.support.choices import choices
from verify.data import BadInput

if TYPE_CHECKING:
    from verify.data import Mission

    ModelName = ControllerName = LinkName = UncheckedName = str
    EstimatorName = Estimator
else:
    ModelName = choices("ModelName", AIRFRAME_MODELS.names())
    ControllerName = choices("ControllerName", CONTROLLERS.names())
    EstimatorName = choices("EstimatorName", ESTIMATORS)
    UncheckedName = choices("UncheckedName", UNCHECKED)
    LinkName = choices("LinkName", ("simulated", "crazyflie", "mavlink"))

TeamArgument = Annotated[
    str, typer.Argument(help="A folder that `ltlplan run` wrote, a mission file, or a shipped mission.", show_default=False)
]
OutOption = Annotated[Path | None, typer.Option("--out", help="Folder to write to.")]
WindOption = Annotated[str | None, typer.Option("--wind", help="m/s: 1.5 (along x), 1,0.5,0, or either with gusts: 1.5+0.4.")]
NoiseOption = Annotated[
    str | None, typer.Option("--noise", help="Motion capture with this standard deviation of a position, m.")
]
ModelOption = Annotated[ModelName, typer.Option("--model", help="Model of the vehicles.")]
ControllerOption = Annotated[ControllerName, typer.Option("--controller", help="Controller that follows the plan.")]
FollowerOption = Annotated[
    ControllerName | None,
    typer.Option("--controller", help="Controller that follows the plan (default: by the vehicles' profiles)."),
]
EstimatorOption = Annotated[
    EstimatorName | None,
    typer.Option("--estimator", help="State estimator: on board, or on the ground."),
]
LatencyOption = Annotated[
    float | None, typer.Option("--latency", help="s from a frame of motion capture to its use; 0.01 where there is noise.")
]
MassOption = Annotated[
    float | None, typer.Option("--mass", help="kg that a controller on board assumes, instead of the vehicle's.")
]
PlaceOption = Annotated[
    list[str] | None,
    typer.Option(
        "--place",
        help="With --link: NAME=x,y,z in m, where motion capture sees a robot stand (default: at z = 0 below its start).",
    ),
]
AddressOption = Annotated[
    list[str] | None,
    typer.Option(
        "--address",
        help="With --link crazyflie or mavlink: NAME=ADDRESS, such as quad0=radio://0/80/2M/E7E7E7E701 or "
        "quad0=udpin:0.0.0.0:14540, once a robot.",
    ),
]
InventoryOption = Annotated[
    Path | None,
    typer.Option(
        "--inventory",
        help="With --link crazyflie or mavlink: YAML of your robots' addresses, weights or MAVLink systems, and of motion capture; only read.",
    ),
]
UncheckedOption = Annotated[
    list[UncheckedName] | None,
    typer.Option("--unchecked", help="With --link: fly though this cannot be checked; once for each check."),
]
FULL = ModelName("full")
GEOMETRIC = ControllerName("geometric")


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
    model: str = FULL
    controller: str | None = None
    estimator: str | None = None
    latency: float | None = None
    mass: float | None = None

    @property
    def anything(self) -> bool:
        """True if any of them was given."""
        said = (self.wind, self.noise, self.controller, self.estimator, self.latency, self.mass)
        return self.model != FULL or any(option is not None for option in said)

    def require_sense(self) -> None:
        """Reject what makes no sense for any mission, before one is planned.

        Raises:
            BadInput: There are no such conditions.
        """
        told = GEOMETRIC if self.mass is None else ControllerName("mellinger")  # somebody who is told what is said
        self.by(self.controller or str(told))

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
        return self.by(self.controller or (usual if self.model == FULL else str(GEOMETRIC)))

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
