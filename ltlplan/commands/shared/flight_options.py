"""Options that the commands which simulate flights share.

Models and controllers are those of the registries; reading them loads `flight`, which these commands need anyway.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from flight.conditions import ESTIMATORS, Conditions, Estimator
from flight.control.controller import CONTROLLERS
from flight.model.plant import AIRFRAME_MODELS
from ltlplan.commands.shared.choices import choices
from verify.data import BadInput

if TYPE_CHECKING:
    ModelName = ControllerName = str
    EstimatorName = Estimator
else:
    ModelName = choices("ModelName", AIRFRAME_MODELS.names())
    ControllerName = choices("ControllerName", CONTROLLERS.names())
    EstimatorName = choices("EstimatorName", ESTIMATORS)

TeamArgument = Annotated[
    str, typer.Argument(help="A folder that `ltlplan run` wrote, a mission file, or a shipped mission.", show_default=False)
]
OutOption = Annotated[Path | None, typer.Option("--out", help="Folder to write to.")]
WindOption = Annotated[str | None, typer.Option("--wind", help="m/s: 1.5 (along x), 1,0.5,0, or either with gusts: 1.5+0.4.")]
NoiseOption = Annotated[
    str | None, typer.Option("--noise", help="Motion capture with this standard deviation of a position, m.")
]
ModelOption = Annotated[ModelName, typer.Option("--model", help="How the vehicles fly.")]
ControllerOption = Annotated[ControllerName, typer.Option("--controller", help="Who follows the plan.")]
EstimatorOption = Annotated[
    EstimatorName | None,
    typer.Option("--estimator", help="Who makes a state of what motion capture sees: on board, or on the ground."),
]
LatencyOption = Annotated[
    float | None, typer.Option("--latency", help="s from a frame of motion capture to its use; 0.01 where there is noise.")
]
MassOption = Annotated[
    float | None, typer.Option("--mass", help="kg that a controller on board is told, instead of the vehicle's.")
]
FULL = ModelName("full")
GEOMETRIC = ControllerName("geometric")


def conditions(
    wind: str | None,
    noise: str | None,
    model: str,
    controller: str,
    *,
    estimator: str | None = None,
    latency: float | None = None,
    mass: float | None = None,
) -> Conditions:  # as many parameters as commands have options
    """Return the conditions that a command's options name.

    Args:
        wind: As `--wind`.
        noise: As `--noise`.
        model: As `--model`.
        controller: As `--controller`.
        estimator: As `--estimator`.
        latency: As `--latency`.
        mass: As `--mass`.

    Raises:
        BadInput: There are none such.
    """
    from flight.control.lee import Lee
    from flight.control.mellinger import Mellinger
    from flight.model.sensing import MotionCapture

    follower = CONTROLLERS.find(controller)
    if mass is not None:
        if not isinstance(follower, Mellinger | Lee):
            raise BadInput(f"--mass is what `mellinger` or `lee` is told; '{controller}' is told none.")
        follower = replace(follower, mass=mass)
    sensor = None if noise is None else MotionCapture.parse(noise)
    if latency is not None:
        if sensor is None:
            raise BadInput("--latency is motion capture's: give --noise as well, 0 for cameras without error.")
        sensor = replace(sensor, delay=latency)
    return Conditions(wind, sensor, model, follower, estimator=cast("Estimator | None", estimator))
