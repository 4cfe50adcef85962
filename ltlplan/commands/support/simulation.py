"""Common steps of commands that simulate flights: look at the folder first, fly what is certified, write, show the results."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ltlplan.commands.support.options import read_mission
from ltlplan.commands.support.progress import progress_bar
from verify.data.progress import Progress, part_of

if TYPE_CHECKING:
    from verify import Certificate
    from verify.data import Plan, Trajectory


@contextmanager
def simulating(out: Path | None, files: tuple[str, ...], *, quiet: bool) -> Generator[Progress]:
    """Show progress of a simulation, after a look at the folder that it will be written to: before minutes of work, not after.

    Yields the function that moves it (sentence, share done from 0 to 1).

    Args:
        out: Folder, or None where nothing is to be written.
        files: What will be written there.
        quiet: Show nothing.

    Raises:
        BadInput: The folder cannot be written.
    """
    from flight.storage.folders import check_folder

    with progress_bar(quiet=quiet) as progress:
        if out is not None:
            check_folder(out, files)
        yield progress


def certified(source: str, progress: Progress) -> tuple[Plan, dict[str, Trajectory], Certificate]:
    """Return a certified team: from a run's folder, proved again, or by planning the mission.

    Args:
        source: A folder, a mission's file, or the name of a shipped mission.
        progress: Receives what is done, from 0 to 1.

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
    from flight.certificate_checks import require_tube
    from ltlplan.pipeline import certified_team, plan

    mission = read_mission(source)
    require_tube(mission.margin)
    made = plan(mission, progress=part_of(progress, 0.0, 0.6))
    done = certified_team(made, progress=part_of(progress, 0.6, 1.0))
    return done.plan, done.team, done.certificate


def written(out: Path | None, write: Callable[[Path], None]) -> tuple[Path, ...]:
    """Write a folder, where one is asked for, and return its files.

    Args:
        out: The folder, or None.
        write: Writes into the folder that it is given.

    Raises:
        BadInput: The folder cannot be written or is somebody else's.
    """
    from flight.storage.folders import write_folder

    return () if out is None else write_folder(out, write)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Output of a simulation once its progress bar is gone.

    Attributes:
        lines: Sentences for a person.
        data: The same as plain data.
        refusal: Why the command does not end with exit code 0, or None.
        interrupted: The exit code where a signal is why; None makes it 5.
    """

    lines: list[str]
    data: dict[str, Any]  # plain data for json
    refusal: str | None
    interrupted: int | None = None

    def show(self, files: tuple[Path, ...], *, as_json: bool) -> None:
        """Print everything.

        Args:
            files: What was written.
            as_json: One JSON document instead of text.

        Raises:
            NotCertified: There is a refusal.
            Exit: There is one, and it was said.
        """
        from ltlplan.commands.support.terminal import print_json
        from verify.data import NotCertified

        if as_json:
            print_json({**self.data, "holds": self.refusal is None, "files": [str(path) for path in files]})
        else:
            for line in (*self.lines, *(f"wrote {path}" for path in files)):
                typer.echo(line)
        if self.refusal is None:
            return
        if self.interrupted is not None and not as_json:
            typer.echo(self.refusal, err=True)
        if self.interrupted is not None or as_json:
            raise typer.Exit(self.interrupted or NotCertified.exit_code)
        raise NotCertified(self.refusal)
