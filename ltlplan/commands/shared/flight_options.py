"""Options that the commands which simulate flights share.

Models and controllers are those of the registries; reading them loads `flight`, which these commands need anyway.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from flight.control.controller import CONTROLLERS
from flight.model.plant import AIRFRAME_MODELS
from ltlplan.commands.shared.choices import choices

if TYPE_CHECKING:
    ModelName = ControllerName = str
else:
    ModelName = choices("ModelName", AIRFRAME_MODELS.names())
    ControllerName = choices("ControllerName", CONTROLLERS.names())

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
FULL = ModelName("full")
GEOMETRIC = ControllerName("geometric")
