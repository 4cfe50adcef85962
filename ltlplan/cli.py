"""The command line: parse, call the same functions as the library, show the result.

`ltlplan.start` calls it and ends the process. Each command is a module of `ltlplan/commands`; heavy imports happen inside the
commands, so that `--help` is quick. Exit codes come from the exception classes in `verify.data.errors`; a user's mistake is a
sentence, not a traceback.
"""

from __future__ import annotations

from typing import Annotated

import typer

import ltlplan
from ltlplan.commands import automaton, certify, check, export, fly, missions, plan, recheck, run, show

app = typer.Typer(name="ltlplan", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)
app.command("run")(run.command)
app.command("plan")(plan.command)
app.command("certify", short_help="Prove a folder's trajectories, or judge a recorded flight.")(certify.command)
app.command("recheck", short_help="Prove a folder's certificate again, from its files alone.")(recheck.command)
app.command("fly", short_help="Fly in simulation: once, a campaign, or sharing tasks online.")(fly.command)
app.command("export", short_help="Write a certified flight for a real vehicle.")(export.command)
app.command("show", short_help="Draw hoops, primitives, sampled and optimised paths.")(show.command)
app.command("automaton", short_help="Show a formula's automaton, or a mission's systems.")(automaton.command)
app.command("check", short_help="Hold words of a robot or a team against a formula.")(check.command)
app.command("missions", short_help="List the shipped missions, show one, or start your own.")(missions.command)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"ltlplan {ltlplan.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[  # its callback does the work
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """From a sentence in temporal logic to certified quadcopter flights."""
