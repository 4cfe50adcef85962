"""Options that the commands which simulate flights share.

Models and controllers are those of the registries; reading them loads `flight`, which these commands need anyway.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flight.condition_options import FULL_MODEL
from flight.conditions import ESTIMATORS, Estimator
from flight.control.controller import CONTROLLERS
from flight.exports.scripts.flying.checks import NAMES as UNCHECKED
from flight.model.plant import AIRFRAME_MODELS
from ltlplan.commands.support.choices import choices

if TYPE_CHECKING:
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
FULL = ModelName(FULL_MODEL)
GEOMETRIC = ControllerName("geometric")
