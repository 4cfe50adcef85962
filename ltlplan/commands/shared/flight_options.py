"""Options that the commands which simulate flights share, and what they make of them.

Models and controllers are those of the registries; reading them loads `flight`, which these commands need anyway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from flight.control.controller import CONTROLLERS
from flight.model.plant import AIRFRAME_MODELS
from ltlplan.commands.shared.choices import choices
from ltlplan.commands.shared.options import read_mission

if TYPE_CHECKING:
    from verify import Certificate
    from verify.data import Plan, Trajectory
    from verify.data.progress import Progress

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


@dataclass(frozen=True, slots=True)
class Finish:
    """What is shown when the progress bar is gone.

    Attributes:
        lines: Sentences for a person.
        data: The same as plain data.
        refusal: Why the command ends with exit code 5, or None.
        files: What was written.
    """

    lines: list[str]
    data: dict[str, Any]  # plain data for json
    refusal: str | None = None
    files: tuple[Path, ...] = field(default=())

    def show(self, as_json: bool) -> None:
        """Print everything.

        Raises:
            NotCertified: There is a refusal.
        """
        from ltlplan.commands.shared.terminal import print_json
        from verify.data import NotCertified

        if as_json:
            print_json({**self.data, "holds": self.refusal is None, "files": [str(path) for path in self.files]})
        else:
            for line in (*self.lines, *(f"wrote {path}" for path in self.files)):
                typer.echo(line)
        if self.refusal is not None:
            if as_json:
                raise typer.Exit(NotCertified.exit_code)
            raise NotCertified(self.refusal)


def check_out(out: Path | None, files: tuple[str, ...]) -> None:
    """Refuse a folder that cannot be written, before minutes of work.

    Raises:
        BadInput: As said.
    """
    from verify.data.storage.folders import check_folder

    if out is not None:
        check_folder(out, files)


def written(out: Path | None, write: Callable[[Path], None]) -> tuple[Path, ...]:
    """Write a folder, where one is asked for, and return its files.

    Raises:
        BadInput: The folder cannot be written or is somebody else's.
    """
    from verify.data.storage.folders import write_folder

    return () if out is None else write_folder(out, write)


def certified(source: str, progress: Progress) -> tuple[Plan, dict[str, Trajectory], Certificate]:
    """Return a certified team: from a run's folder, proved again, or by planning the mission.

    Args:
        source: A folder, a mission's file, or the name of a shipped mission.
        progress: Told what is done, from 0 to 0.5.

    Raises:
        LtlplanError: What planning, refining, certifying or proving again refuses.
    """
    if Path(source).is_dir():
        from verify import recheck
        from verify.run_folder import read_folder

        progress("proving the folder's certificate again", 0.0)
        certificate = recheck(source)
        plan, team = read_folder(source)
        return plan, team, certificate
    from flight.certified import require_tube
    from ltlplan.pipeline import certified_team, plan

    mission = read_mission(source)
    require_tube(mission.margin)
    made = plan(mission, progress=lambda sentence, share: progress(sentence, 0.3 * share))
    done = certified_team(made, progress=lambda sentence, share: progress(sentence, 0.3 + 0.2 * share))
    return done.plan, done.team, done.certificate
